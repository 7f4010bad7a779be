"""Coverage of a grid by strokes, what is missing, and what to stroke next."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from tactileq.modeling.arrays import Bools, Floats
from tactileq.modeling.models.grid import Condition
from tactileq.rig.recording.capture.grid import StrokeGrid


class Coverage:
    """Seconds per wanted cell of a grid.

    Parameters
    ----------
    wanted_s : float
        Of each cell, > 0.
    seconds : mapping of (speed, force) to float
        What there is of each condition once its pieces are joined; others count as 0.
    """

    def __init__(
        self, grid: StrokeGrid, wanted_s: float, *, seconds: Mapping[Condition, float]
    ) -> None:
        self.grid = grid
        self.wanted_s = wanted_s
        # (S, F) ndarray, 0 for cells that are not wanted.
        self.seconds: Floats = np.zeros(grid.shape)
        self.seconds[grid.wanted] = [seconds.get(one, 0.0) for one in grid.conditions]

    @property
    def full(self) -> Bools:
        """(S, F) ndarray: which wanted cells have all their seconds."""
        whole: Bools = self.grid.wanted & (self.seconds >= self.wanted_s)
        return whole

    @property
    def complete(self) -> bool:
        """Whether nothing is missing."""
        return not self.missing

    @property
    def missing(self) -> dict[Condition, float]:
        """Seconds that each wanted cell lacks which is not full."""
        there = self.seconds[self.grid.wanted].tolist()
        every = zip(self.grid.conditions, there, strict=True)
        return {one: self.wanted_s - seconds for one, seconds in every if seconds < self.wanted_s}

    def next_condition(
        self, speed_mm_s: float, force_n: float, *, current: Condition | None = None
    ) -> Condition | None:
        """The cell to stroke next: `current` until it is full, then the nearest that lacks most.

        Parameters
        ----------
        speed_mm_s, force_n : float
            The hand.
        current : (float, float), optional
            The cell that was to be stroked so far.
        """
        missing = self.missing
        if current in missing:
            return current
        steps = [np.log(np.maximum(value, 1e-6)) for value in (abs(speed_mm_s), force_n)]

        def distance(condition: Condition) -> tuple[float, float]:
            apart = sum(abs(np.log(c) - s) for c, s in zip(condition, steps, strict=True))
            return float(apart), -missing[condition]

        return min(missing, key=distance, default=None)


def advice(grid: StrokeGrid, target: Condition, *, speed_mm_s: float, force_n: float) -> list[str]:
    """What a hand has to change to come into a cell; nothing where it is there.

    Returns
    -------
    list of str
        Of "faster", "slower", "harder" and "lighter".
    """
    (low_v, high_v), (low_f, high_f) = grid.bounds()
    row = int(np.searchsorted(grid.speeds_mm_s, target[0]))
    column = int(np.searchsorted(grid.forces_n, target[1]))
    words = []
    if abs(speed_mm_s) < low_v[row]:
        words.append("faster")
    if abs(speed_mm_s) >= high_v[row]:
        words.append("slower")
    if force_n < low_f[column]:
        words.append("harder")
    if force_n >= high_f[column]:
        words.append("lighter")
    return words
