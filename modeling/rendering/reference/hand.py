"""How parameters follow the hand: linear extrapolation, and ramps of gains.

docs/method/rendering.md#extrapolation, docs/method/rendering.md#slew
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from modeling.arrays import Floats
from modeling.hand import Hand
from modeling.rendering.plan import RenderPlan

_SMALLEST_SHARE = 1e-9


def settled(x: float | Floats, lowest: float | Floats) -> Floats:
    """Speeds, forces or their changes, with those below a billionth of the grid's lowest as 0."""
    return np.where(np.abs(x) < _SMALLEST_SHARE * lowest, 0.0, x)


class Extrapolator:
    """Linear extrapolation of the hand by the exponentially smoothed slope of its readings.

    A step, which is a change beyond what a hand can do, and a reading of 0 reset the slope: neither
    is extrapolated. By `lead` updates it goes further, since so late the output is felt.
    """

    def __init__(self, plan: RenderPlan, axes: tuple[Floats, Floats], *, lead: float = 0.0) -> None:
        self._furthest, self._share = plan.hand_changes, plan.slope_share
        self._lowest = np.array([axis[0] for axis in axes])
        self._least = (_SMALLEST_SHARE * self._lowest).tolist()
        to_end = (plan.update_samples - 1) / plan.update_samples
        self._to_middle, self._to_end = to_end / 2 + lead, to_end + lead
        self._last: list[float] = []
        self._slopes = [0.0, 0.0]

    def __call__(self, hand: Hand) -> tuple[Hand, Hand]:
        """The hand in the middle of the time to the next readings, and just before them."""
        raw = np.stack(hand)
        read = settled(raw, self._lowest[:, None])
        pairs = zip(raw.T.tolist(), read.T.tolist(), strict=True)
        slopes = np.array([self._slopes_at(*pair) for pair in pairs]).reshape(-1, 2).T
        with np.errstate(over="ignore"):
            amid, end = read + slopes * self._to_middle, read + slopes * self._to_end
        return Hand(*amid), Hand(*end)

    def _slopes_at(self, now: list[float], kept: list[float]) -> list[float]:
        """The smoothed changes per update of speed and force with the next reading.

        `kept` is what the next change is counted from: the reading, settled.
        """
        if self._last:
            readings = zip(self._slopes, self._last, now, self._furthest, self._least, strict=True)
            self._slopes = [self._slope(*reading) for reading in readings]
        self._last = kept
        return self._slopes

    def _slope(self, slope: float, last: float, now: float, furthest: float, least: float) -> float:
        change = now - last
        goes_on = -furthest <= change <= furthest and now != 0
        smoothed = slope + self._share * (change - slope)
        return smoothed if goes_on and abs(smoothed) >= least else 0.0


class GainRamps:
    """Gains on linear ramps from update to update, no faster than the plan's slews.

    Parameters
    ----------
    plan : RenderPlan
    largest : (k,) ndarray
        Largest amplitude that each gain ever has.
    """

    def __init__(self, plan: RenderPlan, largest: Floats) -> None:
        self._slews = plan.slews(largest).tolist()
        self._per_sample = 1 / plan.update_samples
        self._gains: list[float] = []
        self._courses = [(0.0, 0.0)] * len(self._slews)

    def update(self, wanted: list[float], factors: Sequence[float]) -> None:
        """Start ramps of (k,) gains to their targets, each multiplied by a factor.

        The first update sets all at once.
        """
        now = self._gains or wanted
        self._gains = [_towards(*move) for move in zip(now, wanted, self._slews, strict=True)]
        self._courses = [
            (start * factor, (end - start) * self._per_sample * factor)
            for start, end, factor in zip(now, self._gains, factors, strict=True)
        ]

    def course(self, which: int, count: int) -> list[float]:
        """One gain, times its factor, at each of the next samples."""
        now, step = self._courses[which]
        course = []
        for _ in range(count):
            now += step
            course.append(now)
        self._courses[which] = (now, step)
        return course


def _towards(gain: float, wanted: float, slew: float) -> float:
    change = wanted - gain
    if change > slew:
        return gain + slew
    return gain - slew if change < -slew else wanted
