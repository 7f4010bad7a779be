"""The contact sheet of a stimulus set: all its spectra; draws and computes nothing."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tactileq.analysis.page.drawing import (
    BLACK,
    BLUE,
    LAYER_COLOURS,
    ORANGE,
    axes_or_new,
    log_frequency_axis,
    shared_legend,
    stamp_if_simulated,
)
from tactileq.analysis.spectra.contact_sheet import LINE_HZ, ContactSheet

COLOURS = (BLUE, ORANGE, *LAYER_COLOURS[1:4], *LAYER_COLOURS[5:])
DASHES = ("-", "--", ":", "-.")
# Below the loudest line of the set; what is weaker yet is nothing that anybody feels.
RANGE_DB = 45.0


def figure_contact_sheet(sheet: ContactSheet) -> Figure:
    """One panel per texture (rows) and trajectory (columns), the models overlaid."""
    rows, columns = len(sheet.textures), len(sheet.trajectories)
    size = (max(2.7 * columns + 1.2, 6.0), 1.45 * rows + 2.0)
    figure = Figure(figsize=size, layout="constrained")
    axes = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    for row in range(rows):
        for column in range(columns):
            plot_stimuli(sheet, row, column=column, ax=axes[row, column])
            axes[row, column].label_outer()
        stamp_if_simulated(axes[row, -1], bool(sheet.simulated[row]))
        axes[row, 0].set_ylabel(sheet.textures[row])
    for column, trajectory in enumerate(sheet.trajectories):
        axes[0, column].set_title(trajectory, loc="left", fontsize=9)
    shared_legend(figure, [axes[0, 0]], loc="outside lower center", ncols=4)
    reference = "g²/Hz" if sheet.unit == "g" else "Hz⁻¹, arbitrary"
    of_what = " of the drive" if sheet.compensated else ""
    # In two lines: no longer than a figure of one row is high.
    figure.supylabel(
        f"power spectral density{of_what}\n(dB re 1 {reference}), {LINE_HZ:g} Hz lines", fontsize=9
    )
    figure.suptitle(_title(sheet), fontsize=10)
    return figure


def _title(sheet: ContactSheet) -> str:
    lines = [f"Stimulus set {sheet.name}"]
    if sheet.compensated:
        lines.append("compensated for its vibrator; levels are those intended at the hand")
    unit = "1 g" if sheet.unit == "g" else "1, arbitrary unit"
    return "\n".join([*lines, f"numbers: RMS level (dB re {unit}), in the legend's order"])


def plot_stimuli(sheet: ContactSheet, texture: int, *, column: int, ax: Axes | None = None) -> Axes:
    """Spectra of all models of one texture on one trajectory, with their levels."""
    ax = axes_or_new(ax)
    for number, model in enumerate(sheet.models):
        colour = COLOURS[number % len(COLOURS)]
        density_db = sheet.density_db[texture, column, number]
        dashes = DASHES[number % len(DASHES)]
        ax.plot(sheet.frequency_hz, density_db, color=colour, ls=dashes, lw=1.3, label=model)
    levels = sheet.level_db[texture, column]
    text = " / ".join(f"{level:.1f}" if np.isfinite(level) else "none" for level in levels)
    ax.text(0.03, 0.05, text.replace("-", "−"), transform=ax.transAxes, color=BLACK, fontsize=8)
    log_frequency_axis(ax, float(sheet.frequency_hz[-1]))
    highest = np.max(sheet.density_db, where=np.isfinite(sheet.density_db), initial=-200.0)
    ax.set_ylim(highest - RANGE_DB, highest + 5)
    return ax
