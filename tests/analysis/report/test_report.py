"""The report: whole in one file, complete, escaped, and honest about what is simulated."""

from __future__ import annotations

import base64
import re
from dataclasses import replace
from functools import partial
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tactileq.analysis.answers.responses import PlannedTask, Responses
from tactileq.analysis.chapters.reliability.section import careless_signs
from tactileq.analysis.page import saving
from tactileq.analysis.report.report import write_report
from tactileq.analysis.textures.results import TextureResult
from tactileq.modeling import InputError, RecordingSet, Threshold, simplify
from tests.refusals import refused

# One report is drawn whole, for all tests that only read it (`folder`); the others are about words.
pytestmark = [pytest.mark.filterwarnings("error"), pytest.mark.usefixtures("undrawn")]
WARNING = "sub-01_ses-01_task-absolute_beh.tsv: the last line was cut short & is left out."


BANNER = "SIMULATED: {}."


class Page(HTMLParser):
    """What a browser would fetch, show and execute."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.references: list[str] = []
        self.identifiers: list[str] = []
        self.text = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        for name, value in attrs:
            if name in ("src", "href", "srcset", "data", "poster", "action"):
                self.references.append(value or "")
            if name == "id":
                self.identifiers.append(value or "")

    def handle_data(self, data: str) -> None:
        self.text += data


def responses_of(
    ratings: pd.DataFrame, choices: pd.DataFrame, *, simulated: bool, rig: bool | None = None
) -> Responses:
    """Answers whose participants and (unless told otherwise) rig are simulated or not."""
    return Responses(
        answers={"absolute": ratings, "relative": choices},
        simulated_participants=simulated,
        simulated_rig=simulated if rig is None else rig,
        warnings=(WARNING,),
    )


FEW = ("canvas", "leather", "PVC")  # of seven, tables of confusions take long


def of_six(answers: pd.DataFrame) -> pd.DataFrame:
    """The answers of six of the sixteen about three of the seven textures: enough for what hangs on
    no number of people or textures. Who chose another texture is said to have chosen the next."""
    few = answers[(answers["participant_id"] <= "sub-06") & answers["texture"].isin(FEW)]
    if "answer" not in few:
        return few
    following = dict(zip(FEW, FEW[1:] + FEW[:1], strict=True))
    answered = few["answer"].where(few["answer"].isin(FEW), few["texture"].map(following))
    return few.assign(answer=answered, layout="|".join(FEW))


@pytest.fixture(scope="module")
def folder(once_per_run, results, ratings, choices) -> Path:
    """One report of everything, shared by the tests that only read it."""
    return once_per_run("report", partial(reported, of=(results, ratings, choices)))


def reported(folder: Path, *, of) -> Path:
    results, ratings, choices = of
    told: list[tuple[float, str]] = []
    path = write_report(
        folder / "report.html",
        responses=responses_of(ratings, choices, simulated=True),
        textures=results,
        provenance={"configuration": "<i>study.toml</i>"},
        title="A study <in silico>",
        seed=5,
        progress=lambda share, what: told.append((share, what)),
    )
    assert path == folder / "report.html"
    shares = [share for share, _ in told]
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    return folder


@pytest.fixture(scope="module")
def shown(folder) -> Page:
    return Page((folder / "report.html").read_text(encoding="utf-8"))


def test_the_report_needs_nothing_but_itself(folder, shown):
    for reference in shown.references:
        assert reference.startswith(("#", "data:image/png;base64,"))
    assert not {"link", "iframe", "object"} & set(shown.tags)
    assert shown.tags.count("script") == 1  # inline: what has a src is among the references
    style = re.search(r"<style>(.*?)</style>", (folder / "report.html").read_text(), re.DOTALL)
    assert style
    assert "url(" not in style[1]
    assert "@import" not in style[1]


def test_textures_simplified_in_different_ways_are_told_apart(tmp_path, ratings, results):
    first, second = results
    low = Threshold("low", [1, 2500], [1e-9, 1e-9], "planted", "none")
    kept = replace(first, simplification=simplify(first.model, low))
    otherwise = simplify(second.model, Threshold.shipped("pen-hold"), margin_db=2.0)
    answers = responses_of(ratings, ratings.iloc[:0].assign(correct=0.0), simulated=False)
    path = write_report(
        tmp_path / "report.html",
        responses=answers,
        textures=(kept, replace(second, simplification=otherwise)),
    )
    text = Page(path.read_text(encoding="utf-8")).text
    for result, words in ((first, "“low” in every"), (second, "“pen-hold” in every")):
        rule = f"A layer of {result.texture} was dropped only where it lies below the threshold "
        assert rule + words in text
    assert "margin 2 dB" in text
    assert text.count("Source of the threshold") == 2
    # The data do not say which models are identical; the models themselves do.
    assert kept.simplification.identical
    assert re.search(rf"No layer was dropped from [^:]*{first.texture}[^:]*: identical", text)
    assert f"identical models, nothing to compare: {first.texture}." in text


def test_identical_models_are_told_and_not_tested(tmp_path, ratings, choices):
    same = "canvas"
    kinds = {name: {"full": "0", "simplified": "1"} for name in ("leather", "PVC")}
    answers = replace(
        responses_of(of_six(ratings), of_six(choices), simulated=False),
        models=kinds | {same: {"full": "0", "simplified": "0"}},
    )
    path = write_report(tmp_path / "report.html", responses=answers)
    text = Page(path.read_text(encoding="utf-8")).text
    assert text.count(f"identical models, nothing to compare: {same}.") == 3
    table = pd.read_csv(tmp_path / "tables/claim_tests.tsv", sep="\t", na_values="n/a")
    rows = table[table["texture"] == same]
    assert (rows["note"] == "identical models, nothing to compare").all()
    assert rows["p_holm"].isna().all()
    assert table[table["texture"] != same]["p_holm"].notna().all()


def test_paper_shows_what_the_screen_folds_and_scrolls(folder):
    html = (folder / "report.html").read_text(encoding="utf-8")
    on_paper = html[html.index("@page") : html.index("</style>")]
    assert "size: A4 landscape" in on_paper
    rules = dict(re.findall(r"([^{}]+?)\s*\{([^{}]*)\}", on_paper.split("@media print {")[1]))
    rules = {name.split("*/")[-1].strip(): rule for name, rule in rules.items()}
    assert "content-visibility: visible" in rules["details::details-content"]
    assert "overflow: visible" in rules[".scroll"]
    assert "width: 100%" in rules["table"]
    assert "font-size: 7pt" in rules[".wide table"]
    assert "white-space: normal" in rules["td.name"]  # wraps, where the screen scrolls
    script = html[html.index("<script>") : html.index("</script>")]
    assert '"beforeprint"' in script
    assert '"afterprint"' in script


def test_many_columns_are_set_smaller_on_paper(folder):
    html = (folder / "report.html").read_text(encoding="utf-8")
    found = re.findall(r'<div class="scroll([^"]*)" id="table-([^"]*)"', html)
    kinds = {name: kind.split() for kind, name in found}
    assert "wide" in kinds["claim_tests"]
    assert kinds["provenance"] == ["short"]
    assert "short" not in kinds["confusion_full"]


def test_the_answer_comes_first(folder, shown):
    html = (folder / "report.html").read_text(encoding="utf-8")
    answer = "In a simulation without people, simplified compared with full models "
    assert html.index("</h1>") < html.index(answer) < html.index("<nav>")
    overall = shown.text.index("Rated similarity of vibration magnitude: ")
    table = shown.text.index("Each claim in a row")
    tests = shown.text.index("(rated similarity of vibration magnitude, simplified − full):")
    assert overall < table < tests < shown.text.index("Simplification dropped")
    assert shown.text.index("Forced choice, full model") < shown.text.index("Most frequent")


def test_a_chapter_begins_with_its_answer_and_one_picture(folder):
    html = (folder / "report.html").read_text(encoding="utf-8")
    chapters = re.findall(r'<section id="([^"]+)">(.*?)</section>', html, re.DOTALL)
    assert chapters[0][0] == "overview"
    for anchor, text in chapters[1:]:
        opening, *supplement = text.split('<details class="supplement">')
        assert opening.count("<figure") <= 1, anchor
        assert opening.count("<table") == (anchor == "verdicts"), anchor
        assert len(supplement) <= 1, anchor
        if anchor not in ("origin", "verdicts"):
            assert re.match(r'<h2>[^<]+</h2><p class="answer">', opening), anchor
    pictured = [anchor for anchor, text in chapters if "<figure" in text]
    assert {"overview", "ratings", "models", "planted", "parameters"} <= set(pictured)


def test_no_finding_is_told_twice(folder):
    html = (folder / "report.html").read_text(encoding="utf-8")
    shown = re.sub(
        r'<details class="supplement">.*?</section>', "</section>", html, flags=re.DOTALL
    )
    said = re.findall(r"<li>(.*?)</li>|<p class=\"answer\">(.*?)</p>", shown, re.DOTALL)
    sentences = [one or other for one, other in said]
    assert len(sentences) > 20
    assert len(sentences) == len(set(sentences))


def test_the_supplement_is_a_file_of_its_own(folder, shown):
    behind = Page((folder / "supplement.html").read_text(encoding="utf-8"))
    for reference in behind.references:
        assert reference.startswith(("#", "data:image/png;base64,"))
    tables = {name for name in behind.identifiers if name.startswith("table-")}
    # On paper the report has one table: all others are in the supplement.
    every = {name for name in shown.identifiers if name.startswith("table-")}
    assert every - tables == {"table-claims_in_short"}
    assert tables < every
    pictures = {name for name in behind.identifiers if name.startswith("figure-")}
    whole = {name for name in shown.identifiers if name.startswith("figure-")}
    opening = {"figure-ratings", "figure-paper", "figure-planted_course"}
    assert opening <= whole - pictures
    assert "SIMULATED" in behind.text
    html = (folder / "report.html").read_text(encoding="utf-8")
    assert "body.report details.supplement { display: none; }" in html
    assert '<body class="report">' in html
    assert '<body class="report">' not in (folder / "supplement.html").read_text("utf-8")


def test_an_interrupted_study_says_how_much_was_planned(tmp_path, ratings, choices):
    begun = replace(
        responses_of(ratings, choices, simulated=False),
        planned={"absolute": PlannedTask(16, 16), "relative": PlannedTask(24, 48)},
    )
    shown = Page(write_report(tmp_path / "report.html", responses=begun).read_text("utf-8"))
    assert "16 of 24planned participants, forced choice" in shown.text  # a tile
    assert "16 of 16planned participants, absolute evaluation" in shown.text
    assert "Forced choice: 16 of 24 planned participants, 16 of 48 planned sessions" in shown.text
    assert (
        "The study is not complete (forced choice: 16 of 24 planned participants, 16 of 48 "
        "planned sessions): neither effects nor tests of its claims are shown"
    ) in shown.text
    assert "So far, simplified compared with full models" in shown.text
    assert "Ratings by a mixed model" in shown.text  # of the finished task


def test_nothing_of_an_unfinished_task_compares_models(tmp_path, ratings, choices):
    """Neither on the page nor in a file: not of claims, and not beside them."""
    guesses = choices["participant_id"] == "sub-03"
    choices = choices.assign(correct=choices["correct"].where(~guesses, 0.0))
    chances, rng = {"relative": 1 / 7}, np.random.default_rng(0)
    asked = {"relative": choices}
    assert "right answers at chance" in set(careless_signs(asked, chances=chances, rng=rng)["sign"])
    begun = replace(
        responses_of(ratings, choices, simulated=False),
        planned={"absolute": PlannedTask(20, 20), "relative": PlannedTask(24, 48)},
    )
    moved = {"speed_mm_s": 100.0, "force_n": 1.0, "contact_s": 3.0, "presentations": 2.0}
    hand = ratings.assign(task="absolute", trials=1, **moved)
    path = write_report(tmp_path / "report.html", responses=begun, hand=hand)
    shown = Page(path.read_text("utf-8"))
    assert not re.search(r"CI [+−]|TOST p|BF₀₁ =|d_z =|d′|p [=<]|t\(\d|answers, full", shown.text)
    tables = {
        file.stem: pd.read_csv(file, sep="\t", na_values="n/a")
        for file in tmp_path.glob("tables/*")
    }
    of_claims = ("claims", "claim_tests", "claims_in_short")
    others = {"claim_sentences", "agreement", "raters", "careless", "provenance"}
    assert set(tables) == {*of_claims, *others}
    assert not tables["claim_sentences"]["sentence"].str.contains("CI|points").any()
    for name in of_claims:
        told = tables[name]
        assert set(told["verdict"]) == {"interim, no verdict"}
        assert (told["n"] == 16).all()
        numbers = told.drop(columns="n").select_dtypes("number").dropna(axis=1, how="all")
        assert set(numbers) <= {"share_at_ends", "bound_low", "bound_high"}
    assert "right answers at chance" not in set(tables["careless"]["sign"])
    assert not list(tmp_path.glob("figures/*"))
    assert "16 of 20planned participants, absolute evaluation" in shown.text


@pytest.fixture
def drawn(undrawn: None, monkeypatch: pytest.MonkeyPatch) -> None:
    """Pictures as they are."""
    monkeypatch.setattr("tactileq.analysis.report.report.png_of", saving.png_of)


@pytest.mark.usefixtures("drawn")
def test_names_that_no_font_has_are_told_once(tmp_path, ratings, monkeypatch):
    path = saving.findfont(saving.FontProperties(family=saving.DEFAULT_FAMILY))
    monkeypatch.setattr(saving, "_faces", lambda: ((saving.DEFAULT_FAMILY, path, 0),))
    saving._families_for.cache_clear()
    named = ratings.replace({"texture": {"PVC": "木材"}})
    answers = responses_of(named, named.iloc[:0].assign(correct=0.0), simulated=False)
    with pytest.warns(UserWarning, match="fonts-noto-cjk") as told:
        report = write_report(tmp_path / "report.html", responses=answers)
    saving._families_for.cache_clear()
    assert [str(warning.message) for warning in told] == [saving.missing_fonts("木材")]
    assert saving.missing_fonts("木材") in Page(report.read_text("utf-8")).text


def test_links_lead_somewhere(shown):
    anchors = [reference[1:] for reference in shown.references if reference.startswith("#")]
    assert len(anchors) == 13
    assert set(anchors) <= set(shown.identifiers)
    assert len(shown.identifiers) == len(set(shown.identifiers))


def test_every_figure_is_inline_and_beside_the_report(folder, shown):
    pictures = {path.stem: path.read_bytes() for path in (folder / "figures").glob("*.png")}
    assert len(pictures) == 2 * 2 + 2 + 7 + 1
    inline = {
        base64.b64decode(reference.split(",", 1)[1])
        for reference in shown.references
        if reference.startswith("data:")
    }
    assert inline == set(pictures.values())
    for png in inline:
        assert png.startswith(b"\x89PNG")
    drawn = {path.stem: path.read_bytes() for path in (folder / "figures").glob("*.svg")}
    assert drawn.keys() == pictures.keys()
    assert all(b"<svg" in svg for svg in drawn.values())
    assert len(list((folder / "figures").iterdir())) == 2 * len(pictures)


def test_every_table_is_in_the_report_and_beside_it(folder, shown):
    names = {path.stem for path in (folder / "tables").iterdir()}
    assert {
        "gfc",
        "claims",
        "claim_tests",
        "correct_rates",
        "planted_truth",
    } <= names
    assert {
        "planted_layers",
        "confusion_full",
        "confusion_simplified",
        "provenance",
        "buttons",
    } <= names
    assert {"regressions", "regression_support", "regression_coefficients"} <= names
    assert {"centroid", "centroid_amplitude", "driving"} <= names
    assert sum(name.startswith("verdicts_") for name in names) == 2
    assert shown.tags.count("table") == len(names)
    for name in names:
        table = pd.read_csv(folder / "tables" / f"{name}.tsv", sep="\t")
        assert len(table) > 0 or name == "careless"
        assert set(table["simulated"]) <= {name != "provenance"}


def test_tables_beside_the_report_are_exact(folder, ratings):
    table = pd.read_csv(folder / "tables" / "claim_tests.tsv", sep="\t", na_values="n/a")
    pvc = ratings[(ratings["texture"] == "PVC") & (ratings["model"] == "full")]
    row = table[(table["texture"] == "PVC") & table["measure"].str.endswith("magnitude")].iloc[0]
    assert row["mean_reference"] == pytest.approx(pvc["magnitude_similarity"].mean(), rel=1e-12)


def test_simulated_results_are_called_so(shown):
    assert shown.text.count("SIMULATED") > 15
    assert (
        BANNER.format("the recordings are not of real surfaces; no person took part") in shown.text
    )
    assert "16 simulated participants with the simulated rig" in shown.text
    assert "say nothing about what people feel" in shown.text


def test_what_others_wrote_is_escaped(folder, shown):
    html = (folder / "report.html").read_text(encoding="utf-8")
    assert "<b>bold</b>" not in html
    assert "<i>study.toml</i>" not in html
    assert "<in silico>" not in html
    for text in ("<b>bold</b> & co", "<i>study.toml</i>", "A study <in silico>", WARNING):
        assert text in shown.text
    assert not {"i", "in"} & set(shown.tags)


def test_outcomes_are_computed_and_bounded(shown, ratings):
    assert "different: PVC −" in shown.text
    assert "does not show that two models are equivalent" in shown.text
    assert "chance 14.3%" in shown.text
    assert "of the planted layers" in shown.text
    assert "seed of this report" in shown.text


def test_a_report_of_real_answers_alone(tmp_path, ratings, choices):
    no_choices = choices.iloc[:0]
    path = write_report(
        tmp_path / "deep" / "report.html",
        responses=responses_of(ratings, no_choices, simulated=False),
    )
    shown = Page(path.read_text(encoding="utf-8"))
    assert "SIMULATED" not in shown.text
    assert "simulated" not in shown.text
    assert "Forced choice" not in shown.text
    assert "GFC" not in shown.text
    assert "16participants, absolute evaluation" in shown.text  # a tile: number, then words


def test_a_person_at_the_simulated_rig_is_a_person(tmp_path, ratings, choices):
    people = responses_of(of_six(ratings), of_six(choices), simulated=False, rig=True)
    shown = Page(write_report(tmp_path / "report.html", responses=people).read_text("utf-8"))
    told = "people took part, but with a simulated rig, so nobody felt a real surface"
    assert BANNER.format(told) in shown.text
    assert "Absolute evaluation: 6 participants with the simulated rig, 36 trials" in shown.text
    assert "6participants with the simulated rig, forced choice" in shown.text
    assert "The participants are people, but the rig was simulated" in shown.text
    assert "(SIMULATED)" in shown.text
    assert "simulated participants" not in shown.text.lower()
    assert "no person" not in shown.text


def test_simulated_participants_at_a_real_rig_are_no_people(tmp_path, ratings, choices):
    answers = responses_of(of_six(ratings), of_six(choices), simulated=True, rig=False)
    shown = Page(write_report(tmp_path / "report.html", responses=answers).read_text("utf-8"))
    assert BANNER.format("no person took part") in shown.text
    assert "6simulated participants, forced choice" in shown.text
    assert "Simulated participants follow a model" in shown.text
    assert "simulated rig" not in shown.text


def test_simulated_and_real_recordings_are_told_apart(tmp_path, results):
    measured = replace(
        results[1],
        recordings=RecordingSet(
            replace(recording, simulated=False) for recording in results[1].recordings.recordings
        ),
        model=replace(results[1].model, simulated=False),
        truth=None,
    )
    path = write_report(tmp_path / "report.html", textures=[results[0], measured])
    shown = Page(path.read_text(encoding="utf-8"))
    told = "the recordings of 1 of 2 textures are not of real surfaces"
    assert BANNER.format(told) in shown.text
    assert "fitted to 8 recordings, 4 of them simulated (" in shown.text


def test_the_flip_probability_says_what_it_covers(shown):
    assert (
        "in other records; it does not include whether the estimator would find the layer again"
        in shown.text
    )


@pytest.mark.parametrize("marked", [0, 3])
def test_unresolved_layers_are_counted(tmp_path, results, marked):
    model = results[0].model
    unresolved = np.zeros(model.unresolved.shape, dtype=bool)
    unresolved.flat[:marked] = True
    result = replace(results[0], model=replace(model, unresolved=unresolved))
    path = write_report(tmp_path / "report.html", textures=[result])
    told = f"In {marked} of {unresolved.size} layer-conditions"
    assert (told in Page(path.read_text(encoding="utf-8")).text) == (marked > 0)


def test_a_report_of_models_alone(tmp_path, results):
    path = write_report(tmp_path / "report.html", textures=results[:1])
    shown = Page(path.read_text(encoding="utf-8"))
    assert BANNER.format("the recordings are not of real surfaces") in shown.text
    assert "t-test" not in shown.text


@pytest.mark.parametrize("kept", ["participant_id == 'sub-01'", "model == 'full'"])
def test_a_study_that_has_just_begun_is_reported(tmp_path, ratings, choices, kept):
    begun = responses_of(ratings.query(kept), choices.query(kept), simulated=False)
    path = write_report(tmp_path / "report.html", responses=begun)
    shown = Page(path.read_text(encoding="utf-8"))
    assert "t undefined" in shown.text
    assert not re.search(r"\bnan\b", shown.text)


def test_a_texture_without_layers_is_reported(tmp_path, results):
    bare = results[0].model.with_layers([])
    result = TextureResult(
        results[0].recordings, bare, simplify(bare, Threshold.shipped("codec")), results[0].truth
    )
    path = write_report(tmp_path / "report.html", textures=[result])
    shown = Page(path.read_text(encoding="utf-8"))
    assert "leather: 0 of 0 layers kept" in shown.text
    assert "found 0% of the planted layers" in shown.text
    assert not re.search(r"\bnan\b", shown.text)


@pytest.mark.usefixtures("drawn")
def test_a_second_report_takes_the_place_of_the_first(tmp_path, ratings, choices, monkeypatch):
    """In small pictures, which differ as soon as large ones do."""
    monkeypatch.setattr("tactileq.analysis.report.report.PICTURE_DPI", 30)
    answers = responses_of(of_six(ratings), of_six(choices), simulated=True)
    first = write_report(tmp_path / "report.html", responses=answers, seed=1).read_bytes()
    second = write_report(tmp_path / "report.html", responses=answers, seed=1).read_bytes()
    assert first == second


def test_nothing_to_report_is_refused(tmp_path, ratings, choices):
    with refused(InputError, expected=["answers", "models"], got="neither"):
        write_report(tmp_path / "report.html")
    nothing = responses_of(ratings.iloc[:0], choices.iloc[:0], simulated=True)
    with refused(InputError, expected=["answers", "models"], got="neither"):
        write_report(tmp_path / "report.html", responses=nothing)
    assert not (tmp_path / "report.html").exists()


def test_every_pair_of_three_sets_has_its_times(tmp_path, choices):
    few = of_six(choices)
    few = few[few["participant_id"] <= "sub-04"]
    third = few[few["model"] == "full"].assign(model="AR")
    three = pd.concat([few, third]).sort_values("participant_id", kind="stable", ignore_index=True)
    relative = PlannedTask(
        participants=4, sessions=4, models=("full", "simplified", "AR"), repeats=3
    )
    responses = Responses(
        {"relative": three},
        simulated_participants=True,
        simulated_rig=True,
        planned={"relative": relative},
    )
    page = Page(write_report(tmp_path / "report.html", responses=responses).read_text("utf-8"))
    for other in ("simplified", "AR"):
        assert (tmp_path / "tables" / f"speed_accuracy_{other}_full.tsv").exists()
        assert f"Time, accuracy and both together: {other} compared with full models" in page.text
        assert f"Speed and accuracy, {other} compared with full models" in page.text
    assert len(page.identifiers) == len(set(page.identifiers))
