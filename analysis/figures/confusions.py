"""A confusion matrix: which textures were taken for which."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from tactileq.analysis.page.drawing import GREY, axes_or_new, stamp_if_simulated
from tactileq.analysis.statistics.confusion import ConfusionMatrix

SMALL_TEXT, TEXT = 7, 9
MANY = 9  # classes above which the text in cells is smaller
DARK = 65  # per cent above which text is white


def plot_confusion(matrix: ConfusionMatrix, *, simulated: bool, ax: Axes | None = None) -> Axes:
    """One confusion matrix: row shares in per cent with counts."""
    ax = axes_or_new(ax)
    shares = 100 * matrix.row_shares
    ax.imshow(shares, vmin=0, vmax=100, cmap="Blues", aspect="auto")
    size = SMALL_TEXT if len(matrix.textures) > MANY else TEXT
    for (row, column), share in np.ndenumerate(shares):
        text = f"{share:.0f}\n({matrix.counts[row, column]})" if np.isfinite(share) else "–"
        shade = "black" if not share > DARK else "white"
        shade = shade if np.isfinite(share) else GREY
        ax.text(column, row, text, ha="center", va="center", fontsize=size, color=shade)
    name_axes(ax, rows=matrix.rows, columns=matrix.textures)
    ax.set_xlabel("virtual surface answered")
    ax.set_ylabel("real surface presented")
    stamp_if_simulated(ax, simulated)
    return ax


def name_axes(ax: Axes, *, rows: Sequence[str], columns: Sequence[str]) -> None:
    ax.set_xticks(range(len(columns)), list(columns), rotation=30, ha="right")
    ax.set_yticks(range(len(rows)), list(rows))
