"""Speed and force of a hand over time: constant, or recorded."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from pathlib import Path

import numpy as np

from tactileq.modeling.arrays import Floats
from tactileq.modeling.errors import InputError, shown
from tactileq.modeling.files.columns import Column, names
from tactileq.modeling.files.others.declared import read_user_table
from tactileq.modeling.hand import Hand

LONGEST_S = 3600.0
TRAJECTORY_COLUMNS = (
    Column("time_s", unit="s", description="Rising", limits=(-inf, inf), nan=True, required=True),
    Column(
        "speed_mm_s",
        unit="mm/s",
        description="Tangential speed, its sign the direction; nan: lift-off",
        limits=(-inf, inf),
        nan=True,
        required=True,
    ),
    Column(
        "force_n",
        unit="N",
        description="Normal force; nan: lift-off",
        limits=(-inf, inf),
        nan=True,
        required=True,
    ),
)


@dataclass(frozen=True, eq=False)
class Trajectory:
    """A stroke: speed and force at n ≥ 2 rising times, linear in between.

    Parameters
    ----------
    time_s : (n,) array_like
        Finite and rising, over at most an hour; it may begin anywhere.
    speed_mm_s, force_n : (n,) array_like
        Tangential speed (either direction) and normal force. NaN counts as lift-off, as does all
        that is interpolated from it.

    Raises
    ------
    InputError
        Naming what is wrong with the times.
    """

    name: str
    time_s: Floats
    speed_mm_s: Floats
    force_n: Floats

    def __post_init__(self) -> None:
        for name in names(TRAJECTORY_COLUMNS):
            value = np.array(getattr(self, name), dtype=np.float64)
            value.setflags(write=False)
            object.__setattr__(self, name, value)
        wrong = self._what_is_wrong()
        if wrong:
            raise InputError(
                "expected at least two rising times, with a speed and a force at each, in the "
                f"trajectory {shown(self.name)}, got {wrong}; correct it."
            )
        if not 0 < self.duration_s <= LONGEST_S:
            raise InputError(
                f"expected a trajectory of at most {LONGEST_S:g} s, got {self.duration_s:g} s in "
                f"{shown(self.name)}; cut it, and check that the times are in seconds."
            )

    def _what_is_wrong(self) -> str:
        """The first reason why these are no trajectory; empty where they are one."""
        shapes = {self.time_s.shape, self.speed_mm_s.shape, self.force_n.shape}
        if len(shapes) != 1 or self.time_s.ndim != 1:
            return f"arrays of shapes {', '.join(map(str, sorted(shapes)))}"
        if self.time_s.size < 2:
            return f"{self.time_s.size} of them"
        if not np.isfinite(self.time_s).all():
            return f"the time {self.time_s[~np.isfinite(self.time_s)][0]} s"
        falls = np.diff(self.time_s) <= 0
        at = int(np.argmax(falls))
        return f"{self.time_s[at + 1]:g} s after {self.time_s[at]:g} s" if falls.any() else ""

    @property
    def duration_s(self) -> float:
        """From the first time to the last."""
        return float(self.time_s[-1] - self.time_s[0])

    @property
    def highest_speed_mm_s(self) -> float:
        """In either direction; 0 where the hand is never on the surface."""
        return _highest(np.abs(self.speed_mm_s))

    @property
    def highest_force_n(self) -> float:
        """0 where the hand is never on the surface."""
        return _highest(self.force_n)

    def at(self, elapsed_s: Floats) -> Hand:
        """The hand at (n,) times since the start.

        Before the start and after the end the first and the last condition are held.
        """
        time_s = self.time_s[0] + elapsed_s
        hand = (np.interp(time_s, self.time_s, v) for v in (self.speed_mm_s, self.force_n))
        return Hand(*(np.asarray(values, dtype=np.float64) for values in hand))


def _highest(values: Floats) -> float:
    return float(values[np.isfinite(values)].max(initial=0.0))


def load_trajectory(path: str | Path, *, name: str) -> Trajectory:
    """Read a CSV with the columns time_s, speed_mm_s and force_n (nan: lift-off).

    Raises
    ------
    InputError
        For a missing file, missing columns, cells that are no numbers, or times that do not rise.
    """
    rows = read_user_table(path, TRAJECTORY_COLUMNS, what="a trajectory (CSV)")
    time_s, speed_mm_s, force_n = (
        np.array([row[column] for row in rows], dtype=np.float64)
        for column in names(TRAJECTORY_COLUMNS)
    )
    return Trajectory(name, time_s, speed_mm_s, force_n)
