"""Conditions to record next: half-way between those that are predicted badly and their neighbours.

docs/recording.md#4-more-where-the-model-is-poor
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from itertools import product

import numpy as np

from tactileq.modeling.models.grid import Condition, grid_axes

# Conditions that differ by less in speed and in force are one for a hand: half of what a stroke
# may deviate from its condition (docs/method/strokes.md#cells).
SAME_SPEED, SAME_FORCE = 0.05, 0.1
# Speeds, or forces, that are nearer to each other become one column, or row, of the map.
MERGED = 0.1


def half_way_to_neighbours(
    near: Sequence[Condition], recorded: Collection[Condition]
) -> list[Condition]:
    """Conditions half-way between these and their recorded neighbours, all within the recorded.

    A condition's neighbours are the nearest in (ln v, ln F) that is faster and harder, faster and
    lighter, slower and harder, slower and lighter: on a lattice the opposite corners of the cells
    that adjoin it, so that half-way is a cell's middle. Where all have one force (or speed), they
    are the next ones on either side.

    Parameters
    ----------
    near : sequence of (speed, force)
        Of the recorded ones, such as from `between.worth_recording`.
    recorded : collection of (speed, force)
        In mm/s and N, above 0.

    Returns
    -------
    list of (speed, force)
        In the order of `near`, without what is recorded already but for 5 % of speed and 10 % of
        force. The nearest speeds (or forces) are replaced by their mean until all are 10 % apart,
        so that scattered conditions have rows and columns that a hand can tell apart.
    """
    sides = [(-1, 1) if len(axis) > 1 else (0,) for axis in grid_axes(recorded)]
    middles = [
        ((speed + other[0]) / 2, (force + other[1]) / 2)
        for speed, force in near
        for side in product(*sides)
        for other in _nearest((speed, force), recorded, side=side)
    ]
    speeds, forces = (_merged(middle[axis] for middle in middles) for axis in (0, 1))
    merged = dict.fromkeys((speeds[speed], forces[force]) for speed, force in middles)
    return [one for one in merged if not any(_same(one, other) for other in recorded)]


def _nearest(
    condition: Condition, recorded: Iterable[Condition], *, side: tuple[int, ...]
) -> list[Condition]:
    """The nearest recorded condition on one side (signs of its steps), if there is any."""
    steps = {other: np.log(np.divide(other, condition)) for other in sorted(recorded)}
    there = [other for other in steps if tuple(np.sign(steps[other])) == side]
    apart = [other for other in there if not _same(other, condition)]
    return sorted(apart, key=lambda other: float(np.hypot(*steps[other])))[:1]


def _same(one: Condition, other: Condition) -> bool:
    return abs(one[0] / other[0] - 1) < SAME_SPEED and abs(one[1] / other[1] - 1) < SAME_FORCE


def _merged(values: Iterable[float]) -> dict[float, float]:
    """What each value becomes: the nearest become their mean until all are 10 % apart."""
    groups = [[value] for value in sorted(set(values))]
    while len(groups) > 1:
        means = [sum(group) / len(group) for group in groups]
        steps = np.divide(means[1:], means[:-1])
        least = int(np.argmin(steps))
        if steps[least] >= 1 + MERGED:
            break
        groups[least : least + 2] = [groups[least] + groups[least + 1]]
    return {value: sum(group) / len(group) for group in groups for value in group}
