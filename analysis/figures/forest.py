"""Differences against their bounds: a forest plot of every claim."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from textwrap import fill

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from analysis.figures.drawing import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    VERMILLION,
    stamp_if_simulated,
)
from analysis.statistics.claims import BOUNDS_WITHHELD, CONTROL, WITHHELD
from analysis.statistics.equivalence import DIFFERENT, EQUIVALENT, INCONCLUSIVE, WITHIN_BOUNDS
from analysis.statistics.verdicts import ClaimFound
from modeling.files.answer_tables import ANSWER_TABLES

# Distinguished by shape as well as by colour.
MARKS = {
    EQUIVALENT: ("o", BLUE),
    DIFFERENT: ("D", VERMILLION),
    WITHIN_BOUNDS: ("s", ORANGE),
    INCONCLUSIVE: ("^", PURPLE),
    WITHHELD: ("v", GREEN),
    BOUNDS_WITHHELD: ("P", GREEN),
    CONTROL: ("x", GREY),
    "": ("d", GREY),
}
NO_VERDICT = "no test"
PANEL_WIDTH, ROW_HEIGHT = 4.4, 0.36
MOST_IN_A_ROW = 3
TITLE_WIDTH = 34  # characters, beside the stamp of what is simulated


def figure_forest(found: Sequence[ClaimFound], *, simulated: bool) -> Figure:
    """Mean differences with 90 % and 95 % intervals, and the bounds that were fixed before.

    Parameters
    ----------
    found : sequence of ClaimFound
        A panel each, with at least one row; of finished tasks.
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
        mark, colour = MARKS[row["verdict"]]
        for low, high, width in (("ci_low", "ci_high", 1.2), ("ci90_low", "ci90_high", 3.5)):
            if np.isfinite(row[low]):
                ax.plot(
                    [factor * row[low], factor * row[high]], [place] * 2, color=colour, lw=width
                )
        edge = colour if mark == "x" else "white"
        ax.plot(factor * row["mean_difference"], place, mark, color=colour, mec=edge, ms=8)
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
    handles += [
        Line2D([], [], color=GREY, lw=3.5, label="90% CI"),
        Line2D([], [], color=GREY, lw=1.2, label="95% CI"),
    ]
    if any(one.claim.bounds is not None for one in found):
        handles.append(Patch(color=GREY, alpha=0.15, label="bounds"))
    return handles
