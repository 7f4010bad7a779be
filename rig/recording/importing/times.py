"""The sampling rate that a time column gives, and how evenly its samples are spaced."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tactileq.modeling import InputError
from tactileq.modeling.arrays import Floats
from tactileq.modeling.checks import HIGHEST_RATE_HZ, LARGEST_VALUE
from tactileq.modeling.errors import counted, shown
from tactileq.modeling.recordings.spectrum import MODEL_RATE_HZ

SECONDS_PER_UNIT = {"": 1.0, "s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
LONGEST_GAP = 2.5
MOST_BREAKS = 10
# A tool's vibration needs more; a rate below this means time in another unit than supposed.
LOWEST_RATE_HZ = 20.0
# Below this it may mean so, even if the header names the unit.
LOWEST_RATE_WITHOUT_TIME_UNIT_HZ = 250.0
RATE_TOLERANCE = 0.005
# Share of the power at the highest frequency of a model that jitter may turn into noise (-20 dB).
TOLERATED_NOISE_SHARE = 0.01
LOCAL_S = 0.1
# Of 3, 5 and 7 the one with the least spectral error (docs/method/recordings.md#uneven-samples).
SPLINE_DEGREE = 7
# Times that count from 1970 reveal their unit: from 2001 to 2096.
_EPOCH = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}
_EPOCH_S = (1e9, 4e9)
# After so many ticks counters begin at 0 again: micros() of an Arduino after 71 minutes.
_COUNTERS = (2.0**16, 2.0**24, 2.0**32)
# Late time stamps are made up for within so many samples at most.
_LONGEST_DELAY = 10_000


class Unevenness(NamedTuple):
    """How far times are from evenly spaced ones, and the share of the power that this costs.

    Parameters
    ----------
    rms_s, most_s : float
        RMS, and at most.
    share : float
        Of the power of a vibration at `highest_hz` that becomes noise in samples taken as even.
    """

    rms_s: float
    most_s: float
    share: float
    highest_hz: float

    def __str__(self) -> str:
        return (
            f"its samples are up to {self.most_s * 1e3:.2g} ms ({self.rms_s * 1e3:.2g} ms RMS) "
            f"from where even spacing within {LOCAL_S:g} s puts them"
        )


@dataclass(frozen=True, eq=False)
class TimeColumn:
    """A time column of a file.

    Parameters
    ----------
    file : str
        Name of the file, for messages.
    name : str
        The column's header.
    unit : str
        Of the time, "" where the header names none.
    values : (n,) ndarray
        In that unit.
    """

    file: str
    name: str
    unit: str
    values: Floats

    def rate_hz(self) -> float:
        """The rate by the mean step.

        Raises
        ------
        InputError
            For an unknown unit, times that fall, lost samples, and a rate that no vibration has.
        """
        if self.unit not in SECONDS_PER_UNIT:
            raise InputError(
                f"expected time in s, ms, us or ns in {self.file}, got {shown(self.unit)}; "
                "convert it or give --rate."
            )
        rate_hz, lowest_hz = 1 / self._mean_step_s(), self._lowest_hz
        if not lowest_hz < rate_hz <= HIGHEST_RATE_HZ:
            raise InputError(
                f"expected a rate above {lowest_hz:g} Hz and up to {HIGHEST_RATE_HZ:.0f} Hz in "
                f"{self.file}, got {rate_hz:.4g} Hz by its column {shown(self.name)}: is time in "
                "ms, us or ns? Name the unit in the header (time_s, time_ms, time_us, time_ns) or "
                "give --rate."
            )
        return rate_hz

    def by_rate(self, rate_hz: float) -> tuple[TimeColumn, str]:
        """The same in the unit that agrees with a rate that was given, and a sentence about it.

        As it is, with no sentence, where its own unit agrees or gives a rate that a vibration has,
        or none does.
        """
        if not self.unit or not self.has_a_rate():
            return self, ""
        by_unit = self._rates_hz(1 / self.rate_hz() / SECONDS_PER_UNIT[self.unit])
        for unit, hz in by_unit.items():
            if abs(rate_hz / hz - 1) <= RATE_TOLERANCE and unit != self.unit:
                return replace(self, unit=unit), (
                    f"{self.file}: the header {shown(self.name)} says {self.unit}, but the times "
                    f"are taken in {unit}, in which they agree with --rate {rate_hz:g}."
                )
        return self, ""

    def unit_doubt(self, shortest_s: float) -> tuple[str, bool]:
        """A sentence where its header may name the wrong unit: it gives a rate of few vibrations.

        And whether in a unit a thousandth as long the samples still last `shortest_s`, so that
        either is possible.
        """
        units = [unit for unit in SECONDS_PER_UNIT if unit]
        rate_hz = self.rate_hz()
        if self.unit not in units[:-1] or rate_hz > LOWEST_RATE_WITHOUT_TIME_UNIT_HZ:
            return "", False
        other, other_hz = units[units.index(self.unit) + 1], 1e3 * rate_hz
        return (
            f"{self.file}: expected a rate above {LOWEST_RATE_WITHOUT_TIME_UNIT_HZ:g} Hz, got "
            f"{rate_hz:.6g} Hz with times in {self.unit}, as the header {shown(self.name)} says, "
            f"or {other_hz:.6g} Hz with times in {other}; give the right one as --rate."
        ), self.values.size / other_hz >= shortest_s

    def has_a_rate(self) -> bool:
        """Whether `rate_hz` does."""
        try:
            self.rate_hz()
        except InputError:
            return False
        return True

    def without_gaps(self, given_hz: float | None) -> tuple[slice, str]:
        """The rows of the longest part whose times neither leave a gap nor jump back.

        All rows, and no sentence about it, where there is no gap or the column is none of times: it
        gives no rate, and neither agrees with the one that was given nor rises.

        docs/method/recordings.md#gaps
        """
        breaks = _breaks(self.values)
        if not breaks.size:
            return slice(0, self.values.size), ""
        steps = self.steps()
        ends = np.array([0, *(breaks + 1), self.values.size])
        longest = int(np.argmax(np.diff(ends)))
        rows = slice(int(ends[longest]), int(ends[longest + 1]))
        part = replace(self, values=self.values[rows])
        has_a_rate = part.has_a_rate()
        is_time = given_hz is not None and (part.agrees(given_hz) or (steps >= 0).all())
        if not (has_a_rate or is_time):
            return slice(0, self.values.size), ""
        if breaks.size > MOST_BREAKS and 2 * part.values.size < self.values.size:
            raise InputError(
                f"expected times with at most {MOST_BREAKS} breaks in {self.file}, got "
                f"{breaks.size}: either samples are missing, or they came in batches; record "
                "again, or remove the column of times and give --rate if they are evenly spaced."
            )
        rate_hz = part.rate_hz() if has_a_rate else given_hz or np.nan
        worst = int(breaks[np.argmax(np.abs(steps[breaks]))])
        lost_s = float(steps[worst] / part.steps().mean()) / rate_hz
        what = f"leave a gap of {lost_s:.4g} s" if lost_s > 0 else f"jump back by {-lost_s:.4g} s"
        more = f" (and {counted(breaks.size - 1, 'more break')})" if breaks.size > 1 else ""
        return rows, (
            f"{self.file}: its times {what} after row {worst + 1} of the numbers, at "
            f"{self.values[worst]:.10g} in {shown(self.name)}{more}; the longest part without a "
            f"break is taken, rows {rows.start + 1} to {rows.stop}, and "
            f"{self.values.size - part.values.size} of {self.values.size} samples are left out; "
            "record again if they are needed."
        )

    @property
    def repeats(self) -> int:
        """How many stamps are the same as the one before."""
        return int((self.steps() == 0).sum())

    def steps(self) -> Floats:
        """From each time to the next."""
        return np.diff(self.values)

    def agrees(self, rate_hz: float) -> bool:
        """Whether the mean or the typical step is that of a rate, in any unit."""
        steps = self.steps()
        if not (np.isfinite(steps).all() and (steps > 0).any()):
            return False
        both = np.array([_mean_step(self.values), np.median(steps[steps > 0])])
        ratios = rate_hz * np.outer(both, list(SECONDS_PER_UNIT.values()))
        return bool((np.abs(ratios - 1) <= RATE_TOLERANCE).any())

    def contradiction(self, rate_hz: float) -> str | None:
        """A sentence where neither the mean nor the typical step agrees with a rate that was given.

        A column of times that no vibration has in its unit may be in any; one that counts samples,
        or whose times decrease, gives no rate.
        """
        steps = np.diff(self.values)
        rises = np.isfinite(self.values).all() and (steps >= 0).all() and steps.any()
        counts = not self.unit and (steps == 1).all()
        if not rises or counts or self.unit not in SECONDS_PER_UNIT:
            return None
        # Coarse time stamps keep the mean step, lost samples the typical one.
        mean, typical = _mean_step(self.values), float(np.median(steps[steps > 0]))
        if np.isnan(mean):
            return None
        by_unit = self._rates_hz(mean)
        ratios = [rate_hz / hz * part for hz in by_unit.values() for part in (1, typical / mean)]
        if not by_unit or any(abs(ratio - 1) <= RATE_TOLERANCE for ratio in ratios):
            return None
        by_column = " or ".join(f"{hz:.4g} Hz (in {unit})" for unit, hz in by_unit.items())
        return (
            f"{self.file}: expected a --rate that agrees with the time column, got {rate_hz:g} Hz "
            f"and by its column {shown(self.name)} {by_column}; leave --rate out, or give --yes "
            "if the column is wrong."
        )

    def _rates_hz(self, step: float) -> dict[str, float]:
        """The rate by a step in the column's unit, seconds without one; or in all that fit."""
        rates = {
            unit: 1 / max(step * second, 1 / LARGEST_VALUE)
            for unit, second in SECONDS_PER_UNIT.items()
            if unit
        }
        unit = self.unit or "s"
        if LOWEST_RATE_WITHOUT_TIME_UNIT_HZ < rates[unit] <= HIGHEST_RATE_HZ:
            return {unit: rates[unit]}
        return {unit: hz for unit, hz in rates.items() if LOWEST_RATE_HZ < hz <= HIGHEST_RATE_HZ}

    @property
    def _lowest_hz(self) -> float:
        return LOWEST_RATE_HZ if self.unit else LOWEST_RATE_WITHOUT_TIME_UNIT_HZ

    def unevenness(self, rate_hz: float) -> Unevenness | None:
        """How uneven the times are, where that matters to samples that are taken as even.

        docs/method/recordings.md#uneven-samples
        """
        if not self.has_a_rate():
            return None
        rms_s, most_s = _astray(self._time_s())
        highest_hz = min(rate_hz, MODEL_RATE_HZ) / 2
        share = float(-np.expm1(-((2 * np.pi * highest_hz * rms_s) ** 2)))
        if share <= TOLERATED_NOISE_SHARE:
            return None
        return Unevenness(rms_s, most_s, share, highest_hz)

    def resampled(self, samples: Floats, rate_hz: float) -> Floats:
        """Samples (k, n) at even times of this rate, by a spline through them at their own times.

        Where a time repeats, its first sample counts.
        """
        from scipy.interpolate import make_interp_spline  # late: slow to load

        time_s = self._time_s() - self._time_s()[0]
        first = np.append(True, np.diff(time_s) > 0)
        even_s = np.arange(int(time_s[-1] * rate_hz + 1e-6) + 1) / rate_hz
        spline = make_interp_spline(time_s[first], samples[:, first], k=SPLINE_DEGREE, axis=1)
        return np.asarray(spline(np.minimum(even_s, time_s[-1])))

    def _time_s(self) -> Floats:
        return self.values * SECONDS_PER_UNIT[self.unit]

    def _mean_step_s(self) -> float:
        """Mean distance of the samples (s), which must rise evenly."""
        time_s = self._time_s()
        steps = np.diff(time_s)
        span = float(time_s[-1] - time_s[0])
        if not (np.isfinite(time_s).all() and span > 0 and (steps >= 0).all()):
            raise InputError(
                f"expected rising times in {self.file}, got some that fall, repeat or are not "
                "finite; repair the file or give --rate."
            )
        mean_step = _mean_step(time_s)
        if np.isnan(mean_step):
            raise InputError(
                f"expected times that change often enough to give a rate in {self.file}, got "
                f"{counted(int((steps > 0).sum()), 'change')} in {steps.size} steps; give --rate."
            )
        # Coarse time stamps repeat and jump by whole ticks; lost samples leave a longer gap.
        tick = float(steps[steps > 0].min())
        if steps.max() > LONGEST_GAP * max(mean_step, tick):
            typical = float(np.median(steps[steps > 0]))
            raise InputError(
                f"expected evenly spaced samples in {self.file}, got a step of {steps.max():.4g} s "
                f"among steps of typically {typical:.4g} s; give --rate, or record again."
            )
        return mean_step


def _mean_step(values: Floats) -> float:
    """Mean distance of samples; NaN where times change too rarely to tell.

    Stamps that repeat change at whole ticks only: what lies before the first and behind the last
    change is no whole tick.
    """
    steps = np.diff(values)
    changes = np.flatnonzero(steps > 0)
    if (steps != 0).all():
        return float(steps.mean())
    if changes.size < 2:
        return float("nan")
    first, last = int(changes[0]), int(changes[-1])
    return float(values[last + 1] - values[first + 1]) / (last - first)


def _breaks(values: Floats) -> NDArray[np.intp]:
    """After which rows times leave a gap or jump back.

    Time stamps may repeat and jump by whole ticks. No sample is missing at a single wrong stamp, or
    where one that came late is followed by others that came too soon.
    """
    steps = np.diff(values) if np.isfinite(values).all() else np.zeros(0)
    rising = np.sort(steps[steps > 0])
    if not rising.size:
        return np.array([], dtype=np.intp)
    typical = rising[(rising.size - 1) // 2]
    usual = np.abs(steps) <= LONGEST_GAP * typical
    spacing = float(steps[usual].mean())
    over_two = np.abs(values[2:] - values[:-2])
    one_wrong = ~usual[:-1] & ~usual[1:] & (over_two <= 2 * LONGEST_GAP * typical)
    usual[:-1] |= one_wrong
    usual[1:] |= one_wrong

    def lasts(row: int) -> bool:
        delay = int(min(steps[row] / spacing, _LONGEST_DELAY / 2)) if spacing > 0 else 0
        after = values[row + 1 : row + 2 + 2 * max(delay, 0)] - values[row]
        late = after - spacing * np.arange(1, after.size + 1)
        return steps[row] < 0 or bool(late.min() > (LONGEST_GAP - 1) * typical)

    return np.array([row for row in np.flatnonzero(~usual) if lasts(int(row))], dtype=np.intp)


def unwrapped(values: Floats) -> Floats:
    """Times of a counter that began at 0 again, as if it had gone on."""
    steps = np.diff(values) if np.isfinite(values).all() else np.zeros(0)
    if not (steps > 0).any():
        return values
    longest = LONGEST_GAP * float(np.median(steps[steps > 0]))
    for counter in _COUNTERS:
        began = (steps < 0) & (steps + counter >= 0) & (steps + counter <= longest)
        if began.any() and values.min() >= 0 and values.max() < counter:
            return values + counter * np.append(0, np.cumsum(began))
    return values


def _astray(time_s: Floats) -> tuple[float, float]:
    """How far times are from evenly spaced ones (s), RMS and at most; 0 where rounding explains it.

    Even spacing may change from one `LOCAL_S` to the next: that shifts frequencies a little, but
    makes no noise. Times that were rounded, up or down, are off by no more than the tick that they
    were rounded to, and by tick/√12 RMS.
    """
    from scipy.ndimage import uniform_filter1d  # late: slow to load

    place = np.arange(time_s.size) - (time_s.size - 1) / 2
    off = time_s - time_s.mean()
    off -= place * float(place @ off / (place @ place))
    nearby = round(LOCAL_S / float(np.diff(time_s).mean()))
    if 1 < nearby < off.size:
        off -= uniform_filter1d(off, nearby, mode="nearest")
    steps = np.sort(np.append(np.diff(time_s), 0.0))
    # Closer than this steps are equal, but for the last digits of the time.
    same = max(1e-6 * float(steps.mean()), 4 * float(np.spacing(np.abs(time_s).max())))
    ticks = np.diff(steps)
    tick = float(ticks[ticks > same].min(initial=steps[-1]))
    if 2 * np.count_nonzero(steps <= same) > steps.size:  # mostly repeats: each step is a tick
        tick = float(steps[-1])
    most = float(np.abs(off).max())
    if most <= tick:
        return 0.0, 0.0
    return float(np.sqrt(max(float(np.mean(off**2)) - tick**2 / 12, 0.0))), most


def since_first(values: Floats, cells: Sequence[str]) -> tuple[Floats, str]:
    """Times, read from these cells, and their unit where they count from 1970, else "".

    Whole numbers that floating-point ones would round (those of nanoseconds to 256 ns) are given
    from the first one on.
    """
    unit = _unit_since_1970(float(values[0]))
    if abs(values[0]) > 2**53 and all(re.fullmatch(r"\s*\d+\s*", cell) for cell in cells):
        first = int(cells[0])
        values = np.array([int(cell) - first for cell in cells], dtype=np.float64)
    return values, unit


def _unit_since_1970(time: float) -> str:
    low, high = _EPOCH_S
    return next((unit for unit, per_s in _EPOCH.items() if low <= time / per_s < high), "")
