"""Figures of the hand: speed and force by model."""

from __future__ import annotations

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tactileq.analysis.page.drawing import (
    BLACK,
    BLUE,
    GREY,
    ORANGE,
    axes_or_new,
    finish_axes,
    shared_legend,
    stamp_if_simulated,
)
from tactileq.analysis.statistics.paired import t_test, why_undefined

LABELS = {
    "speed_mm_s": "mean speed while touching (mm/s)",
    "force_n": "mean force while touching (N)",
}
COLOURS = (BLUE, ORANGE)
MARKERS = ("o", "s")
BESIDE = 0.16  # the mean stands outside of its participants


def figure_hand(means: pd.DataFrame, *, models: tuple[str, str], simulated: bool) -> Figure:
    """Speed and force with either model: participants, and the mean with its 95 % interval.

    docs/method/reliability.md#hand

    Parameters
    ----------
    means : DataFrame
        From `tactileq.analysis.chapters.hand.statistics.hand_means`, of one task.
    models : (str, str)
        The reference, and the other one.
    simulated : bool
        Written into the figure.
    """
    measured = means.dropna(subset=["reference", "other"])
    shown = [name for name in LABELS if name in set(measured["measure"])]
    figure = Figure(figsize=(4.6 * len(shown), 4.6), layout="constrained")
    for ax, name in zip(figure.subplots(1, len(shown), squeeze=False)[0], shown, strict=True):
        own = measured[measured["measure"] == name]
        plot_measure(own, name, models=models, simulated=simulated, ax=ax)
    shared_legend(figure, figure.axes[:1], ncols=3)
    return figure


def plot_measure(
    means: pd.DataFrame,
    measure: str,
    *,
    models: tuple[str, str],
    simulated: bool,
    ax: Axes | None = None,
) -> Axes:
    """One measure: a point per participant and model, one person's two joined.

    Parameters
    ----------
    means : DataFrame
        As for `figure_hand`, of one measure.
    measure : str
        One of `LABELS`.
    models : (str, str)
    """
    ax = axes_or_new(ax)
    values = means[["reference", "other"]].to_numpy(dtype=float)
    lines = ax.plot(
        [0, 1], values.T, color=GREY, lw=0.7, marker="o", ms=4, mfc=BLACK, mec="white", mew=0.5
    )
    lines[0].set_label("one participant")
    for column, model in enumerate(models):
        own = values[:, column]
        ax.errorbar(
            column + (2 * column - 1) * BESIDE,
            own.mean(),
            None if why_undefined(own) else (t_test(own)[3] - own.mean()),
            color=COLOURS[column],
            marker=MARKERS[column],
            ms=8,
            lw=2,
            capsize=5,
            ls="",
            label=f"{model}: mean, 95% CI",
        )
    ax.set_xticks([0, 1], list(models))
    ax.set_xlim(-0.5, 1.5)
    ax.set_ylim(bottom=0)
    ax.set_xlabel("model of the virtual surface")
    ax.set_ylabel(LABELS[measure])
    finish_axes(ax)
    stamp_if_simulated(ax, simulated)
    return ax
