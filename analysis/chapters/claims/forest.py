"""Differences against their bounds: a forest plot of every claim."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from textwrap import fill
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from tactileq.analysis.answers.plan import MODEL_RULE
from tactileq.analysis.page.drawing import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SKY_BLUE,
    VERMILLION,
    stamp_if_simulated,
)
from tactileq.analysis.statistics.caveats import BOUNDS_WITHHELD, NOT_CONVERGED, WITHHELD
from tactileq.analysis.statistics.claims import CONTROL
from tactileq.analysis.statistics.equivalence import (
    DIFFERENT,
    EQUIVALENT,
    INCONCLUSIVE,
    WITHIN_BOUNDS,
)
from tactileq.analysis.statistics.verdicts import ClaimFound
from tactileq.modeling.files.answer_tables import ANSWER_TABLES

# Distinguished by shape as well as by colour.
MARKS = {
    EQUIVALENT: ("o", BLUE),
    DIFFERENT: ("D", VERMILLION),
    WITHIN_BOUNDS: ("s", ORANGE),
    INCONCLUSIVE: ("^", PURPLE),
    WITHHELD: ("v", GREEN),
    BOUNDS_WITHHELD: ("P", GREEN),
    CONTROL: ("x", GREY),
    NOT_CONVERGED: ("<", SKY_BLUE),
    "": ("d", GREY),
}
NO_VERDICT = "no test"
BESIDE = 0.26  # of a row: how far below the model's interval those of the paired test lie
INTERVALS = (("ci_low", "ci_high", 1.2), ("ci90_low", "ci90_high", 3.5))
BY_MODEL = ("model_low", "model_high", 2.2)
PANEL_WIDTH, ROW_HEIGHT = 4.4, 0.36
MOST_IN_A_ROW = 3
TITLE_WIDTH = 34  # characters, beside the stamp of what is simulated


def figure_forest(found: Sequence[ClaimFound], *, simulated: bool) -> Figure:
    """Mean differences with 90 % and 95 % intervals, and the bounds that were fixed before.

    Parameters
    ----------
    found : sequence of ClaimFound
        A panel each, with at least one row; of finished tasks. Where the model of the participants
        decides, its means and intervals stand above those of the paired tests.
    simulated : bool
        Written into the figure.
    """
    columns = min(len(found), MOST_IN_A_ROW)
    rows = -(-len(found) // columns)
    textures = max(len(one.tests) for one in found)
    size = (1.6 + PANEL_WIDTH * columns, rows * (1.5 + ROW_HEIGHT * textures) + 0.9)
    figure = Figure(figsize=size, layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False)
    for number, ax in enumerate(axes.flat):
        if number < len(found):
            plot_forest(found[number], simulated=simulated, ax=ax)
        else:
            ax.set_axis_off()
    figure.legend(
        handles=_legend(found), loc="outside lower center", ncols=4, frameon=False, fontsize=9
    )
    return figure


def plot_forest(found: ClaimFound, *, simulated: bool, ax: Axes) -> Axes:
    """One claim: all textures together on top, then each, identical ones last."""
    tests, claim = found.tests, found.claim
    factor = 100.0 if claim.measure == "correct" else 1.0
    if claim.bounds is not None:
        ax.axvspan(*(factor * bound for bound in claim.bounds), color=GREY, alpha=0.15, lw=0)
    ax.axvline(0, color=BLACK, lw=0.8)
    for place, row in enumerate(tests.to_dict("records")):
        _plot_row(ax, row, place=place, factor=factor)
    ax.set_yticks(range(len(tests)), [_label(row) for row in tests.to_dict("records")])
    ax.get_yticklabels()[0].set_fontweight("bold")
    ax.set_ylim(len(tests) - 0.5, -0.5)
    reference, other = claim.models
    if ANSWER_TABLES[claim.task].both_models:
        reference, other = "chance", "share"
    unit = "percentage points" if claim.measure == "correct" else "points of the scale"
    ax.set_xlabel(f"{other} − {reference} ({unit})")
    name = claim.name if claim.planned else f"{claim.name} (exploratory)"
    ax.set_title(fill(name, TITLE_WIDTH), loc="left", fontsize=10)
    ax.spines[["top", "right"]].set_visible(False)
    stamp_if_simulated(ax, simulated)
    return ax


def _plot_row(ax: Axes, row: Mapping[Hashable, Any], *, place: float, factor: float) -> None:
    """The marker of the verdict on the mean it rests on, and the intervals."""
    mark, colour = MARKS[row["verdict"]]
    middle = row["mean_difference"]
    tests_place, tests_colour = place, colour
    if row["rule"] == MODEL_RULE:
        middle = row["model_mean"]
        _plot_interval(ax, row, BY_MODEL, place=place, factor=factor, colour=colour)
        tests_place, tests_colour = place + BESIDE, GREY
    for ends in INTERVALS:
        _plot_interval(ax, row, ends, place=tests_place, factor=factor, colour=tests_colour)
    edge = colour if mark == "x" else "white"
    ax.plot(factor * middle, place, mark, color=colour, mec=edge, ms=8)


def _plot_interval(
    ax: Axes,
    row: Mapping[Hashable, Any],
    ends: tuple[str, str, float],
    *,
    place: float,
    factor: float,
    colour: str,
) -> None:
    low, high, width = ends
    if np.isfinite(row[low]):
        ax.plot([factor * row[low], factor * row[high]], [place] * 2, color=colour, lw=width)


def _label(row: Mapping[Hashable, object]) -> str:
    return f"{row['texture']} (n = {row['n']})"


def _legend(found: Sequence[ClaimFound]) -> list[Line2D | Patch]:
    """Every verdict that occurs, the two intervals, and the bounds where there are some."""
    occurring = pd.concat([one.tests["verdict"] for one in found]).unique()
    handles: list[Line2D | Patch] = [
        Line2D([], [], marker=mark, color=colour, ls="", ms=8, label=name or NO_VERDICT)
        for name, (mark, colour) in MARKS.items()
        if name in occurring
    ]
    of = ""
    if any(one.by_model for one in found):
        of = " of the paired test"
        handles.append(Line2D([], [], color=BLACK, lw=BY_MODEL[2], label="95% CI of the model"))
    handles += [
        Line2D([], [], color=GREY, lw=width, label=f"{level} CI{of}")
        for level, (*_, width) in zip(("95%", "90%"), INTERVALS, strict=True)
    ]
    if any(one.claim.bounds is not None for one in found):
        handles.append(Patch(color=GREY, alpha=0.15, label="bounds"))
    return handles
