"""Figures of spectra: model, recording, layers and threshold."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullLocator

from tactileq.analysis.labels import MODELS
from tactileq.analysis.page.drawing import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    PURPLE,
    SKY_BLUE,
    VERMILLION,
    axes_or_new,
    log_frequency_axis,
    shared_legend,
    stamp_if_simulated,
)
from tactileq.analysis.spectra.comparison import SpectrumComparison, SpectrumPanel
from tactileq.modeling.errors import counted
from tactileq.modeling.recordings.spectrum import HIGH_PASS_HZ

PANELS_IN_A_ROW = 3
JUST_FELT_DASHES = (0, (1.2, 0.5))  # dense, since these lines are short
LEAST_LABEL_RATIO = 1.65  # of two frequencies whose labels stand side by side on a log axis
# Recordings are modelled and drawn behind it, so a model drawn beside one has to be, too.
BEHIND_HIGH_PASS = f"model, with the recording's {HIGH_PASS_HZ:g} Hz high-pass"
AMPLITUDE_LABELS = {
    "energy": "sinusoid of the change of power",
    "paper-fft": "single-sided FFT amplitude of the peak",
    "paper-gain": "gain G read as an amplitude",
}


def figure_spectra_and_threshold(comparison: SpectrumComparison) -> Figure:
    """Recording, both models and the threshold (PAPER fig. 6): spectra above, layers below."""
    figure = Figure(figsize=(10.5, 7), layout="constrained")
    axes = figure.subplots(2, 2, sharex=True, sharey="row")
    for column, model in enumerate(MODELS):
        plot_model_spectrum(comparison, model=model, ax=axes[0, column])
        plot_layers_and_threshold(comparison, model=model, ax=axes[1, column])
        axes[0, column].set_xlabel("")
    for ax in axes[:, 1]:
        ax.set_ylabel("")
    shared_legend(figure, axes[:, 0], loc="outside lower center", ncols=3)
    figure.suptitle(
        f"{comparison.texture}, {comparison.speed_mm_s:g} mm/s, {comparison.force_n:g} N"
    )
    return figure


def plot_model_spectrum(
    comparison: SpectrumComparison, *, model: str, ax: Axes | None = None
) -> Axes:
    """One model (full or simplified) and the recording, smoothed; its layers and their thresholds.

    The threshold stands at each layer as the gain with which that layer, were it alone, would be
    just felt.
    """
    ax = axes_or_new(ax)
    frequency, response = comparison.frequency_hz, getattr(comparison, model)
    recorded = bool(np.isfinite(comparison.recording).any())
    if recorded:
        ax.plot(frequency, comparison.recording, color=GREY, lw=2.5, label="recording")
    ax.plot(
        frequency,
        response,
        color=BLUE,
        lw=1.5,
        ls="--",
        label=BEHIND_HIGH_PASS if recorded else "model",
    )
    labels = {False: "layer alone, not smoothed", True: "dropped layer alone"}
    for layer, dropped in enumerate(comparison.dropped):
        if dropped and model == "simplified":
            continue
        ax.plot(
            frequency,
            comparison.layer_response[layer],
            color=VERMILLION if dropped else SKY_BLUE,
            ls=":" if dropped else "-",
            lw=1.2,
            label=labels.pop(bool(dropped), None),
        )
        ax.plot(
            frequency,
            comparison.layer_threshold[layer],
            color=GREEN,
            lw=2.4,
            ls=JUST_FELT_DASHES,
            label="" if layer else "gain at which the layer alone would just be felt",
        )
    # Far skirts of layers must not stretch the axis.
    lowest, highest = (
        response.min(),
        max(response.max(), np.nanmax(comparison.recording, initial=0)),
    )
    ax.set_ylim(lowest / 5, 3 * highest)
    log_frequency_axis(ax, frequency[-1])
    ax.set_yscale("log")
    ax.set_ylabel("magnitude (g per unit noise),\nmodel and recording smoothed")
    ax.set_title(f"({'a' if model == 'full' else 'b'}) {model} model", loc="left")
    stamp_if_simulated(ax, comparison.simulated)
    return ax


def plot_layers_and_threshold(
    comparison: SpectrumComparison, *, model: str = "full", ax: Axes | None = None
) -> Axes:
    """Amplitude of each layer by the criterion (stems at f) against the threshold.

    By `energy` the one of the change of power by dropping it, which the criterion compares with
    the threshold at all frequencies of the change.
    """
    ax = axes_or_new(ax)
    threshold = comparison.threshold
    ax.plot(
        threshold.frequency_hz,
        threshold.acceleration_g,
        color=BLACK,
        label=f"detection threshold ({threshold.name})",
    )
    end, last = threshold.frequency_hz[-1], threshold.acceleration_g[-1]
    if comparison.hold_above and end < comparison.frequency_hz[-1]:
        ax.plot(
            [end, comparison.frequency_hz[-1]],
            [last, last],
            color=PURPLE,
            lw=2.0,
            ls="--",
            label="assumed lower bound of the threshold",
        )
    # A layer without power must not stretch the axis: weaker ones stand on its lower edge.
    bottom = float(threshold.acceleration_g.min()) / 1000
    _plot_stems(ax, comparison, bottom=bottom, with_dropped=model == "full")
    ax.axvspan(
        threshold.frequency_hz[-1],
        comparison.frequency_hz[-1],
        color=GREY,
        alpha=0.12,
        label="no threshold known",
    )
    log_frequency_axis(ax, comparison.frequency_hz[-1])
    ax.set_yscale("log")
    ax.set_ylim(bottom, 3 * max(threshold.acceleration_g.max(), *comparison.layer_amplitude_g, 0))
    ax.set_ylabel(f"{AMPLITUDE_LABELS[comparison.criterion]}\n(g peak)")
    stamp_if_simulated(ax, comparison.simulated)
    return ax


def _plot_stems(
    ax: Axes, comparison: SpectrumComparison, *, bottom: float, with_dropped: bool
) -> None:
    """Numbered stems from the bottom of the axes up to each layer's amplitude."""
    labels = {False: "layer, kept", True: "layer, dropped by simplification"}
    for dropped, label in labels.items() if with_dropped else [(False, labels[False])]:
        colour = VERMILLION if dropped else BLUE
        chosen = comparison.dropped == dropped
        if not chosen.any():
            continue
        frequency = comparison.layer_frequency_hz[chosen]
        top = np.maximum(comparison.layer_amplitude_g[chosen], bottom)
        ax.vlines(frequency, bottom, top, color=colour, ls=":" if dropped else "-")
        ax.plot(
            frequency,
            top,
            ls="",
            color=colour,
            marker="X" if dropped else "o",
            mfc="white" if dropped else colour,
            ms=8,
            label=label,
        )
        for number, at in zip(
            np.flatnonzero(chosen) + 1, zip(frequency, top, strict=True), strict=True
        ):
            ax.annotate(
                str(number),
                at,
                xytext=(0, 8),
                textcoords="offset points",
                ha="center",
                bbox={"fc": "white", "ec": "none", "alpha": 0.7, "pad": 0.6},
            )


def figure_spectra(panels: Sequence[SpectrumPanel]) -> Figure:
    """Small multiples: each condition's smoothed spectrum with its layers marked."""
    columns = min(PANELS_IN_A_ROW, len(panels))
    rows = -(-len(panels) // columns)
    figure = Figure(figsize=(max(3.4 * columns, 5), 2.6 * rows + 0.4), layout="constrained")
    first = None
    for number, panel in enumerate(panels):
        ax = figure.add_subplot(rows, columns, number + 1, sharex=first, sharey=first)
        first = first or ax
        plot_spectrum_panel(panel, ax=ax)
        lowest_of_its_column = number + columns >= len(panels)
        ax.tick_params(labelleft=number % columns == 0, labelbottom=lowest_of_its_column)
        if number % columns:
            ax.set_ylabel("")
        if not lowest_of_its_column:
            ax.set_xlabel("")
    shared_legend(figure, figure.axes[:1], loc="outside lower center", ncols=3)
    return figure


def plot_spectrum_panel(panel: SpectrumPanel, *, ax: Axes | None = None) -> Axes:
    """Smoothed spectrum of one condition; triangles mark its layers, numbers are their Hz.

    The dashed line is the response of the model that was fitted to the whole grid, if there is one.
    """
    ax = axes_or_new(ax)
    ax.plot(panel.frequency_hz, panel.magnitude, color=GREY, lw=1.5, label="recording, smoothed")
    ax.plot(
        panel.layer_frequency_hz,
        panel.layer_height * 1.25,
        ls="",
        marker="v",
        color=VERMILLION,
        label="layer found in it alone (Hz)",
    )
    if panel.response.size:
        ax.plot(
            panel.frequency_hz, panel.response, color=BLUE, lw=1.2, ls="--", label=BEHIND_HIGH_PASS
        )
    labelled = 0.0
    for x, y in zip(panel.layer_frequency_hz, panel.layer_height, strict=True):
        if x > LEAST_LABEL_RATIO * labelled:
            labelled = x
            ax.annotate(
                f"{x:.0f}",
                (x, y * 1.25),
                xytext=(0, 6),
                textcoords="offset points",
                ha="center",
                fontsize=8,
            )
    count = panel.layer_frequency_hz.size
    found = f"{counted(count, 'layer')} found alone"
    ax.text(0.98, 0.9, found, transform=ax.transAxes, ha="right", fontsize=8)
    log_frequency_axis(ax, panel.frequency_hz[-1])
    ax.set_yscale("log")
    # Few ticks: drawing them takes most of the time that a grid of 49 panels takes.
    ax.yaxis.set_major_locator(LogLocator(subs=(1, 3)))
    ax.yaxis.set_major_formatter("{x:g}")
    ax.yaxis.set_minor_locator(NullLocator())
    ax.margins(y=0.25)
    ax.set_ylabel(f"magnitude\n({panel.unit} per unit noise)")
    ax.set_title(panel.title, loc="left", fontsize=9)
    stamp_if_simulated(ax, panel.simulated)
    return ax
