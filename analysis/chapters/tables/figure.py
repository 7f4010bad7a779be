"""Figure of a measure by the levels of factors, a line per participant and their mean."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tactileq.analysis.page.drawing import (
    BLACK,
    BLUE,
    GREY,
    axes_or_new,
    finish_axes,
    shared_legend,
    stamp_if_simulated,
)

PANELS_IN_A_ROW = 4
LONGEST_UPRIGHT = 6  # letters of a level that fit below their place


def figure_factorial(
    cells: pd.DataFrame,
    means: pd.DataFrame,
    *,
    factors: Sequence[str],
    label: str,
    simulated: bool,
    chance: float | None = None,
) -> Figure:
    """The first factor along x; a panel for each combination of the others.

    Parameters
    ----------
    cells : DataFrame
        From `factorial.participant_cells`.
    means : DataFrame
        From `factorial.cell_means`, whose order the panels and levels follow.
    factors : sequence of str
        One or more.
    label : str
        Of the vertical axis, with its unit.
    simulated : bool
        Written into the figure.
    chance : float, optional
        Drawn as a dashed line.
    """
    first, *others = factors
    levels = list(dict.fromkeys(means[first]))
    panels = means[others].drop_duplicates().to_dict("records") if others else [{}]
    columns = min(len(panels), PANELS_IN_A_ROW)
    rows = -(-len(panels) // columns)
    size = (max(5.0, 3.1 * columns), 0.6 + 3.4 * rows)
    figure = Figure(figsize=size, layout="constrained")
    axes = figure.subplots(rows, columns, sharey=True, squeeze=False).ravel()
    for ax, panel in zip(axes, panels, strict=False):
        own = [_panel_rows(table, panel) for table in (cells, means)]
        plot_levels(own[0], own[1], factor=first, levels=levels, simulated=simulated, ax=ax)
        if chance is not None:
            ax.axhline(chance, color=GREY, lw=1, ls="--", label="chance")
        ax.set_title(", ".join(f"{name} {level}" for name, level in panel.items()), loc="left")
    for ax in axes[len(panels) :]:
        ax.remove()
    for ax in axes[: len(panels) : columns]:
        ax.set_ylabel(label)
    shared_legend(figure, axes[:1], ncols=2 if chance is None else 3)
    return figure


def plot_levels(
    cells: pd.DataFrame,
    means: pd.DataFrame,
    *,
    factor: str,
    levels: Sequence[str],
    simulated: bool,
    ax: Axes | None = None,
) -> Axes:
    """A thin line per participant, and the mean with its 95 % interval bold.

    Parameters
    ----------
    cells, means : DataFrame
        As for `figure_factorial`, of one panel.
    factor : str
        Along x.
    levels : sequence of str
        In their order along x.
    simulated : bool
        Written into the figure.
    """
    ax = axes_or_new(ax)
    place = np.arange(len(levels))
    for number, (_, own) in enumerate(cells.groupby("participant_id", sort=False)):
        values = own.set_index(factor)["mean"].reindex(list(levels))
        label = "" if number else "one participant"
        ax.plot(place, values, color=GREY, lw=0.7, marker="o", ms=2.5, alpha=0.6, label=label)
    mean = means.set_index(factor).reindex(list(levels))
    half = np.nan_to_num([mean["mean"] - mean["ci_low"], mean["ci_high"] - mean["mean"]])
    style: dict[str, Any] = {
        "color": BLUE,
        "lw": 2.4,
        "marker": "s",
        "ms": 6,
        "capsize": 5,
        "capthick": 2,
    }
    ax.errorbar(place, mean["mean"], half, **style, label="mean and 95% CI", zorder=4, mec=BLACK)
    long = any(len(str(level)) > LONGEST_UPRIGHT for level in levels)
    ax.set_xticks(place, list(levels), rotation=30 if long else 0, ha="right" if long else "center")
    ax.set_xlim(-0.35, len(levels) - 0.65)
    ax.set_xlabel(factor)
    finish_axes(ax)
    stamp_if_simulated(ax, simulated)
    return ax


def _panel_rows(table: pd.DataFrame, panel: Mapping[Hashable, str]) -> pd.DataFrame:
    for name, level in panel.items():
        table = table[table[name] == level]
    return table
