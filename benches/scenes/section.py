"""The section on the shipped scenes: how much cheaper models become, and at what loss."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import pandas as pd

from analysis.labels import ALL_TEXTURES
from analysis.page.outcomes import Outcome, described
from analysis.page.page import Fold, Picture, Table
from analysis.page.sections import Section
from analysis.spectra.figures.scenes import figure_tradeoff
from analysis.textures.scenes import (
    BEFORE_AFTER_COLUMNS,
    STEP_COLUMNS,
    before_after_table,
    steps_table,
)
from benches.scenes.examples import (
    FULL_MODEL,
    LEAST,
    RIVAL,
    SCENE_COMPARISON_COLUMNS,
    CompiledExample,
    Surface,
    comparison_table,
)
from modeling import CompiledScene
from modeling.files.columns import Column, chosen

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


def scene_section(examples: Sequence[Example]) -> Section:
    """The shipped scenes as compiled; the first one is drawn.

    Parameters
    ----------
    examples : sequence of (CompiledExample, mapping of texture to Surface)
    """
    comparison = comparison_table(examples)
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
    sentences = []
    for scene, rows in comparison.groupby("scene", sort=False):
        full, least, rival = (rows[rows["method"] == m].iloc[0] for m in (FULL_MODEL, LEAST, RIVAL))
        sentences.append(
            f"Scene {scene}: the least models need {least['numbers'] / full['numbers']:.0%} of the "
            f"numbers of the full ones ({least['numbers']} instead of {full['numbers']}), "
            f"{least['bytes'] / full['bytes']:.0%} of the bytes and "
            f"{least['operations'] / full['operations']:.0%} of the operations; the bound was kept "
            f"in {least['windows']} seconds of random strokes. {RIVAL} needs "
            f"{rival['numbers'] / least['numbers']:.1f} times the numbers of the least models; its "
            f"GFC30 relative to the true surface is {rival['gfc30']:.3f} (least models "
            f"{least['gfc30']:.3f}), its error in nine bands {rival['bands_db']:.2f} dB (least "
            f"models {least['bands_db']:.2f} dB)."
        )
    return described(sentences)
