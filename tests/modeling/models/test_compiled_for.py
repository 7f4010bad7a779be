"""What a model says of the scene that it was compiled for: kinds, files, equality."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from tactileq.modeling import RegressedModel, TextureModel
from tactileq.modeling.models.compiled_for import CompiledFor

NOTE = CompiledFor("touch", "a" * 64, "b" * 64, {"gfc30": 0.95, "level_db": 1}, 4e-3, True)


def test_a_model_file_holds_it_and_loads_back_equal(
    make_model: Callable[..., TextureModel],
    make_falling: Callable[..., RegressedModel],
    tmp_path: Path,
) -> None:
    for model in (make_model(0.1, [(100, 20, 1)]), make_falling()):
        noted = replace(model, compiled_for=NOTE)
        noted.save(tmp_path / "model.json")
        loaded = type(model).load(tmp_path / "model.json")
        assert loaded == noted
        assert loaded.compiled_for == NOTE
        assert loaded.sha256 == noted.sha256 != model.sha256


def test_what_it_says_tells_models_apart(make_model: Callable[..., TextureModel]) -> None:
    model = make_model(0.1, [(100, 20, 1)])
    noted = replace(model, compiled_for=NOTE)
    assert noted != model
    assert noted != replace(model, compiled_for=replace(NOTE, single=False))
    assert noted == replace(model, compiled_for=replace(NOTE))


def test_a_model_without_it_has_the_file_that_it_had(
    make_model: Callable[..., TextureModel], tmp_path: Path
) -> None:
    model = make_model(0.1, [(100, 20, 1)])
    assert "compiled_for" not in model.to_dict()
    assert TextureModel.read(model.to_dict()).compiled_for is None
