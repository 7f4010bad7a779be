"""The trade-off found by the scene compiler: cost against the share of the bound."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, NullFormatter, NullLocator, ScalarFormatter

from tactileq.analysis.page.drawing import (
    BLACK,
    GREY,
    LAYER_COLOURS,
    LAYER_MARKERS,
    VERMILLION,
    axes_or_new,
    finish_axes,
    series_style,
    stamp_if_simulated,
)
from tactileq.modeling import CompiledScene
from tactileq.modeling.scenes.compiled import CompiledTexture

Cost = Literal["operations", "bytes"]
LABELS: dict[Cost, str] = {
    "operations": "operations per sample",
    "bytes": "bytes of table and state",
}
HIGHEST_SHARE = 2.0  # beyond, a broken bound is drawn at the edge
PAIRS = len(LAYER_COLOURS) * len(LAYER_MARKERS)
LINES = ("-", "--", "-.")
LEGEND_COLUMNS, LEGEND_ROW_INCHES = 6, 0.22


def figure_tradeoff(compiled: CompiledScene) -> Figure:
    """Both costs along x, side by side; every texture has an entry in the legend."""
    handles = _legend(compiled.textures)
    height = 5.0 + LEGEND_ROW_INCHES * -(-len(handles) // LEGEND_COLUMNS)
    figure = Figure(figsize=(12, height), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True)
    plot_tradeoff(compiled, "operations", ax=left)
    plot_tradeoff(compiled, "bytes", ax=right)
    right.set_ylabel("")
    figure.legend(
        handles=handles, loc="outside upper center", ncols=LEGEND_COLUMNS, frameon=False, fontsize=9
    )
    return figure


def plot_tradeoff(compiled: CompiledScene, cost: Cost, *, ax: Axes | None = None) -> Axes:
    """What each step costs and takes of the bound, from the full model (right) to the least one.

    A cross is the next longer update interval, with which the bound would be broken.
    """
    ax = axes_or_new(ax)
    ax.axhspan(1.0, HIGHEST_SHARE, color=VERMILLION, alpha=0.07, lw=0)
    ax.axhline(1.0, color=VERMILLION, lw=1)
    ax.annotate(
        "bound broken", (0.99, 1.03), xycoords=("axes fraction", "data"), color=VERMILLION,
        fontsize=9, ha="right",
    )  # fmt: skip
    for number, texture in enumerate(compiled.textures):
        _plot_texture(ax, texture, cost, number)
    ax.set_xscale("log")
    ax.set_xlabel(f"{LABELS[cost]} (logarithmic)")
    ax.set_ylabel("largest share of the bound that is used")
    ax.set_ylim(0, HIGHEST_SHARE)
    ax.xaxis.set_major_locator(LogLocator(base=10, subs=(1.0, 2.0, 5.0), numticks=12))
    ax.xaxis.set_major_formatter(ScalarFormatter())
    ax.xaxis.set_minor_formatter(NullFormatter())
    ax.xaxis.set_minor_locator(NullLocator())
    finish_axes(ax)
    stamp_if_simulated(ax, any(texture.full.simulated for texture in compiled.textures))
    return ax


def _plot_texture(ax: Axes, texture: CompiledTexture, cost: Cost, number: int) -> None:
    colour, marker, line = _style(number)
    costs = [getattr(step, cost) for step in texture.steps]
    shares = [min(step.share, HIGHEST_SHARE) for step in texture.steps]
    ax.plot(costs, shares, color=colour, ls=line, lw=1.2, alpha=0.8)
    ax.plot(costs[1:-1], shares[1:-1], color=colour, marker=marker, ms=3.5, lw=0)
    ax.plot(costs[:1], shares[:1], color=colour, marker=marker, ms=7, mfc="white", lw=0)
    ax.plot(costs[-1:], shares[-1:], color=colour, marker=marker, ms=8, mec=BLACK, lw=0)
    refused = texture.refused
    if refused is not None and cost == "operations":
        end = (refused.operations, min(refused.share, HIGHEST_SHARE))
        ax.plot([costs[-1], end[0]], [shares[-1], end[1]], color=colour, lw=0.8, ls=":")
        ax.plot(*end, color=colour, marker="x", ms=6, lw=0, clip_on=False)


def _style(number: int) -> tuple[str, str, str]:
    """Colour, marker and line: 147 textures look different."""
    return (*series_style(number), LINES[number // PAIRS % len(LINES)])


def _legend(textures: Sequence[CompiledTexture]) -> list[Line2D]:
    handles = []
    for number, texture in enumerate(textures):
        colour, marker, line = _style(number)
        handles.append(Line2D([], [], color=colour, marker=marker, ls=line, label=texture.texture))
    handles += [
        Line2D([], [], color=GREY, marker="o", mfc="white", lw=0, label="full model"),
        Line2D([], [], color=GREY, marker="o", mec=BLACK, ms=8, lw=0, label="least model"),
        Line2D([], [], color=GREY, marker="x", ls=":", label="next longer interval"),
    ]
    return handles
