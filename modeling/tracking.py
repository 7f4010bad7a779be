"""One layer, one name, over the whole grid (METHOD 5; PAPER III)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from modeling.grid import Condition
from modeling.peq import Floats


def visiting_order(conditions: Sequence[Condition]) -> list[Condition]:
    """(speed, force) pairs force by force downwards, and within a force by falling speed."""
    return sorted(conditions, key=lambda c: (-c[1], -c[0]))


def reference_of(condition: Condition, visited: Sequence[Condition]) -> Condition:
    """The condition whose layers name the peaks of this one.

    The next-faster one at the same force, else the next-stronger one at the same speed. Where that
    speed was not recorded at all yet, the one at the nearest force whose speed is nearest.
    """
    speed, force = condition
    faster = [c for c in visited if c[1] == force and c[0] > speed]
    if faster:
        return min(faster)
    stronger = [c for c in visited if c[0] == speed and c[1] > force]
    if stronger:
        return min(stronger, key=lambda c: c[1])
    return min(visited, key=lambda c: (abs(c[1] - force), abs(c[0] - speed)))


def assign_peaks(peaks_hz: Floats, layers_hz: Floats) -> NDArray[np.intp]:
    """Which peak belongs to which layer.

    A peak takes the name of the nearest layer, within half the gap to that layer's neighbours
    (outermost layers use their inner gap on both sides; a single layer f/2). In a conflict the
    nearest peak wins.

    Parameters
    ----------
    peaks_hz : (k,) ndarray
        Peaks found in this condition, any order.
    layers_hz : (m,) ndarray
        The layers' frequencies in the reference condition, any order.

    Returns
    -------
    (m,) ndarray of int
        Index of each layer's peak, −1 where it has none. No peak is used twice.
    """
    chosen = np.full(layers_hz.size, -1, dtype=np.intp)
    if not (peaks_hz.size and layers_hz.size):
        return chosen
    below, above = _reaches(layers_hz)
    offset = peaks_hz[None, :] - layers_hz[:, None]
    distance = np.abs(offset)
    nearest = np.argmin(distance, axis=0)
    for layer in range(layers_hz.size):
        reach = np.where(offset[layer] < 0, below[layer], above[layer])
        mine = (nearest == layer) & (distance[layer] <= reach)
        if mine.any():
            chosen[layer] = np.argmin(np.where(mine, distance[layer], np.inf))
    return chosen


def _reaches(layers_hz: Floats) -> tuple[Floats, Floats]:
    """How far below and above each layer a peak may lie (Hz)."""
    if layers_hz.size == 1:
        return layers_hz / 2, layers_hz / 2
    order = np.argsort(layers_hz, kind="stable")
    half_gaps = np.diff(layers_hz[order]) / 2
    below, above = np.empty(layers_hz.size), np.empty(layers_hz.size)
    below[order] = np.concatenate((half_gaps[:1], half_gaps))
    above[order] = np.concatenate((half_gaps, half_gaps[-1:]))
    return below, above
