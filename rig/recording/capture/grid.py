"""The grid of conditions that strokes are to fill, and which of its cells a hand is in.

docs/method/strokes.md#cells
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from tactileq.modeling.arrays import Bools, Floats, Integers
from tactileq.modeling.checks import (
    HIGHEST_FORCE_N,
    HIGHEST_SPEED_MM_S,
    check_keys,
    check_number,
    is_number,
)
from tactileq.modeling.errors import InputError, shown
from tactileq.modeling.files.documents import read_toml
from tactileq.modeling.models.grid import Condition, check_axes

SPEEDS_MM_S = (50.0, 100.0, 150.0, 200.0, 250.0, 300.0, 350.0)
FORCES_N = (0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5)
SPEED_TOLERANCE = 0.1
FORCE_TOLERANCE = 0.2
LARGEST_TOLERANCE = 0.5
MOST_STEPS = 50
NOWHERE = -1
_AXES = ("speeds_mm_s", "forces_n")
_TOLERANCES = ("speed_tolerance", "force_tolerance")
_CONDITIONS = "conditions"


@dataclass(frozen=True, eq=False)
class StrokeGrid:
    """Conditions to record, and how far from one a hand may be and still be in its cell.

    Parameters
    ----------
    speeds_mm_s, forces_n : (S,), (F,) array_like
        Rising, above 0; up to 50 of each.
    speed_tolerance, force_tolerance : float
        Shares (above 0, up to 0.5) of a condition's speed and force. A cell never reaches further
        than half-way to its neighbour.
    conditions : sequence of (speed, force)
        The cells to record, each of a speed and a force of the grid; none given means all. Kept
        force by force within a speed.

    Raises
    ------
    InputError
    """

    speeds_mm_s: Floats
    forces_n: Floats
    speed_tolerance: float = SPEED_TOLERANCE
    force_tolerance: float = FORCE_TOLERANCE
    conditions: Sequence[Condition] = ()

    def __post_init__(self) -> None:
        for name, highest in zip(_AXES, (HIGHEST_SPEED_MM_S, HIGHEST_FORCE_N), strict=True):
            axis = np.array(getattr(self, name), dtype=np.float64)
            if axis.ndim != 1 or axis.size > MOST_STEPS or (axis > highest).any():
                raise InputError(
                    f"expected 1 to {MOST_STEPS} values of at most {highest:g} in {name}, got "
                    f"{shown(getattr(self, name))}; correct the grid."
                )
            axis.setflags(write=False)
            object.__setattr__(self, name, axis)
        check_axes(self.speeds_mm_s, self.forces_n)
        for name in _TOLERANCES:
            check_number(name, getattr(self, name), low=0.01, high=LARGEST_TOLERANCE)
        object.__setattr__(self, "conditions", self._checked_conditions())

    def _checked_conditions(self) -> list[Condition]:
        every = list(product(self.speeds_mm_s.tolist(), self.forces_n.tolist()))
        given = set(self.conditions)
        if len(given) < len(self.conditions) or not given <= set(every):
            raise InputError(
                "expected conditions, each once, of a speed and a force of the grid, got "
                f"{shown(list(self.conditions))}; correct the grid."
            )
        return [pair for pair in every if pair in given or not given]

    @classmethod
    def default(cls) -> StrokeGrid:
        """50 to 350 mm/s and 0.5 to 3.5 N in seven steps each."""
        return cls(np.array(SPEEDS_MM_S), np.array(FORCES_N))

    @classmethod
    def load(cls, path: str | Path) -> StrokeGrid:
        """Read a TOML file with speeds_mm_s and forces_n, such as tactileq rig range writes.

        Raises
        ------
        InputError
        """
        values = read_toml(Path(path), "a grid (TOML)")
        check_keys(values, (*_AXES, *_TOLERANCES, _CONDITIONS, "exploration"), where=str(path))
        for name in _AXES:
            axis = values.get(name)
            if not isinstance(axis, list) or not all(is_number(value) for value in axis):
                raise InputError(
                    f"expected a list of numbers {name} in {path}, got {shown(axis)}; make the "
                    "file with tactileq rig range, or correct it."
                )
        given: dict[str, Any] = {name: values[name] for name in _TOLERANCES if name in values}
        if _CONDITIONS in values:
            given[_CONDITIONS] = _pairs(values[_CONDITIONS], path)
        speeds, forces = (np.array(values[name], dtype=np.float64) for name in _AXES)
        try:
            return cls(speeds, forces, **given)
        except InputError as error:
            raise InputError(f"{path}: {error}") from None

    @property
    def shape(self) -> tuple[int, int]:
        """Numbers of speeds and of forces."""
        return self.speeds_mm_s.size, self.forces_n.size

    @property
    def wanted(self) -> Bools:
        """(S, F) ndarray: which cells are to be recorded."""
        every = product(self.speeds_mm_s.tolist(), self.forces_n.tolist())
        wanted = set(self.conditions)
        return np.array([pair in wanted for pair in every]).reshape(self.shape)

    def cells(self, speed_mm_s: ArrayLike, force_n: ArrayLike) -> Integers:
        """Which wanted cell each of (n,) hands is in: its place in `conditions`, or `NOWHERE`.

        Parameters
        ----------
        speed_mm_s : (n,) array_like
            In either direction.
        force_n : (n,) array_like
            NaN in either is in no cell.
        """
        speed = np.abs(np.asarray(speed_mm_s, dtype=np.float64))
        row = _places(self.speeds_mm_s, speed, tolerance=self.speed_tolerance)
        column = _places(
            self.forces_n, np.asarray(force_n, dtype=np.float64), tolerance=self.force_tolerance
        )
        inside = (row != NOWHERE) & (column != NOWHERE)
        places = np.full(self.shape, NOWHERE)
        places[self.wanted] = np.arange(len(self.conditions))
        return np.where(inside, places[row, column], NOWHERE)

    def bounds(self) -> tuple[Floats, Floats]:
        """Lowest and highest value of each step of the speeds (2, S) and of the forces (2, F)."""
        return (
            _bounds(self.speeds_mm_s, self.speed_tolerance),
            _bounds(self.forces_n, self.force_tolerance),
        )

    def to_dict(self) -> dict[str, Any]:
        """What a file of the grid holds."""
        axes = {name: getattr(self, name).tolist() for name in _AXES}
        values = axes | {name: getattr(self, name) for name in _TOLERANCES}
        if not self.wanted.all():
            values[_CONDITIONS] = [list(pair) for pair in self.conditions]
        return values


def _pairs(given: Any, path: str | Path) -> list[Condition]:
    """The conditions that a file lists."""
    whole = isinstance(given, list) and all(isinstance(pair, list) for pair in given)
    if not (whole and given and all(len(p) == 2 and all(map(is_number, p)) for p in given)):
        raise InputError(
            f"expected a list of pairs {_CONDITIONS} such as [[60, 1.0]] in {path}, got "
            f"{shown(given)}; give a speed and a force of the grid in each, or leave it out to "
            "record all."
        )
    return [(float(speed), float(force)) for speed, force in given]


def _bounds(axis: Floats, tolerance: float) -> Floats:
    half = np.diff(axis) / 2
    low = np.maximum(axis * (1 - tolerance), axis - np.append(np.inf, half))
    high = np.minimum(axis * (1 + tolerance), axis + np.append(half, np.inf))
    return np.stack((low, high))


def _places(axis: Floats, values: Floats, *, tolerance: float) -> Integers:
    """Index of the step that holds each value: at least its low bound, below its high one."""
    low, high = _bounds(axis, tolerance)
    place = np.searchsorted(high, values, side="right")
    held = np.minimum(place, axis.size - 1)
    # NaN is sorted behind everything, and compares as False.
    inside = (place < axis.size) & (values >= low[held])
    return np.where(inside, held, NOWHERE)
