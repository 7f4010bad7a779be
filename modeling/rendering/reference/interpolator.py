"""From samples at the model's rate to those of the output, in Python."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tactileq.modeling.arrays import Floats
from tactileq.modeling.rendering.plan import RenderPlan


class Interpolator:
    """The plan's interpolation on a stream; without one samples stay as they are."""

    def __init__(self, plan: RenderPlan) -> None:
        self._way = way = plan.interpolation
        if way is not None:
            # Places in the output are counted in 1 / (2 up) samples of the model, from the newest.
            self._phase = 2 * way.up
            self._past = np.zeros(way.doubling.shape[0] - 1)
            self._doubled = np.zeros(way.phases.shape[1] + 1)

    def before_next_made(self, ago: float) -> float:
        """From `ago` samples before the next one of the output to the model's next one."""
        way = self._way
        return ago if way is None else 1 + (ago * way.down - self._phase) / (2 * way.up)

    def made_before(self, count: int) -> Sequence[int]:
        """Before which of the next `count` output samples the model makes each of its own."""
        way = self._way
        if way is None:
            return range(count)
        samples = (self._phase + (count - 1) * way.down) // (2 * way.up) if count else 0
        return [-(-(2 * way.up * (made + 1) - self._phase) // way.down) for made in range(samples)]

    def output(self, made: list[float], count: int) -> list[float]:
        """The next `count` samples of the output, for which the model has made some of its own."""
        way = self._way
        if way is None:
            return made
        past = np.append(self._past, made)
        pairs = _weighted(past, way.doubling, len(made))
        doubled = np.append(self._doubled, pairs.ravel())
        place, phase = np.divmod(self._phase + way.down * np.arange(count), way.up)
        taps = np.arange(way.phases.shape[1])
        terms = way.phases[phase] * doubled[place[:, None] + taps]
        even, odd = (_in_turn(terms[:, first::2]) for first in (0, 1))
        self._past = past[len(made) :]
        self._doubled = doubled[2 * len(made) :]
        self._phase += count * way.down - len(made) * 2 * way.up
        samples: list[float] = (even + odd).tolist()
        return samples


def _weighted(past: Floats, weights: Floats, count: int) -> Floats:
    """Weighted sums (count, k) of the past of each of the last `count` samples."""
    sums = np.zeros((count, weights.shape[1]))
    for tap, weight in enumerate(weights):
        term = weight * past[tap : tap + count, None]
        sums = sums + term if tap else term
    return sums


def _in_turn(terms: Floats) -> Floats:
    """Sums of (n, k) terms, added one after the other as in C."""
    total = terms[:, 0]
    for term in terms.T[1:]:
        total = total + term
    return total
