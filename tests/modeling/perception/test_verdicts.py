"""Simplifications on disk: they load back equal, and what was changed is refused."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tactileq.modeling import InputError, Simplification, TextureModel, Threshold, simplify
from tactileq.modeling.models.loading import models_in
from tactileq.modeling.perception.verdicts import ENDING, load_simplifications
from tactileq.stimuli.planted.textures import planted_texture
from tests.refusals import refused

ModelMaker = Callable[..., TextureModel]
CODEC = Threshold.shipped("codec")


@pytest.fixture(scope="module")
def polyester() -> Simplification:
    """A simplification that drops layers."""
    return simplify(planted_texture("polyester"), CODEC, criterion="paper-fft", margin_db=1.5)


def test_it_loads_back_equal(tmp_path: Path, polyester: Simplification) -> None:
    polyester.save(tmp_path / "x.json")
    loaded = Simplification.load(tmp_path / "x.json")
    assert loaded == polyester
    assert loaded.layers == polyester.layers
    assert loaded.model == polyester.model
    assert loaded.margin_db == 1.5
    assert loaded.threshold.source == CODEC.source
    assert {layer.verdict for layer in loaded.layers} == {"kept", "dropped"}


@pytest.mark.parametrize("gain", [0.0, 0.2])
def test_verdicts_without_a_number_load_back_equal(
    tmp_path: Path, make_model: ModelMaker, gain: float
) -> None:
    # 1000 Hz lies above the table: without the held level no distance is known (NaN); a silent
    # layer lies infinitely far below.
    made = simplify(
        make_model(0.01, [(1000.0, 50.0, gain), (100.0, 50.0, gain)]), CODEC, hold_above=False
    )
    assert not np.isfinite([layer.distance_db for layer in made.layers]).all()
    made.save(tmp_path / "x.json")
    loaded = Simplification.load(tmp_path / "x.json")
    assert loaded == made
    assert [str(a) for a in loaded.layers] == [str(b) for b in made.layers]


def test_models_that_keep_every_layer_are_identical() -> None:
    leather = simplify(planted_texture("MDF"), Threshold("low", [1, 2500], [1e-9, 1e-9], "", ""))
    assert leather.identical
    assert leather.model == planted_texture("MDF")
    assert not simplify(planted_texture("PVC"), CODEC).identical


def test_hashes_are_those_of_the_saved_files(tmp_path: Path, polyester: Simplification) -> None:
    full = planted_texture("polyester")
    full.save(tmp_path / "full.json")
    digest = hashlib.sha256((tmp_path / "full.json").read_bytes()).hexdigest()
    assert digest == full.sha256 == polyester.full_sha256
    assert full.sha256 != polyester.model.sha256


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({"threshold_sha256": "00"}, "threshold_sha256 as tactileq simplify wrote it"),
        ({"model_sha256": "00"}, "model_sha256 as tactileq simplify wrote it"),
        ({"identical": True}, "identical as tactileq simplify wrote it"),
        ({"texture": "silk"}, "texture as tactileq simplify wrote it"),
        ({"sha256": "00"}, "sha256 as tactileq simplify wrote it"),
    ],
)
def test_changed_files_are_refused(
    tmp_path: Path, polyester: Simplification, change: dict[str, object], expected: str
) -> None:
    path = tmp_path / "x.json"
    polyester.save(path)
    path.write_text(json.dumps(json.loads(path.read_text()) | change))
    with pytest.raises(InputError, match=expected) as caught:
        Simplification.load(path)
    assert str(path) in str(caught.value)
    assert str(caught.value).count("expected") == 1


def test_edited_verdicts_are_refused(tmp_path: Path, polyester: Simplification) -> None:
    path = tmp_path / "x.json"
    polyester.save(path)
    text = path.read_text()
    path.write_text(text.replace('"verdict": "dropped"', '"verdict": "kept"'))
    with pytest.raises(InputError, match="sha256 as tactileq simplify wrote it"):
        Simplification.load(path)
    path.write_text(text.replace('"margin_db": 1.5', '"margin_db": 6.0'))
    with pytest.raises(InputError, match="sha256 as tactileq simplify wrote it"):
        Simplification.load(path)


def test_a_folder_of_them(tmp_path: Path, polyester: Simplification) -> None:
    with refused(InputError, expected=tmp_path, got=["none", "tactileq simplify"]):
        load_simplifications(tmp_path)
    polyester.save(tmp_path / f"polyester{ENDING}")
    polyester.model.save(tmp_path / "polyester.json")
    assert load_simplifications(tmp_path) == {"polyester": polyester}
    # It stands beside models and is none, nor a stranger that has to be told of.
    assert models_in(tmp_path) == ([tmp_path / "polyester.json"], [])
    polyester.save(tmp_path / f"again{ENDING}")
    with refused(InputError, expected=tmp_path, got="'polyester'"):
        load_simplifications(tmp_path)
