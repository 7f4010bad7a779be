"""Figures of ratings (PAPER fig. 9)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from tactileq.analysis.figures.answers import LEGEND_OF_BARS, plot_paired_bars
from tactileq.analysis.labels import SCALES
from tactileq.analysis.page.drawing import GREY, shared_legend
from tactileq.analysis.statistics.verdicts import ClaimFound


def figure_ratings(found: Sequence[ClaimFound], *, simulated: bool) -> Figure:
    """Rated similarity on each scale with either model (PAPER fig. 9).

    Parameters
    ----------
    found : sequence of ClaimFound
        About the same two models, a panel each.
    simulated : bool
        Written into the figure.
    """
    figure = Figure(figsize=(6.25 * len(found), 5), layout="constrained")
    axes = np.atleast_1d(figure.subplots(1, len(found)))
    for panel, ax, one in zip("abcdef", axes, found, strict=False):
        scale = SCALES[one.claim.measure]
        plot_paired_bars(one, simulated=simulated, ax=ax)
        ax.set_title(f"({panel}) {scale}", loc="left")
        ax.set_ylabel(f"rated similarity of {scale} (0–100)")
        ax.set_ylim(0, 115)
        ax.set_yticks(range(0, 101, 20))
    shared_legend(figure, figure.axes[:1], ncols=3)
    figure.supxlabel(LEGEND_OF_BARS, fontsize=9, color=GREY)
    return figure
