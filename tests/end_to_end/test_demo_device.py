"""The study on simulated devices, with two textures and participants; the command has more."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tactileq.commands.benches.demo_device import PARTICIPANTS, demo_on_devices, device_study
from tactileq.experiments.study.study import Study
from tactileq.modeling import RecordingSet
from tactileq.modeling.models.loading import models_in
from tactileq.rig.machines.recorder.store import TABLE_NAME

TEXTURES = ["PVC", "leather"]


def small() -> Study:
    tables = device_study().to_tables()
    tables["textures"] = TEXTURES
    tables["trays"] = {name: tables["trays"][name] for name in TEXTURES}
    for task in ("absolute", "relative"):
        tables[task] |= {"participants": 2}
    tables["absolute"].pop("anchors")
    return Study.from_tables(tables)


def test_the_study_has_seven_textures_and_four_participants() -> None:
    study = device_study()
    assert len(study.textures) == 7
    assert PARTICIPANTS >= 4
    assert {plan.participants for plan in study.tasks.values()} == {PARTICIPANTS}


def test_from_the_recorder_to_the_report(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    demo_on_devices(Path("demo"), 1, small())
    demo = tmp_path / "demo"
    assert Path(capsys.readouterr().out.strip().splitlines()[-1]) == demo / "report.html"
    for texture in TEXTURES:
        records = RecordingSet.load(demo / "recordings" / texture)
        assert len(records) == 49
        assert all(record.simulated for record in records)
        table = pd.read_csv(demo / "recordings" / texture / TABLE_NAME, sep="\t")
        assert table.mean_force_n.to_numpy() == pytest.approx(table.true_force_n, rel=0.021)
    # Two textures are not the same sample on the turntable.
    assert len(models_in(demo / "models")[0]) == len(TEXTURES)

    near = pd.read_csv(demo / "tables/recorder_near.tsv", sep="\t")
    assert near.difference_db.abs().mean() < 0.1
    moved = pd.read_csv(demo / "tables/device_moved.tsv", sep="\t")
    assert list(moved.participant_id) == ["sub-01", "sub-02"]
    assert (moved.contact_s > 10).all()
    assert moved.force_n.between(0.3, 3.5).all()
    assert np.ptp(moved.speed_mm_s) > 1

    stored = next(demo.glob("data/sourcedata/sub-01/ses-*/*_task-absolute_hand.tsv"))
    depth = pd.read_csv(stored, sep="\t").query("surface == 'virtual'").depth_mm
    assert 0.5 < depth.max() < 15
    page = (demo / "report.html").read_text(encoding="utf-8")
    assert "On simulated devices" in page
    assert "SIMULATED" in page
    assert json.loads((demo / "data/dataset_description.json").read_text())["Simulated"] is True
