"""Figures of stability under moving parameters and of clicks; all they show is simulated."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from analysis.benches.clicks import STEADY, THIS_RENDERER, StepSignals
from analysis.benches.stability import OURS
from analysis.figures.drawing import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    VERMILLION,
    finish_axes,
    shared_legend,
)
from modeling.arrays import Floats

SHOWN_DB = (-50.0, 100.0)
AROUND_MS = (-10.0, 15.0)
COLOURS = {
    OURS: BLUE,
    "plain state-variable": ORANGE,
    "direct form": VERMILLION,
    THIS_RENDERER: BLUE,
    f"{OURS}, switched": GREEN,
    "plain state-variable, switched": ORANGE,
    "direct form, switched": VERMILLION,
    STEADY: BLACK,
}
MARKERS = dict(zip(COLOURS, ("o", "s", "^", "o", "D", "s", "^", "v"), strict=True))
STYLES = {STEADY: ":", "direct form, switched": "--", "direct form": "--"}


def plot_excess_ranges(table: pd.DataFrame, *, of: str, ax: Axes) -> Axes:
    """Lowest to highest excess of every form on every motion; an arrow where it overflowed.

    Parameters
    ----------
    table : DataFrame
        From `stability.stability_table`.
    of : {"band", "sum"}
    """
    names = list(table["motion"].unique())
    forms = list(table["form"].unique())
    for number, form in enumerate(forms):
        rows = table[table["form"] == form]
        shift = 0.22 * (number - 1)
        y = np.array([names.index(motion) for motion in rows["motion"]]) + shift
        low, high = rows[f"{of}_lowest_db"], rows[f"{of}_highest_db"]
        ax.hlines(y, low, np.minimum(high, SHOWN_DB[1]), color=COLOURS[form], linewidth=2)
        ends = np.where(np.isinf(high), np.nan, high)
        ax.plot(ends, y, MARKERS[form], color=COLOURS[form], markersize=5, label=form)
        for lost in y[np.isinf(high)]:
            ax.plot(SHOWN_DB[1], lost, ">", color=COLOURS[form], clip_on=False)
    ax.axvline(0, color=GREY, linewidth=0.8, linestyle=":")
    ax.set_xlim(*SHOWN_DB)
    ax.set_ylim(len(names) - 0.5, -0.5)
    ax.set_yticks(range(len(names)), names)
    ax.set_xlabel(f"excess variance of {'each band' if of == 'band' else 'the sum'} (dB)")
    finish_axes(ax)
    return ax


def plot_excess_over_time(courses: Mapping[str, Floats], *, rate_hz: float, ax: Axes) -> Axes:
    """One band's excess (n,) in dB over time, a line per form, the first one on top."""
    for form, course in reversed(list(courses.items())):
        time_ms = np.arange(course.size) / rate_hz * 1e3
        style = STYLES.get(form, "-")
        ax.plot(time_ms, course, style, color=COLOURS[form], linewidth=1.2, label=form)
    ax.set_xlabel("time (ms)")
    ax.set_ylabel("excess variance (dB)")
    finish_axes(ax)
    return ax


def figure_stability(
    table: pd.DataFrame, courses: Mapping[str, Floats], *, motion: str, rate_hz: float
) -> Figure:
    """Ranges for bands and for sums over all motions, and one band over time in one of them."""
    figure = Figure(figsize=(10, 7.5), layout="constrained")
    axes = figure.subplot_mosaic([["band", "sum"], ["time", "time"]])
    plot_excess_ranges(table, of="band", ax=axes["band"])
    plot_excess_ranges(table, of="sum", ax=axes["sum"]).tick_params(labelleft=False)
    plot_excess_over_time(courses, rate_hz=rate_hz, ax=axes["time"]).set_title(motion, fontsize=10)
    shared_legend(figure, [axes["band"]], loc="outside lower center", ncols=3)
    figure.suptitle(
        "Simulated: how much louder or softer than they should be filters are while their\n"
        "parameters move. Lines: lowest to highest; arrow: grows without bound",
        fontsize=11,
    )
    return figure


def plot_step(signals: StepSignals, *, shown: Sequence[str], ax: Axes) -> Axes:
    """The first stream around a step, as some of the methods render it."""
    streams = {name: signals.renderings[name][0] for name in shown}
    _plot_around_the_step(streams, time_s=signals.time_s, ax=ax)
    return ax


def plot_levels(
    levels: Mapping[str, Floats], *, time_s: Floats, shown: Sequence[str], ax: Axes
) -> Axes:
    """Level above 1 kHz around a step, in dB re the steady layer's there.

    Parameters
    ----------
    levels : dict of (n,) ndarray
        From `clicks.level_above_click_hz`.
    """
    _plot_around_the_step({name: levels[name] for name in shown}, time_s=time_s, ax=ax)
    ax.set_ylim(-15, 22)
    ax.set_xlabel("time from the step (ms)")
    return ax


def _plot_around_the_step(curves: Mapping[str, Floats], *, time_s: Floats, ax: Axes) -> None:
    time_ms = 1e3 * time_s
    near = (time_ms >= AROUND_MS[0]) & (time_ms <= AROUND_MS[1])
    for name, curve in curves.items():
        style = STYLES.get(name, "-")
        ax.plot(time_ms[near], curve[near], style, color=COLOURS[name], linewidth=1.2, label=name)
    ax.set_xlim(*AROUND_MS)
    ax.axvline(0, color=GREY, linewidth=0.8, linestyle=":")
    finish_axes(ax)


def figure_clicks(
    steps: Sequence[tuple[StepSignals, Mapping[str, Floats]]], *, shown: Mapping[str, Sequence[str]]
) -> Figure:
    """A column per step: one stream above, the level above 1 kHz over all streams below.

    Parameters
    ----------
    steps : sequence of (StepSignals, levels from `clicks.level_above_click_hz`)
    shown : dict of str to sequence of str
        By step: the methods to draw. Where several make the same signal, one will do.
    """
    figure = Figure(figsize=(11, 6.5), layout="constrained")
    axes = figure.subplots(2, len(steps), sharex=True, sharey="row", squeeze=False)
    for column, (signals, levels) in zip(axes.T, steps, strict=True):
        drawn = shown[signals.step]
        plot_step(signals, shown=drawn, ax=column[0]).set_title(signals.step, fontsize=10)
        plot_levels(levels, time_s=signals.time_s, shown=[*drawn, STEADY], ax=column[1])
    axes[0, 0].set_ylabel("acceleration (g)")
    axes[1, 0].set_ylabel("level above 1 kHz (dB)\nre the steady layer's there")
    lines = {str(line.get_label()): line for ax in axes[1] for line in ax.get_lines()}
    handles = [lines[name] for name in COLOURS if name in lines]
    figure.legend(handles=handles, loc="outside lower center", ncols=3, frameon=False, fontsize=9)
    figure.suptitle(
        "Simulated: one layer of 10 Hz width when the hand steps; above one stream of noise, below "
        f"the RMS over {len(steps[0][0].steady)} streams",
        fontsize=11,
    )
    return figure
