"""The section on the shipped scenes: how much cheaper models become, and at what loss."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import pandas as pd

from tactileq.analysis.labels import ALL_TEXTURES
from tactileq.analysis.page.outcomes import Outcome, described
from tactileq.analysis.page.page import Fold, Picture, Table
from tactileq.analysis.page.sections import Mapped, Section
from tactileq.analysis.spectra.figures.scenes import figure_tradeoff
from tactileq.analysis.textures.scenes import (
    BEFORE_AFTER_COLUMNS,
    STEP_COLUMNS,
    before_after_table,
    steps_table,
)
from tactileq.benches.scenes.examples import (
    FULL_MODEL,
    LEAST,
    RIVAL,
    SCENE_COMPARISON_COLUMNS,
    CompiledExample,
    Surface,
    comparison_table,
)
from tactileq.modeling import CompiledScene
from tactileq.modeling.errors import counted
from tactileq.modeling.files.columns import Column, chosen

SCENE = Column("scene", is_name=True)
SCENE_TEXTURE_COLUMNS = (SCENE, *BEFORE_AFTER_COLUMNS)
SCENE_STEP_COLUMNS = (SCENE, *STEP_COLUMNS)
SHOWN_TEXTURES = (
    *chosen(
        SCENE_TEXTURE_COLUMNS,
        *("scene", "texture", "layers_before", "layers_after", "numbers_before", "numbers_after"),
        *("operations_before", "operations_after", "driven_by", "update_ms"),
        *("gfc30_worst", "bands_db_worst", "level_db_worst", "bands_db_place"),
    ),
)
SHOWN_STEPS = chosen(
    SCENE_STEP_COLUMNS, "scene", "step", "layers", "numbers", "bytes", "operations", "share"
)
Example = tuple[CompiledExample, Mapping[str, Surface]]


def scene_section(examples: Sequence[Example], *, mapped: Mapped = map) -> Section:
    """The shipped scenes as compiled; the first one is drawn.

    Parameters
    ----------
    examples : sequence of (CompiledExample, mapping of texture to Surface)
    mapped : callable
        How the scenes are gone through; it changes no result.
    """
    comparison = comparison_table(examples, mapped=mapped)
    simulated = bool(comparison["simulated"].any())
    steps, textures = _step_table(examples, simulated), _texture_table(examples, simulated)
    return Section(
        "scenes",
        "Models reduced to what a scene needs",
        (
            _picture(examples[0][0].compiled, simulated),
            _comparison(comparison, simulated),
            Fold(steps.title, (steps,)),
            Fold(textures.title, (textures,)),
        ),
        outcomes=tuple(_outcomes(comparison)),
    )


def _picture(compiled: CompiledScene, simulated: bool) -> Picture:
    return Picture(
        "scene_tradeoff",
        f"Steps of the scene compiler: {compiled.scene.name}",
        "From the full model of each texture (open marker) to the least model (outlined), by "
        "dropping layers that are not felt, thinning the grid, a longer update interval and single "
        "precision; the least model still keeps the bound. Cross: the next longer interval, which "
        "would break the bound.",
        figure_tradeoff(compiled),
        simulated,
    )


def _comparison(comparison: pd.DataFrame, simulated: bool) -> Table:
    return Table(
        "scene_comparison",
        "Full models, least models and an AR model, scene by scene",
        "Numbers and bytes are those of all textures, operations those of the most expensive "
        "texture. GFC and errors are relative to the true surface at all conditions that the scene "
        "visits: layers that cannot be felt there are absent from the least models, which lowers "
        "their GFC but cannot be felt. The bound itself is kept relative to the part of the full "
        "model that can be felt; the last column counts the seconds of random strokes in which it "
        f"was kept. {RIVAL} has its recorded conditions within the scene, double precision and the "
        "update interval of the least model, and reads its coefficients from a table with a node "
        "more between each two of them.",
        comparison,
        SCENE_COMPARISON_COLUMNS[:-1],
        simulated,
    )


def _step_table(examples: Sequence[Example], simulated: bool) -> Table:
    steps = _tables_by_scene(examples, steps_table)
    return Table(
        "scene_steps",
        "Effect of each step",
        "All textures of a scene together; each step follows those above it. Last column: the "
        "largest share of the bound that is used; 1 is the whole bound.",
        steps[steps["texture"] == ALL_TEXTURES],
        SHOWN_STEPS,
        simulated,
    )


def _texture_table(examples: Sequence[Example], simulated: bool) -> Table:
    return Table(
        "scene_textures",
        "Each texture in each scene",
        "Bounds: GFC30 ≥ 0.95 of the attainable value, error in nine bands and level error ≤ 1 dB "
        "unless the scene specifies others; the worst values include the effects of late updates "
        "and of precision.",
        _tables_by_scene(examples, before_after_table),
        SHOWN_TEXTURES,
        simulated,
    )


def _tables_by_scene(
    examples: Sequence[Example], table_of: Callable[[CompiledScene], pd.DataFrame]
) -> pd.DataFrame:
    tables = [table_of(one.compiled) for one, _ in examples]
    for (one, _), table in zip(examples, tables, strict=True):
        table.insert(0, "scene", one.compiled.scene.name)
    return pd.concat(tables, ignore_index=True)


def _outcomes(comparison: pd.DataFrame) -> list[Outcome]:
    """What the least models of all scenes need, and how near they and the rival come."""
    by_method = {
        method: rows.set_index("scene") for method, rows in comparison.groupby("method", sort=False)
    }
    full, least, rival = (by_method[method] for method in (FULL_MODEL, LEAST, RIVAL))
    needed = ", ".join(
        f"{_range(least[cost] / full[cost], '.0%')} of the {cost}"
        for cost in ("numbers", "bytes", "operations")
    )
    kept, looked = (
        sum(int(text.split(" of ")[place]) for text in least["windows"]) for place in (0, 1)
    )
    nearness = "; ".join(
        f"{words} {_range(rival[name], form)} (least models {_range(least[name], form)})"
        for name, words, form in (
            ("bands_db", "error in nine bands in dB", ".2f"),
            ("gfc30", "GFC30", ".3f"),
        )
    )
    return described(
        [
            f"In {counted(len(least), 'scene')} the least models need {needed} of the full ones; "
            f"the bound was kept in {kept} of {looked} seconds of random strokes.",
            f"{RIVAL} needs {_range(rival['numbers'] / least['numbers'], '.1f')} times the numbers "
            f"of the least models; relative to the true surface: {nearness}.",
        ]
    )


def _range(values: pd.Series, form: str) -> str:
    """The smallest and the largest of the scenes."""
    low, high = (format(float(end), form) for end in (values.min(), values.max()))
    return low if low == high else f"{low} to {high}"
