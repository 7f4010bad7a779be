"""Stimulus sets of scenes: the least models stand where models from files stand."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tactileq.modeling import InputError, Scene, compile_scene
from tactileq.modeling.models.loading import load_model
from tactileq.modeling.scenes.loading import scene_models
from tactileq.stimuli.planted.textures import planted_texture
from tactileq.stimuli.sets.recipe import Recipe
from tactileq.stimuli.sets.sources import files_behind, load_sources
from tactileq.stimuli.sets.writing import write_set
from tests.refusals import refused

SMALL = {"speeds_mm_s": np.array([100.0, 300.0]), "forces_n": np.array([1.0, 3.0])}
SCENE = """
version = 1
scene = {name = "light touch", models = "models", textures = ["MDF"]}
hand = {speed_mm_s = [100, 300], force_n = [1, 3]}
"""
RECIPE = """
version = 1
set = {name = "touch", rate_hz = 5000, duration_s = 0.2}
[[model]]
scene = "light.toml"
[[model]]
path = "models"
[[trajectory]]
speed_mm_s = 150
force_n = 1.5
"""


@pytest.fixture
def place(tmp_path: Path) -> Path:
    """A full model, a scene of it and a recipe of both."""
    planted_texture("MDF", **SMALL).save(tmp_path / "models/MDF.json")
    (tmp_path / "light.toml").write_text(SCENE)
    (tmp_path / "set.toml").write_text(RECIPE)
    return tmp_path


def samples(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.glob("*.wav")}


def test_a_set_holds_the_compiled_models_and_can_be_made_again(place: Path) -> None:
    recipe = Recipe.load(place / "set.toml")
    assert [entry.label for entry in recipe.models] == ["light touch", "models"]
    made = write_set(place / "a", recipe)
    least = scene_models(place / "light.toml")["MDF"]
    assert load_model(place / "a/sources/MDF_light-touch.json") == least
    assert made[0].model_sha256 == least.sha256
    assert set(samples(place / "a")) == {
        "MDF_light-touch_150mms_1.5N.wav",
        "MDF_models_150mms_1.5N.wav",
    }
    # Whatever becomes of scene and models.
    own = Recipe.load(place / "a/recipe.toml")
    assert [entry.scene for entry in own.models] == [None, None]
    (place / "light.toml").unlink()
    (place / "models/MDF.json").unlink()
    assert write_set(place / "b", own) == made
    assert samples(place / "b") == samples(place / "a")


def test_a_compiled_folder_renders_as_its_scene_file(place: Path) -> None:
    from_file = write_set(place / "a", Recipe.load(place / "set.toml"))
    scene = Scene.load(place / "light.toml")
    compile_scene(scene, {"MDF": planted_texture("MDF", **SMALL)}).save(place / "light")
    (place / "set.toml").write_text(RECIPE.replace("light.toml", "light"))
    assert write_set(place / "b", Recipe.load(place / "set.toml")) == from_file
    assert samples(place / "b") == samples(place / "a")


def test_a_recipe_rests_on_what_its_scenes_name(place: Path) -> None:
    recipe = Recipe.load(place / "set.toml")
    assert files_behind(recipe) == [place / "light.toml", place / "models"]
    (place / "set.toml").write_text(RECIPE.replace("light.toml", "light"))
    folder = replace(recipe.models[0], scene=place / "light")
    (place / "light").mkdir()
    assert files_behind(replace(recipe, models=(folder,))) == [place / "light"]


@pytest.mark.parametrize(
    ("old", "new", "expected", "got"),
    [
        ('models = "models", ', "", ["models", "light touch"], ["none", "[scene]", "--models"]),
        ('"MDF"', '"silk"', ["texture", "light touch"], "silk"),
        ("[100, 300]", "[10, 300]", ["speeds", "100…300 mm/s", "MDF"], "10…300 mm/s"),
    ],
)
def test_scenes_that_cannot_be_compiled_are_refused(
    place: Path, old: str, new: str, expected: object, got: object
) -> None:
    (place / "light.toml").write_text(SCENE.replace(old, new))
    recipe = Recipe.load(place / "set.toml")
    with refused(InputError, expected=expected, got=got):
        load_sources(recipe)


@pytest.mark.parametrize("key", ["path", "scene"])
@pytest.mark.parametrize("label", ["", 'label = "x"'])
def test_a_name_too_long_for_a_file_is_refused_in_one_sentence(
    place: Path, key: str, label: str
) -> None:
    (place / "set.toml").write_text(
        RECIPE.replace('scene = "light.toml"', f'{key} = "{"y" * 9999}"\n{label}')
    )
    with refused(InputError, expected=f"{place}/", got="name") as refusal:
        load_sources(Recipe.load(place / "set.toml"))
    assert len(str(refusal.value)) < 400 + len(str(place))


def test_two_models_of_a_texture_under_one_label_are_refused(place: Path) -> None:
    text = RECIPE.replace('"light.toml"', '"light.toml"\nlabel = "models"')
    (place / "set.toml").write_text(text)
    with refused(InputError, expected="label", got=["MDF", "models"]):
        load_sources(Recipe.load(place / "set.toml"))
