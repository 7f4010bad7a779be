"""Figures of people's answers: ratings and correct rates."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy import stats

from analysis.labels import ALL_TEXTURES, IDENTICAL, SCALES, significance_mark
from analysis.page.drawing import (
    BLACK,
    BLUE,
    GREY,
    ORANGE,
    axes_or_new,
    finish_axes,
    shared_legend,
    stamp_if_simulated,
)
from analysis.statistics.paired import CONFIDENCE, ignoring_case
from analysis.statistics.verdicts import ClaimFound
from modeling.arrays import Floats

ROLES = ("reference", "other")
ROLE_COLOURS = {"reference": BLUE, "other": ORANGE}
ROLE_HATCHES = {"reference": "", "other": "///"}
LEGEND_OF_BARS = (
    "bars: mean with 95% confidence interval; points: participants, lines connect the same person\n"
    "* p < .05, ** p < .01, *** p < .001: paired t-test, Holm over the textures"
)
BAR_WIDTH = 0.42
BAR_OPACITY = 0.35
POINTS_WIDTH = 0.85  # of a bar
SIDES = (-0.5, 0.5)
GOLDEN_RATIO = (5**0.5 - 1) / 2


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


def figure_correct_rates(found: ClaimFound, *, chance: float, simulated: bool) -> Figure:
    """Correct rates with either model against chance (PAPER fig. 11).

    Parameters
    ----------
    found : ClaimFound
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


def plot_paired_bars(found: ClaimFound, *, simulated: bool, ax: Axes | None = None) -> Axes:
    """Bars of means with their 95 % intervals per texture, either model, over their participants.

    Parameters
    ----------
    found : ClaimFound
        A participant's two means are joined by a line.
    simulated : bool
        Written into the figure.
    ax : Axes, optional
    """
    ax = axes_or_new(ax)
    tests = found.tests[found.tests["texture"] != ALL_TEXTURES]
    tests = tests.sort_values("texture", key=ignoring_case)
    place = np.arange(len(tests))
    for side, role, model in zip(SIDES, ROLES, found.claim.models, strict=True):
        ax.bar(
            place + side * BAR_WIDTH,
            tests[f"mean_{role}"],
            BAR_WIDTH,
            color=(ROLE_COLOURS[role], BAR_OPACITY),
            hatch=ROLE_HATCHES[role],
            edgecolor=ROLE_COLOURS[role],
            label=f"{model} model",
        )
    for x, test in zip(place, tests.to_dict("records"), strict=True):
        rows = found.values["texture"] == test["texture"]
        own = found.values.loc[rows, list(ROLES)].to_numpy(dtype=float)
        _participants(ax, float(x), own)
        top = np.nanmax([0.0, *own.ravel(), *(test[f"mean_{role}"] for role in ROLES)])
        _significance_bracket(ax, float(x), top=float(top), p=float(test["p_holm"]))
    wide = stats.t.isf((1 - CONFIDENCE) / 2, np.maximum(tests["n"].to_numpy(float) - 1, 1))
    for side, role in zip(SIDES, ROLES, strict=True):
        ax.errorbar(
            place + side * BAR_WIDTH,
            tests[f"mean_{role}"],
            wide * tests[f"se_{role}"].fillna(0.0),
            ls="",
            color=BLACK,
            lw=1.8,
            capsize=4,
            capthick=1.8,
            zorder=4,
        )
    if ax.lines:
        ax.lines[0].set_label("one participant")
    same = tests["note"] == IDENTICAL
    labels = np.where(same, tests["texture"] + " (identical)", tests["texture"])
    ax.set_xticks(place, list(labels), rotation=30, ha="right")
    ax.set_xlabel("texture")
    finish_axes(ax)
    stamp_if_simulated(ax, simulated)
    return ax


def _participants(ax: Axes, x: float, means: Floats) -> None:
    """Points (n, 2) of one texture, spread over most of their bars, always alike."""
    # Steps of the golden ratio lie apart from each other, however many there are.
    spread = (np.arange(len(means)) * GOLDEN_RATIO % 1.0 - 0.5) * POINTS_WIDTH
    at = x + (np.array(SIDES) + spread[:, None]) * BAR_WIDTH
    ax.plot(
        at.T,
        means.T,
        color=GREY,
        lw=0.5,
        marker="o",
        ms=2.8,
        mfc=BLACK,
        mec="white",
        mew=0.4,
        alpha=0.75,
        zorder=3,
        clip_on=False,  # a rate of 0 stands on the axis
    )


def _significance_bracket(ax: Axes, x: float, *, top: float, p: float) -> None:
    mark = significance_mark(p)
    if mark:
        ax.annotate(
            "",
            (x - BAR_WIDTH / 2, top),
            (x + BAR_WIDTH / 2, top),
            arrowprops={
                "arrowstyle": "-",
                "connectionstyle": "bar,fraction=0.25",
                "shrinkB": 3,
                "shrinkA": 3,
            },
        )
        ax.annotate(
            mark, (x, top), xytext=(0, 8), textcoords="offset points", ha="center", va="bottom"
        )
