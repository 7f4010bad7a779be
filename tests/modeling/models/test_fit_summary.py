"""What the estimator says of its fit: in the model's file, and gone where it no longer holds."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np

from tactileq.modeling import TextureModel
from tactileq.modeling.models.fit_summary import FitSummary
from tactileq.stimuli.planted.textures import planted_texture

SUMMARY = FitSummary(0.5, 1.25, 0.6, {"2": 0.7, "4": 0.59}, ("a sentence", "another"))


def model() -> TextureModel:
    axes = {"speeds_mm_s": np.array([100.0, 300.0]), "forces_n": np.array([1.0, 3.0])}
    return replace(planted_texture("PVC", **axes), fit=SUMMARY)


def test_it_is_saved_and_loaded_with_the_model(tmp_path: Path) -> None:
    model().save(tmp_path / "PVC.json")
    again = TextureModel.load(tmp_path / "PVC.json")
    assert again == model()
    assert again.fit == SUMMARY
    assert again.to_dict() == json.loads((tmp_path / "PVC.json").read_text())


def test_files_without_it_are_read_as_before(tmp_path: Path) -> None:
    plain = replace(model(), fit=None)
    assert "fit" not in plain.to_dict()
    plain.save(tmp_path / "PVC.json")
    assert TextureModel.load(tmp_path / "PVC.json").fit is None


def test_it_says_nothing_of_a_model_with_fewer_layers() -> None:
    assert model().with_layers([0, 1, 2, 3]).fit == SUMMARY
    assert model().with_layers([0, 1, 3]).fit is None
    assert model().at_rate(10_000.0).fit == SUMMARY
