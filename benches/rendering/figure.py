"""The figure of the render bench; it draws and computes nothing."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

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
)
from tactileq.benches.rendering.bench import (
    BLOCKS,
    LFILTER,
    RENDERER,
    SOSFILT,
    SWEEP_UPDATE,
    UPDATES,
    RenderingBench,
)
from tactileq.benches.rendering.rivals import AR, DIRECT_FORM_I, KERNEL, TPT, TRANSPOSED

FILTER_COLOURS = {
    KERNEL: BLUE,
    DIRECT_FORM_I: ORANGE,
    TRANSPOSED: GREY,
    TPT: GREEN,
    AR: PURPLE,
}
BLOCK_COLOURS = {RENDERER: SKY_BLUE, LFILTER: BLACK, SOSFILT: VERMILLION}
_BARS_SHARE = 0.84


def figure_rendering(bench: RenderingBench) -> Figure:
    """Cost per sample: filters in C by updates, called once or live, from Python, and by layers."""
    figure = Figure(figsize=(12, 10.5), layout="constrained")
    panels = figure.subplots(3, 3)
    for number, update in enumerate(UPDATES):
        every = f"update every {f'{update} samples' if update > 1 else 'sample'}"
        for row, (table, called) in enumerate(
            ((bench.throughput, "one call"), (bench.live, "a call each"))
        ):
            ax = panels[row, number]
            plot_costs(table[table["update_samples"] == update], FILTER_COLOURS, ax=ax)
            ax.set_title(f"in C, {called}: {every}", fontsize=10)
    for block, ax in zip(BLOCKS, panels[2], strict=False):
        rows = bench.blocks[bench.blocks["block_samples"] == block]
        plot_costs(rows, BLOCK_COLOURS, logarithmic=True, ax=ax)
        ax.set_title(f"from Python, an update every block of {block}", fontsize=10)
    plot_sweep(bench, ax=panels[2, 2])
    shared_legend(figure, [panels[0, 0], panels[2, 0]], ncols=8)
    machine = textwrap.fill(f"{bench.machine}; {bench.compiler}", 170)
    figure.supxlabel(f"noise included; {machine}", fontsize=7.5, color=GREY)
    return figure


def plot_costs(
    rows: pd.DataFrame,
    colours: Mapping[str, str],
    *,
    logarithmic: bool = False,
    ax: Axes | None = None,
) -> Axes:
    """Bars of ns per sample, one group for each number of layers.

    Parameters
    ----------
    rows : DataFrame
        layers, and one column of ns per sample for each name in `colours`.
    colours : mapping of str to str
        Column to colour, in the order of the bars.
    logarithmic : bool
        Where costs differ by orders of magnitude; by default the axis begins at 0.
    """
    ax = axes_or_new(ax)
    groups, width = np.arange(len(rows)), _BARS_SHARE / len(colours)
    for number, (name, colour) in enumerate(colours.items()):
        at = groups + (number - (len(colours) - 1) / 2) * width
        bars = ax.bar(at, rows[name], width=width, color=colour, label=name)
        shown = [f"{ns:.0f}" if ns >= 10 else f"{ns:.1f}" for ns in rows[name]]
        ax.bar_label(bars, shown, fontsize=6.5, padding=1)
    heights = rows[list(colours)].to_numpy()
    if logarithmic:
        ax.set_yscale("log")
        ax.yaxis.set_major_formatter("{x:g}")
        ax.set_ylim(heights.min() / 2, heights.max() * 2)  # room for the numbers above
    else:
        ax.set_ylim(0, heights.max() * 1.1)
    ax.set_xticks(groups, [f"{layers:.0f}" for layers in rows["layers"]])
    ax.set_xlabel("layers")
    ax.set_ylabel("time per sample (ns)")
    finish_axes(ax)
    return ax


def plot_sweep(bench: RenderingBench, ax: Axes | None = None) -> Axes:
    """Cost against the number of layers: the kernel's with its straight line, and AR(20)'s."""
    ax = axes_or_new(ax)
    line, sweep = bench.line, bench.sweep
    ends = np.array([0, sweep["layers"].max()])
    ax.plot(ends, line.ns_at_none + line.ns_per_layer * ends, color=BLUE, linewidth=1)
    ax.plot(sweep["layers"], sweep["ns_per_sample"], "o", color=BLUE)
    ar_ns = sweep["ar_ns_per_sample"].iloc[0]
    ax.axhline(ar_ns, color=FILTER_COLOURS[AR], linewidth=1.5)
    ax.text(ends[1], ar_ns, AR, color=FILTER_COLOURS[AR], ha="right", va="bottom")
    ax.set_title(f"in C, one call, updates every {SWEEP_UPDATE} samples", fontsize=10)
    fitted = f"kernel: {line.ns_per_layer:.2g} ns per layer, R² = {line.r_squared:.4f}"
    ax.text(0.04, 0.92, fitted, transform=ax.transAxes, color=BLUE, backgroundcolor="white")
    ax.set_xticks(sweep["layers"])
    ax.set_xlim(left=0)
    ax.set_ylim(bottom=0)
    ax.set_xlabel("layers")
    ax.set_ylabel("time per sample (ns)")
    finish_axes(ax)
    return ax
