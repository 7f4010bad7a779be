"""Where in a model's grid the bound of a scene applies, and how fast the hand changes there.

Errors are looked at where the renderer reads parameters: at the nodes of the model's table, between
which all parameters, and so all errors of them, are bilinear. A scene is rounded outwards to these
nodes, so that a narrower scene never counts places that a wider one does not.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tactileq.modeling.arrays import Bools, Floats, Integers
from tactileq.modeling.errors import InputError
from tactileq.modeling.hand import Hand
from tactileq.modeling.models.texture_model import TextureModel
from tactileq.modeling.scenes.hands import AskedRange, HandPlaces, HandRange, HandUse, Range

LEAST_VISITED = 0.01  # of the hand's time, over which a bound may be broken


@dataclass(frozen=True, eq=False)
class Places:
    """The nodes of one model's table, and the hand on them.

    Parameters
    ----------
    speeds_mm_s, forces_n : (p,), (q,) ndarray
        The nodes: the conditions of the grid, of a model that blends in logarithms more.
    share : (p, q) ndarray
        Of the hand's time; sums up to 1.
    counts : (p, q) ndarray of bool
        Where the bound is to be kept: of a range everywhere, else all but the least visited places,
        together at most 1 % of the time.
    speed_change_mm_s2, force_change_n_s : (p, q) ndarray
        How fast the hand's speed and force change there at most.
    speed_range, force_range : (float, float)
        What the scene covers.
    """

    speeds_mm_s: Floats
    forces_n: Floats
    share: Floats
    counts: Bools
    speed_change_mm_s2: Floats
    force_change_n_s: Floats
    speed_range: Range
    force_range: Range

    @property
    def visited(self) -> Hand:
        """The places that count, in C order, moved into what the scene covers."""
        rows, columns = np.nonzero(self.counts)
        return Hand(
            np.clip(self.speeds_mm_s[rows], *self.speed_range),
            np.clip(self.forces_n[columns], *self.force_range),
        )

    def name(self, index: int) -> str:
        """A place, by its number in C order, as text."""
        row, column = np.unravel_index(index, self.share.shape)
        return f"{self.speeds_mm_s[row]:g} mm/s, {self.forces_n[column]:g} N"


def places_of(model: TextureModel, hand: HandUse) -> Places:
    """The places of a scene's hand on a model's grid.

    Raises
    ------
    InputError
        For a hand beyond the recorded grid (of one that is not a range, for more than 1 % of its
        time).
    """
    if isinstance(hand, HandRange):
        return _places_in_range(model, hand)
    return _places_as_listed(model, hand)


def nodes_of(model: TextureModel) -> tuple[Floats, Floats]:
    """Speeds and forces of a model's table; of a grid with one speed or force that one alone."""
    table = model.table
    speeds = model.speeds_mm_s if model.speeds_mm_s.size == 1 else table.speeds_mm_s
    forces = model.forces_n if model.forces_n.size == 1 else table.forces_n
    return speeds, forces


def ranges_of(model: TextureModel, hand: HandRange) -> tuple[Range, Range]:
    """Lowest and highest speed and force of a hand that may stay anywhere in a range.

    Raises
    ------
    InputError
        For a range beyond the recorded grid.
    """
    speeds, forces = nodes_of(model)
    return (
        _range_on(model, hand.speed_mm_s, speeds, unit="mm/s", what="speeds"),
        _range_on(model, hand.force_n, forces, unit="N", what="forces"),
    )


def _places_in_range(model: TextureModel, hand: HandRange) -> Places:
    speeds, forces = nodes_of(model)
    speed_range, force_range = ranges_of(model, hand)
    rows, columns = enclosing(speeds, speed_range), enclosing(forces, force_range)
    counts = rows[:, None] & columns[None, :]
    omega, fastest = 2 * np.pi * hand.stroke_hz, speed_range[1]
    speed_change = omega * np.sqrt(np.maximum(fastest**2 - speeds**2, 0.0))
    force_change = omega * (force_range[1] - force_range[0]) / 2
    return Places(
        speeds,
        forces,
        counts / counts.sum(),
        counts,
        np.broadcast_to(speed_change[:, None], counts.shape),
        np.full(counts.shape, force_change),
        speed_range,
        force_range,
    )


def _range_on(
    model: TextureModel, asked: AskedRange, axis: Floats, *, unit: str, what: str
) -> Range:
    low, high = float(axis[0]), float(axis[-1])
    if isinstance(asked, str):  # all that was recorded
        return low, high
    if not low <= asked[0] <= asked[1] <= high:
        raise InputError(
            f"expected {what} of the scene within {low:g}…{high:g} {unit}, where {model.texture} "
            f"was recorded, got {asked[0]:g}…{asked[1]:g} {unit}; narrow the scene, or record more."
        )
    return asked


def enclosing(axis: Floats, asked: Range) -> Bools:
    """The values of an axis within a range, and the next ones on both sides of it."""
    first = int(np.searchsorted(axis, asked[0], side="right")) - 1
    last = int(np.searchsorted(axis, asked[1], side="left"))
    index = np.arange(axis.size)
    return (index >= first) & (index <= last)


def _places_as_listed(model: TextureModel, hand: HandPlaces) -> Places:
    speeds, forces = nodes_of(model)
    beyond = (hand.speed_mm_s > speeds[-1]) | (hand.force_n > forces[-1])
    too_long = float(hand.share[beyond].sum())
    if too_long > LEAST_VISITED:
        raise InputError(
            f"expected a hand of at most {speeds[-1]:g} mm/s and {forces[-1]:g} N, up to which "
            f"{model.texture} was recorded, for 99 % of its time, got one beyond for "
            f"{too_long:.0%}; narrow the scene, or record more."
        )
    # Below the lowest condition the level falls, but nothing else changes.
    speed = np.clip(hand.speed_mm_s, speeds[0], speeds[-1])
    force = np.clip(hand.force_n, forces[0], forces[-1])
    shape = (speeds.size, forces.size)
    share, fastest, strongest = np.zeros(shape), np.zeros(shape), np.zeros(shape)
    (row, row_share), (column, column_share) = _around(speeds, speed), _around(forces, force)
    for i, j in ((0, 0), (0, 1), (1, 0), (1, 1)):
        at = np.minimum(row + i, speeds.size - 1), np.minimum(column + j, forces.size - 1)
        part = np.abs(1 - i - row_share) * np.abs(1 - j - column_share) * hand.share
        np.add.at(share, at, part)
        there = part > 0
        where = at[0][there], at[1][there]
        np.maximum.at(fastest, where, hand.speed_change_mm_s2[there])
        np.maximum.at(strongest, where, hand.force_change_n_s[there])
    counts = _most_visited(share)
    ranges = [(float(x.min()), float(x.max())) for x in (speed, force)]
    return Places(speeds, forces, share, counts, fastest, strongest, ranges[0], ranges[1])


def _around(axis: Floats, values: Floats) -> tuple[Integers, Floats]:
    """Index of the value of an axis next below each of (n,), and how far it is to the next one."""
    if axis.size == 1:
        return np.zeros(values.size, dtype=np.intp), np.zeros(values.size)
    index = np.clip(np.searchsorted(axis, values, side="right") - 1, 0, axis.size - 2)
    return index, (values - axis[index]) / (axis[index + 1] - axis[index])


def _most_visited(share: Floats) -> Bools:
    """All places but the least visited ones, which together make up at most 1 % of the time."""
    order = np.argsort(share, axis=None, kind="stable")
    passed_over = order[np.cumsum(share.ravel()[order]) <= LEAST_VISITED]
    counts = np.ones(share.size, dtype=bool)
    counts[passed_over] = False
    most: Bools = counts.reshape(share.shape) & (share > 0)
    return most
