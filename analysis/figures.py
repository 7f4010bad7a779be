"""Figures of the study; each draws what it is given and computes nothing (PAPER fig. 6, 9–11)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullLocator
from numpy.typing import NDArray

from analysis.comparison import LayerCourse, SpectrumComparison, SpectrumPanel
from analysis.drawing import (
    BLACK,
    BLUE,
    GREY,
    LAYER_COLOURS,
    LAYER_MARKERS,
    ORANGE,
    SKY_BLUE,
    VERMILLION,
    axes_or_new,
    finish_axes,
    log_frequency_axis,
    shared_legend,
    stamp_if_simulated,
)
from analysis.load import MODELS, SCALES
from analysis.statistics import ALL_TEXTURES, ConfusionMatrix

MODEL_COLOURS = {"full": BLUE, "simplified": ORANGE}
MODEL_HATCHES = {"full": "", "simplified": "///"}
LEVELS = ((0.001, "***"), (0.01, "**"), (0.05, "*"))
LEGEND_OF_MARKS = "* p < .05, ** p < .01, *** p < .001: paired t-test, Holm over the textures"
BAR_WIDTH = 0.38
PANELS_IN_A_ROW = 3
LEAST_LABEL_RATIO = 1.65  # of two frequencies whose labels stand side by side on a log axis
AMPLITUDE_LABELS = {
    "energy": "amplitude of the sinusoid of equal power",
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

    The threshold stands at each layer as the gain with which that layer would be just felt, so a
    layer is above threshold where its own response peaks above it.
    """
    ax = axes_or_new(ax)
    frequency, response = comparison.frequency_hz, getattr(comparison, model)
    if np.isfinite(comparison.recording).any():
        ax.plot(frequency, comparison.recording, color=GREY, lw=2.5, label="recording")
    ax.plot(frequency, response, color=BLUE, lw=1.5, ls="--", label="model")
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
            color=BLACK,
            lw=1.2,
            label="" if layer else "gain at which the layer here would be just felt",
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
    """Amplitude of the model's layers by the criterion (stems at f) against the threshold."""
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
            color=BLACK,
            ls="--",
            label="assumed lower bound",
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


def figure_ratings(tests: pd.DataFrame, *, simulated: bool) -> Figure:
    """Rated similarity, both scales, before and after simplification (PAPER fig. 9).

    Parameters
    ----------
    tests : DataFrame
        From `statistics.rating_tests`.
    simulated : bool
        Written into the figure.
    """
    figure = Figure(figsize=(10.5, 4.6), layout="constrained")
    for panel, ax, scale in zip("ab", figure.subplots(1, 2), SCALES.values(), strict=True):
        chosen = tests[tests["scale"] == scale]
        plot_paired_bars(chosen, simulated=simulated, ax=ax)
        ax.set_title(f"({panel}) {scale}", loc="left")
        ax.set_ylabel(f"rated similarity of {scale} (0–100)")
        ax.set_ylim(0, 115)
        ax.set_yticks(range(0, 101, 20))
    shared_legend(figure, figure.axes[:1])
    figure.supxlabel(f"mean ± standard error. {LEGEND_OF_MARKS}", fontsize=9, color=GREY)
    return figure


def figure_correct_rates(tests: pd.DataFrame, *, simulated: bool, chance: float = 1 / 7) -> Figure:
    """Correct rates before and after simplification against chance (PAPER fig. 11).

    Parameters
    ----------
    tests : DataFrame
        From `statistics.rate_tests`; the row over all textures is left out.
    simulated : bool
        Written into the figure.
    chance : float
        Rate of a guessing participant, drawn as a line.
    """
    figure = Figure(figsize=(8, 4.6), layout="constrained")
    ax = figure.subplots()
    plot_paired_bars(tests[tests["texture"] != ALL_TEXTURES], simulated=simulated, ax=ax)
    ax.axhline(chance, color=BLACK, ls="--", lw=1)
    ax.text(1.0, chance, f" chance\n {chance:.1%}", transform=ax.get_yaxis_transform(), va="center")
    ax.set_ylabel("correct rate (share of trials, 0–1)")
    ax.set_ylim(0, 1.15)
    ax.set_yticks(np.arange(0, 1.01, 0.2))
    shared_legend(figure, figure.axes[:1])
    figure.supxlabel(f"mean ± standard error. {LEGEND_OF_MARKS}", fontsize=9, color=GREY)
    return figure


def plot_paired_bars(tests: pd.DataFrame, *, simulated: bool, ax: Axes | None = None) -> Axes:
    """Mean ± standard error per texture, full beside simplified, with significance marks."""
    ax = axes_or_new(ax)
    place = np.arange(len(tests))
    for side, model in zip((-0.5, 0.5), MODELS, strict=True):
        ax.bar(
            place + side * BAR_WIDTH,
            tests[f"mean_{model}"],
            BAR_WIDTH,
            yerr=tests[f"se_{model}"].fillna(0.0),
            capsize=3,
            color=MODEL_COLOURS[model],
            hatch=MODEL_HATCHES[model],
            edgecolor="white",
            label=f"{model} model",
        )
    columns = zip(MODELS, ("se_full", "se_simplified"), strict=True)
    tops = [tests[f"mean_{model}"] + tests[se].fillna(0.0) for model, se in columns]
    for x, full_top, top, p in zip(place, *tops, tests["p_holm"], strict=True):
        _significance_bracket(ax, float(x), top=max(full_top, top), p=float(p))
    ax.set_xticks(place, list(tests["texture"]), rotation=30, ha="right")
    ax.set_xlabel("texture")
    finish_axes(ax)
    stamp_if_simulated(ax, simulated)
    return ax


def _significance_bracket(ax: Axes, x: float, *, top: float, p: float) -> None:
    mark = next((mark for level, mark in LEVELS if p < level), "")
    if mark:
        ax.annotate(
            "",
            (x - BAR_WIDTH / 2, top),
            (x + BAR_WIDTH / 2, top),
            arrowprops={
                "arrowstyle": "-",
                "connectionstyle": "bar,fraction=0.25",
                "shrinkB": 3,
                "shrinkA": 3,
            },
        )
        ax.annotate(
            mark, (x, top), xytext=(0, 8), textcoords="offset points", ha="center", va="bottom"
        )


def figure_confusion(matrices: Mapping[str, ConfusionMatrix], *, simulated: bool) -> Figure:
    """Who was taken for whom, full beside simplified (PAPER fig. 10)."""
    figure = Figure(figsize=(12.5, 6.2), layout="constrained")
    axes = figure.subplots(1, 2, sharey=True)
    for panel, ax, model in zip("ab", axes, MODELS, strict=True):
        plot_confusion(matrices[model], simulated=simulated, ax=ax)
        ax.set_title(f"({panel}) {model} model", loc="left")
    axes[1].set_ylabel("")
    bar = figure.colorbar(axes[1].images[0], ax=axes, shrink=0.8, pad=0.01)
    bar.set_label("share of the row's answers (%)")
    chance = 1 / len(matrices["full"].textures)
    figure.supxlabel(
        f"rows: real surface presented; columns: virtual surface answered; each row adds up to "
        f"100%; chance {chance:.1%}; in brackets: number of answers",
        fontsize=9,
        color=GREY,
    )
    return figure


def plot_confusion(matrix: ConfusionMatrix, *, simulated: bool, ax: Axes | None = None) -> Axes:
    """One confusion matrix: row shares in per cent with counts."""
    ax = axes_or_new(ax)
    shares = 100 * matrix.row_shares
    ax.imshow(shares, vmin=0, vmax=100, cmap="Blues", aspect="auto")
    for (row, column), share in np.ndenumerate(shares):
        text = f"{share:.0f}\n({matrix.counts[row, column]})" if np.isfinite(share) else "–"
        shade = "black" if not share > 55 else "white"
        shade = shade if np.isfinite(share) else GREY
        ax.text(column, row, text, ha="center", va="center", fontsize=9, color=shade)
    names = list(matrix.textures)
    ax.set_xticks(range(len(names)), names, rotation=30, ha="right")
    ax.set_yticks(range(len(names)), names)
    ax.set_xlabel("virtual surface answered")
    ax.set_ylabel("real surface presented")
    stamp_if_simulated(ax, simulated)
    return ax


def figure_layer_courses(courses: Sequence[LayerCourse]) -> Figure:
    """Frequency and amplitude of each layer over speed at one force.

    Parameters
    ----------
    courses : sequence of LayerCourse
        The first is drawn with markers, a second one (such as the planted truth) as thin lines.
    """
    figure = Figure(figsize=(10.5, 4.2), layout="constrained")
    axes = figure.subplots(1, 2)
    plot_layer_course(courses, quantity="frequency_hz", ax=axes[0])
    plot_layer_course(courses, quantity="amplitude", ax=axes[1])
    shared_legend(figure, axes[:1], loc="outside right center", ncols=1)
    figure.suptitle(f"{courses[0].texture}, {courses[0].force_n:g} N")
    return figure


def plot_layer_course(
    courses: Sequence[LayerCourse], *, quantity: str, ax: Axes | None = None
) -> Axes:
    """One quantity (frequency_hz or amplitude) of each layer over speed."""
    ax = axes_or_new(ax)
    for course, solid in zip(courses, (True, False), strict=False):
        values: NDArray[np.float64] = getattr(course, quantity)
        for layer in range(values.shape[1]):
            ax.plot(
                course.speeds_mm_s,
                values[:, layer],
                color=LAYER_COLOURS[layer % 7] if solid else BLACK,
                marker=LAYER_MARKERS[(layer + layer // 7) % 7] if solid else "",
                ls="-" if solid else "--",
                lw=1.6 if solid else 0.9,
                label=f"{course.label}, layer {layer + 1}" if solid or layer == 0 else None,
            )
            if not solid and layer == 0:
                ax.lines[-1].set_label(course.label)
    frequency = quantity == "frequency_hz"
    unit = courses[0].unit if courses[0].unit == "arbitrary" else "g peak"
    ax.set_ylabel("frequency (Hz)" if frequency else f"amplitude, sinusoid of equal power ({unit})")
    ax.set_xlabel("speed (mm/s)")
    ax.set_ylim(bottom=0)
    finish_axes(ax)
    stamp_if_simulated(ax, any(course.simulated for course in courses))
    return ax


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
            panel.frequency_hz, panel.response, color=BLUE, lw=1.2, ls="--", label="model, smoothed"
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
    ax.text(0.98, 0.9, f"{count} layer{'s' * (count != 1)}", transform=ax.transAxes, ha="right")
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
