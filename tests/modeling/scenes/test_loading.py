"""A scene by its file or by its folder, and the scenes that ship as examples."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tactileq.modeling import InputError, Scene, TextureModel, compile_scene
from tactileq.modeling.models.loading import models_in
from tactileq.modeling.scenes.compiled import FORMAT
from tactileq.modeling.scenes.loading import full_models, scene_files, scene_models, scene_name
from tactileq.stimuli.planted.textures import planted_texture
from tests.refusals import refused

SMALL = {"speeds_mm_s": np.array([100.0, 300.0]), "forces_n": np.array([1.0, 3.0])}
SCENE = """
version = 1
scene = {name = "light touch", models = "models", textures = ["MDF"]}
hand = {speed_mm_s = [100, 300], force_n = [1, 3]}
"""
EXAMPLES = sorted((Path(__file__).parents[3] / "modeling/scenes/shipped").glob("*.toml"))


@pytest.fixture
def full(tmp_path: Path) -> dict[str, TextureModel]:
    """Two full models, in the folder models; beside it a scene file of one."""
    found = {name: planted_texture(name, **SMALL) for name in ("MDF", "PVC")}
    for name, model in found.items():
        model.save(tmp_path / f"models/{name}.json")
    (tmp_path / "light.toml").write_text(SCENE)
    return found


def test_a_file_and_the_folder_it_was_compiled_into_give_the_same_models(
    tmp_path: Path, full: dict[str, TextureModel]
) -> None:
    file, folder = tmp_path / "light.toml", tmp_path / "light"
    told: list[tuple[float, str]] = []
    least = scene_models(file, full, progress=lambda *done: told.append(done))
    assert told == [(1.0, "MDF")]
    compile_scene(Scene.load(file), full).save(folder)
    assert scene_models(folder, full) == least == scene_models(file) == scene_models(folder)
    assert scene_name(file) == scene_name(folder) == "light touch"
    assert scene_files(file) == (file,)
    assert scene_files(folder) == (folder,)
    # What tells of the scene is no model, and needs no word.
    assert models_in(folder) == ([folder / "MDF.json"], [])
    assert f'"{FORMAT}"' in (folder / "scene.json").read_text()


def test_models_that_have_changed_since_are_refused(
    tmp_path: Path, full: dict[str, TextureModel]
) -> None:
    compile_scene(Scene.load(tmp_path / "light.toml"), full).save(tmp_path / "light")
    other = full | {"MDF": replace(full["MDF"], estimator="another")}
    with refused(InputError, expected=["MDF", tmp_path / "light"]):
        scene_models(tmp_path / "light", other)
    with refused(InputError, expected=["MDF", tmp_path / "light"], got="none"):
        scene_models(tmp_path / "light", {"PVC": full["PVC"]})


def test_full_models_are_in_the_folder_that_a_scene_names(
    tmp_path: Path, full: dict[str, TextureModel]
) -> None:
    scene = Scene.load(tmp_path / "light.toml")
    assert full_models(scene) == (tmp_path / "models", full)
    assert full_models(replace(scene, models=None), tmp_path / "models")[1] == full
    with refused(InputError, expected="light touch", got=["none", "models", "[scene]", "--models"]):
        full_models(replace(scene, models=None))
    with refused(InputError, expected="light touch", got=[tmp_path / "nowhere", "--models"]):
        full_models(scene, tmp_path / "nowhere")


def test_a_folder_without_a_compiled_scene_is_refused(
    tmp_path: Path, full: dict[str, TextureModel]
) -> None:
    with refused(InputError, expected=tmp_path / "models/scene.json", got="nothing"):
        scene_models(tmp_path / "models")


@pytest.mark.parametrize("path", EXAMPLES, ids=[path.stem for path in EXAMPLES])
def test_scenes_that_ship_compile_for_any_texture(path: Path) -> None:
    scene = Scene.load(path)
    full = {"oak": replace(planted_texture("MDF"), texture="oak")}
    (compiled,) = compile_scene(scene, full).textures
    assert compiled.after.operations < compiled.before.operations
    assert {measured.measure for measured in compiled.measures} == set(scene.bound.to_dict())


def test_five_scenes_ship() -> None:
    assert len(EXAMPLES) == 5
