"""tactileq power and tactileq analyze --validate, as a user meets them."""

from __future__ import annotations

import json
from pathlib import Path

import pandas as pd
import pytest

from tactileq.analysis.statistics.participants.posterior import Effort
from tactileq.modeling import Threshold, simplify
from tactileq.stimuli.planted.textures import planted_texture


@pytest.fixture
def place(tmp_path: Path, small_study: str, claimed_study: str) -> Path:
    """A study with a claim, and its models."""
    codec = Threshold.named("codec")
    for name in ("canvas", "MDF"):
        truth = planted_texture(name)
        truth.save(tmp_path / f"models/{name}.json")
        simplify(truth, codec, criterion="paper-fft").model.save(
            tmp_path / f"simplified/{name}.json"
        )
    (tmp_path / "study.toml").write_text(claimed_study)
    (tmp_path / "none.toml").write_text(small_study)
    return tmp_path


def power(main, *more: object, study: str = "study.toml"):
    return main("power", study, "--simulations", 10, "--jobs", 1, *more)


def test_power_writes_its_table_and_chart(main, place: Path) -> None:
    words = ("--subjects", "4,8,4", "--effect", "magnitude_similarity=0")
    told = power(main, *words)
    assert told.returncode == 0, told.stderr
    line = "magnitude feels the same: simulated: "
    assert [text for text in told.stdout.splitlines() if text.startswith(line)]
    table = pd.read_csv(place / "power/power.tsv", sep="\t")
    assert set(table["n"]) == {4, 8}
    assert set(table["simulations"]) == {10}
    assert table["simulated"].all()
    note = json.loads((place / "power/provenance.json").read_text())
    assert note["settings"]["planted"]["MDF"] == {"magnitude_similarity": 0.0}
    files = ("power.tsv", "power.png", "power.svg")
    first = {name: (place / "power" / name).read_bytes() for name in files}
    assert first["power.svg"].startswith(b"<?xml")
    assert power(main, *words).returncode == 0
    assert {name: (place / "power" / name).read_bytes() for name in files} == first


def test_power_counts_by_the_rule_of_the_plan(
    main, place: Path, claimed_study: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    brief = Effort(chains=1, warm_up=10, steps=20, every=2)
    monkeypatch.setattr("tactileq.analysis.statistics.participants.verdict.SHORT", brief)
    by_model = '[plan]\nrule = "hierarchical"\n[[plan.claims]]'
    study = claimed_study.replace("participants = 2", "participants = 8")
    (place / "model.toml").write_text(study.replace("[[plan.claims]]", by_model))
    words = ("--subjects", "[8,9]", "--effect", "magnitude_similarity=0")
    told = power(main, *words, study="model.toml")
    assert told.returncode == 0, told.stderr
    table = pd.read_csv(place / "power/power.tsv", sep="\t")
    assert set(table["n"]) == {8, 9}
    assert set(table[table["texture"] == "all textures"].groupby("n")["hits"].sum()) == {
        table["simulations"].max()
    }
    told = power(main, "--subjects", "4,8,4", "--out", "no", study="model.toml")
    assert told.returncode == 1
    (line,) = told.stderr.splitlines()
    assert (
        'expected 8 participants or more, as the rule of the plan is "hierarchical", got 4' in line
    )
    assert not (place / "no").exists()


@pytest.mark.long("Dask with real workers")
def test_dask_workers_give_the_same_table(main, place: Path) -> None:
    from distributed import LocalCluster  # late: collecting the tests needs no Dask

    words = ("power", "study.toml", "--simulations", 10, "--subjects", "[2,4]")
    many = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": None}
    with LocalCluster(processes=False, **many) as cluster:
        there = main(*words, "--dask", cluster.scheduler_address, "--out", "there")
    assert there.returncode == 0, there.stderr
    assert main(*words, "--jobs", 1, "--out", "here").returncode == 0
    assert (place / "here/power.tsv").read_bytes() == (place / "there/power.tsv").read_bytes()


def test_power_refuses_in_one_sentence_and_replaces_nothing(main, place: Path) -> None:
    refused = power(main, study="none.toml")
    assert refused.returncode == 1
    (line,) = refused.stderr.splitlines()
    assert "expected claims under [[plan.claims]] in the study" in line
    assert not (place / "power").exists()
    (place / "power").mkdir()
    (place / "power/mine.txt").write_text("mine")
    refused = power(main)
    assert "expected a new folder or earlier results of tactileq power" in refused.stderr
    assert (place / "power/mine.txt").read_text() == "mine"


@pytest.mark.usefixtures("undrawn")
def test_the_report_gets_the_appendix(main, place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from tactileq.benches.validation import model as validation_model
    from tactileq.benches.validation import procedures as validation
    from tactileq.benches.validation import ranks as validation_ranks

    few = validation.cells(["TOST, guard on ends"], sizes=[8])
    monkeypatch.setattr(validation, "cells", lambda: few)
    of_model = [("none, SD 2", 8), ("choices, days .25", 8)]
    monkeypatch.setattr(validation_model, "model_cells", lambda: of_model)
    ranks = {"two repeats": validation_ranks.RANK_KINDS["two repeats"]}
    monkeypatch.setattr(validation_ranks, "RANK_KINDS", ranks)
    monkeypatch.setattr(validation_ranks, "STEPS", 100)
    assert main("simulate", "--study", "study.toml", "--data", "data").returncode == 0
    told = main("analyze", "data", "--validate", 4, "--jobs", 1)
    assert told.returncode == 0, told.stderr
    table = pd.read_csv(place / "analysis-results/tables/validation.tsv", sep="\t")
    assert len(table) == len(few)
    assert set(table["simulations"]) == {4}
    table = pd.read_csv(place / "analysis-results/tables/validation_model.tsv", sep="\t")
    assert list(table["world"]) == [name for name, _ in of_model]
    assert list(table["rule"]) == ["hierarchical", "tests"]
    table = pd.read_csv(place / "analysis-results/tables/validation_ranks.tsv", sep="\t")
    assert {sum(map(int, ranks.split())) for ranks in table["ranks"]} == {4}
    page = (place / "analysis-results/report.html").read_text()
    assert "Appendix: the procedures on planted truth" in page
    assert main("analyze", "data").returncode == 0
    assert "Appendix" not in (place / "analysis-results/report.html").read_text()
