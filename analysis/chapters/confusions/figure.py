"""Figures of confusions, and of the similarities that follow."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tactileq.analysis.figures.confusions import DARK, TEXT, name_axes, plot_confusion
from tactileq.analysis.page.drawing import GREY, stamp_if_simulated
from tactileq.analysis.statistics.confusion import ConfusionMatrix
from tactileq.modeling.arrays import Floats

CELL_INCHES = 0.62


def figure_confusion(matrices: Mapping[str, ConfusionMatrix], *, simulated: bool) -> Figure:
    """Which textures were taken for which, a panel for each set of models (PAPER fig. 10).

    Parameters
    ----------
    matrices : mapping of set to ConfusionMatrix
        Over the same textures; one at least.
    simulated : bool
        Written into the figure.
    """
    textures = next(iter(matrices.values())).textures
    figure, axes = _panels(len(matrices), len(textures))
    for panel, ax, model in zip("abcdefgh", axes, matrices, strict=False):
        plot_confusion(matrices[model], simulated=simulated, ax=ax)
        ax.set_title(f"({panel}) {model} model", loc="left")
    for ax in axes[1:]:
        ax.set_ylabel("")
    bar = figure.colorbar(axes[-1].images[0], ax=axes, shrink=0.8, pad=0.01)
    bar.set_label("share of the row's answers (%)")
    figure.supxlabel(
        f"rows: real surface presented; columns: virtual surface answered; each row sums to "
        f"100%; chance {1 / len(textures):.1%}; in brackets: number of answers",
        fontsize=9,
        color=GREY,
    )
    return figure


def figure_similarities(
    similarities: Mapping[str, Floats], textures: Sequence[str], *, simulated: bool
) -> Figure:
    """Similarities of the choice model, a panel for each set of models.

    Parameters
    ----------
    similarities : mapping of set to (k, k) ndarray
        0 … 1 and more, NaN where there is none (`similarity_choice.SimilarityChoice`).
    textures : sequence of str
        Names of the k classes.
    simulated : bool
        Written into the figure.
    """
    figure, axes = _panels(len(similarities), len(textures))
    for panel, ax, model in zip("abcdefgh", axes, similarities, strict=False):
        values = similarities[model]
        # Each pair once: neither the first row nor the last column would hold any.
        below = np.where(np.tri(len(textures) - 1, dtype=bool), values[1:, :-1], np.nan)
        ax.imshow(below, vmin=0, vmax=1, cmap="Blues", aspect="auto")
        for (row, column), value in np.ndenumerate(below):
            if column > row:
                continue
            text = f"{value:.2f}" if np.isfinite(value) else "–"
            shade = "white" if value > DARK / 100 else "black"
            ax.text(column, row, text, ha="center", va="center", fontsize=TEXT, color=shade)
        name_axes(ax, rows=textures[1:], columns=textures[:-1])
        ax.set_title(f"({panel}) {model} model", loc="left")
        ax.spines[:].set_visible(False)
        stamp_if_simulated(ax, simulated)
    bar = figure.colorbar(axes[-1].images[0], ax=axes, shrink=0.8, pad=0.01)
    bar.set_label("similarity η (0: never confused, 1: not told apart)")
    return figure


def _panels(count: int, classes: int) -> tuple[Figure, list[Axes]]:
    """So many matrices of so many classes side by side."""
    side = max(4.8, CELL_INCHES * classes)
    figure = Figure(figsize=(side * count + 2.9, side + 1.4), layout="constrained")
    axes = figure.subplots(1, count, sharey=True, squeeze=False)
    return figure, list(axes[0])
