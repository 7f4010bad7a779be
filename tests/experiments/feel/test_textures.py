"""Models for visitors, by files and folders."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from tactileq.experiments.feel.textures import Texture, load_textures
from tactileq.modeling import InputError, Threshold, fit_ar, regressed, simplify
from tactileq.stimuli.planted.textures import planted_texture, record_texture
from tests.refusals import refused


def test_files_and_folders_give_textures_in_their_order(tmp_path: Path) -> None:
    for folder in ("models", "fewer"):
        (tmp_path / folder).mkdir()
    for name in ("canvas", "PVC"):
        model = planted_texture(name)
        model.save(tmp_path / "models" / f"{name}.json")
    result = simplify(planted_texture("canvas"), Threshold.shipped("codec"), criterion="paper-fft")
    result.model.save(tmp_path / "fewer" / "canvas.json")
    result.save(tmp_path / "fewer" / "canvas_simplification.json")
    regressed(planted_texture("MDF")).save(tmp_path / "driven.json")
    textures = load_textures([tmp_path / "driven.json", tmp_path / "models"], tmp_path / "fewer")
    assert [texture.name for texture in textures] == ["MDF", "PVC", "canvas"]
    assert [texture.simplified is None for texture in textures] == [True, True, False]
    canvas, pvc = textures[2], textures[1]
    assert canvas.model(simplified=True).n_layers == 1
    assert canvas.model(simplified=False).n_layers == 4
    assert pvc.model(simplified=True) is pvc.full


def test_what_cannot_be_felt_is_refused_in_one_sentence(tmp_path: Path) -> None:
    canvas = planted_texture("canvas")
    canvas.save(tmp_path / "a.json")
    replace(canvas, unit="arbitrary").save(tmp_path / "arbitrary.json")
    fit_ar(record_texture(canvas), order=4).save(tmp_path / "ar.json")
    fewer = tmp_path / "fewer"
    fewer.mkdir()
    planted_texture("PVC").save(fewer / "PVC.json")

    def refusal(*named: str, simplified: Path | None = None) -> str:
        with pytest.raises(InputError) as told:
            load_textures([tmp_path / name for name in named], simplified)
        return str(told.value)

    assert refusal("nothing.json").startswith("expected a model file at ")
    assert "got an autoregressive one" in refusal("ar.json")
    assert "expected a model in g, got the unit 'arbitrary'" in refusal("arbitrary.json")
    assert "expected one model of each texture, got two of 'canvas'" in refusal("a.json", "a.json")
    told = refusal("a.json", simplified=fewer)
    assert told.startswith("expected a simplified model of canvas in ")
    assert told.endswith("got PVC; simplify these models, too.")
    with refused(InputError, names="canvas", got=[5000, "8000 Hz"]):
        Texture(full=canvas, simplified=canvas.at_rate(8000.0))
