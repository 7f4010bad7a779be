"""Which estimator finds the layers, how well, and how fast.

Simulated: random spectra whose layers are known, of three kinds of truth, 200 of each, 1 s long.

Example: python docs/studies/estimators_study.py writes estimators_study.tsv and .png beside this
file and prints the table.
"""

from __future__ import annotations

from pathlib import Path

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from threadpoolctl import threadpool_limits

from analysis.benches.estimators import ALL_KINDS, FROM_THE_TRUTH, estimators_table
from analysis.figures.drawing import (
    LAYER_COLOURS,
    LAYER_MARKERS,
    finish_axes,
    shared_legend,
)
from analysis.figures.drawing import stamp_if_simulated as stamp

TEXTURES = 200
SEED = 1


def figure_of(table: pd.DataFrame) -> Figure:
    """Distance from the spectrum against time, one panel per kind of truth."""
    kinds = [kind for kind in table["kind"].unique() if kind != ALL_KINDS]
    figure = Figure(figsize=(10, 4), layout="constrained")
    panels = figure.subplots(1, len(kinds), sharey=True)
    for ax, kind in zip(panels, kinds, strict=True):
        shown = table[(table["kind"] == kind) & (table["estimator"] != FROM_THE_TRUTH)]
        _panel(ax, shown, title=f"{kind} truth")
    panels[0].set_ylabel("log-spectral distance\nto the record (dB)")
    shared_legend(figure, panels[:1], ncols=5)
    stamp(panels[-1], simulated=True)
    return figure


def _panel(ax: Axes, table: pd.DataFrame, *, title: str) -> None:
    for number, row in enumerate(table.itertuples()):
        ax.loglog(
            row.milliseconds,
            row.log_spectral_distance_db,
            LAYER_MARKERS[number],
            color=LAYER_COLOURS[number],
            markersize=9,
            label=row.estimator,
        )
    ticks = [0.5, 1, 2, 5, 10]
    ax.set_yticks(ticks, [f"{tick:g}" for tick in ticks])
    ax.set_ylim(0.3, 15)
    times = [0.2, 0.5, 1, 2, 5]
    ax.set_xticks(times, [f"{time:g}" for time in times])
    ax.minorticks_off()
    ax.set_xlabel("time for one spectrum (ms)")
    ax.set_title(title, loc="left", fontsize=10)
    finish_axes(ax)


def main() -> None:
    """Run the study and write its table and picture."""
    with threadpool_limits(limits=1):
        table = estimators_table(textures=TEXTURES, seed=SEED)
    target = Path(__file__).with_suffix(".tsv")
    table.to_csv(target, sep="\t", index=False, na_rep="n/a", float_format="%.5g")
    figure_of(table).savefig(target.with_suffix(".png"), dpi=110)
    print(table.round(4).to_string(index=False))


if __name__ == "__main__":
    main()
