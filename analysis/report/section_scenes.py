"""The section on the shipped scenes: how much less they need, and at which loss."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import pandas as pd

from analysis.benches.scenes import (
    COMPARISON_COLUMNS,
    FULL,
    LEAST,
    RIVAL,
    CompiledExample,
    Surface,
    comparison_table,
)
from analysis.columns import Column, chosen
from analysis.figures.scenes import figure_tradeoff
from analysis.labels import ALL_TEXTURES
from analysis.report.outcomes import Outcome
from analysis.report.page import Fold, Picture, Table
from analysis.report.sections import Section
from analysis.report.sentences import described
from analysis.textures.scenes import (
    BEFORE_AFTER_COLUMNS,
    STEP_COLUMNS,
    before_after_table,
    steps_table,
)
from modeling import CompiledScene

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
    """Shipped scenes that were compiled, one after the other; the first one is drawn.

    Parameters
    ----------
    examples : sequence of (CompiledExample, mapping of texture to Surface)
    """
    comparison = comparison_table(examples)
    simulated = bool(comparison["simulated"].any())
    steps, textures = _step_table(examples, simulated), _texture_table(examples, simulated)
    return Section(
        "scenes",
        "No more model than the scene needs",
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
        f"What the compiler walked: {compiled.scene.name}",
        "From the full model of each texture (open) by dropping layers that are not felt, thinning "
        "the grid, a longer update interval and single precision to the least model (outlined), "
        "which still keeps the bound. A cross: the next longer interval, which would break it.",
        figure_tradeoff(compiled),
        simulated,
    )


def _comparison(comparison: pd.DataFrame, simulated: bool) -> Table:
    return Table(
        "scene_comparison",
        "Full models, least ones and an AR model, scene by scene",
        "Numbers and bytes of all textures, operations of the one that takes most. GFC and errors "
        "are against the true surface at all places of the scene: layers that nobody feels there "
        "are missing in the least models, which the GFC counts and a finger does not. The bound "
        "itself is kept against what is felt of the full model; the last column counts the seconds "
        f"of random strokes in which it was. {RIVAL} has its recorded conditions within the scene, "
        "double precision and the update interval of the least model; its operations do not "
        "compare with ours, as they hold coefficients made anew at every update.",
        comparison,
        COMPARISON_COLUMNS[:-1],
        simulated,
    )


def _step_table(examples: Sequence[Example], simulated: bool) -> Table:
    steps = _of_scenes(examples, steps_table)
    return Table(
        "scene_steps",
        "What each step brings",
        "All textures of a scene together, each step after those above it. The last column: the "
        "largest share of the bound that is taken; 1 is all of it.",
        steps[steps["texture"] == ALL_TEXTURES],
        SHOWN_STEPS,
        simulated,
    )


def _texture_table(examples: Sequence[Example], simulated: bool) -> Table:
    return Table(
        "scene_textures",
        "Each texture in each scene",
        "Bounds: GFC30 ≥ 0.95 of the attainable, error in nine bands and level error ≤ 1 dB unless "
        "the scene says otherwise; each worst value has late updates and precision in it.",
        _of_scenes(examples, before_after_table),
        SHOWN_TEXTURES,
        simulated,
    )


def _of_scenes(
    examples: Sequence[Example], table_of: Callable[[CompiledScene], pd.DataFrame]
) -> pd.DataFrame:
    tables = [table_of(one.compiled) for one, _ in examples]
    for (one, _), table in zip(examples, tables, strict=True):
        table.insert(0, "scene", one.compiled.scene.name)
    return pd.concat(tables, ignore_index=True)


def _outcomes(comparison: pd.DataFrame) -> list[Outcome]:
    sentences = []
    for scene, rows in comparison.groupby("scene", sort=False):
        full, least, rival = (rows[rows["method"] == m].iloc[0] for m in (FULL, LEAST, RIVAL))
        numbers = least["fewer_numbers"]
        counted = (
            f"{numbers:.1f} times fewer numbers"
            if numbers >= 1
            else f"{1 / numbers:.1f} times more numbers"
        )
        sentences.append(
            f"Scene {scene}: the least models take {counted} ({least['numbers']} instead "
            f"of {full['numbers']}), {full['bytes'] / least['bytes']:.1f} times fewer bytes and "
            f"{least['fewer_operations']:.1f} times fewer operations than the full ones; the bound "
            f"was kept in {least['windows']} seconds of random strokes. {RIVAL} takes "
            f"{rival['numbers'] / least['numbers']:.1f} times the numbers of the least ones, with "
            f"a GFC30 to the truth of {rival['gfc30']:.3f} against "
            f"{least['gfc30']:.3f}, and {rival['bands_db']:.2f} against {least['bands_db']:.2f} dB "
            "in nine bands."
        )
    return described(sentences)
