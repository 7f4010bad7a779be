"""Each person's effect by the model of the participants, beside the bounds."""

from __future__ import annotations

from textwrap import fill

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tactileq.analysis.labels import unit_of
from tactileq.analysis.page.drawing import (
    BLACK,
    BLUE,
    GREY,
    axes_or_new,
    finish_axes,
    shared_legend,
    stamp_if_simulated,
)
from tactileq.analysis.statistics.participants.verdict import LIKELY, PeopleFound, PeopleSummary
from tactileq.analysis.statistics.verdicts import ClaimFound
from tactileq.modeling.arrays import Bools

ATTENDING, CARELESS = ("o", BLUE), ("s", GREY)
MOST_TICKS = 40  # participants whose names still fit below the axis
MOST_NAMED = 6
LEGEND_WIDTH, TITLE_WIDTH = 58, 72  # characters
HEIGHT, NARROWEST, WIDEST = 4.6, 7.0, 13.0  # inches
PLACE = 0.24  # inches for each participant


def figure_people(found: ClaimFound, *, simulated: bool) -> Figure:
    """The effect of each participant, in a figure as wide as their number needs.

    Parameters
    ----------
    found : ClaimFound
        About ratings, that the model of the participants was asked about.
    simulated : bool
        Written into the figure.
    """
    width = float(np.clip(2.0 + PLACE * len(_people(found).people), NARROWEST, WIDEST))
    figure = Figure(figsize=(width, HEIGHT), layout="constrained")
    ax = plot_people(found, simulated=simulated, ax=figure.subplots())
    shared_legend(figure, [ax], loc="outside lower center")
    return figure


def plot_people(found: ClaimFound, *, simulated: bool, ax: Axes | None = None) -> Axes:
    """The same in axes: effects with 95 % intervals, sorted, and the mean beside them."""
    ax = axes_or_new(ax)
    people = _people(found).people.sort_values("effect", ignore_index=True)
    assert found.claim.bounds is not None
    ax.axhspan(*found.claim.bounds, color=GREY, alpha=0.15, lw=0)
    ax.axhline(0, color=BLACK, lw=0.8)
    _draw_people(ax, people)
    _draw_mean(ax, _people(found).summary, place=len(people) + 0.5)
    _name_axes(ax, found, people=people)
    ax.set_title(_title(found), loc="left", fontsize=10)
    stamp_if_simulated(ax, simulated)
    return ax


def _people(found: ClaimFound) -> PeopleFound:
    assert found.people is not None
    return found.people


def _draw_people(ax: Axes, people: pd.DataFrame) -> None:
    """Everybody's marker and interval."""
    careless: Bools = (people["careless"] > LIKELY).to_numpy()
    kinds = (
        (~careless, ATTENDING, "participant, 95% CI"),
        (careless, CARELESS, _careless_label(people[careless])),
    )
    for which, (mark, colour), label in kinds:
        if which.any():
            at, own = np.flatnonzero(which), people[which]
            ax.vlines(at, own["ci_low"], own["ci_high"], color=colour, lw=1.3)
            face = "white" if mark == CARELESS[0] else colour
            ax.plot(at, own["effect"], mark, color=colour, mfc=face, ms=5.5, label=label)


def _careless_label(careless: pd.DataFrame) -> str:
    names = [str(who) for who in careless["participant_id"]]
    more = len(names) - MOST_NAMED
    shown = ", ".join(names[:MOST_NAMED]) + (f" and {more} more" if more > 0 else "")
    return fill(f"probably did not attend: {shown}", LEGEND_WIDTH)


def _draw_mean(ax: Axes, summary: PeopleSummary, *, place: float) -> None:
    """The mean effect on the right of all participants, with a line across."""
    ax.vlines(place, summary.mean_low, summary.mean_high, color=BLACK, lw=3)
    ax.axhline(summary.mean, color=BLACK, lw=0.8, ls=":")
    label = "mean of those who attend, 95% CI"
    ax.plot(place, summary.mean, "d", color=BLACK, mfc="white", mew=1.5, ms=9, label=label)


def _name_axes(ax: Axes, found: ClaimFound, *, people: pd.DataFrame) -> None:
    count = len(people)
    if count <= MOST_TICKS:
        ax.set_xticks(range(count), [str(who) for who in people["participant_id"]])
        ax.tick_params(axis="x", rotation=90, labelsize=8)
    else:
        ax.set_xticks([])
    ax.set_xlim(-0.8, count + 1.3)
    ax.set_xlabel(f"{count} participants, sorted by their effect")
    reference, other = found.claim.models
    ax.set_ylabel(f"{other} − {reference}\n({unit_of(found.claim.measure)[0]})")
    finish_axes(ax)


def _title(found: ClaimFound) -> str:
    """The claim with its verdict, and the SD between people."""
    summary, overall = _people(found).summary, found.tests.iloc[0]
    claim = fill(f"{found.claim.name}: {overall['verdict']}", TITLE_WIDTH)
    if np.isnan(summary.sd):
        return claim
    what = "SD of people and days" if found.by_day else "SD between people"
    return (
        f"{claim}\n{what}: {summary.sd:.1f} (95% CI {summary.sd_low:.1f} to {summary.sd_high:.1f})"
    )
