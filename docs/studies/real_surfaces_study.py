"""How close models of real surfaces are at the recorded conditions, and between them.

Simulated: random surfaces with the statistics of 100 real ones and no layers of their own
(`tactileq.stimuli.planted.drawn`), whose spectra are known at every speed and force.

Example: python docs/studies/real_surfaces_study.py writes real_surfaces_study*.tsv and .png beside
this file and prints the tables.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tactileq.analysis.page.drawing import (
    LAYER_COLOURS,
    LAYER_MARKERS,
    finish_axes,
    shared_legend,
)
from tactileq.analysis.page.drawing import stamp_if_simulated as stamp
from tactileq.analysis.textures.between import FilterAt, halfway, truth_summary
from tactileq.modeling import Recording, RecordingSet, fit_ar, fit_texture
from tactileq.modeling.arrays import Floats
from tactileq.modeling.fitting.spectral_field import fit_spectral_field
from tactileq.modeling.models.grid import Condition
from tactileq.modeling.threads import one_linear_algebra_thread
from tactileq.stimuli.planted.drawn import (
    FORCES_N,
    SPEEDS_MM_S,
    DrawnSurface,
    alter_surface,
    draw_surface,
)

SURFACES = 40
FIRST = 1000  # surfaces that no constant of the estimator was chosen by
FREQUENCY_HZ = np.arange(15.0, 481.0)
MODELS = (
    "joint",
    "joint, 2 layers",
    "joint, 3 layers",
    "AR(6)",
    "AR(20)",
    "field of spectra",
    "paper",
    "paper-consistent",
)
# Few speeds: three are recorded at two forces, two others are predicted.
SPEED_RANGE, FORCE_RANGE = (50.0, 350.0), (0.5, 3.5)
FEW_SPEEDS, FEW_FORCES, HIDDEN_SPEEDS = (50.0, 150.0, 350.0), (1.0, 2.5), (90.0, 230.0)
Conditions = Sequence[Condition]


def fitted(records: RecordingSet, name: str) -> tuple[FilterAt, int]:
    """One of `MODELS` of these records, and its numbers per condition: of a field, its bands."""
    if name.startswith("AR"):
        order = int(name[3:-1])
        return fit_ar(records, order=order).filter, order + 1
    if name == "field of spectra":
        field = fit_spectral_field(records)
        return field.filter, field.n_parameters
    estimator, _, layers = name.partition(", ")
    model = fit_texture(
        records, estimator=estimator, layers=int(layers.split()[0]) if layers else None
    )
    return model.peq, 1 + 3 * model.n_layers


def compared(
    surface: DrawnSurface, records: RecordingSet, places: dict[str, Conditions]
) -> list[dict[str, Any]]:
    """Every model of these records against the surface, at the places named: one row each."""
    rows = []
    for name in MODELS:
        start = perf_counter()
        filter_at, numbers = fitted(records, name)
        row: dict[str, Any] = {"surface": surface.name, "model": name, "numbers": numbers}
        row["milliseconds_a_record"] = 1e3 * (perf_counter() - start) / len(records)
        for place, conditions in places.items():
            distance, level, worst = truth_summary(
                filter_at, surface, conditions, frequency_hz=FREQUENCY_HZ
            )
            row |= {place: distance, f"{place}_level": level, f"{place}_worst_level": worst}
        rows.append(row)
    return rows


def whole_grid(seed: int) -> list[dict[str, Any]]:
    """7 × 7 conditions: at them and half-way between them."""
    return on_whole_grid(draw_surface(seed), seed)


def altered(seed: int) -> list[dict[str, Any]]:
    """The same of surfaces that are shifted in frequency and have resonances and lines besides."""
    return on_whole_grid(alter_surface(seed), seed)


def on_whole_grid(surface: DrawnSurface, seed: int) -> list[dict[str, Any]]:
    """Every model of one surface, recorded at 7 × 7 conditions."""
    nodes = [(v, f) for v in SPEEDS_MM_S for f in FORCES_N]
    places = {"at": nodes, "between": halfway(list(SPEEDS_MM_S), list(FORCES_N))}
    return compared(surface, surface.record(seed=seed), places)


def every_second_node(seed: int) -> list[dict[str, Any]]:
    """4 × 4 of the 7 × 7 conditions recorded: at the 33 others."""
    surface = draw_surface(seed)
    known = {(v, f) for v in SPEEDS_MM_S[::2] for f in FORCES_N[::2]}
    hidden = [(v, f) for v in SPEEDS_MM_S for f in FORCES_N if (v, f) not in known]
    records = RecordingSet(r for r in surface.record(seed=seed) if r.condition in known)
    return compared(surface, records, {"between": hidden})


def few_speeds(seed: int) -> list[dict[str, Any]]:
    """3 × 2 conditions: at two speeds between them."""
    surface = draw_surface(seed)
    records = surface.record(FEW_SPEEDS, FEW_FORCES, seed=seed)
    nodes = [(v, f) for v in FEW_SPEEDS for f in FEW_FORCES]
    hidden = [(v, f) for v in HIDDEN_SPEEDS for f in FEW_FORCES]
    return compared(surface, records, {"at": nodes, "between": hidden})


def scattered(seed: int) -> list[dict[str, Any]]:
    """20 to 35 random conditions, a tenth of them hidden: `joint`, the field, AR(20) at the others.

    The last rival blends the log spectra of AR(20) by the inverse distance in log speed and log
    force, or by its square.
    """
    rng, surface = np.random.default_rng([seed, 7]), draw_surface(seed)
    count = int(rng.integers(20, 36))
    axes = [np.exp(rng.uniform(*np.log(ends), count)) for ends in (SPEED_RANGE, FORCE_RANGE)]
    places = [(float(v), float(f)) for v, f in zip(*axes, strict=True)]
    records = [
        next(iter(surface.record([v], [f], seed=int(rng.integers(1 << 30))))) for v, f in places
    ]
    hidden = max(2, round(0.1 * count))
    rows = []
    for name, (log_response, numbers, time) in _predictors(records[hidden:]).items():
        off = []
        for v, f in places[:hidden]:
            true = surface.magnitude(FREQUENCY_HZ, speed_mm_s=v, force_n=f)
            off.append(20 / np.log(10) * (log_response(v, f) - np.log(true)))
        level = np.abs(np.mean(off, axis=1))
        rows.append(
            {
                "surface": surface.name,
                "model": name,
                "numbers": numbers,
                "milliseconds_a_record": time,
                "between": float(np.sqrt(np.mean(np.square(off)))),
                "between_level": float(np.median(level)),
                "between_worst_level": float(level.max()),
            }
        )
    return rows


def _predictors(
    records: Sequence[Recording],
) -> dict[str, tuple[Callable[[float, float], Floats], int, float]]:
    """What predicts `scattered`: log response anywhere, numbers per condition, fitting time."""
    found: dict[str, tuple[Callable[[float, float], Floats], int, float]] = {}
    for name in ("joint", "field of spectra"):
        start = perf_counter()
        filter_at, numbers = fitted(RecordingSet(records), name)
        time = 1e3 * (perf_counter() - start) / len(records)
        found[name] = (partial(_log_response, filter_at), numbers, time)
    start = perf_counter()
    levels = [
        _log_response(fit_ar(RecordingSet([r]), order=20).filter, *r.condition) for r in records
    ]
    time = 1e3 * (perf_counter() - start) / len(records)
    logs = np.log([r.condition for r in records])

    def blended(v: float, f: float, *, power: int) -> Floats:
        away = np.linalg.norm(logs - np.log([v, f]), axis=1)
        return np.asarray(np.average(levels, axis=0, weights=away**-power))

    for name, power in {"AR(20), inverse distance": 1, "its square": 2}.items():
        found[name] = (partial(blended, power=power), 21, time)
    return found


def _log_response(filter_at: FilterAt, speed_mm_s: float, force_n: float) -> Floats:
    return np.asarray(np.log(filter_at(speed_mm_s, force_n).response(FREQUENCY_HZ)))


def summary(rows: Sequence[dict[str, Any]]) -> pd.DataFrame:
    """Per model: median and 95th percentile over surfaces, and the worst level of all."""
    table = pd.DataFrame(rows)
    by_model = table.groupby("model", sort=False)
    found = pd.DataFrame({"numbers": by_model["numbers"].median()})
    for place in ("at", "between"):
        if place not in table:
            continue
        found[f"{place}_db"] = by_model[place].median()
        found[f"{place}_95th_db"] = by_model[place].quantile(0.95)
        found[f"{place}_level_db"] = by_model[f"{place}_level"].median()
        found[f"{place}_worst_level_db"] = by_model[f"{place}_worst_level"].max()
    found["milliseconds_a_record"] = by_model["milliseconds_a_record"].median()
    return found.reset_index().assign(surfaces=table["surface"].nunique(), simulated=True)


def figure_of(table: pd.DataFrame) -> Figure:
    """Distance from the truth against fitting time, at and between the conditions."""
    figure = Figure(figsize=(10, 4.4), layout="constrained")
    panels = figure.subplots(1, 2, sharey=True)
    titles = {"at": "at the recorded conditions", "between": "half-way between them"}
    for ax, (place, title) in zip(panels, titles.items(), strict=True):
        _panel(ax, table, place=place)
        ax.set_title(title, loc="left", fontsize=10)
    panels[0].set_ylabel("log-spectral distance\nfrom the truth (dB)")
    shared_legend(figure, panels[:1], ncols=4)
    stamp(panels[-1], simulated=True)
    return figure


def _panel(ax: Axes, table: pd.DataFrame, *, place: str) -> None:
    """Markers at medians over the surfaces, bars up to the 95th percentile."""
    for number, row in table.iterrows():
        median = row[f"{place}_db"]
        colour = LAYER_COLOURS[int(number) % len(LAYER_COLOURS)]
        ax.errorbar(
            row["milliseconds_a_record"],
            median,
            yerr=[[0.0], [row[f"{place}_95th_db"] - median]],
            fmt=LAYER_MARKERS[int(number) % len(LAYER_MARKERS)],
            color=colour,
            # Colours and markers are used up once.
            markerfacecolor=colour if int(number) < len(LAYER_COLOURS) else "white",
            capsize=3,
            markersize=8,
            label=f"{row['model']} ({row['numbers']:.0f} numbers)",
        )
    ax.set_xscale("log")
    ax.set_yscale("log")
    times, distances = [1, 3, 10, 30], [0.3, 0.5, 1, 2, 5, 10]
    ax.set_xticks(times, [f"{time:g}" for time in times])
    ax.set_yticks(distances, [f"{distance:g}" for distance in distances])
    ax.set_xlim(1, 60)
    ax.minorticks_off()
    ax.set_xlabel("fitting time a record (ms)")
    finish_axes(ax)


def run(make: Callable[[int], list[dict[str, Any]]], surfaces: int) -> pd.DataFrame:
    """The summary of one of the cases over this many surfaces."""
    return summary([row for n in range(surfaces) for row in make(FIRST + n)])


def main() -> None:
    """Run the study and write its tables and picture."""
    stem = Path(__file__).with_suffix("")
    cases = {"": whole_grid, "_every_second": every_second_node, "_few_speeds": few_speeds}
    cases |= {"_scattered": scattered, "_altered": altered}
    for suffix, make in cases.items():
        with one_linear_algebra_thread():
            table = run(make, SURFACES)
        table.to_csv(f"{stem}{suffix}.tsv", sep="\t", index=False, float_format="%.4g")
        print(f"{make.__name__}\n{table.round(3).to_string(index=False)}", flush=True)
        if not suffix:
            figure_of(table).savefig(stem.with_suffix(".png"), dpi=110)


if __name__ == "__main__":
    main()
