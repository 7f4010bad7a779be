"""How parameters follow the hand: linear extrapolation, and ramps of gains.

docs/method/rendering.md#extrapolation, docs/method/rendering.md#slew
"""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite

import numpy as np

from tactileq.modeling.arrays import Floats
from tactileq.modeling.hand import Hand
from tactileq.modeling.rendering.plan import RenderPlan

_SMALLEST_SHARE = 1e-9
# A reading that is no later after the last one, in samples, does not count.
_NO_LATER = 1e-3
_LONGEST = 2**30


class Extrapolator:
    """Linear extrapolation of the hand by the exponentially smoothed slope of its readings.

    A step, which is a change beyond what a hand can do, and a reading of 0 reset the slope: neither
    is extrapolated. By `lead` updates it goes further, since so late the output is felt.
    docs/method/rendering.md#readings: how long a reading counts, and when contact ends.
    """

    known: bool  # whether there is a reading that counts
    outside: tuple[bool, bool]  # above and below the grid, as last read
    _left: bool  # whether there were readings without contact since
    _last: list[float]
    # The smoothed change of each per update; the turns, smoothed half as long, are for the past.
    _slopes: list[float]
    _turns: list[float]
    # Positions, and samples before them: of the last reading, of the first one without contact.
    _read: tuple[int, float]
    _off: tuple[int, float]

    def __init__(self, plan: RenderPlan, axes: tuple[Floats, Floats], *, lead: float = 0.0) -> None:
        self._period, self._share = plan.update_samples, plan.slope_share
        self._furthest, self._times = plan.hand_changes, plan.readings
        self._highest = [float(axis[-1]) for axis in axes]
        self._lowest = [float(axis[0]) for axis in axes]
        to_end = (plan.update_samples - 1) / plan.update_samples
        self._to_middle, self._to_end = to_end / 2 + lead, to_end + lead
        self._position = 0
        self._forget()

    def __call__(self, hand: Hand) -> tuple[Hand, Hand]:
        """The hand amid and at the end of each update, at each of which it is read."""
        followed = []
        for speed, force in zip(*(part.tolist() for part in hand), strict=True):
            self.read(0.0, speed, force)
            followed.append(self.follow())
            self.go_on(self._period)
        amid, end = zip(*followed, strict=True)
        return Hand(*np.array(amid).T), Hand(*np.array(end).T)

    def read(self, ago: float, speed: float, force: float) -> None:
        """A reading so many samples before the next one: speed (mm/s) and force (N)."""
        now, since = [speed, force], self._age(*self._read) - ago
        if not (isfinite(speed) and isfinite(force)) or (self.known and not since > _NO_LATER):
            return
        if self._leaving(ago, since, force):
            return
        if self.known:
            self._turn(now, since / self._period)
        self.known, self._left = True, False
        self._read = (self._position, ago)
        self._last = [_settled(new, low) for new, low in zip(now, self._lowest, strict=True)]
        self.outside = self._located()

    def follow(self) -> tuple[list[float], list[float]]:
        """The hand in the middle of the time to the next update, and just before it."""
        age = self._age(*self._read)
        if age > self._times["hold"]:
            self._forget()
        past = age / self._period
        now = [last + turn * past for last, turn in zip(self._last, self._turns, strict=True)]
        amid, end = (
            [at + slope * until for at, slope in zip(now, self._slopes, strict=True)]
            for until in (self._to_middle, self._to_end)
        )
        return amid, end

    def go_on(self, samples: int) -> None:
        """So many samples pass."""
        self._position += samples

    def _age(self, position: int, ago: float) -> float:
        """Samples since a time, which was so many before a position."""
        return min(self._position - position, _LONGEST) + ago

    def _forget(self) -> None:
        self.known = self._left = False
        self.outside = (False, False)
        self._last = [0.0, 0.0]
        self._slopes, self._turns = [0.0, 0.0], [0.0, 0.0]
        self._read = self._off = (0, 0.0)

    def _turn(self, now: list[float], updates: float) -> None:
        """Smoothed changes with readings so many updates after the last ones."""
        share, most = min(self._share * updates, 1.0), max(updates, 1.0)
        shares = share, min(2 * share, 1.0)
        for axis, new in enumerate(now):
            last, lowest = self._last[axis], self._lowest[axis]
            furthest = self._furthest[axis] * most
            for slopes, by in zip((self._slopes, self._turns), shares, strict=True):
                slopes[axis] = _slope(slopes[axis], last, new, 1 / updates, furthest, by, lowest)

    def _leaving(self, ago: float, since: float, force: float) -> bool:
        """Whether a reading without contact is too soon after the first of them to end it."""
        if not self.known or not self._last[1] > 0 or force > 0:
            return False
        if not self._left:
            self._left, self._off = True, (self._position, ago)
        soon = self._age(*self._off) - ago < self._times["release"]
        return soon and since <= self._times["hold"]

    def _located(self) -> tuple[bool, bool]:
        """Whether a hand that touches and moves is above the grid, or else below it."""
        speed, force = abs(self._last[0]), self._last[1]
        strokes = speed > 0 and force > 0
        above = speed > self._highest[0] or force > self._highest[1]
        below = speed < self._lowest[0] or force < self._lowest[1]
        return strokes and above, strokes and below and not above


def _settled(x: float, lowest: float) -> float:
    """A speed, force or their change; one below a billionth of the grid's lowest is 0."""
    return 0.0 if abs(x) < _SMALLEST_SHARE * lowest else x


def _slope(
    slope: float,
    last: float,
    now: float,
    rate: float,
    furthest: float,
    share: float,
    lowest: float,
) -> float:
    change = now - last
    goes_on = -furthest <= change <= furthest and now != 0
    return _settled(slope + share * (change * rate - slope), lowest) if goes_on else 0.0


class GainRamps:
    """Gains on linear ramps from update to update, no faster than the plan's slews.

    Parameters
    ----------
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
