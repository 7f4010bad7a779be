"""Figure of a study on simulated devices: the recorder's errors, models beside the direct route."""

from __future__ import annotations

import pandas as pd
from matplotlib.figure import Figure

from tactileq.analysis.page.drawing import (
    BLACK,
    BLUE,
    GREY,
    ORANGE,
    finish_axes,
    stamp_if_simulated,
)

TOLERANCE_PERCENT = 2.0


def figure_recorder(records: pd.DataFrame, near: pd.DataFrame) -> Figure:
    """Errors of force and speed over all records, and the models' distances to the truth.

    Parameters
    ----------
    records : DataFrame
        `tactileq.rig.machines.recorder.store.RECORDER_COLUMNS`, of a simulated recorder.
    near : DataFrame
        `tactileq.benches.recorder.tables.NEAR_COLUMNS`.
    """
    figure = Figure(figsize=(12.6, 4.4), layout="constrained")
    force, speed, models = figure.subplots(1, 3, width_ratios=(1, 1, 1.2))
    for ax, name, what, unit, colour, marker in (
        (force, "force_n", "force", "N", BLUE, "o"),
        (speed, "speed_mm_s", "speed", "mm/s", ORANGE, "s"),
    ):
        off = 100 * (records[f"true_{name}"] / records[name] - 1)
        ax.axhspan(-TOLERANCE_PERCENT, TOLERANCE_PERCENT, color=GREY, alpha=0.2, lw=0)
        ax.axhline(0.0, color=GREY, lw=0.8)
        ax.plot(records[name], off, marker, color=colour, ms=4, mew=0, alpha=0.5)
        ax.set_xlabel(f"{what} asked for ({unit})")
        ax.set_ylabel(f"true mean {what}, error (%)")
        finish_axes(ax)
        stamp_if_simulated(ax, simulated=True)
    places = range(len(near))
    for column, label, colour, marker in (
        ("direct_db", "in silico, directly", BLACK, "x"),
        ("recorder_db", "from the recorder", BLUE, "o"),
    ):
        models.plot(near[column], places, marker, color=colour, ms=7, mfc="none", label=label)
    models.set_yticks(list(places), list(near["texture"]))
    models.invert_yaxis()
    models.set_xlim(left=0)
    models.set_xlabel("RMS distance of the model to the truth (dB)")
    models.legend(loc="best")
    finish_axes(models)
    stamp_if_simulated(models, simulated=True)
    return figure
