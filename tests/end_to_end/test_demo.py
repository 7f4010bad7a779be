"""The whole road in one command, and what is left behind."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pandas as pd
import pytest

from tactileq import Study
from tactileq.modeling import RecordingSet, TextureModel
from tactileq.modeling.models.loading import models_in
from tactileq.modeling.perception.verdicts import load_simplifications
from tactileq.stimuli.planted.textures import TEXTURES

RATINGS = ["magnitude_similarity", "frequency_similarity"]


@pytest.mark.long("the full demo")
def test_demo_from_recording_to_report(run, tmp_path: Path) -> None:
    result = run("demo")
    assert result.returncode == 0, result.stderr
    report = Path(result.stdout.strip().splitlines()[-1])
    assert report == tmp_path / "demo/report.html"
    demo = report.parent
    page = report.read_text(encoding="utf-8")
    assert "SIMULATED" in page
    assert not re.search(r"""(src|href)=["'](?!data:|#)""", page)
    for texture in TEXTURES:
        assert texture in page
    assert json.loads((demo / "provenance.json").read_text())["seed"] == 1

    assert_recorded(demo)
    layers = assert_modelled_and_simplified(demo)
    assert_answered_as_planned(demo)
    assert_as_similar_as_planted(demo)
    assert_tables_stand_beside_the_report(demo, layers=layers)
    assert_the_report_says_what_was_planted(demo)


def assert_recorded(demo: Path) -> None:
    sets = [RecordingSet.load(folder) for folder in (demo / "recordings").iterdir()]
    assert sorted(records.texture for records in sets) == sorted(TEXTURES)
    assert all(len(records) == 49 for records in sets)
    assert all(r.simulated and r.rate_hz == 22704 for s in sets for r in s.recordings)


def assert_modelled_and_simplified(demo: Path) -> int:
    """How many layers the full models have."""
    full = {p.name: TextureModel.load(p) for p in (demo / "models").glob("*.json")}
    shown = models_in(demo / "simplified")[0]
    fewer = {p.name: TextureModel.load(p) for p in shown}
    reasons = load_simplifications(demo / "simplified")
    assert {name: why.model for name, why in reasons.items()} == {
        model.texture: model for model in fewer.values()
    }
    assert full.keys() == fewer.keys()
    assert all(m.simulated for m in [*full.values(), *fewer.values()])
    layers = sum(m.n_layers for m in full.values())
    assert sum(m.n_layers for m in fewer.values()) < layers

    manifest = pd.read_csv(demo / "stimuli/manifest.tsv", sep="\t")
    assert len(manifest) == 14
    assert manifest.simulated.all()
    return layers


def assert_answered_as_planned(demo: Path) -> None:
    """The paper's study: 20 people and 2 × 24 sessions, each with training."""
    people = pd.read_csv(demo / "data/participants.tsv", sep="\t")
    assert list(people.participant_id) == [f"sub-{n:02d}" for n in range(1, 25)]
    assert json.loads((demo / "data/dataset_description.json").read_text())["Simulated"] is True

    absolute, relative = (answers_of(demo / "data", task) for task in ("absolute", "relative"))
    assert absolute.simulated.all()
    assert relative.simulated.all()
    assert absolute[RATINGS].stack().between(0, 100).all()
    training = absolute[absolute.phase != "main"]
    assert len(training) == 20 * Study.load().plan_of("absolute").training_trials

    absolute, relative = (table[table.phase == "main"] for table in (absolute, relative))
    assert absolute.participant.nunique() == 20
    assert relative.participant.nunique() == 24
    # 7 textures × 2 models and two anchors; 7 textures × 3 repeats on each of two days.
    assert (absolute.groupby("participant").size() == 16).all()
    assert (relative.groupby("participant").size() == 42).all()
    own = absolute[absolute.virtual_texture == absolute.texture]
    assert set(own.groupby(["texture", "model"]).size()) == {20}
    assert set(relative.groupby(["texture", "model"]).size()) == {24 * 3}
    assert 1.5 / 7 < relative.correct.mean() < 0.95


def assert_as_similar_as_planted(demo: Path) -> None:
    absolute = answers_of(demo / "data", "absolute")
    own = absolute[(absolute.phase == "main") & (absolute.virtual_texture == absolute.texture)]
    ratings = own.set_index(["texture", "participant", "model"])[RATINGS]
    assert (ratings >= 99.5).to_numpy().mean() < 0.05
    planted = json.loads((demo / "provenance.json").read_text())["settings"]["planted"]
    assert {p for points in planted.values() for p in points.values()} == {-15.0, 0.0}
    differences = ratings.xs("simplified", level="model") - ratings.xs("full", level="model")
    for texture, points in planted.items():
        found = differences.loc[texture]
        errors = found.std() / len(found) ** 0.5
        assert ((found.mean() - pd.Series(points)).abs() < 4 * errors).all()


def assert_tables_stand_beside_the_report(demo: Path, *, layers: int) -> None:
    names = ["gfc", "claims", "claim_tests", "correct_rates", "planted_truth"]
    names += ["regressions", "regression_support", "regression_coefficients", "centroid", "driving"]
    for name in names:
        table = pd.read_csv(demo / "tables" / f"{name}.tsv", sep="\t")
        assert len(table) > 0
        assert table.simulated.all()
    regressions = pd.read_csv(demo / "tables/regressions.tsv", sep="\t")
    assert len(regressions) == len(TEXTURES) + 3 * layers
    driving = pd.read_csv(demo / "tables/driving.tsv", sep="\t")
    numbers = driving[driving.texture == "all textures"].set_index("driven_by").numbers
    assert numbers["grid"] > 10 * numbers["conditions"] > 10 * numbers["centroid"]
    assert (demo / "figures/centroid.png").read_bytes().startswith(b"\x89PNG")


def assert_the_report_says_what_was_planted(demo: Path) -> None:
    """Or nothing; the difference of PVC it finds."""
    said = pd.read_csv(demo / "tables/planted_effects.tsv", sep="\t")
    assert set(said.agreement) <= {"agrees", "undecided"}
    magnitude = said[said.claim == "magnitude feels the same"].set_index("texture")
    assert magnitude.loc["PVC", ["planted", "verdict"]].tolist() == [-15.0, "different"]
    assert (said.agreement == "agrees").sum() >= 4
    tests = pd.read_csv(demo / "tables/claim_tests.tsv", sep="\t", na_values="n/a")
    # Anchors and the reference are told apart: nothing withholds equality.
    assert tests.doubt.isna().all()
    assert "equivalent" in set(tests.verdict)


def answers_of(data: Path, task: str) -> pd.DataFrame:
    """All trials of a task, those for training too, straight from the files."""
    parts = []
    for path in data.glob(f"sub-*/ses-*/beh/*_task-{task}_beh.tsv"):
        parts.append(pd.read_csv(path, sep="\t").assign(participant=path.name[:6]))
    return pd.concat(parts)
