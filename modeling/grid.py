"""Grids of speeds and forces: their axes and holes (METHOD 5), between and beyond (METHOD 9)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from modeling.errors import GridError, InputError

Floats = NDArray[np.float64]
Condition = tuple[float, float]


class Hand(NamedTuple):
    """Speeds (n,) and forces (n,) within a grid, and the share (n,) of the level that is left."""

    speed_mm_s: Floats
    force_n: Floats
    ramp: Floats


def check_axes(speeds_mm_s: Floats, forces_n: Floats) -> None:
    """Refuse a grid that is not at least 2 × 2 rising finite values above 0.

    Raises
    ------
    InputError
    """
    for name, axis in (("speeds_mm_s", speeds_mm_s), ("forces_n", forces_n)):
        rising = axis.ndim == 1 and axis.size >= 2 and bool((np.diff(axis) > 0).all())
        if not rising or not (axis[0] > 0 and np.isfinite(axis).all()):
            raise InputError(
                f"expected at least two rising values above 0 in {name}, got "
                f"{axis.tolist()}; a model needs a grid of at least 2 × 2."
            )


def within_grid(
    speeds_mm_s: Floats, forces_n: Floats, *, speed_mm_s: ArrayLike, force_n: ArrayLike
) -> Hand:
    """Where a hand is on a grid, with the edges of METHOD 9.

    Above the grid: clamped. Below the lowest speed or force: clamped too, and `ramp` falls linearly
    to 0 at rest or lift-off (in the corner by the product of both ramps). NaN and infinite values
    count as lift-off.

    Parameters
    ----------
    speeds_mm_s, forces_n : (S,), (F,) ndarray
        The grid's axes, rising and above 0.
    speed_mm_s : (n,) array_like
        Tangential speed; its sign (direction) does not matter.
    force_n : (n,) array_like
        Normal force; negative values count as lift-off.
    """
    speed = np.abs(np.atleast_1d(np.asarray(speed_mm_s, dtype=np.float64)))
    force = np.atleast_1d(np.asarray(force_n, dtype=np.float64))
    contact = np.isfinite(speed) & np.isfinite(force)
    speed, force = np.where(contact, speed, 0.0), np.where(contact, force, 0.0)
    ramp = np.minimum(speed, speeds_mm_s[0]) / speeds_mm_s[0]
    ramp = ramp * (np.clip(force, 0.0, forces_n[0]) / forces_n[0])
    return Hand(
        np.clip(speed, speeds_mm_s[0], speeds_mm_s[-1]),
        np.clip(force, forces_n[0], forces_n[-1]),
        ramp,
    )


class Cells:
    """The grid cells that hold a hand's points, for bilinear interpolation of any array."""

    def __init__(self, speeds_mm_s: Floats, forces_n: Floats, *, hand: Hand) -> None:
        self._row, self._row_share = _cell(speeds_mm_s, hand.speed_mm_s)
        self._column, self._column_share = _cell(forces_n, hand.force_n)

    def blend(self, grid: Floats) -> Floats:
        """Values (n, …) of a grid of values (S, F, …)."""
        tail = (slice(None),) + (None,) * (grid.ndim - 2)
        x, y = self._row_share[tail], self._column_share[tail]
        row, column = self._row, self._column
        low = grid[row, column] * (1 - x) + grid[row + 1, column] * x
        high = grid[row, column + 1] * (1 - x) + grid[row + 1, column + 1] * x
        blended: Floats = low * (1 - y) + high * y
        return blended


def _cell(axis: Floats, inside: Floats) -> tuple[NDArray[np.intp], Floats]:
    """Index of the grid cell that holds each value, and the position within it (0 … 1)."""
    index = np.clip(np.searchsorted(axis, inside, side="right") - 1, 0, axis.size - 2)
    return index, (inside - axis[index]) / (axis[index + 1] - axis[index])


def grid_axes(conditions: Iterable[Condition], texture: str) -> tuple[list[float], list[float]]:
    """The rising speeds and forces that (speed, force) conditions span.

    Raises
    ------
    GridError
        For fewer than two speeds or two forces.
    """
    speeds = sorted({speed for speed, _ in conditions})
    forces = sorted({force for _, force in conditions})
    if len(speeds) < 2 or len(forces) < 2:
        raise GridError(
            f"{texture}: expected recordings at 2 or more speeds and 2 or more forces for a full "
            f"model, got {_count(speeds, 'speed')} and {_count(forces, 'force')}; "
            f"record more {'force' if len(forces) < 2 else 'speed'} levels."
        )
    return speeds, forces


def fill_grid(
    rows: Mapping[Condition, ArrayLike], texture: str
) -> tuple[Floats, NDArray[np.bool_]]:
    """Values over the whole grid from those of its known conditions.

    Holes are interpolated linearly over speed and force; beyond the outermost neighbours the
    nearest one is taken.

    Parameters
    ----------
    rows : mapping of (speed, force) to (k,) array_like
        At least 2 speeds × 2 forces.
    texture : str
        For messages.

    Returns
    -------
    (S, F, k) ndarray, (S, F) ndarray of bool
        The values, and where they were interpolated.

    Raises
    ------
    GridError
        Where the conditions do not span the grid.
    """
    speeds, forces = grid_axes(rows, texture)
    conditions = [(speed, force) for speed in speeds for force in forces]
    known = np.array([condition in rows for condition in conditions], dtype=np.bool_)
    points = np.array(conditions)
    values = np.array([rows[c] for c, there in zip(conditions, known, strict=True) if there])
    full = np.empty((len(conditions), values.shape[1]))
    full[known] = values
    if not known.all() and values.size:
        full[~known] = _between(points[known], values, holes=points[~known], texture=texture)
    shape = (len(speeds), len(forces))
    return full.reshape(*shape, -1), ~known.reshape(shape)


def _count(levels: list[float], name: str) -> str:
    return f"{len(levels)} {name}{'' if len(levels) == 1 else 's'}"


def _between(points: Floats, values: Floats, *, holes: Floats, texture: str) -> Floats:
    """Linear interpolation over (speed, force); beyond the outermost neighbours the nearest one."""
    from scipy.interpolate import griddata
    from scipy.spatial import QhullError

    try:
        linear = griddata(points, values, holes, method="linear", rescale=True)
    except (QhullError, ValueError):
        raise GridError(
            f"{texture}: expected recordings that span the grid, got {len(points)} of "
            f"{len(points) + len(holes)} conditions on one line; record more of them."
        ) from None
    nearest = griddata(points, values, holes, method="nearest", rescale=True)
    filled = np.where(np.isnan(linear), nearest, linear)
    # Rounding must not carry a value beyond its neighbours, and so out of the legal range.
    bounded: Floats = np.clip(filled, values.min(axis=0), values.max(axis=0))
    return bounded
