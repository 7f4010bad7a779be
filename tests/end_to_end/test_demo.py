"""The whole road in one command, and what is left behind."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pandas as pd

from modeling import RecordingSet, TextureModel
from modeling.models.loading import models_in
from modeling.perception.verdicts import load_simplifications
from stimuli.planted.textures import TEXTURES


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

    sets = [RecordingSet.load(folder) for folder in (demo / "recordings").iterdir()]
    assert sorted(records.texture for records in sets) == sorted(TEXTURES)
    assert all(len(records) == 49 for records in sets)
    assert all(r.simulated and r.rate_hz == 22704 for s in sets for r in s.recordings)

    full = {p.name: TextureModel.load(p) for p in (demo / "models").glob("*.json")}
    shown = models_in(demo / "simplified")[0]
    fewer = {p.name: TextureModel.load(p) for p in shown}
    reasons = load_simplifications(demo / "simplified")
    assert {name: why.model for name, why in reasons.items()} == {
        model.texture: model for model in fewer.values()
    }
    assert full.keys() == fewer.keys()
    assert all(m.simulated for m in [*full.values(), *fewer.values()])
    assert sum(m.n_layers for m in fewer.values()) < sum(m.n_layers for m in full.values())

    manifest = pd.read_csv(demo / "stimuli/manifest.tsv", sep="\t")
    assert len(manifest) == 14
    assert manifest.simulated.all()

    people = pd.read_csv(demo / "data/participants.tsv", sep="\t")
    assert list(people.participant_id) == [f"sub-{n:02d}" for n in range(1, 25)]
    assert json.loads((demo / "data/dataset_description.json").read_text())["Simulated"] is True
    answers = {task: answers_of(demo / "data", task) for task in ("absolute", "relative")}
    assert answers["absolute"].participant.nunique() == 20
    assert answers["relative"].participant.nunique() == 24
    # 7 textures × 2 models and two anchors; 7 textures × 3 repeats on each of two days.
    assert (answers["absolute"].groupby("participant").size() == 16).all()
    assert (answers["relative"].groupby("participant").size() == 42).all()
    assert set(answers["relative"].groupby(["texture", "model"]).size()) == {24 * 3}
    assert all(table.simulated.all() for table in answers.values())
    absolute = answers["absolute"]
    own = absolute[absolute.virtual_texture == absolute.texture]
    assert set(own.groupby(["texture", "model"]).size()) == {20}
    ratings = own.set_index(["texture", "participant", "model"])
    ratings = ratings[["magnitude_similarity", "frequency_similarity"]]
    assert ratings.stack().between(0, 100).all()
    assert 1.5 / 7 < answers["relative"].correct.mean() < 0.95
    assert (ratings >= 99.5).to_numpy().mean() < 0.05
    planted = json.loads((demo / "provenance.json").read_text())["settings"]["planted"]
    assert {p for points in planted.values() for p in points.values()} == {-15.0, 0.0}
    differences = ratings.xs("simplified", level="model") - ratings.xs("full", level="model")
    for texture, points in planted.items():
        found = differences.loc[texture]
        errors = found.std() / len(found) ** 0.5
        assert ((found.mean() - pd.Series(points)).abs() < 4 * errors).all()
    assert json.loads((demo / "provenance.json").read_text())["seed"] == 1

    names = ["gfc", "claims", "claim_tests", "correct_rates", "planted_truth"]
    names += ["regressions", "regression_support", "regression_coefficients", "centroid", "driving"]
    for name in names:
        table = pd.read_csv(demo / "tables" / f"{name}.tsv", sep="\t")
        assert len(table) > 0
        assert table.simulated.all()
    regressions = pd.read_csv(demo / "tables/regressions.tsv", sep="\t")
    layers = sum(m.n_layers for m in full.values())
    assert len(regressions) == len(TEXTURES) + 3 * layers
    driving = pd.read_csv(demo / "tables/driving.tsv", sep="\t")
    numbers = driving[driving.texture == "all textures"].set_index("driven_by").numbers
    assert numbers["grid"] > 10 * numbers["conditions"] > 10 * numbers["centroid"]
    assert (demo / "figures/centroid.png").read_bytes().startswith(b"\x89PNG")

    # What the report says is what was planted, or nothing; the difference of PVC it finds.
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
    """All main trials of a task, straight from the files."""
    parts = []
    for path in data.glob(f"sub-*/ses-*/beh/*_task-{task}_beh.tsv"):
        parts.append(pd.read_csv(path, sep="\t").assign(participant=path.name[:6]))
    table = pd.concat(parts)
    return table[table.phase == "main"]
