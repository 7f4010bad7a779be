"""A hand that follows a script: the test source, whose readings are marked simulated."""

from __future__ import annotations

from math import cos, pi
from pathlib import Path
from typing import Protocol

import numpy as np

from tactileq.modeling.arrays import Floats
from tactileq.modeling.errors import InputError, shown
from tactileq.modeling.files.columns import Column, names
from tactileq.modeling.files.others.declared import read_user_table
from tactileq.rig.devices.hand.sample import Sample
from tactileq.rig.devices.hand.settings import SCRIPTS, HandSettings
from tactileq.rig.devices.hand.tracking import REST_S
from tactileq.rig.shared.live.clock import now_s, sleep

RATE_HZ = 1000
_LARGEST = 1e6  # of any number in a table
SCRIPT_COLUMNS = tuple(
    Column(name, unit=unit, description=description, limits=(-_LARGEST, _LARGEST), required=True)
    for name, unit, description in (
        ("time_s", "s", "Rising; the first moment is when the device is opened"),
        ("x_mm", "mm", "Position along x"),
        ("y_mm", "mm", "Position along y"),
        ("force_n", "N", "Normal force; the hand is lifted where it is 0 or less"),
    )
)
_MOST_AT_ONCE = 1000  # after a longer pause, as when the process was stopped, the rest is left out


class Script(Protocol):
    """Where a hand is, and how it presses, at a time (s) since it began."""

    def at(self, time_s: float) -> tuple[float, float, float]:
        """Position (mm, mm) and force (N); no force where the hand is lifted."""


class Strokes:
    """Back and forth along x, as a sine of speed, which begins at rest."""

    def __init__(self, speed_mm_s: float, force_n: float, *, per_s: float) -> None:
        self._angular = 2 * pi * per_s
        self._reach_mm = speed_mm_s / self._angular
        self._force_n = force_n

    def at(self, time_s: float) -> tuple[float, float, float]:
        """Position and force at a time."""
        return self._reach_mm * (1 - cos(self._angular * time_s)), 0.0, self._force_n


class Steady:
    """Always onward along x, at constant speed and force."""

    def __init__(self, speed_mm_s: float, force_n: float) -> None:
        self._speed_mm_s = speed_mm_s
        self._force_n = force_n

    def at(self, time_s: float) -> tuple[float, float, float]:
        """Position and force at a time."""
        return self._speed_mm_s * time_s, 0.0, self._force_n


class ScriptedTrajectory:
    """A hand that was written down, played once; afterwards it is lifted.

    Parameters
    ----------
    time_s, x_mm, y_mm, force_n : (n,) ndarray
        Two or more moments, rising; straight lines between them.
    """

    def __init__(self, time_s: Floats, x_mm: Floats, *, y_mm: Floats, force_n: Floats) -> None:
        rows = np.array([time_s, x_mm, y_mm, force_n], dtype=float)
        outside = rows[~(np.abs(rows) <= _LARGEST)]  # so is NaN
        if outside.size:
            raise InputError(
                f"expected numbers within ±{_LARGEST:g} in a trajectory, got {outside[0]:g}; "
                "correct its table."
            )
        if rows.shape[1] < 2 or (np.diff(rows[0]) <= 0).any():
            raise InputError(
                "expected two or more moments of rising time in a trajectory, got "
                f"{shown(rows[0].tolist())}; correct its table."
            )
        self._rows = rows

    @classmethod
    def load(cls, path: str | Path) -> ScriptedTrajectory:
        """From a table with the columns time_s, x_mm, y_mm and force_n."""
        rows = read_user_table(path, SCRIPT_COLUMNS, what="a table")
        time_s, x_mm, y_mm, force_n = (
            np.array([row[name] for row in rows], dtype=float) for name in names(SCRIPT_COLUMNS)
        )
        return cls(time_s, x_mm, y_mm=y_mm, force_n=force_n)

    def at(self, time_s: float) -> tuple[float, float, float]:
        """Position and force at a time since the first moment."""
        moments, *columns = self._rows
        moment = moments[0] + time_s
        x_mm, y_mm, force_n = (float(np.interp(moment, moments, column)) for column in columns)
        return x_mm, y_mm, force_n if moment <= moments[-1] else 0.0


class ScriptedHand:
    """A device that plays a script at 1 kHz from the moment at which it is opened."""

    name = "scripted hand"
    rest_s = REST_S
    firmware = ""

    def __init__(self, script: Script) -> None:
        self._script = script
        self._start_s = now_s()
        self._given = 0

    @classmethod
    def open(cls, settings: HandSettings) -> ScriptedHand:
        """The hand that the settings describe."""
        return cls(script_of(settings))

    def wait(self, seconds: float) -> None:
        """Until the next sample is due."""
        due_s = self._start_s + self._given / RATE_HZ - now_s()
        sleep(min(max(due_s, 0.0), seconds))

    def read(self) -> list[Sample]:
        """The samples that are due."""
        due = int((now_s() - self._start_s) * RATE_HZ) + 1
        first = max(self._given, due - _MOST_AT_ONCE)
        self._given = due
        return [self._sample(index / RATE_HZ) for index in range(first, due)]

    def counts(self) -> dict[str, int]:
        """Nothing can be lost."""
        return {}

    def close(self) -> None:
        """Nothing to give back."""

    def _sample(self, time_s: float) -> Sample:
        x_mm, y_mm, force_n = self._script.at(time_s)
        return Sample(self._start_s + time_s, x_mm, y_mm, force_n=force_n, contact=force_n > 0)


def script_of(settings: HandSettings) -> Script:
    """The script that is named in the settings."""
    if settings.script not in SCRIPTS:
        return ScriptedTrajectory.load(settings.script)
    if settings.script == "hold":
        return Steady(settings.speed_mm_s, settings.force_n)
    return Strokes(settings.speed_mm_s, settings.force_n, per_s=settings.strokes_per_s)
