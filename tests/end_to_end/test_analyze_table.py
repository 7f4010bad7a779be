"""`tactileq analyze --table`: a report on tables of any experiment."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

HAPTICOMM = sorted((Path(__file__).parents[1] / "data/hapticomm_3x3").glob("P*.csv"))
# F of TYPE, SIZE and both, the accuracy, and the degrees of freedom of TYPE times ε, as R's
# anova(lm(cells ~ 1), …, test = "Spherical") finds them.
KNOWN = {
    "TYPE_ANS": (0.7222, [15.554, 50.619, 17.952], "1.73, 15.61"),
    "SIZE_ANS": (0.5759, [6.566, 23.670, 6.370], "1.98, 17.78"),
}


@pytest.mark.parametrize("measure", KNOWN)
def test_the_example_of_two_factors(main, tmp_path: Path, measure: str) -> None:
    mapping = f"correct={measure},factor=TYPE,factor=SIZE"
    done = main("analyze", "--table", *HAPTICOMM, "--map", mapping)
    assert (done.returncode, done.stderr) == (0, "")
    tables = tmp_path / "analysis-results/tables"
    own = pd.read_csv(tables / "by_participant.tsv", sep="\t")
    assert (own["trials"] == 6).all()
    assert own["participant_id"].nunique() == 10
    accuracy, f, df = KNOWN[measure]
    assert round(own["mean"].mean(), 4) == accuracy
    anova = pd.read_csv(tables / "anova.tsv", sep="\t")
    assert list(anova["effect"]) == ["TYPE", "SIZE", "TYPE × SIZE"]
    assert [round(value, 3) for value in anova["F"]] == f
    assert len(pd.read_csv(tables / "pairs.tsv", sep="\t")) == 6
    page = (tmp_path / "analysis-results/report.html").read_text()
    assert f"F({df}) = {f[0]:.2f}, p " in page
    assert "The effects of TYPE and SIZE on accuracy depend on each other" in page
    assert (tmp_path / "analysis-results/figures/by_condition.png").exists()


def test_matrices_are_drawn_for_each_condition(main, tmp_path: Path) -> None:
    for more, person in zip((-1, 0, 1), ("P01", "P02", "P03"), strict=True):
        for level, other in (("full", 0), ("simplified", 1)):
            text = f";canvas;MDF;felt\ncanvas;{3 + more};{1 - more};0\nMDF;2;4;0\n"
            text += f"felt;{1 - other};{3 + other};0\n\n"
            (tmp_path / f"{person}_{level}.csv").write_text(text)
    files = sorted(path.name for path in tmp_path.glob("P*.csv"))
    done = main("analyze", "--table", *files, "--map", "factor=model")
    assert (done.returncode, done.stderr) == (0, "")
    counts = pd.read_csv(tmp_path / "analysis-results/tables/confusion_1.tsv", sep="\t")
    assert list(counts["count"]) == [9, 3, 0, 6, 12, 0, 3, 9, 0]
    assert "confusion_2" in (tmp_path / "analysis-results/report.html").read_text()


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ((), "expected a folder of answers, or --table with files, got neither"),
        (("--table", HAPTICOMM[0], "--complete"), "expected --table with no option but"),
        (("--map", "correct=A"), "expected files of answers with --table, got none"),
        (("--table", ".", "--map", "correct=A"), "got the folder ."),
        (("--table", HAPTICOMM[0], "--map", "correct=NO"), "there are ID, TYPE, SIZE, TYPE_ANS"),
        (("--table", HAPTICOMM[0], "--models", "m"), "expected --table with no option but"),
    ],
)
def test_what_cannot_be_analysed_is_refused(main, tmp_path: Path, words, told: str) -> None:
    done = main("analyze", *words)
    assert done.returncode != 0
    assert told in done.stderr
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "analysis-results").exists()
