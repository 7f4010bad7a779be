"""What all figures share: colours, axes, legends, and the stamp on what is simulated."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

# Okabe and Ito's palette, distinguishable with any colour vision.
BLUE, VERMILLION, GREEN, ORANGE = "#0072B2", "#D55E00", "#009E73", "#E69F00"
PURPLE, SKY_BLUE, BLACK, GREY = "#CC79A7", "#56B4E9", "#000000", "#6E6E6E"
LAYER_COLOURS = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY_BLUE, BLACK)
LAYER_MARKERS = ("o", "s", "^", "D", "v", "P", "X")


def series_style(number: int) -> tuple[str, str]:
    """Colour and marker of the n-th layer or texture (from 0): 49 pairs before one repeats."""
    turn, place = divmod(number, len(LAYER_COLOURS))
    return LAYER_COLOURS[place], LAYER_MARKERS[(place + turn) % len(LAYER_MARKERS)]


def shared_legend(
    figure: Figure, axes: Iterable[Axes], *, loc: Any = "outside upper center", ncols: int = 2
) -> None:
    """One legend for the whole figure, of everything with a label in these axes."""
    handles = [handle for ax in axes for handle in ax.get_legend_handles_labels()[0]]
    figure.legend(handles=handles, loc=loc, ncols=ncols, frameon=False, fontsize=9)


def axes_or_new(ax: Axes | None) -> Axes:
    """The axes themselves, or those of a new figure."""
    return Figure(layout="constrained").subplots() if ax is None else ax


def log_frequency_axis(ax: Axes, highest_hz: float) -> None:
    """Frequency from 10 Hz to `highest_hz` along x, logarithmic."""
    ax.set_xscale("log")
    ax.set_xlim(10, highest_hz)
    ax.set_xlabel("frequency (Hz)")
    ticks = [f for f in (10, 30, 100, 300, 1000) if f < highest_hz]
    ax.set_xticks(ticks, [str(f) for f in ticks])
    ax.set_xticks([], minor=True)
    finish_axes(ax)


def finish_axes(ax: Axes) -> None:
    """No frame, light horizontal lines behind the data."""
    ax.spines[["top", "right"]].set_visible(False)
    ax.grid(axis="y", color=GREY, alpha=0.2)
    ax.set_axisbelow(True)


def stamp_if_simulated(ax: Axes, simulated: bool) -> None:
    """Mark simulated results, so that they cannot be mistaken for measured ones anywhere."""
    if simulated:
        ax.text(
            1.0,
            1.01,
            "SIMULATED",
            transform=ax.transAxes,
            ha="right",
            va="bottom",
            color=VERMILLION,
            weight="bold",
            fontsize=9,
        )
