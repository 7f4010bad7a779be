"""The figure of the render bench; it draws and computes nothing."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from analysis.benches.rendering import (
    BLOCKS,
    CALLS,
    ONE_CALL,
    RENDERER,
    SOSFILT,
    SWEEP_UPDATE,
    UPDATES,
    RenderingBench,
)
from analysis.benches.rivals import AR, DIRECT, KERNEL, TPT, TRANSPOSED
from analysis.figures.drawing import (
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
)

FILTER_COLOURS = {
    KERNEL: BLUE,
    DIRECT: ORANGE,
    TRANSPOSED: GREY,
    TPT: GREEN,
    AR: PURPLE,
}
BLOCK_COLOURS = {ONE_CALL: BLUE, CALLS: BLACK, RENDERER: SKY_BLUE, SOSFILT: VERMILLION}
_BARS_SHARE = 0.84


def figure_rendering(bench: RenderingBench) -> Figure:
    """Cost per sample: filters in C by updates, blocks beside sosfilt, and by number of layers."""
    figure = Figure(figsize=(12, 7.5), layout="constrained")
    panels = figure.subplots(2, 3)
    for update, ax in zip(UPDATES, panels[0], strict=True):
        rows = bench.filters[bench.filters["update_samples"] == update]
        plot_costs(rows, FILTER_COLOURS, ax=ax)
        ax.set_title(f"updates every {update} sample{'s' if update > 1 else ''}", fontsize=10)
        ax.set_ylim(1, 300)
    for block, ax in zip(BLOCKS, panels[1], strict=False):
        rows = bench.blocks[bench.blocks["block_samples"] == block]
        plot_costs(rows, BLOCK_COLOURS, ax=ax)
        ax.set_title(f"from Python, an update every block of {block}", fontsize=10)
        ax.set_ylim(1, 20000)
    plot_sweep(bench, ax=panels[1, 2])
    shared_legend(figure, [panels[0, 0], panels[1, 0]], ncols=9)
    figure.supxlabel(f"noise included; {bench.machine}", fontsize=9, color=GREY)
    return figure


def plot_costs(rows: pd.DataFrame, colours: Mapping[str, str], ax: Axes | None = None) -> Axes:
    """Bars of ns per sample on a logarithmic axis, one group for each number of layers.

    Parameters
    ----------
    rows : DataFrame
        layers, and one column of ns per sample for each name in `colours`.
    colours : mapping of str to str
        Column to colour, in the order of the bars.
    ax : Axes, optional
    """
    ax = axes_or_new(ax)
    groups, width = np.arange(len(rows)), _BARS_SHARE / len(colours)
    for number, (name, colour) in enumerate(colours.items()):
        at = groups + (number - (len(colours) - 1) / 2) * width
        bars = ax.bar(at, rows[name], width=width, color=colour, label=name)
        shown = [f"{ns:.0f}" if ns >= 10 else f"{ns:.1f}" for ns in rows[name]]
        ax.bar_label(bars, shown, fontsize=6.5, padding=1)
    ax.set_yscale("log")
    ax.set_xticks(groups, [f"{layers:.0f}" for layers in rows["layers"]])
    ax.set_xlabel("layers")
    ax.set_ylabel("time per sample (ns)")
    finish_axes(ax)
    return ax


def plot_sweep(bench: RenderingBench, ax: Axes | None = None) -> Axes:
    """The kernel's cost against the number of layers, with its straight line."""
    ax = axes_or_new(ax)
    line, sweep = bench.line, bench.sweep
    ends = np.array([0, sweep["layers"].max()])
    ax.plot(ends, line.ns_at_none + line.ns_per_layer * ends, color=GREY, linewidth=1)
    ax.plot(sweep["layers"], sweep["ns_per_sample"], "o", color=BLUE)
    ax.set_title(f"kernel, updates every {SWEEP_UPDATE} samples", fontsize=10)
    fitted = f"{line.ns_per_layer:.2g} ns per layer, R² = {line.r_squared:.4f}"
    ax.text(0.04, 0.92, fitted, transform=ax.transAxes, color=GREY, backgroundcolor="white")
    ax.set_xticks(sweep["layers"])
    ax.set_xlim(left=0)
    ax.set_ylim(bottom=0)
    ax.set_xlabel("layers")
    ax.set_ylabel("time per sample (ns)")
    finish_axes(ax)
    return ax
