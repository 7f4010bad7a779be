"""Figure of planning: participants against the chance of each verdict.

docs/method/power.md
"""

from __future__ import annotations

from textwrap import fill

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tactileq.analysis.labels import ALL_TEXTURES
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
    stamp_if_simulated,
)
from tactileq.analysis.power.power import EVERY_TEXTURE, NO_VERDICT, TARGET
from tactileq.analysis.statistics.caveats import BOUNDS_WITHHELD, WITHHELD
from tactileq.analysis.statistics.equivalence import (
    DIFFERENT,
    EQUIVALENT,
    INCONCLUSIVE,
    WITHIN_BOUNDS,
)

# Distinguished by colour, marker and line style.
STYLES = {
    EQUIVALENT: (BLUE, "o", "-"),
    WITHIN_BOUNDS: (GREEN, "^", "-."),
    DIFFERENT: (VERMILLION, "s", "-"),
    INCONCLUSIVE: (ORANGE, "D", "--"),
    WITHHELD: (PURPLE, "v", ":"),
    BOUNDS_WITHHELD: (BLACK, "h", "--"),
    NO_VERDICT: (GREY, "X", ":"),
    EVERY_TEXTURE: (SKY_BLUE, "P", "-."),
}
# What has a line of its own beside the verdicts over all textures.
LABELS = {
    EVERY_TEXTURE: "every single texture equivalent",
}
PANELS_IN_A_ROW = 3
LETTERS_IN_A_LINE = 48  # of a panel's title
APART = 0.006  # of the axis, between intervals at one n


def figure_power(table: pd.DataFrame) -> Figure:
    """A panel for each claim: n against the chance of each verdict over all textures.

    Parameters
    ----------
    table : DataFrame
        From `tactileq.analysis.power.power.power_table`.
    """
    claims = list(table["claim"].drop_duplicates())
    across = min(len(claims), PANELS_IN_A_ROW)
    down = -(-len(claims) // across)
    figure = Figure(figsize=(max(4.6 * across, 7.5), 4.4 * down + 0.9), layout="constrained")
    axes = figure.subplots(down, across, squeeze=False, sharey=True).ravel()
    for ax in axes[len(claims) :]:
        ax.set_axis_off()
    for claim, ax in zip(claims, axes, strict=False):
        plot_power(table[table["claim"] == claim], ax=ax)
        ax.set_title(fill(claim, LETTERS_IN_A_LINE), loc="left", pad=16, fontsize=10)
    for ax in axes[::across]:
        ax.set_ylabel("chance of the verdict (share of simulations, 0–1)")
    handles = {
        str(handle.get_label()): handle
        for ax in axes
        for handle in ax.get_legend_handles_labels()[0]
    }
    figure.legend(
        handles=list(handles.values()),
        loc="outside upper center",
        ncols=3,
        frameon=False,
        fontsize=9,
    )
    figure.supxlabel(
        "bars: 95% intervals over simulations (Clopper–Pearson); verdicts over all textures "
        f"where no other is named; dotted line: {TARGET:.0%}",
        fontsize=9,
        color=GREY,
    )
    return figure


def plot_power(table: pd.DataFrame, *, ax: Axes | None = None) -> Axes:
    """One claim: a line for each verdict over all textures, and for each of `LABELS`.

    Parameters
    ----------
    table : DataFrame
        As for `figure_power`, of one claim.
    """
    ax = axes_or_new(ax)
    lines = {
        verdict: rows
        for verdict, rows in table[table["texture"] == ALL_TEXTURES].groupby("verdict")
    }
    lines |= {place: rows for place, rows in table.groupby("texture") if place in LABELS}
    ax.axhline(TARGET, color=BLACK, lw=1, ls=":")
    sizes = sorted(table["n"].unique())
    shown = [name for name in STYLES if name in lines]
    reach = (sizes[-1] - sizes[0]) or 1
    for place, name in enumerate(shown):
        rows, (colour, marker, kind) = lines[name], STYLES[name]
        aside = (place - (len(shown) - 1) / 2) * APART * reach
        below, above = rows["chance"] - rows["ci_low"], rows["ci_high"] - rows["chance"]
        ax.errorbar(
            rows["n"] + aside,
            rows["chance"],
            [below.clip(lower=0), above.clip(lower=0)],
            color=colour,
            marker=marker,
            ls=kind,
            capsize=2.5,
            ms=5,
            lw=1.6,
            label=LABELS.get(name, name),
        )
    ax.set_xlabel("participants")
    ax.set_xticks(sizes)
    ax.set_ylim(-0.03, 1.03)
    finish_axes(ax)
    stamp_if_simulated(ax, True)
    return ax
