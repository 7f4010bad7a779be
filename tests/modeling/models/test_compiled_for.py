"""What a model says of the scene that it was compiled for: kinds, files, equality."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import pytest

from modeling import InputError, RegressedModel, TextureModel
from modeling.models.compiled_for import CompiledFor

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
    assert TextureModel.from_dict(model.to_dict(), source=tmp_path).compiled_for is None


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"scene": ""}, "expected printable text in one line as name of the scene"),
        ({"scene": 5}, "expected printable text in one line as name of the scene"),
        ({"scene_sha256": None}, "in compiled_for, got"),
        ({"full_sha256": 5}, "in compiled_for, got"),
        ({"bound": 1.0}, "in compiled_for, got"),
        ({"bound": {"gfc30": "0.9"}}, "in compiled_for, got"),
        ({"update_s": 0}, "in compiled_for, got"),
        ({"update_s": float("inf")}, "in compiled_for, got"),
        ({"update_s": "4 ms"}, "in compiled_for, got"),
        ({"single": "false"}, "in compiled_for, got"),
        ({"more": 1}, "expected bound, full_sha256, scene, scene_sha256, single, update_s"),
    ],
)
def test_values_of_other_kinds_are_refused(changes: dict[str, Any], expected: str) -> None:
    with pytest.raises(InputError, match=expected) as refused:
        CompiledFor.of(asdict(NOTE) | changes)
    assert str(refused.value).count(". ") == 0


@pytest.mark.parametrize("value", [5, "touch", [], {}, {"scene": "touch"}])
def test_what_is_no_such_note_is_refused(value: object) -> None:
    with pytest.raises(InputError, match="expected bound, full_sha256, scene"):
        CompiledFor.of(value)
