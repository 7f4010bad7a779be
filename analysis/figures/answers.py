"""Bars of people's answers, ratings or correct rates, with either model."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from scipy import stats

from tactileq.analysis.labels import ALL_TEXTURES, IDENTICAL, significance_mark
from tactileq.analysis.page.drawing import (
    BLACK,
    BLUE,
    GREY,
    ORANGE,
    axes_or_new,
    finish_axes,
    stamp_if_simulated,
)
from tactileq.analysis.statistics.paired import CONFIDENCE, ignoring_case
from tactileq.analysis.statistics.verdicts import ClaimFound
from tactileq.modeling.arrays import Floats

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


def plot_paired_bars(found: ClaimFound, *, simulated: bool, ax: Axes | None = None) -> Axes:
    """Bars of means with their 95 % intervals per texture, either model, over their participants.

    Parameters
    ----------
    found : ClaimFound
        A participant's two means are joined by a line.
    simulated : bool
        Written into the figure.
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
