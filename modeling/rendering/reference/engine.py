"""Rendering in Python, as `kernel.h` does, without a compiler; and of all-pole models.

The filters pass white noise through orthogonal steps, so that their states keep unit variance (or
lose some) at every sample, whatever the parameters do from one update to the next. Plain Python
floats are IEEE doubles, and all is computed in the order of `kernel.h`: the bits are the same.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np

from modeling.arrays import Floats
from modeling.hand import Hand
from modeling.rendering.plan import RenderCounters, RenderPlan
from modeling.rendering.reference.compensator import Compensator
from modeling.rendering.reference.hand import settled
from modeling.rendering.reference.interpolator import Interpolator
from modeling.rendering.reference.limiter import Limiter


class StreamFilter(Protocol):
    """A filter whose state carries on from block to block.

    A setting holds its coefficients from one parameter update to the next.
    """

    clamped: int
    axes: tuple[Floats, Floats]  # speeds (mm/s) and forces (N) of the model's grid

    def settings(self, hand: Hand) -> list[Any]:
        """One setting for each of the n readings of the hand."""

    def update(self, setting: Any) -> None:
        """Put a setting into force."""

    def inputs(self, key: np.uint64, start: int, *, count: int) -> tuple[list[float], ...]:
        """Its driving noise from position `start` on: one or more lists of `count` samples."""

    def filter(self, *inputs: list[float]) -> list[float]:
        """The output for the next samples of its inputs."""


class PythonEngine:
    """Renders with any `StreamFilter`: updates, filters, interpolates, compensates and limits."""

    def __init__(self, stream_filter: StreamFilter, plan: RenderPlan, *, key: np.uint64) -> None:
        self._filter, self._plan, self._key = stream_filter, plan, key
        self._position = 0
        self._lift_offs = 0
        self._outside = (False, False)  # above and below the grid, as the hand was last read
        self._samples_outside = [0, 0]
        self._interpolator = Interpolator(plan)
        self._limiter = Limiter(plan)
        self._compensator = Compensator(plan)

    @property
    def counters(self) -> RenderCounters:
        """What had to be corrected so far."""
        above, below = self._samples_outside
        return RenderCounters(
            self._lift_offs, above, below, self._filter.clamped, *self._limiter.touched
        )

    def render(self, speed_mm_s: Floats, force_n: Floats) -> Floats:
        """The next samples for (n,) speeds and forces."""
        finite = np.isfinite(speed_mm_s) & np.isfinite(force_n)
        self._lift_offs += finite.size - int(np.count_nonzero(finite))
        made = self._made(Hand(speed_mm_s, force_n), self._interpolator.made_before(finite.size))
        output = self._compensator.filter(self._interpolator.output(made, finite.size))
        return np.array(self._limiter.limit(output), dtype=np.float64)

    def _made(self, hand: Hand, places: Sequence[int]) -> list[float]:
        """The next samples at the model's rate, each for one place in the output."""
        count, period = len(places), self._plan.own.update_samples
        inputs = self._filter.inputs(self._key, self._position, count=count)
        starts = list(range(-self._position % period, count, period))
        bounds = [*starts, count]
        output = self._filter.filter(*(part[: bounds[0]] for part in inputs))
        readings = [places[start] for start in starts]
        self._count_outside([*readings, hand.speed_mm_s.size][0])
        read = Hand(hand.speed_mm_s[readings], hand.force_n[readings])
        settings, outside = self._filter.settings(read), _outside(read, *self._filter.axes)
        lasting = np.diff([*readings, hand.speed_mm_s.size]).tolist()
        pieces = zip(starts, bounds[1:], settings, outside, lasting, strict=True)
        for start, stop, setting, where, samples in pieces:
            self._filter.update(setting)
            self._outside = where
            self._count_outside(samples)
            output += self._filter.filter(*(part[start:stop] for part in inputs))
        self._position += count
        return output

    def _count_outside(self, samples: int) -> None:
        for which, outside in enumerate(self._outside):
            self._samples_outside[which] += samples * outside


def _outside(hand: Hand, speeds: Floats, forces: Floats) -> list[tuple[bool, bool]]:
    """Whether each reading of a hand that touches and moves is above the grid, or else below it."""
    speed, force = settled(np.abs(hand.speed_mm_s), speeds[0]), settled(hand.force_n, forces[0])
    strokes = np.isfinite(speed) & np.isfinite(force) & (speed > 0) & (force > 0)
    above = strokes & ((speed > speeds[-1]) | (force > forces[-1]))
    below = strokes & ~above & ((speed < speeds[0]) | (force < forces[0]))
    return list(zip(above.tolist(), below.tolist(), strict=True))
