"""Which models a study compares, and where they come from."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tactileq.experiments.study.models import ModelSets, load_model_sets
from tactileq.experiments.study.study import Study
from tactileq.modeling import ARModel, InputError, TextureModel, Threshold, regressed, simplify
from tactileq.modeling.models.compiled_for import CompiledFor
from tactileq.stimuli.planted.textures import planted_texture
from tactileq.stimuli.sets.recipe import Recipe
from tactileq.stimuli.sets.writing import write_set
from tests.refusals import refused

SMALL = {"speeds_mm_s": np.array([100.0, 300.0]), "forces_n": np.array([1.0, 3.0])}
FULL = {name: planted_texture(name, **SMALL) for name in ("canvas", "MDF")}
CODEC = Threshold.shipped("codec")
LEAST = {name: simplify(model, CODEC, criterion="paper-fft").model for name, model in FULL.items()}
NOTE = CompiledFor(
    scene="light touch",
    scene_sha256="a",
    full_sha256="b",
    bound={"gfc30": 0.95},
    update_s=0.008,
    single=True,
)

SCENE = """
version = 1
[scene]
name = "light touch"
[hand]
speed_mm_s = [100, 200]
force_n = [1.0, 2.0]
"""


def study(**models: str) -> Study:
    return Study(
        name="two",
        seed=1,
        textures=("canvas", "MDF"),
        trays={"canvas": "A", "MDF": "B"},
        models=models or {"full": "models", "simplified": "simplified"},
    )


def pair(simplified: object, full: object = None) -> ModelSets:
    return ModelSets(sets={"full": full or FULL, "simplified": simplified})


def other_rate(models: dict[str, TextureModel]) -> dict[str, TextureModel]:
    return {name: model.at_rate(8000.0) for name, model in models.items()}


def test_models_of_a_scene_stand_where_simplified_ones_stand() -> None:
    least = {name: replace(regressed(model), compiled_for=NOTE) for name, model in FULL.items()}
    sets = pair(least)
    sets.require(study())
    assert sets.scene == NOTE
    assert sets.names == ("full", "simplified")
    assert sets.identical(("canvas", "MDF")) == ()
    assert sets.of("MDF", "simplified") == least["MDF"]
    assert sets.sha256(["MDF"])["MDF"]["simplified"] == least["MDF"].sha256


def test_a_scene_without_a_texture_of_the_study_is_named() -> None:
    least = {"MDF": replace(FULL["MDF"], compiled_for=NOTE)}
    with refused(InputError, expected=["texture", "light touch"], got="canvas"):
        pair(least).require(study())


def test_simplified_models_are_of_no_scene() -> None:
    sets = pair({"MDF": FULL["MDF"]})
    assert sets.scene is None
    assert sets.identical(["MDF"]) == ("MDF",)
    with refused(InputError, expected=["simplified", "texture"], got="canvas"):
        sets.require(study())


def test_equal_models_of_all_textures_are_nothing_to_compare() -> None:
    with refused(InputError, expected=["simplified", "full"], got="identical"):
        pair(FULL).require(study())
    one = pair({**FULL, "canvas": LEAST["canvas"]})
    one.require(study())
    assert one.identical(("canvas", "MDF")) == ("MDF",)
    three = ModelSets(sets={**one.sets, "other": LEAST})
    assert three.identical(("canvas", "MDF")) == ()
    assert three.identical(("canvas", "MDF"), ("simplified", "other")) == ("canvas",)
    assert three.equal_models(("canvas", "MDF")) == {
        "canvas": (("simplified", "other"),),
        "MDF": (("full", "simplified"),),
    }
    assert three.equal_models(("canvas", "MDF"), ("full", "simplified")) == {
        "MDF": (("full", "simplified"),)
    }
    four = ModelSets(sets={**three.sets, "again": {**FULL}})
    assert four.equal_models(("canvas",))["canvas"] == (("full", "again"), ("simplified", "other"))


def test_exchanged_sets_are_refused_or_go_on_for_a_reason() -> None:
    turned = pair(FULL, full=LEAST)
    assert turned.exchanged(("canvas", "MDF")) == (
        ("canvas", "full", "simplified"),
        ("MDF", "full", "simplified"),
    )
    with refused(InputError, got=["full", "canvas", "simplified"]):
        turned.require(study())
    allowed: list[str] = []
    turned.require(study(), allow=lambda what, sentence: allowed.append(what))
    assert allowed == ["exchanged models"]
    assert pair(LEAST).exchanged(("canvas", "MDF")) == ()
    between = ModelSets(sets={"paper": other_rate(FULL), "simplified": LEAST, "full": FULL})
    assert between.exchanged(("MDF",)) == (("MDF", "simplified", "full"),)


def test_the_full_model_of_a_compiled_one_is_known_too() -> None:
    note = replace(NOTE, full_sha256=FULL["MDF"].sha256)
    least = {**FULL, "MDF": replace(FULL["MDF"], compiled_for=note)}
    assert pair(FULL, full=least).exchanged(("canvas", "MDF")) == (("MDF", "full", "simplified"),)


def test_a_model_that_was_made_from_one_of_no_set_is_told() -> None:
    other = other_rate(FULL)
    assert pair(LEAST).of_others(("canvas", "MDF")) == ()
    assert pair(LEAST, full=other).of_others(("MDF",)) == (("MDF", "simplified"),)


# --- Loading -------------------------------------------------------------------------------------


def saved(folder: Path, models: dict[str, object]) -> Path:
    folder.mkdir(parents=True)
    for number, model in enumerate(models.values()):
        model.save(folder / f"{number}.json")
    return folder


def ar_of(model: TextureModel) -> ARModel:
    shape = model.noise_gains.shape
    return ARModel(
        texture=model.texture,
        rate_hz=model.rate_hz,
        speeds_mm_s=model.speeds_mm_s,
        forces_n=model.forces_n,
        line_spectral_frequencies=np.broadcast_to([1.0, 2.0], (*shape, 2)),
        gains=np.full(shape, 0.1),
        level_sd_db=np.zeros(shape),
    )


def test_sets_of_every_kind_are_loaded_by_the_studys_paths(tmp_path: Path) -> None:
    saved(tmp_path / "models", FULL)
    kinds = {
        "simplified": LEAST,
        "driven": {name: regressed(model) for name, model in FULL.items()},
        "AR": {name: ar_of(model) for name, model in FULL.items()},
    }
    for name, models in kinds.items():
        saved(tmp_path / name.lower(), models)
    plan = study(full="models", **{name: name.lower() for name in kinds})
    files: list[Path] = []
    sets = load_model_sets(plan, tmp_path, reads=lambda *paths: files.extend(paths))
    assert sets.sets == {"full": FULL, **kinds}
    assert files == [tmp_path / "models", *(tmp_path / name.lower() for name in kinds)]
    sets.require(plan)


def test_another_place_stands_for_the_studys(tmp_path: Path) -> None:
    saved(tmp_path / "study" / "models", FULL)
    elsewhere = saved(tmp_path / "elsewhere", LEAST)
    overriding = {"simplified": elsewhere}
    files: list[Path] = []
    sets = load_model_sets(
        study(),
        tmp_path / "study",
        overriding=overriding,
        reads=lambda *paths: files.extend(paths),
    )
    assert sets.sets["simplified"] == LEAST
    assert files[1] == elsewhere
    with refused(InputError, expected=["full", "simplified"], got="paper"):
        load_model_sets(study(), tmp_path / "study", overriding={"paper": elsewhere})


def test_a_scene_is_compiled_from_the_reference(tmp_path: Path) -> None:
    saved(tmp_path / "models", FULL)
    scene = tmp_path / "scene.toml"
    scene.write_text(SCENE)
    plan = study(full="models", least="scene.toml")
    files: list[Path] = []
    sets = load_model_sets(plan, tmp_path, reads=lambda *paths: files.extend(paths))
    assert {sets.of(name, "least").compiled_for.full_sha256 for name in FULL} == {
        model.sha256 for model in FULL.values()
    }
    assert files[:2] == [tmp_path / "models", scene]
    sets.require(plan)
    turned = study(least="scene.toml", full="models")
    with refused(InputError, names=["least", "scene"]):
        load_model_sets(turned, tmp_path)


RECIPE = """
version = 1
[set]
name = "surfaces"
rate_hz = [5000]
format = "float32"
duration_s = 0.2
[[model]]
path = "{full}"
label = "full"
[[model]]
path = "{simplified}"
label = "simplified"
[[trajectory]]
speed_mm_s = 100
force_n = 1.0
"""


@pytest.mark.parametrize("turned", [False, True])
def test_a_stimulus_set_stands_where_models_stand(tmp_path: Path, turned: bool) -> None:
    """Its files are those labelled as the study's sets, and know what their models were made of."""
    alike = {**LEAST, "MDF": FULL["MDF"]}
    saved(tmp_path / "models", FULL)
    saved(tmp_path / "fewer", alike)
    places = ("fewer", "models") if turned else ("models", "fewer")
    text = RECIPE.format(full=places[0], simplified=places[1])
    (tmp_path / "recipe.toml").write_text(text)
    write_set(tmp_path / "set", Recipe.load(tmp_path / "recipe.toml"))
    plan = study(full="set", simplified="set")
    files: list[Path] = []
    sets = load_model_sets(plan, tmp_path, reads=lambda *paths: files.extend(paths))
    assert files == [tmp_path / "set"] * 2
    assert {sets.of("canvas", name).texture for name in sets.names} == {"canvas"}
    assert sets.sha256(["canvas"])["canvas"]["full"] == sets.of("canvas", "full").sha256
    assert sets.identical(plan.textures) == ("MDF",)
    assert sets.of_others(plan.textures) == ()
    if turned:
        with refused(InputError, got=["full", "canvas", "simplified"]):
            sets.require(plan)
        return
    sets.require(plan)
    mixed = load_model_sets(study(full="models", simplified="set"), tmp_path)
    mixed.require(plan)
    assert mixed.of_others(plan.textures) == ()
    with refused(InputError, expected=["full", "texture"], got="PVC"):
        load_model_sets(
            study(full="set", simplified="set"), tmp_path, overriding={"full": tmp_path / "set"}
        ).require(replace(plan, textures=("canvas", "PVC"), trays={"canvas": "A", "PVC": "B"}))


def test_places_without_models_are_refused(tmp_path: Path) -> None:
    saved(tmp_path / "models", FULL)
    with refused(
        InputError, names="models simplified", expected=["folder", "scene", tmp_path / "simplified"]
    ):
        load_model_sets(study(), tmp_path)
    (tmp_path / "simplified").mkdir()
    with refused(InputError, names="models simplified", expected=tmp_path / "simplified"):
        load_model_sets(study(), tmp_path)
    (tmp_path / "simplified" / "manifest.tsv").write_text("file\n")
    with pytest.raises(InputError, match=r"models simplified: expected the columns file, unit"):
        load_model_sets(study(), tmp_path)
    saved(tmp_path / "twice", {**LEAST, "again": LEAST["MDF"]})
    with refused(InputError, expected=["texture", tmp_path / "twice"], got="'MDF'"):
        load_model_sets(study(full="models", simplified="twice"), tmp_path)
