"""Tables of a compiled scene: they say what was compiled, and their sums are sums."""

from __future__ import annotations

from dataclasses import replace

import pandas as pd
import pytest

from tactileq.analysis.labels import ALL_TEXTURES
from tactileq.analysis.spectra.figures.scenes import figure_tradeoff
from tactileq.analysis.textures.scenes import (
    BEFORE_AFTER_COLUMNS,
    SHARED,
    STEP_COLUMNS,
    before_after_table,
    steps_table,
)
from tactileq.modeling import CompiledScene, Scene, compile_scene
from tactileq.modeling.files.columns import names
from tactileq.modeling.scenes.hands import HandRange
from tactileq.stimuli.planted.textures import planted_texture


@pytest.fixture(scope="module")
def compiled() -> CompiledScene:
    """Two planted textures in a part of their grid."""
    hand = HandRange(speed_mm_s=(60.0, 140.0), force_n=(0.5, 1.0))
    models = {name: planted_texture(name) for name in ("MDF", "leather")}
    return compile_scene(Scene(name="part", hand=hand), models)


def test_before_and_after_are_those_of_the_models(compiled: CompiledScene) -> None:
    table = before_after_table(compiled)
    assert list(table) == names(BEFORE_AFTER_COLUMNS)
    assert table["texture"].tolist() == ["MDF", "leather", ALL_TEXTURES]
    for row, texture in zip(table.to_dict("records"), compiled.textures, strict=False):
        assert row["layers_before"] - row["layers_after"] == len(texture.dropped)
        assert row["dropped"] == (", ".join(map(str, texture.dropped)) or "none")
        cost = texture.plan.cost(texture.model)
        assert row["bytes_after"] == cost.table_bytes + cost.state_bytes
        assert row["operations_after"] == cost.operations < row["operations_before"]
        assert row["update_ms"] == pytest.approx(texture.plan.update_samples / 5)
        assert row["gfc30_worst"] >= row["gfc30_bound"] == 0.95
        assert row["bands_db_worst"] <= row["bands_db_bound"] == 1.0
        assert row["level_db_worst"] <= row["level_db_bound"] == 1.0
        assert row["bands_db_mean"] <= row["bands_db_worst"]
        assert row["full_sha256"] == texture.full.sha256
        assert row["simulated"]


def test_the_last_row_is_the_whole_scene(compiled: CompiledScene) -> None:
    table = before_after_table(compiled).set_index("texture")
    total, each = table.loc[ALL_TEXTURES], table.drop(ALL_TEXTURES)
    for column in ("layers_before", "layers_after", "numbers_before", "numbers_after"):
        assert total[column] == each[column].sum()
    assert total["bytes_before"] == each["bytes_before"].sum()
    assert total["bytes_after"] < each["bytes_after"].sum()  # one state, and what is equal
    assert total["operations_after"] == each["operations_after"].max()


def test_steps_lead_from_the_full_to_the_least_model(compiled: CompiledScene) -> None:
    table = steps_table(compiled)
    assert list(table) == names(STEP_COLUMNS)
    for texture in compiled.textures:
        steps = table[table["texture"] == texture.texture]
        first, last = steps.iloc[0], steps.iloc[-1]
        assert first["operations"] == texture.before.operations
        assert last["operations"] == texture.after.operations
        assert last["bytes"] == texture.after.table_bytes + texture.after.state_bytes
        assert (steps["operations"].diff().dropna() <= 0).all()
        assert steps["share"].between(0, 1).all()
    together = table[table["texture"] == ALL_TEXTURES]
    assert together["step"].iloc[-1] == SHARED
    assert together["bytes"].iloc[-1] == compiled.bytes_after < together["bytes"].iloc[-2]
    singles = table[table["texture"] != ALL_TEXTURES]
    sums = singles.groupby("step", sort=False)["bytes"].sum()
    assert together.set_index("step")["bytes"]["full model"] == sums["full model"]


def test_the_picture_shows_every_texture_and_says_what_is_simulated(
    compiled: CompiledScene,
) -> None:
    figure = figure_tradeoff(compiled)
    for ax in figure.axes:
        assert "SIMULATED" in {text.get_text() for text in ax.texts}
        assert ax.get_xscale() == "log"
    labels = {text.get_text() for text in figure.legends[0].get_texts()}
    assert {"MDF", "leather", "full model", "least model"} <= labels
    drawn = [line.get_xdata()[0] for line in figure.axes[0].lines if len(line.get_xdata())]
    assert compiled.textures[0].before.operations in drawn
    figure.canvas.draw()  # type: ignore[attr-defined]


@pytest.mark.parametrize("count", [8, 100])
def test_many_textures_look_different_and_all_are_in_the_legend(
    compiled: CompiledScene, count: int
) -> None:
    first = compiled.textures[0]
    # `texture` is the name of the full model.
    many = tuple(
        replace(first, full=replace(first.full, texture=f"wood {n}")) for n in range(count)
    )
    figure = figure_tradeoff(replace(compiled, textures=many))
    entries = figure.legends[0].get_lines()[:count]
    assert [line.get_label() for line in entries] == [f"wood {n}" for n in range(count)]
    looks = {(line.get_color(), line.get_marker(), line.get_linestyle()) for line in entries}
    assert len(looks) == count
    figure.draw_without_rendering()
    legend = figure.legends[0].get_window_extent()
    assert legend.x0 >= 0
    assert legend.x1 <= figure.bbox.width
    assert legend.y0 >= max(ax.get_window_extent().y1 for ax in figure.axes)


def test_a_table_of_one_way_names_it(compiled: CompiledScene) -> None:
    table = steps_table(compiled)
    ways = table.loc[table["texture"] == ALL_TEXTURES, "step"].iloc[3]
    assert isinstance(ways, str)
    assert ways in {
        "grid thinned",
        "grid thinned or regressed",
        "regression on speed and force",
        "regression on the centroid",
    }
    assert pd.notna(table["share"]).all()
