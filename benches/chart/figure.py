"""The speed–accuracy chart; it draws, and computes nothing but the front of what it draws."""

from __future__ import annotations

import re
from typing import NamedTuple

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullLocator

from tactileq.analysis.page.drawing import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SKY_BLUE,
    VERMILLION,
    axes_or_new,
    finish_axes,
    shared_legend,
    stamp_if_simulated,
)
from tactileq.benches.chart.chart import Chart
from tactileq.benches.chart.judging import AT, BETWEEN, LOADED, STROKING
from tactileq.benches.chart.methods import (
    AUTOREGRESSIVE,
    GRAINS,
    LOOPS,
    METHODS,
    OUR_METHOD,
    POLE_ZERO,
    SHAPED,
    TRUTH,
    WHITE,
)
from tactileq.benches.chart.summary import default_rows, front_of
from tactileq.benches.chart.surfaces import Kind, counted_kind

# By family: colour, marker, and whether its methods are steps of one number and joined by a line.
STYLES: dict[str, tuple[str, str, bool]] = {
    "joint": (BLUE, "*", False),
    "joint, given layers": (BLUE, "o", True),
    "simplified": (SKY_BLUE, "D", False),
    "regressed": (GREEN, "P", False),
    "paper": (VERMILLION, "X", False),
    AUTOREGRESSIVE: (ORANGE, "s", True),
    POLE_ZERO: (ORANGE, "d", False),
    LOOPS: (PURPLE, "p", False),
    GRAINS: (PURPLE, "<", False),
    SHAPED: (PURPLE, "^", False),
    "white noise": (GREY, "v", False),
    "truth": (BLACK, "_", False),
    LOADED: (BLACK, "h", False),
}
SHORT = {
    OUR_METHOD: "joint",
    "paper-consistent": "consistent",
    "simplified, energy": "energy",
    "simplified, paper-fft": "fft",
    "simplified, paper-gain": "gain",
    "regressed, conditions": "conditions",
    "regressed, centroid": "centroid",
    "FFT, 1/16 s": "1/16 s",
    "FFT, 1/4 s": "1/4 s",
    "grains, 1/16 s": "1/16 s",
    "grains, 1/4 s": "1/4 s",
    "IIR, 2 sections": "2 sections",
    "IIR, 4 sections": "4 sections",
    "joint, direct form": "direct form",
    "loops of joint": "joint",
    "loops of joint, at conditions": "at conditions",
    "loops of field": "field",
    "loops of spectra": "spectra",
    "white noise": "floor",
}


class Panel(NamedTuple):
    """What one panel shows: a cost along x, a place along y."""

    cost: str
    cost_label: str
    place: str
    title: str


WIDE = 1e3  # from here on an axis is labelled at powers of ten alone
OPERATIONS = "operations per sample at 5 kHz"
PANELS = (
    Panel("operations", OPERATIONS, AT, "at rest at the recorded conditions"),
    Panel("operations", OPERATIONS, BETWEEN, "at rest between them"),
    Panel("operations", OPERATIONS, STROKING, "during strokes"),
    Panel("numbers", "numbers stored", BETWEEN, "between the conditions"),
)


def figure_chart(chart: Chart, kind: Kind) -> Figure:
    """All panels of one kind of surface."""
    summary = chart.summary[chart.summary["kind"] == kind]
    shown = [panel for panel in PANELS if summary[f"{panel.place}_distance_db"].notna().any()]
    rows = -(-len(shown) // 2)
    figure = Figure(figsize=(12, 4.6 * rows + 1.1), layout="constrained")
    axes = figure.subplots(rows, 2, squeeze=False).ravel()
    for ax, panel in zip(axes, shown, strict=False):
        plot_panel(summary, panel, ax=ax)
    for ax in axes[len(shown) :]:
        ax.set_visible(False)
    shared_legend(figure, [_keys(axes[0], summary)], ncols=5)
    count = int(summary["surfaces"].max())
    figure.supxlabel(
        f"{counted_kind(count, kind)}; markers: medians with default rendering (updates each ms, "
        "grains and FFT by blocks), bars: quartiles over surfaces;\ndots: other updates and "
        "blendings; black line: the front, which no variant beats in both; numbers: layers, orders",
        fontsize=8.5,
        color=GREY,
    )
    stamp_if_simulated(axes[min(1, len(shown) - 1)], bool(summary["simulated"].any()))
    return figure


def plot_panel(summary: pd.DataFrame, panel: Panel, ax: Axes | None = None) -> Axes:
    """Cost against distance for one kind of surface.

    Parameters
    ----------
    summary : DataFrame
        Rows of one kind of `summary.summarised`.
    """
    ax = axes_or_new(ax)
    error = f"{panel.place}_distance_db"
    usual = default_rows(summary)
    ax.plot(
        summary[panel.cost], summary[error], ".", color=GREY, alpha=0.35, markersize=4, zorder=1
    )
    _plot_front(summary, panel, ax=ax)
    for family, rows in usual.groupby("family", sort=False):
        _plot_family(rows, str(family), panel, ax=ax)
    _name_points(usual, panel.cost, error, ax=ax)
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.margins(0.09)
    for axis in (ax.xaxis, ax.yaxis):
        low, high = axis.get_view_interval()
        steps = (1.0, 2.0, 5.0) if high < WIDE * low else (1.0,)
        axis.set_major_locator(LogLocator(subs=steps))
        axis.set_major_formatter("{x:,.7g}")
        axis.set_minor_locator(NullLocator())
    ax.set_xlabel(panel.cost_label)
    ax.set_ylabel("log-spectral distance from the truth (dB)")
    ax.set_title(panel.title, loc="left", fontsize=10)
    finish_axes(ax)
    return ax


def _plot_family(rows: pd.DataFrame, family: str, panel: Panel, *, ax: Axes) -> None:
    colour, marker, joined = STYLES[family]
    error = f"{panel.place}_distance_db"
    rows = rows[rows[panel.cost].gt(0) & rows[error].gt(0)].sort_values(panel.cost)
    if rows.empty:
        return
    middle = rows[error]
    spread = [middle - rows[f"{error}_25"], rows[f"{error}_75"] - middle]
    ax.errorbar(
        rows[panel.cost],
        middle,
        yerr=np.maximum(np.array(spread), 0.0),
        fmt=marker,
        color=colour,
        markersize=13 if family == "joint" else 7,
        markeredgecolor="white",
        markeredgewidth=0.5,
        linestyle="-" if joined else "none",
        linewidth=0.7,
        elinewidth=1,
        zorder=4 if family == "joint" else 3,
    )


def _name_points(usual: pd.DataFrame, cost: str, error: str, *, ax: Axes) -> None:
    """One name for methods that coincide; ours below its marker, all others above."""
    known = usual[usual[cost].gt(0) & usual[error].gt(0)]
    for _, here in known.groupby([cost, error], sort=False):
        ours = (here["family"] == OUR_METHOD).any()
        ax.annotate(
            ", ".join(map(_short, here["method"])),
            (here[cost].iloc[0], here[error].iloc[0]),
            xytext=(0, -15) if ours else (5, 4),
            textcoords="offset points",
            ha="center" if ours else "left",
            fontsize=7.5,
            color=STYLES[here["family"].iloc[0]][0],
            zorder=5,
        )


def _short(method: str) -> str:
    """The label of a marker: for the steps of a family only the number."""
    number = re.search(r"\d+", method)
    is_step = method.startswith(("joint, ", "AR("))
    return number.group() if number and is_step else SHORT.get(method, method)


def _on_front(method: str) -> str:
    """The same beside other families: what loops are made of would not tell."""
    return method if method in METHODS and METHODS[method].family == LOOPS else _short(method)


def _plot_front(every: pd.DataFrame, panel: Panel, *, ax: Axes) -> None:
    """The front as a staircase: what no other variant beats."""
    error = f"{panel.place}_distance_db"
    front = front_of(every[every[error].gt(0)], cost=panel.cost, error=error)
    ax.step(front[panel.cost], front[error], where="post", color=BLACK, linewidth=1.1, zorder=2)
    _name_front(front, panel, ax=ax)
    if panel.place == STROKING:
        _draw_late_truth(every, error, ax=ax)


def _draw_late_truth(every: pd.DataFrame, error: str, *, ax: Axes) -> None:
    """What late updates alone cost."""
    for _, row in every[every["method"] == TRUTH].drop_duplicates(error).iterrows():
        if row["update_ms"] > 1:
            ax.axhline(row[error], color=BLACK, linewidth=0.7, linestyle=":", zorder=1)
            name = f"truth, updated each {row['update_ms']:g} ms"
            ax.text(
                0.01,
                row[error],
                name,
                transform=ax.get_yaxis_transform(),
                ha="left",
                va="bottom",
                fontsize=6.5,
            )


def _name_front(front: pd.DataFrame, panel: Panel, *, ax: Axes) -> None:
    """Names of variants on the front that are not default rendering."""
    error = f"{panel.place}_distance_db"
    usual = default_rows(front).index
    for index, row in front.iterrows():
        if index not in usual and row["method"] != WHITE:
            ax.annotate(
                f"{_on_front(row['method'])}: {row['update_ms']:g} ms",
                (row[panel.cost], row[error]),
                xytext=(3, -3),
                textcoords="offset points",
                ha="left",
                va="top",
                fontsize=6.5,
                color=STYLES[row["family"]][0],
            )


def _keys(ax: Axes, summary: pd.DataFrame) -> Axes:
    """Markers of the legend alone, so that there is one for each family."""
    for family in summary["family"].unique():
        colour, marker, joined = STYLES[family]
        if family == "truth":
            continue
        label = {"joint": "joint, its own choice (ours)"}.get(family, family)
        ax.plot([], [], marker, color=colour, label=label, linestyle="-" if joined else "none")
    return ax
