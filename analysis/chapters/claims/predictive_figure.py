"""Ratings beside those that the model of the participants predicts."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

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

SIZE = (10.0, 3.6)  # inches
BINS = 24


def figure_predictive(found: ClaimFound, *, simulated: bool) -> Figure:
    """Share at the ends, spread of each person, and scatter of repeats, given and predicted.

    Parameters
    ----------
    found : ClaimFound
        That the model of the participants was asked about.
    simulated : bool
        Written into the figure.
    """
    assert found.people is not None
    given, predicted = found.people.given, found.people.replicated
    figure = Figure(figsize=SIZE, layout="constrained")
    ends, people, repeats = figure.subplots(1, 3)
    _draw_share(ends, 100 * predicted.at_ends, 100 * given.at_ends[0])
    ends.set_xlabel("ratings at an end of the scale (%)")
    _draw_people(people, predicted.spread, given.spread[0])
    _draw_share(repeats, predicted.repeated, given.repeated[0])
    repeats.set_xlabel("SD of repeated ratings (points)")
    for ax in (ends, repeats):
        ax.set_yticks([])
        ax.set_ylabel("how probable")
    for ax in (ends, people, repeats):
        finish_axes(ax)
    stamp_if_simulated(ends, simulated)
    shared_legend(figure, [ends, people], loc="outside lower center")
    return figure


def _draw_share(ax: Axes, predicted: Floats, given: float) -> None:
    known = predicted[np.isfinite(predicted)]
    if not known.size or not np.isfinite(given):
        ax.text(0.5, 0.5, "no surface was\nrated twice", ha="center", transform=ax.transAxes)
        return
    ax.hist(known, bins=BINS, color=SKY_BLUE, density=True, label="predicted")
    ax.axvline(given, color=BLACK, lw=2, label="given")


def _draw_people(ax: Axes, predicted: Floats, given: Floats) -> None:
    own = np.sort(given[np.isfinite(given)])
    ranked = np.sort(predicted[:, np.isfinite(given)], axis=1)
    low, high = np.quantile(ranked, [0.025, 0.975], axis=0)
    places = np.arange(1, own.size + 1)
    ax.fill_between(places, low, high, color=BLUE, alpha=0.25, lw=0, label="95% predicted")
    ax.plot(places, own, "o", color=BLACK, ms=4)
    ax.set_xlabel("participants, in rising order")
    ax.set_ylabel("SD of a person's ratings (points)")
    ax.set_ylim(bottom=0)
