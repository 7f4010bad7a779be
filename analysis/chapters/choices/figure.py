"""Figures of correct rates (PAPER fig. 11)."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from tactileq.analysis.figures.answers import LEGEND_OF_BARS, plot_paired_bars
from tactileq.analysis.page.drawing import BLACK, GREY, shared_legend
from tactileq.analysis.statistics.verdicts import ClaimFound


def figure_correct_rates(found: ClaimFound, *, chance: float, simulated: bool) -> Figure:
    """Correct rates with either model against chance (PAPER fig. 11).

    Parameters
    ----------
    chance : float
        Rate of a guessing participant, drawn as a line; NaN for none.
    simulated : bool
        Written into the figure.
    """
    figure = Figure(figsize=(9.5, 5), layout="constrained")
    ax = figure.subplots()
    plot_paired_bars(found, simulated=simulated, ax=ax)
    if np.isfinite(chance):
        ax.axhline(chance, color=BLACK, ls="--", lw=1)
        text = f" chance\n {chance:.1%}"
        ax.text(1.0, chance, text, transform=ax.get_yaxis_transform(), va="center")
    ax.set_ylabel("correct rate (share of trials, 0–1)")
    ax.set_ylim(0, 1.15)
    ax.set_yticks(np.arange(0, 1.01, 0.2))
    shared_legend(figure, figure.axes[:1], ncols=3)
    figure.supxlabel(LEGEND_OF_BARS, fontsize=9, color=GREY)
    return figure
