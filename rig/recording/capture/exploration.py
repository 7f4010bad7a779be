"""What a hand does when it explores freely, and the grid to record that follows from it.

docs/method/strokes.md#range
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from tactileq.modeling.arrays import Floats
from tactileq.modeling.checks import check_whole
from tactileq.modeling.errors import InputError
from tactileq.rig.recording.capture.cutting import LONGEST_GAP_S, Readings, on_surface
from tactileq.rig.recording.capture.grid import MOST_STEPS, StrokeGrid
from tactileq.rig.recording.capture.recorder import RESTING_MM_S
from tactileq.rig.shared.live.memory import FORCE_ASSUMED, SIMULATED

PERCENTILES = (5, 25, 50, 75, 95)
LEAST_S = 5.0
# Steps of the grid are rounded to these, so that they are easy to read and to communicate.
_SPEED_STEP_MM_S = 5.0
_FORCE_STEP_N = 0.05


@dataclass(frozen=True, eq=False)
class Exploration:
    """The moving hand on the surface: speed and force at moments that are evenly spaced in time.

    Parameters
    ----------
    speed_mm_s, force_n : (n,) ndarray
        Speed without direction.
    seconds : float
        For which the hand moved on the surface.
    force_assumed, simulated : bool
        As the readings say.
    """

    speed_mm_s: Floats
    force_n: Floats
    seconds: float
    force_assumed: bool
    simulated: bool

    @property
    def speed_percentiles_mm_s(self) -> dict[str, float]:
        """5th, 25th, 50th, 75th and 95th percentile, by "p5" … "p95"."""
        return _percentiles(self.speed_mm_s)

    @property
    def force_percentiles_n(self) -> dict[str, float]:
        """The same of the force."""
        return _percentiles(self.force_n)

    def to_dict(self) -> dict[str, Any]:
        """What a file of the grid says of it."""
        return {
            "seconds": round(self.seconds, 2),
            "speed_percentiles_mm_s": self.speed_percentiles_mm_s,
            "force_percentiles_n": self.force_percentiles_n,
            "force_assumed": self.force_assumed,
            "simulated": self.simulated,
        }


def explored(readings: Readings) -> Exploration:
    """What free strokes say; rest, turning round and lifting off (below 5 mm/s) are left out.

    Parameters
    ----------
    readings : (n,) ndarray of READING
        In order of time.

    Raises
    ------
    InputError
        If the hand moved on the surface for less than 5 s.
    """
    steps = np.diff(readings["time_s"], append=readings["time_s"][-1:])
    speed = np.abs(readings["speed_mm_s"])
    moving = on_surface(readings) & (speed > RESTING_MM_S) & (steps <= LONGEST_GAP_S)
    seconds = float(steps[moving].sum())
    if seconds < LEAST_S:
        raise InputError(
            f"expected a hand that strokes the surface for {LEAST_S:g} s at least, got "
            f"{seconds:.1f} s; stroke it as if to find out what it is, and for longer."
        )
    # Devices report more often while the hand moves, so each reading counts by its time.
    even = np.searchsorted(np.cumsum(steps[moving]), np.arange(0.0, seconds, 0.005), side="right")
    chosen = readings[moving][even.clip(max=int(moving.sum()) - 1)]
    flags = chosen["flags"]
    return Exploration(
        np.abs(chosen["speed_mm_s"]),
        np.asarray(chosen["force_n"], dtype=np.float64),
        seconds,
        force_assumed=bool((flags & FORCE_ASSUMED).any()),
        simulated=bool((flags & SIMULATED).any()),
    )


def grid_for(exploration: Exploration, *, speeds: int = 7, forces: int = 7) -> StrokeGrid:
    """The grid up to the 95th percentile of speed and force, evenly spaced.

    It begins at the 5th percentile, but not below the 95th divided by the number of steps, and is
    rounded to 5 mm/s and 0.05 N where the steps are large enough. An assumed force is one value.

    Parameters
    ----------
    speeds, forces : int
        Numbers of steps, 1 to 50.

    Raises
    ------
    InputError
        For more steps than the hand's range can hold.
    """
    for what, count in (("the number of speeds", speeds), ("the number of forces", forces)):
        check_whole(what, count, low=1, high=MOST_STEPS)
    rows = _axis(exploration.speed_mm_s, speeds, step=_SPEED_STEP_MM_S, what="a speed")
    if exploration.force_assumed:
        return StrokeGrid(rows, np.array([float(np.median(exploration.force_n))]))
    columns = _axis(exploration.force_n, forces, step=_FORCE_STEP_N, what="a force")
    return StrokeGrid(rows, columns)


def grid_text(grid: StrokeGrid, exploration: Exploration | None = None) -> str:
    """The text of a grid's file (TOML), which `StrokeGrid.load` reads."""
    lines = ["# Conditions to record: tactileq record FOLDER --audio --grid THIS_FILE"]
    lines += [f"{name} = {_toml(value)}" for name, value in grid.to_dict().items()]
    if exploration is not None:
        lines += ["", "[exploration] # what a hand did freely; percentiles of the moving hand"]
        lines += [f"{name} = {_toml(value)}" for name, value in exploration.to_dict().items()]
    return "\n".join(lines) + "\n"


def _axis(values: Floats, count: int, *, step: float, what: str) -> Floats:
    """Even steps up to the 95th percentile; of one step: the median."""
    low, middle, high = np.percentile(values, (5, 50, 95))
    if count == 1:
        return np.array([_rounded(middle, step)])
    # Each stroke passes low speeds when it turns, so that the 5th percentile may be next to rest.
    exact = np.linspace(max(low, high / count), high, count)
    if exact[1] - exact[0] < 0.01 * high:
        raise InputError(
            f"expected {what} that varies to take {count} steps of it, got {low:.3g} to "
            f"{high:.3g}; vary it, or ask for fewer steps."
        )
    rounded = np.array([_rounded(value, step) for value in exact])
    # Steps that rounding would move by more than a fifth of their distance stay as they are.
    far = np.abs(rounded - exact).max() > (exact[1] - exact[0]) / 5
    return np.round(exact if far else rounded, 3)


def _rounded(value: float, step: float) -> float:
    return round(step * max(round(value / step), 1), 3)


def _percentiles(values: Floats) -> dict[str, float]:
    found = np.percentile(values, PERCENTILES).round(3).tolist()
    return {f"p{share}": value for share, value in zip(PERCENTILES, found, strict=True)}


def _toml(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_toml(one)}" for key, one in value.items()) + " }"
    return repr(value)
