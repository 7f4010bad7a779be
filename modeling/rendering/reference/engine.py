"""Rendering in Python, as `kernel.h` does, without a compiler; and of all-pole models.

The filters pass white noise through orthogonal steps, so that their states keep unit variance (or
lose some) at every sample, whatever the parameters do from one update to the next. Plain Python
floats are IEEE doubles, and all is computed in the order of `kernel.h`: the bits are the same.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any, Protocol

import numpy as np

from tactileq.modeling.arrays import Floats
from tactileq.modeling.hand import Hand
from tactileq.modeling.rendering.plan import RenderCounters, RenderPlan
from tactileq.modeling.rendering.reference.compensator import Compensator
from tactileq.modeling.rendering.reference.hand import Extrapolator
from tactileq.modeling.rendering.reference.interpolator import Interpolator
from tactileq.modeling.rendering.reference.limiter import Limiter


class StreamFilter(Protocol):
    """A filter whose state carries on from block to block.

    A setting holds its coefficients from one parameter update to the next.
    """

    clamped: int
    axes: tuple[Floats, Floats]  # speeds (mm/s) and forces (N) of the model's grid

    def settings(self, amid: Hand, end: Hand) -> list[Any]:
        """One setting for each of n updates, given the hand amid and at the end of each."""

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
        self._hand = Extrapolator(plan.own, stream_filter.axes, lead=plan.lead)
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
        return self._rendered(finite.size, Hand(speed_mm_s, force_n))

    def read(self, ago: float, speed_mm_s: float, force_n: float) -> None:
        """A reading that was made so many samples before the next one."""
        self._hand.read(self._interpolator.before_next_made(ago), speed_mm_s, force_n)

    def render_on(self, samples: int) -> Floats:
        """The next samples for the hand as it was last read."""
        return self._rendered(samples, None)

    def _rendered(self, count: int, hand: Hand | None) -> Floats:
        made = self._made(hand, self._interpolator.made_before(count), count)
        output = self._compensator.filter(self._interpolator.output(made, count))
        return np.array(self._limiter.limit(output), dtype=np.float64)

    def _made(self, hand: Hand | None, places: Sequence[int], outputs: int) -> list[float]:
        """The next samples at the model's rate, each for one place in the output."""
        count, period = len(places), self._plan.own.update_samples
        inputs = self._filter.inputs(self._key, self._position, count=count)
        starts = list(range(-self._position % period, count, period))
        bounds = [*starts, count]
        passed = [*(places[start] for start in starts), outputs]
        self._go_on(bounds[0], passed[0], counts=hand is None)
        output = self._filter.filter(*(part[: bounds[0]] for part in inputs))
        followed = []
        for (start, stop), (place, until) in zip(pairwise(bounds), pairwise(passed), strict=True):
            if hand is not None:
                self._hand.read(0.0, float(hand.speed_mm_s[place]), float(hand.force_n[place]))
            followed.append(self._hand.follow())
            self._go_on(stop - start, until - place, counts=hand is None)
        amid, end = np.array(followed).reshape(-1, 2, 2).transpose(1, 2, 0)
        settings = self._filter.settings(Hand(*amid), Hand(*end))
        for start, stop, setting in zip(starts, bounds[1:], settings, strict=True):
            self._filter.update(setting)
            output += self._filter.filter(*(part[start:stop] for part in inputs))
        self._position += count
        return output

    def _go_on(self, samples: int, outputs: int, *, counts: bool) -> None:
        """So many samples of the model pass, for so many of the output."""
        self._hand.go_on(samples)
        self._lift_offs += outputs * (counts and not self._hand.known)
        for which, outside in enumerate(self._hand.outside):
            self._samples_outside[which] += outputs * outside
