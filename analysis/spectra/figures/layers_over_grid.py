"""Figures of a model's layers over its grid of speeds and forces; they draw and compute nothing."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator

from tactileq.analysis.page.drawing import (
    BLACK,
    GREY,
    axes_or_new,
    finish_axes,
    series_style,
    stamp_if_simulated,
)
from tactileq.analysis.spectra.layers_over_grid import LayersOverGrid
from tactileq.modeling.arrays import Bools

QUANTITIES = ("frequency_hz", "amplitude")
# Marker, filling, size and meaning of the marks on points that are no measurements.
MARKS = (
    ("o", "white", 4, "frequency inherited"),
    ("x", "none", 5, "not resolved"),
    ("s", "none", 7, "no recording, interpolated"),
)


def figure_layers_over_grid(layers: LayersOverGrid) -> Figure:
    """Frequency and amplitude of each layer against speed: its mean, and a light line per force."""
    figure = Figure(figsize=(11, 5), layout="constrained")
    for quantity, ax in zip(QUANTITIES, figure.subplots(1, 2), strict=True):
        plot_layers_over_grid(layers, quantity=quantity, ax=ax)
    figure.legend(handles=_legend(layers), loc="outside right center", frameon=False, fontsize=9)
    forces = f"{layers.forces_n[0]:g} to {layers.forces_n[-1]:g} N"
    figure.suptitle(
        f"{layers.texture}: layers over the grid, {forces} (estimator {layers.estimator})"
    )
    return figure


def plot_layers_over_grid(layers: LayersOverGrid, *, quantity: str, ax: Axes | None = None) -> Axes:
    """One quantity (frequency_hz or amplitude) of each layer against speed.

    Thick: mean over the forces; thin: each force. Open circles mark inherited frequencies, crosses
    layers that were not resolved, squares conditions without a recording.
    """
    ax = axes_or_new(ax)
    if (getattr(layers, quantity) > 0).any():
        # An amplitude of 0 has no place on the axis; its line has a gap there.
        ax.set_yscale("log", nonpositive="mask")
        ax.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        ax.yaxis.set_major_formatter("{x:g}")
        ax.yaxis.set_minor_formatter("")
    for layer in range(layers.inherited.shape[2]):
        _plot_layer(layers, quantity=quantity, layer=layer, ax=ax)
    ax.set_xticks(layers.speeds_mm_s, [f"{speed:g}" for speed in layers.speeds_mm_s])
    ax.set_xlabel("speed (mm/s)")
    unit = "arbitrary" if layers.unit == "arbitrary" else "g peak"
    frequency = quantity == "frequency_hz"
    ax.set_ylabel("frequency (Hz)" if frequency else f"amplitude, sinusoid of equal power ({unit})")
    finish_axes(ax)
    stamp_if_simulated(ax, layers.simulated)
    return ax


def _plot_layer(layers: LayersOverGrid, *, quantity: str, layer: int, ax: Axes) -> None:
    """Lines of one layer, and marks on those of its points that are no measurements."""
    speeds = layers.speeds_mm_s
    colour, marker = series_style(layer)
    values = getattr(layers, quantity)[:, :, layer]
    ax.plot(speeds, values, color=colour, lw=0.7, alpha=0.35)
    mean = getattr(layers, f"mean_{quantity}")[:, layer]
    ax.plot(speeds, mean, color=colour, marker=marker, lw=2.0)
    for marked, (mark, filling, size, _) in zip(_marked(layers), MARKS, strict=True):
        speed, force = np.broadcast_to(marked, layers.inherited.shape)[:, :, layer].nonzero()
        ax.plot(
            speeds[speed],
            values[speed, force],
            ls="",
            color=colour,
            marker=mark,
            mfc=filling,
            ms=size,
            mew=0.8,
        )


def _marked(layers: LayersOverGrid) -> tuple[Bools, ...]:
    """What `MARKS` stand for, in their order."""
    return layers.inherited, layers.unresolved, layers.interpolated[:, :, None]


def _legend(layers: LayersOverGrid) -> list[Line2D]:
    """Layers by colour and marker, and what the marks mean as far as any are drawn."""
    handles = []
    for layer in range(layers.inherited.shape[2]):
        colour, marker = series_style(layer)
        label = f"layer {layer + 1}, mean over forces"
        handles.append(Line2D([], [], color=colour, marker=marker, lw=2.0, label=label))
    handles.append(Line2D([], [], color=GREY, lw=0.7, label="the same at each force"))
    for marked, (mark, filling, _, label) in zip(_marked(layers), MARKS, strict=True):
        if marked.any():
            handles.append(
                Line2D([], [], ls="", marker=mark, mfc=filling, color=BLACK, label=label)
            )
    return handles
