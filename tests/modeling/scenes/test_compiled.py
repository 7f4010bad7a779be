"""Compiled scenes: files and what was changed since, costs, the steps of the compiler."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tactileq.modeling import InputError, Renderer, TextureModel, compile_scene
from tactileq.modeling.models.loading import load_model
from tactileq.modeling.rendering.plan import plan_for
from tactileq.modeling.scenes.compiled import CompiledScene, load_compiled
from tactileq.modeling.scenes.cost import scene_bytes, stored_numbers
from tactileq.modeling.scenes.scene import Scene
from tests.refusals import refused

ModelMaker = Callable[..., TextureModel]
SceneMaker = Callable[..., Scene]


@pytest.fixture(scope="module")
def full(varied_model: ModelMaker) -> dict[str, TextureModel]:
    return {name: varied_model(seed, texture=name) for seed, name in enumerate(("a b", "c", "d"))}


@pytest.fixture(scope="module")
def compiled(full: dict[str, TextureModel], make_scene: SceneMaker) -> CompiledScene:
    return compile_scene(make_scene((80.0, 250.0), (0.7, 2.0)), full)


@pytest.fixture
def folder(compiled: CompiledScene, tmp_path: Path) -> Path:
    compiled.save(tmp_path)
    return tmp_path


# --- Files


def test_what_is_saved_loads_back_equal(
    compiled: CompiledScene, full: dict[str, TextureModel], folder: Path
) -> None:
    for models in (load_compiled(folder), load_compiled(folder, full)):
        assert models == compiled.models
    assert sorted(path.name for path in folder.iterdir()) == sorted(
        ["a-b.json", "c.json", "d.json", "scene.json"]
    )


def test_a_loaded_model_renders_as_compiled(compiled: CompiledScene, folder: Path) -> None:
    for each in compiled.textures:
        model = load_compiled(folder)[each.texture]
        loaded = Renderer(model, seed=3, single=each.plan.single)
        assert loaded.update_samples == each.plan.update_samples
        ours, theirs = (r.render(150.0, 1.0, samples=500) for r in (loaded, each.renderer(seed=3)))
        assert ours.tobytes() == theirs.tobytes()


def test_a_compiled_model_loads_as_any_model(compiled: CompiledScene, folder: Path) -> None:
    model = load_model(folder / "a-b.json")
    assert model == compiled.models["a b"]
    assert model.compiled_for is not None  # type: ignore[union-attr]
    assert model.compiled_for.scene_sha256 == compiled.scene.sha256  # type: ignore[union-attr]


def changed(path: Path, old: str, new: str) -> None:
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")


@pytest.mark.parametrize(
    ("file", "old", "new", "expected"),
    [
        ("c.json", '"simulated": true', '"simulated": false', "c.json as tactileq scene wrote it"),
        ("scene.json", '"way"', '"Way"', "scene.json as tactileq scene wrote it"),
        ("scene.json", '"planted"', '"other"', "scene.json as tactileq scene wrote it"),
        ("scene.json", "compiled-scene", "other", "expected the format tactileq.compiled-scene"),
        ("scene.json", '"version": 1', '"version": 2', "version 2; give a folder"),
        ("scene.json", "{", "[", "scene.json"),
    ],
)
def test_files_that_were_changed_are_refused(
    file: str, old: str, new: str, expected: str, folder: Path
) -> None:
    changed(folder / file, old, new)
    with pytest.raises(InputError, match=expected) as refused:
        load_compiled(folder)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("file", ["c.json", "scene.json"])
def test_missing_files_are_refused(file: str, folder: Path) -> None:
    (folder / file).unlink()
    with refused(InputError, expected=folder / file, got="nothing"):
        load_compiled(folder)


def test_full_models_that_have_changed_since_are_refused(
    full: dict[str, TextureModel], folder: Path
) -> None:
    later = full | {"c": replace(full["c"], noise_gains=1.01 * full["c"].noise_gains)}
    with refused(InputError, expected=["c", folder]):
        load_compiled(folder, later)
    fewer = {name: model for name, model in full.items() if name != "d"}
    with refused(InputError, expected=["d", folder], got="none"):
        load_compiled(folder, fewer)


def test_two_textures_with_one_file_are_not_saved(
    varied_model: ModelMaker, make_scene: SceneMaker, tmp_path: Path
) -> None:
    for names, got in (
        (("a b", "a-b"), "a-b.json, a-b.json"),
        (("scene", "c"), "scene.json, c.json"),
    ):
        models = {name: varied_model(1, texture=name) for name in names}
        together = compile_scene(make_scene(), models)
        with refused(InputError, expected="scene.json", got=got):
            together.save(tmp_path / "out")
        assert not (tmp_path / "out").exists()


def test_two_runs_write_the_same_bytes(
    compiled: CompiledScene, full: dict[str, TextureModel], folder: Path, tmp_path: Path
) -> None:
    compile_scene(compiled.scene, full).save(tmp_path / "again")
    for path in folder.glob("*.json"):
        assert path.read_bytes() == (tmp_path / "again" / path.name).read_bytes()


# --- Costs


def test_equal_tables_and_the_state_are_stored_once(varied_model: ModelMaker) -> None:
    model = varied_model(0)
    plan = plan_for(5000.0, update_samples=20)
    alone, state = scene_bytes([(model, plan)]), plan.cost(model).state_bytes
    assert alone == plan.cost(model).table_bytes + state
    twin = replace(model, texture="twin")
    assert scene_bytes([(model, plan), (twin, plan)]) == alone
    louder = replace(model, gains=2 * model.gains)
    both = scene_bytes([(model, plan), (louder, plan)])
    # What differs are the values, and the slews, which follow the largest gains.
    numbers = model.table.values.size + 1 + model.n_layers
    assert both == alone + 8 * numbers
    assert scene_bytes([]) == 0


def test_numbers_of_a_grid_and_of_its_least_model(compiled: CompiledScene) -> None:
    for each in compiled.textures:
        first, last = each.steps[0], each.steps[-1]
        assert first.numbers == stored_numbers(each.full) == 9 * (1 + 3 * each.full.n_layers)
        assert last.numbers == stored_numbers(each.model)
        assert last.operations == each.after.operations
        assert last.bytes == each.after.table_bytes + each.after.state_bytes


def test_totals_are_those_of_the_textures(compiled: CompiledScene) -> None:
    after = [each.after for each in compiled.textures]
    assert compiled.operations_after == max(cost.operations for cost in after)
    apart = sum(cost.table_bytes + cost.state_bytes for cost in after)
    assert compiled.bytes_after <= apart < compiled.bytes_before
    assert compiled.operations_after < compiled.operations_before


def test_the_last_step_takes_what_the_worst_measure_takes(compiled: CompiledScene) -> None:
    for each in compiled.textures:
        taken = [
            np.arccos(m.worst) / np.arccos(m.bound) if m.measure == "gfc30" else m.worst / m.bound
            for m in each.measures
        ]
        assert each.steps[-1].share == pytest.approx(max(taken), rel=1e-6)
        assert max(taken) <= 1 + 1e-9


def test_a_measure_is_no_better_at_its_worst_place_than_on_average(
    compiled: CompiledScene,
) -> None:
    for measure in (m for each in compiled.textures for m in each.measures):
        better = measure.mean - measure.worst
        assert (better if measure.measure == "gfc30" else -better) >= -1e-9


# --- Models of other kinds


@pytest.mark.parametrize(
    "kind",
    [
        {"speeds_mm_s": (100.0,), "forces_n": (1.0,)},
        {"speeds_mm_s": (100.0,)},
        {"forces_n": (1.0,)},
        {"felt": 1, "weak": 0},
        {"felt": 0, "weak": 1},
        {"felt": 0, "weak": 0},
        {"rate_hz": 1000.0},
        {"estimator": "paper"},
        {"estimator": "paper-consistent"},
        {"speeds_mm_s": (100.0,), "blending": "logarithmic"},
    ],
    ids=str,
)
def test_models_of_every_kind_are_compiled(
    kind: dict[str, Any], varied_model: ModelMaker, make_scene: SceneMaker, tmp_path: Path
) -> None:
    model = varied_model(1, **kind)
    if "paper" in model.estimator:
        model = replace(model, gains=np.abs(model.gains))
    ends = [(float(x[0]), float(x[-1])) for x in (model.speeds_mm_s, model.forces_n)]
    scene = compile_scene(make_scene(*ends), {model.texture: model})
    [each] = scene.textures
    assert each.steps[-1].share <= 1 + 1e-9
    assert each.after.operations <= each.before.operations
    assert each.model.n_layers >= min(1, model.n_layers)
    scene.save(tmp_path)
    assert load_compiled(tmp_path)[model.texture] == each.model
    samples = each.renderer().render(ends[0][0], ends[1][0], samples=100)
    assert np.isfinite(samples).all()


def test_a_layer_without_a_gain_goes_and_a_silent_model_stays_silent(
    varied_model: ModelMaker, make_scene: SceneMaker
) -> None:
    model = varied_model(3, weak=0)
    mute = model.gains * [0.0, 1.0]
    [one] = compile_scene(make_scene(), {"one": replace(model, gains=mute)}).textures
    assert one.dropped == (1,)
    silent = replace(model, gains=0 * model.gains, noise_gains=0 * model.noise_gains)
    [none] = compile_scene(make_scene(), {"none": silent}).textures
    assert not none.renderer().render(100.0, 1.0, samples=100).any()
