"""Figures of speed and accuracy: time against right answers, and accuracy by quantile of time."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

from tactileq.analysis.figures.answers import ROLE_COLOURS
from tactileq.analysis.page.drawing import (
    BLACK,
    GREY,
    axes_or_new,
    finish_axes,
    shared_legend,
    stamp_if_simulated,
)

COLOURS = tuple(ROLE_COLOURS.values())
MARKERS = ("o", "s")
NARROWEST = 1.3  # factor from the middle of the time axis to either end, at least


def figure_speed_accuracy(
    scores: pd.DataFrame, means: pd.DataFrame, *, models: Sequence[str], simulated: bool
) -> Figure:
    """Time against share of right answers: a point per participant and model, and the means.

    docs/method/speed-accuracy.md#trade-off

    Parameters
    ----------
    scores : DataFrame
        From `tactileq.analysis.chapters.speed.scores.participant_scores`.
    means : DataFrame
        From `score_means` of these.
    models : sequence of str
        One, or the reference and the other one.
    simulated : bool
        Written into the figure.
    """
    figure = Figure(figsize=(7.5, 5.4), layout="constrained")
    ax = plot_speed_accuracy(
        scores, means, models=models, simulated=simulated, ax=figure.subplots()
    )
    shared_legend(figure, [ax], ncols=2)
    joined = ", lines connect the same person" * (len(models) > 1)
    figure.supxlabel(
        f"small: participants{joined}; large: mean with 95% confidence interval in both "
        "directions\nup: more accurate; left: faster",
        fontsize=9,
        color=GREY,
    )
    return figure


def plot_speed_accuracy(
    scores: pd.DataFrame,
    means: pd.DataFrame,
    *,
    models: Sequence[str],
    simulated: bool,
    ax: Axes | None = None,
) -> Axes:
    """The same in one pair of axes."""
    ax = axes_or_new(ax)
    for _, own in scores.groupby("participant_id"):
        if len(own) > 1:
            ax.plot(own["time_s"], own["share_correct"], color=GREY, alpha=0.35, lw=0.8, zorder=1)
    by_model = {row["model"]: row for row in means.to_dict("records")}
    for model, colour, marker in zip(models, COLOURS, MARKERS, strict=False):
        own = scores[scores["model"] == model]
        look: dict[str, Any] = {"marker": marker, "color": colour, "ls": ""}
        ax.plot(own["time_s"], own["share_correct"], ms=4.5, alpha=0.45, mew=0, zorder=2, **look)
        if model in by_model:
            _mean(ax, by_model[model], label=model, **look)
    _time_axis(ax)
    _accuracy_axis(ax)
    stamp_if_simulated(ax, simulated)
    return ax


def _mean(ax: Axes, row: Mapping[Hashable, Any], *, label: str, **look: Any) -> None:
    """The mean, its intervals where there are some."""
    time, share = row["time_s"], row["share_correct"]
    across = np.nan_to_num([[time - row["time_low"]], [row["time_high"] - time]])
    upright = np.nan_to_num([[share - row["share_low"]], [row["share_high"] - share]])
    ax.errorbar(
        time,
        share,
        xerr=across,
        yerr=upright,
        ms=11,
        mec=BLACK,
        ecolor=BLACK,
        elinewidth=1.8,
        capsize=4,
        capthick=1.8,
        zorder=4,
        label=label,
        **look,
    )


def figure_conditional_accuracy(
    table: pd.DataFrame, *, models: Sequence[str], chance: float | None = None, simulated: bool
) -> Figure:
    """Share of right answers by quantile of response time, a line per model.

    docs/method/speed-accuracy.md#conditional-accuracy

    Parameters
    ----------
    table : DataFrame
        From `tactileq.analysis.chapters.speed.scores.conditional_accuracy`.
    models : sequence of str
        One, or the reference and the other one.
    chance : float, optional
        Share of a guessing participant, drawn as a line.
    simulated : bool
        Written into the figure.
    """
    figure = Figure(figsize=(7.5, 4.8), layout="constrained")
    ax = figure.subplots()
    for model, colour, marker in zip(models, COLOURS, MARKERS, strict=False):
        own = table[table["model"] == model]
        share = own["share_correct"]
        limits = [share - own["ci_low"], own["ci_high"] - share]
        ax.errorbar(
            own["time_s"],
            share,
            yerr=np.nan_to_num(np.array(limits, dtype=float)),
            color=colour,
            marker=marker,
            ms=8,
            capsize=4,
            label=model,
        )
    if chance is not None:
        ax.axhline(chance, color=BLACK, ls="--", lw=1, label=f"chance, {chance:.1%}")
    _time_axis(ax)
    _accuracy_axis(ax)
    stamp_if_simulated(ax, simulated)
    shared_legend(figure, [ax], ncols=3)
    figure.supxlabel(
        "each participant's answers in groups of equal size, from the fastest to the slowest; "
        "means over participants\nwith 95% confidence intervals",
        fontsize=9,
        color=GREY,
    )
    return figure


def _time_axis(ax: Axes) -> None:
    """Response time in seconds, logarithmic; people differ by a factor of a few only."""
    ax.set_xscale("log")
    low, high = ax.get_xlim()
    # Times of simulated participants may all be alike.
    middle, reach = np.sqrt(low * high), max(np.sqrt(high / low), NARROWEST)
    ax.set_xlim(middle / reach, middle * reach)
    ax.xaxis.set_major_locator(LogLocator(subs=(1, 1.5, 2, 3, 4, 5, 7)))
    ax.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    ax.xaxis.set_minor_formatter(NullFormatter())
    ax.set_xlabel("response time (s, geometric mean)")


def _accuracy_axis(ax: Axes) -> None:
    ax.set_ylabel("right answers (share of trials, 0–1)")
    ax.set_ylim(-0.03, 1.03)
    ax.set_yticks(np.arange(0, 1.01, 0.2))
    finish_axes(ax)
