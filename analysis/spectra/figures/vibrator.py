"""A vibrator before and after its compensation (PAPER eq. 7); draws and computes nothing."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tactileq.analysis.page.drawing import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    VERMILLION,
    axes_or_new,
    log_frequency_axis,
    shared_legend,
    stamp_if_simulated,
)
from tactileq.analysis.spectra.vibrator import CompensatedVibrator

MISTUNED_STYLES = ((ORANGE, (0, (5, 2))), (VERMILLION, (0, (1, 1))), (GREEN, "-."))
LOWEST_DB, HIGHEST_DB = -30.0, 20.0
BARS_DB = (-27.5, -24.5)


def figure_vibrator(shown: CompensatedVibrator) -> Figure:
    """Response before and after, tuned and mistuned, with the flat bands; coherence beneath."""
    figure = Figure(figsize=(8.5, 7.5), layout="constrained")
    response, coherence = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1))
    plot_compensation(shown, ax=response)
    plot_coherence(shown, ax=coherence)
    response.set_xlabel("")
    shared_legend(figure, [response, coherence], loc="outside lower center")
    vibrator = shown.vibrator
    title = "Simulated vibrator" if vibrator.simulated else "Vibrator"
    figure.suptitle(
        f"{title}: resonance at {vibrator.frequency_hz:.1f} Hz, {vibrator.bandwidth_hz:.1f} Hz "
        f"wide, {vibrator.height:.2f} times the flat part"
    )
    return figure


def plot_compensation(shown: CompensatedVibrator, *, ax: Axes | None = None) -> Axes:
    """Response in dB re the flat part; bars mark the bands in which it is flat."""
    ax = axes_or_new(ax)
    frequency, within = shown.vibrator.curve_hz, shown.within_db
    ax.axhspan(-within, within, color=GREY, alpha=0.15, lw=0)
    ax.plot(frequency, shown.before_db, color=BLACK, lw=1.4, label="without compensation")
    for (colour, dashes), off, curve in zip(
        MISTUNED_STYLES, shown.mistunings, shown.mistuned_db, strict=False
    ):
        label = f"with a notch {abs(off):.0%} too {'high' if off > 0 else 'low'}"
        ax.plot(frequency, curve, color=colour, ls=dashes, lw=1.6, label=label)
    ax.plot(frequency, shown.after_db, color=BLUE, lw=2.4, label="with compensation")
    bands = ((shown.flat_before_hz, BLACK, "without"), (shown.flat_after_hz, BLUE, "with"))
    for (band, colour, which), height_db in zip(bands, BARS_DB, strict=True):
        label = f"flat to ±{within:g} dB {which}: {band[0]:.0f} to {band[1]:.0f} Hz"
        ax.plot(band, (height_db, height_db), color=colour, marker="|", ms=9, lw=4, label=label)
    ax.set_ylim(LOWEST_DB, max(HIGHEST_DB, float(shown.before_db.max()) + 3))
    ax.set_ylabel("response re flat part (dB)")
    log_frequency_axis(ax, float(frequency[-1]))
    stamp_if_simulated(ax, shown.vibrator.simulated)
    return ax


def plot_coherence(shown: CompensatedVibrator, *, ax: Axes | None = None) -> Axes:
    """Coherence of drive and acceleration, the band that was fitted, and what is asked for."""
    ax = axes_or_new(ax)
    vibrator = shown.vibrator
    label = f"fitted: {vibrator.lowest_hz:.0f} to {vibrator.highest_hz:.0f} Hz"
    ax.axvspan(vibrator.lowest_hz, vibrator.highest_hz, color=PURPLE, alpha=0.25, lw=0, label=label)
    ax.plot(vibrator.curve_hz, vibrator.curve_coherence, color=BLACK, lw=1.2)
    least = f"least median: {shown.least_coherence:g}"
    ax.axhline(shown.least_coherence, color=VERMILLION, ls="--", lw=1.2, label=least)
    ax.set_ylim(0, 1.05)
    ax.set_ylabel("coherence γ²")
    log_frequency_axis(ax, float(vibrator.curve_hz[-1]))
    return ax
