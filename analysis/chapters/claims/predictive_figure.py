"""Ratings beside those that the model of the participants predicts."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from tactileq.analysis.page.drawing import (
    BLACK,
    BLUE,
    SKY_BLUE,
    finish_axes,
    shared_legend,
    stamp_if_simulated,
)
from tactileq.analysis.statistics.verdicts import ClaimFound
from tactileq.modeling.arrays import Floats

WIDTH, HEIGHT = 4.4, 3.8  # inches of a panel
BINS = 24


def figure_predictive(found: ClaimFound, *, simulated: bool) -> Figure:
    """Share at the ends, spread of each person and, where there are some, scatter of repeats.

    Parameters
    ----------
    found : ClaimFound
        That the model of the participants was asked about.
    simulated : bool
        Written into the figure.
    """
    assert found.people is not None
    given, predicted = found.people.given, found.people.replicated
    repeated = bool(np.isfinite(given.repeated[0]))
    panels = 2 + repeated
    figure = Figure(figsize=(WIDTH * panels, HEIGHT), layout="constrained")
    axes = figure.subplots(1, panels)
    _draw_shares(axes[0], 100 * predicted.at_ends, 100 * float(given.at_ends[0]))
    _draw_people(axes[1], predicted.spread, given.spread[0])
    if repeated:
        axes[2].hist(predicted.repeated, bins=BINS, color=SKY_BLUE)
        axes[2].axvline(float(given.repeated[0]), color=BLACK, lw=2)
        axes[2].set_xlabel("SD of repeated ratings (points)")
    for ax in axes:
        finish_axes(ax)
    for ax in (axes[0], *axes[2:]):
        ax.set_yticks([])
        ax.set_ylabel("how probable")
    stamp_if_simulated(axes[-1], simulated)
    shared_legend(figure, [axes[0], axes[1]], loc="outside lower center")
    return figure


def _draw_shares(ax: Axes, predicted: Floats, given: float) -> None:
    """A bar for each share that there can be, since ratings at an end are counted."""
    shares, counts = np.unique(predicted, return_counts=True)
    width = float(np.diff(shares).min()) if shares.size > 1 else 1.0
    ax.bar(shares, counts, width=0.9 * width, color=SKY_BLUE, label="predicted")
    ax.axvline(given, color=BLACK, lw=2, label="given")
    ax.set_xlabel("ratings at an end of the scale (%)")


def _draw_people(ax: Axes, predicted: Floats, given: Floats) -> None:
    own = np.sort(given[np.isfinite(given)])
    ranked = np.sort(predicted[:, np.isfinite(given)], axis=1)
    low, high = np.quantile(ranked, [0.025, 0.975], axis=0)
    places = np.arange(1, own.size + 1)
    ax.fill_between(places, low, high, color=BLUE, alpha=0.25, lw=0, label="95% predicted")
    ax.plot(places, own, "o", color=BLACK, ms=4, label="given, a participant")
    ax.set_xlabel("participants, in rising order")
    ax.set_ylabel("SD of a person's ratings (points)")
    ax.set_ylim(bottom=0)
    ax.xaxis.set_major_locator(MaxNLocator(integer=True))
