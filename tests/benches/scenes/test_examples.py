"""Shipped scenes load; compiled ones are held against the truth beside an AR model."""

from __future__ import annotations

import numpy as np
import pytest

from tactileq.benches.chart.rival_costs import coefficients_cost
from tactileq.benches.scenes.examples import (
    DRAWN_EXAMPLE,
    FULL_MODEL,
    LEAST,
    PLANTED_EXAMPLES,
    RIVAL,
    CompiledExample,
    Surface,
    comparison_table,
    compile_examples,
    drawn_example,
    example,
)
from tactileq.benches.scenes.section import scene_section
from tactileq.modeling import Scene, compile_scene, fit_ar
from tactileq.modeling.scenes.hands import HandRange
from tactileq.modeling.scenes.places import places_of
from tactileq.modeling.scenes.strokes import windows_kept
from tactileq.stimuli.planted.textures import (
    TEXTURES,
    PlantedSurface,
    planted_texture,
    record_texture,
)


def test_the_scenes_that_ship_are_those_that_the_report_shows() -> None:
    scenes = {name: example(name) for name in (*PLANTED_EXAMPLES, DRAWN_EXAMPLE)}
    assert {scene.textures for scene in scenes.values()} == {()}
    assert scenes["vibrator_40_400_hz"].actuator.band_hz == (40.0, 400.0)
    assert scenes["microcontroller_64_kb"].budget.most_bytes == 65536
    assert np.isfinite(scenes["microcontroller_64_kb"].budget.most_operations(5000.0))
    planted = planted_texture("canvas")
    slow, full = (
        places_of(planted, scenes[name].hand) for name in ("slow_light_touch", "full_range")
    )
    assert slow.speed_range[1] < full.speed_range[1]
    assert slow.force_range[1] < full.force_range[1]


@pytest.fixture(scope="module")
def judged() -> tuple[CompiledExample, dict[str, Surface]]:
    """One planted texture in a part of its grid, beside an AR model of a short record."""
    planted = planted_texture("aluminum")
    hand = HandRange(speed_mm_s=(100.0, 200.0), force_n=(1.0, 2.0))
    compiled = compile_scene(Scene(name="part", hand=hand), {"aluminum": planted})
    windows = windows_kept(compiled.textures[0], compiled.scene, count=3)
    rival = fit_ar(record_texture(planted, duration_s=0.5, seed=1), order=20)
    surface = Surface(PlantedSurface("aluminum"), rival)
    return CompiledExample(compiled, (windows,)), {"aluminum": surface}


def test_the_comparison_counts_what_each_method_needs(judged) -> None:
    table = comparison_table([judged]).set_index("method")
    [texture] = judged[0].compiled.textures
    assert table.loc[FULL_MODEL, "numbers"] == 49 * 10
    assert table.loc[LEAST, "numbers"] < table.loc[FULL_MODEL, "numbers"]
    assert table.loc[LEAST, "fewer_operations"] == pytest.approx(
        texture.before.operations / texture.after.operations
    )
    # Three speeds and three forces lie within the scene.
    assert table.loc[RIVAL, "numbers"] == 9 * 21
    cost = coefficients_cost(  # with a node more between each two of them
        20, 0, nodes=25, update_samples=texture.plan.update_samples, single=False
    )
    assert table.loc[RIVAL, "operations"] == cost.operations
    assert table.loc[RIVAL, "bytes"] == cost.table_bytes + cost.state_bytes
    assert table.loc[LEAST, "windows"] == "3 of 3"
    assert table["simulated"].all()


def test_the_truth_tells_a_better_model_from_a_worse_one(judged) -> None:
    """The full planted model is the truth but for its rate; a rival of 0.5 s is not."""
    table = comparison_table([judged]).set_index("method")
    assert table.loc[FULL_MODEL, "gfc30"] > 0.999
    assert table.loc[FULL_MODEL, "bands_db"] < 0.5 < table.loc[RIVAL, "bands_db"]
    assert (
        table.loc[LEAST, "gfc30_worst"]
        <= table.loc[LEAST, "gfc30"]
        < table.loc[FULL_MODEL, "gfc30"]
    )
    assert (table["bands_db"] <= table["bands_db_worst"]).all()
    assert (table["level_db"] <= table["level_db_worst"]).all()


def test_the_section_says_what_came_out(judged) -> None:
    section = scene_section([judged])
    kept, rival = (outcome.sentence for outcome in section.outcomes)
    assert "3 of 3 seconds" in kept
    assert "AR(20)" in rival


def test_scenes_of_drawn_surfaces_are_compiled_from_recordings() -> None:
    one, surfaces = drawn_example(seeds=(1003,))
    [texture] = one.compiled.textures
    assert texture.texture == "drawn 1003"
    assert set(surfaces) == {"drawn 1003"}
    [windows] = one.windows
    assert windows.kept >= 0.99 * windows.of
    assert texture.after.operations <= texture.before.operations


def test_one_shipped_scene_compiles_from_planted_textures() -> None:
    models = {name: planted_texture(name) for name in TEXTURES}
    [one] = compile_examples(models, ["slow_light_touch"])
    assert set(one.compiled.models) == set(TEXTURES)
    kept, count = (sum(windows[i] for windows in one.windows) for i in (0, 1))
    assert kept >= 0.99 * count
    assert one.compiled.bytes_after < one.compiled.bytes_before / 10
