"""Grids of speeds and forces: axes, holes, interpolation, edges.

docs/method/fitting.md#missing-conditions, docs/method/rendering.md#grid-edges
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from tactileq.modeling.arrays import Bools, Floats, Integers
from tactileq.modeling.errors import GridError, InputError
from tactileq.modeling.files.described import key
from tactileq.modeling.hand import Hand

Condition = tuple[float, float]
LEAST_REACH = 0.01  # of log speed or log force, of conditions that are not all the same
LEAST_WIDTH = 0.02  # of conditions across their longest extent: a hull with less has no area


def is_axis(values: Floats) -> bool:
    """Whether these are rising finite values above 0, one at least."""
    rising = values.ndim == 1 and values.size >= 1 and bool((np.diff(values) > 0).all())
    return rising and bool(values[0] > 0 and np.isfinite(values).all())


_RISING = "one or more rising values above 0"
Speeds = Annotated[
    Floats,
    key("of the grid", unit="mm/s", shape="speeds", expected=_RISING, holds=is_axis, gt=0),
]
Forces = Annotated[
    Floats, key("of the grid", unit="N", shape="forces", expected=_RISING, holds=is_axis, gt=0)
]


def check_axes(speeds_mm_s: Floats, forces_n: Floats) -> None:
    """Refuse axes that are not rising finite values above 0, one at least.

    Raises
    ------
    InputError
    """
    for name, axis in (("speeds_mm_s", speeds_mm_s), ("forces_n", forces_n)):
        if not is_axis(axis):
            raise InputError(
                f"expected {_RISING} in {name}, got "
                f"{axis.tolist()}; give the speeds and forces of the model's grid."
            )


def within_grid(
    speeds_mm_s: Floats, forces_n: Floats, *, speed_mm_s: ArrayLike, force_n: ArrayLike
) -> tuple[Hand, Floats]:
    """A hand on the grid, and the share (n,) of level that is left there.

    docs/method/rendering.md#grid-edges

    Above the grid: clamped. Below the lowest speed or force: clamped too, and the share falls
    linearly to 0 at rest or lift-off (in the corner by the product of both ramps). NaN and infinite
    values count as lift-off.

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
    inside = Hand(
        np.clip(speed, speeds_mm_s[0], speeds_mm_s[-1]), np.clip(force, forces_n[0], forces_n[-1])
    )
    return inside, ramp


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
        # Of an axis of one value both ends of the cell are that one.
        below, beside = np.minimum(row + 1, len(grid) - 1), np.minimum(column + 1, len(grid[0]) - 1)
        low = grid[row, column] * (1 - x) + grid[below, column] * x
        high = grid[row, beside] * (1 - x) + grid[below, beside] * x
        blended: Floats = low * (1 - y) + high * y
        return blended


def _cell(axis: Floats, inside: Floats) -> tuple[Integers, Floats]:
    """Index of the grid cell that holds each value, and the position within it (0 … 1)."""
    if axis.size == 1:
        return np.zeros(inside.shape, dtype=np.intp), np.zeros(inside.shape)
    index = np.clip(np.searchsorted(axis, inside, side="right") - 1, 0, axis.size - 2)
    return index, (inside - axis[index]) / (axis[index + 1] - axis[index])


def grid_axes(conditions: Iterable[Condition]) -> tuple[list[float], list[float]]:
    """The rising speeds and forces that (speed, force) conditions span."""
    every = list(conditions)
    return sorted({speed for speed, _ in every}), sorted({force for _, force in every})


def check_spanned(conditions: Collection[Condition], texture: str) -> None:
    """Refuse conditions on a line across the grid, between which nothing can be interpolated.

    One speed or one force alone is no such line: nothing is known of others then. Nor do
    conditions that are all but the same span anything.

    Raises
    ------
    GridError
    """
    speeds, forces = grid_axes(conditions)
    if len(speeds) == 1 or len(forces) == 1:
        return
    points = np.log(np.array(sorted(conditions)))
    reach = np.ptp(points, axis=0)
    if (reach < LEAST_REACH).all():
        raise GridError(
            f"{texture}: expected recordings at different speeds or forces, got {len(points)} "
            f"conditions within {LEAST_REACH:.0%} of {speeds[0]:g} mm/s and {forces[0]:g} N; "
            "record others, or declare them as repeats at one speed and force."
        )
    long, short = np.linalg.svd((points - points.mean(axis=0)) / reach, compute_uv=False)
    if short < LEAST_WIDTH * long:
        raise GridError(
            f"{texture}: expected recordings that span the grid, got {len(points)} of "
            f"{len(speeds) * len(forces)} conditions on one line; record more of them."
        )


def fill_grid(rows: Mapping[Condition, ArrayLike], texture: str) -> tuple[Floats, Bools]:
    """Values over the whole grid from those of its known conditions.

    Holes are interpolated linearly over speed and force; beyond the outermost neighbours the
    nearest one is taken.

    Parameters
    ----------
    rows : mapping of (speed, force) to (k,) array_like
        One condition at least.
    texture : str
        For messages.

    Returns
    -------
    (S, F, k) ndarray, (S, F) ndarray of bool
        The values, and where they were interpolated.

    Raises
    ------
    GridError
        If the conditions do not span the grid.
    """
    check_spanned(rows, texture)
    speeds, forces = grid_axes(rows)
    conditions = [(speed, force) for speed in speeds for force in forces]
    known = np.array([condition in rows for condition in conditions], dtype=np.bool_)
    points = np.array(conditions)
    values = np.array([rows[c] for c, there in zip(conditions, known, strict=True) if there])
    full = np.empty((len(conditions), values.shape[1]))
    full[known] = values
    if not known.all() and values.size:
        full[~known] = _between(points[known], values, holes=points[~known])
    shape = (len(speeds), len(forces))
    return full.reshape(*shape, -1), ~known.reshape(shape)


def _between(points: Floats, values: Floats, *, holes: Floats) -> Floats:
    """Linear interpolation over (speed, force); beyond the outermost neighbours the nearest one."""
    from scipy.interpolate import griddata

    linear = griddata(points, values, holes, method="linear", rescale=True)
    nearest = griddata(points, values, holes, method="nearest", rescale=True)
    filled = np.where(np.isnan(linear), nearest, linear)
    # Rounding must not carry a value beyond its neighbours, and so out of the legal range.
    bounded: Floats = np.clip(filled, values.min(axis=0), values.max(axis=0))
    return bounded
