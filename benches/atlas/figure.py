"""The picture of the atlas: where methods hold, degrade and fail; it computes nothing."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import LogLocator, NullLocator

from tactileq.analysis.page.drawing import (
    BLACK,
    BLUE,
    GREY,
    ORANGE,
    SKY_BLUE,
    VERMILLION,
    axes_or_new,
    finish_axes,
    shared_legend,
    stamp_if_simulated,
)
from tactileq.benches.atlas.case import DEGRADES, FAILS, HOLDS, VERDICTS, Axis, Case
from tactileq.benches.atlas.edges import Examined
from tactileq.benches.atlas.tables import LEAST_MARGIN, theory_of

COLOURS = {HOLDS: BLUE, DEGRADES: ORANGE, FAILS: VERMILLION}
BARS = {HOLDS: SKY_BLUE, DEGRADES: ORANGE, FAILS: VERMILLION}
MARKERS = {HOLDS: "o", DEGRADES: "^", FAILS: "X"}
FADED = {HOLDS: 0.45, DEGRADES: 0.3, FAILS: 0.35}
COLUMNS = 3
# Inches: of a column its labels and its panels; of a panel what is above its rows and below them.
LABELS_IN, PANEL_IN, GAP_IN = 2.45, 3.3, 0.25
ROW_IN, ABOVE_IN, BELOW_IN = 0.18, 0.52, 0.44
TOP_IN, BOTTOM_IN = 0.45, 0.35
_BAR_SHARE = 0.72


def figure_atlas(examined: Sequence[Examined], *, columns: int = COLUMNS) -> Figure:
    """All cases, a panel for each family and quantity that is varied.

    Parameters
    ----------
    examined : sequence of Examined
        The columns of a case one after the other.
    columns : int
        Of panels, side by side; as many as are needed at most.
    """
    panels = panels_of(examined)
    stacks = _stacked(panels, min(columns, len(panels)))
    column_in = LABELS_IN + PANEL_IN + GAP_IN
    width = column_in * len(stacks)
    height = TOP_IN + BOTTOM_IN + max(sum(map(_height_in, stack)) for stack in stacks)
    figure = Figure(figsize=(width, height))
    for number, stack in enumerate(stacks):
        left, top = number * column_in + LABELS_IN, height - TOP_IN
        for panel in stack:
            rows_in = ROW_IN * len(panel)
            bottom = top - ABOVE_IN - rows_in
            place = (left / width, bottom / height, PANEL_IN / width, rows_in / height)
            plot_panel(panel, ax=figure.add_axes(place))
            top -= _height_in(panel)
    figure.legend(handles=_legend(), loc="upper center", ncols=6, frameon=False, fontsize=9)
    figure.text(
        0.5,
        0.1 / height,
        "Simulated: every mark is a run on simulated signals, hand movements and answers. "
        "Easy on the left, hard on the right; bold: the default of the program.",
        ha="center",
        fontsize=9,
        color=GREY,
    )
    return figure


def figure_margins(margins: pd.DataFrame, *, most: int = 20) -> Figure:
    """The defaults that are nearest to an edge, by the factor between them and the edge.

    Parameters
    ----------
    margins : DataFrame
        `tables.margin_table`; at least one row.
    most : int
        Rows that are drawn.
    """
    near = margins.sort_values("margin", kind="stable").head(most).iloc[::-1]
    figure = Figure(figsize=(9.0, 1.3 + 0.21 * len(near)), layout="constrained")
    ax = figure.subplots()
    ax.axvspan(1.0, LEAST_MARGIN, color=GREY, alpha=0.15, lw=0)
    ax.axvline(1.0, color=BLACK, lw=0.8)
    styles = {True: ("o", BLUE, "far enough"), False: ("X", VERMILLION, "too near, or beyond")}
    for enough, (mark, colour, label) in styles.items():
        which = np.flatnonzero(near["enough"].to_numpy(dtype=bool) == enough)
        values = near["margin"].to_numpy(dtype=float)[which]
        ax.hlines(which, 1.0, values, color=colour, lw=1.2)
        ax.plot(values, which, mark, color=colour, ms=6, ls="", label=label)
    words = near["method"] + ": " + near["axis"] + " (" + near["family"] + ")"
    ax.set_yticks(range(len(near)), list(words), fontsize=8)
    ax.set_ylim(-0.7, len(near) - 0.3)
    ax.set_xscale("log")
    ax.xaxis.set_major_formatter("{x:g}")
    ax.xaxis.set_minor_formatter("{x:g}")
    ax.tick_params(axis="x", which="both", labelsize=8)
    ax.set_xlabel(f"factor from the default to the nearest edge (grey: below {LEAST_MARGIN:g})")
    finish_axes(ax)
    shared_legend(figure, [ax])
    stamp_if_simulated(ax, True)
    return figure


def panels_of(examined: Sequence[Examined]) -> list[list[Examined]]:
    """What shares a family, an axis and a measure, in the order of the cases."""
    panels: dict[object, list[Examined]] = {}
    for one in examined:
        case = one.case
        panels.setdefault((case.family, case.axis.name, case.figure), []).append(one)
    return list(panels.values())


def _height_in(panel: Sequence[Examined]) -> float:
    """Of a panel with its title and its axis, in inches."""
    return ABOVE_IN + ROW_IN * len(panel) + BELOW_IN


def _stacked(panels: Sequence[list[Examined]], count: int) -> list[list[list[Examined]]]:
    """The panels in order, in so many columns of about one height."""
    total = sum(map(_height_in, panels))
    stacks: list[list[list[Examined]]] = [[] for _ in range(count)]
    before = 0.0
    for panel in panels:
        middle = before + _height_in(panel) / 2
        stacks[min(count - 1, int(count * middle / total))].append(panel)
        before += _height_in(panel)
    return [stack for stack in stacks if stack]


def plot_panel(panel: Sequence[Examined], *, ax: Axes | None = None) -> Axes:
    """One row per method and column: bars between the edges, marks at the runs.

    Theory's edge is a black bar across the row, an arrow where none is expected within the axis;
    the default a dashed line.
    """
    ax = axes_or_new(ax)
    case = panel[0].case
    for row, one in enumerate(panel):
        _plot_row(one, row=row, ax=ax)
    _plot_runs(panel, ax=ax)
    _finish(panel, ax=ax)
    rows = " or ".join(dict.fromkeys(one.case.across for one in panel if one.case.across))
    ax.set_title(
        f"{case.family}: {case.figure}{f', by {rows}' if rows else ''}\nholds to "
        f"{_limit(case, case.holds)}, fails beyond {_limit(case, case.degrades)}",
        fontsize=8,
        loc="left",
        x=-LABELS_IN / PANEL_IN + 0.05,  # above the labels
    )
    stamp_if_simulated(ax, True)
    return ax


def _plot_row(one: Examined, *, row: int, ax: Axes) -> None:
    axis = one.case.axis
    held = axis.mild if math.isnan(one.holds_to) else one.holds_to
    failed = axis.severe if math.isnan(one.fails_from) else one.fails_from
    ends = {HOLDS: (axis.mild, held), DEGRADES: (held, failed), FAILS: (failed, axis.severe)}
    for verdict, (start, end) in ends.items():
        if start != end:
            ax.barh(
                row,
                end - start,
                left=start,
                height=_BAR_SHARE,
                color=BARS[verdict],
                alpha=FADED[verdict],
                linewidth=0,
            )
    if axis.default is not None:
        ax.vlines(axis.default, row - 0.5, row + 0.5, color=GREY, linestyle=(0, (2, 1)), lw=1.1)
    theory = theory_of(one)
    if not math.isnan(theory):
        beyond = theory == axis.severe
        ax.plot(
            theory,
            row,
            marker=9 if beyond else "|",  # 9: an arrow to the right that begins at its place
            markersize=5 if beyond else 9,
            markeredgewidth=1 if beyond else 2,
            color=BLACK,
            linestyle="",
            clip_on=False,
            zorder=5,
        )


def _plot_runs(panel: Sequence[Examined], *, ax: Axes) -> None:
    """The marks of all rows, those of one verdict together: far fewer things to draw."""
    for verdict in VERDICTS:
        runs = [
            (cell.value, row)
            for row, one in enumerate(panel)
            for cell in one.cells
            if cell.verdict == verdict
        ]
        ax.plot(
            [value for value, _ in runs],
            [row for _, row in runs],
            color=COLOURS[verdict],
            marker=MARKERS[verdict],
            markersize=4,
            linestyle="",
            clip_on=False,
            zorder=4,
        )


def _finish(panel: Sequence[Examined], *, ax: Axes) -> None:
    axis: Axis = panel[0].case.axis
    if axis.logarithmic:
        ax.set_xscale("log")
        decades = abs(math.log10(axis.severe / axis.mild))
        ax.xaxis.set_major_locator(LogLocator(subs=(1,) if decades > 2 else (1, 2, 5)))
        ax.xaxis.set_major_formatter("{x:g}")
        ax.xaxis.set_minor_locator(NullLocator())
    ax.set_xlim(axis.mild, axis.severe)
    ax.set_xlabel(f"{axis.name} ({axis.unit})" if axis.unit else axis.name, fontsize=8)
    ax.set_ylim(len(panel) - 0.4, -0.6)
    ax.set_yticks(range(len(panel)), [_label(one) for one in panel], fontsize=7)
    for label, one in zip(ax.get_yticklabels(), panel, strict=True):
        label.set_fontweight("bold" if one.case.ours else "normal")
    ax.tick_params(axis="x", labelsize=7)
    ax.tick_params(axis="y", length=0)
    ax.spines[["top", "right", "left"]].set_visible(False)


def _limit(case: Case, value: float) -> str:
    return f"{value:g} {case.unit}".strip().replace("-", "−")


def _label(one: Examined) -> str:
    return f"{one.case.method}, {one.column}" if one.column else one.case.method


def _legend() -> list[Line2D | Patch]:
    marks: list[Line2D | Patch] = [
        Line2D([], [], color=COLOURS[v], marker=MARKERS[v], linestyle="", label=f"a run: {v}")
        for v in (HOLDS, DEGRADES, FAILS)
    ]
    return [
        *marks,
        Patch(color=BARS[HOLDS], alpha=FADED[HOLDS], label="bars: between the measured edges"),
        Line2D(
            [],
            [],
            color=BLACK,
            marker="|",
            linestyle="",
            markersize=9,
            markeredgewidth=2,
            label="edge by theory (arrow: holds throughout)",
        ),
        Line2D([], [], color=GREY, linestyle=(0, (2, 1)), label="the default"),
    ]
