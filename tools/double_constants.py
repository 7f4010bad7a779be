"""What changes if a tuned constant of the fit is doubled, one at a time: distance, layers, time.

On the drawn surfaces 3000 … 3010, which constants were chosen on and nothing is judged by. Prints a
line for each constant: ratio of the distance from the truth between the conditions (geometric mean
over the surfaces, then the worst surface), layers more or fewer over all surfaces, ratio of the
time of the fits. Ten minutes on one core.

Example: python tools/double_constants.py STIFFNESS PRIOR_CHANGE
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from tactileq.benches.chart.judging import judge
from tactileq.benches.chart.surfaces import Origin
from tactileq.modeling.estimation import coherent
from tactileq.modeling.fitting import field, growth, joint_grid, layer_search

SURFACES = range(3000, 3011)
CONSTANTS = {
    layer_search: (
        *("STIFFNESS", "LEAST_GAIN", "DECIDING_CONDITIONS", "STARTING_CONDITIONS"),
        *("MOST_SPREAD_LAYERS", "ALL_PATTERNS", "TRIED_SIGNS", "TRIED_GROWTH", "TRIED_REMOVALS"),
        *("TRIED_STARTS", "CONTENDERS", "ROUGH_ROUNDS", "NOT_WORSE"),
    ),
    joint_grid: (
        *("EM_ROUNDS", "LEAST_DIFFERENCE", "MUCH_UNEXPLAINED_DB", "STRAIGHT"),
        *("LARGEST_LEVEL_SD_DB", "LEAST_EVIDENCE", "CANCELLING_SHARE", "LEAST_LEFT"),
        *("REFIT_ROUNDS", "FADED", "TREND_ROUNDS"),
    ),
    growth: ("CELL", "CLEAR_EVIDENCE", "CANDIDATES"),
    field: ("PRIOR_CHANGE", "PRIOR_LEVEL_CHANGE", "FREEDOM", "RESTART_ROUNDS"),
    coherent: ("LARGEST_SHARE", "CANCELLING"),
}


@contextmanager
def doubled(name: str, value: float) -> Iterator[None]:
    """The constant twice as large in every module of modeling that has imported it."""
    holders = [
        module
        for module in list(sys.modules.values())
        if getattr(module, "__name__", "").startswith("modeling")
        and vars(module).get(name) == value
    ]
    for module in holders:
        setattr(module, name, 2 * value)
    try:
        yield
    finally:
        for module in holders:
            setattr(module, name, value)


def fitted() -> tuple[np.ndarray, int, float]:
    """Distances (dB) of all surfaces, layers of all of them, and the time that their fits took."""
    distances, layers, seconds = [], 0, 0.0
    for number in SURFACES:
        rows = judge(Origin("drawn", f"drawn {number}", number), methods=("joint",)).rows
        default = rows[rows["default_blending"]].iloc[0]
        seconds += default["fit_ms"]
        distances.append(default["between_distance_db"])
        layers += int(default["layers"])
    return np.array(distances), layers, seconds


def main(wanted: list[str]) -> None:
    distances, layers, seconds = fitted()
    print(f"{'as it is':22} {np.exp(np.log(distances).mean()):.3f} dB, {layers} layers")
    for module, names in CONSTANTS.items():
        for name in names:
            if wanted and name not in wanted:
                continue
            with doubled(name, getattr(module, name)):
                there, count, took = fitted()
            ratios = there / distances
            print(
                f"{name:22} {np.exp(np.log(ratios).mean()):.3f} (worst {ratios.max():.2f}), "
                f"{count - layers:+d} layers, time {took / seconds:.2f}",
                flush=True,
            )


if __name__ == "__main__":
    main(sys.argv[1:])
