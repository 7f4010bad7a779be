"""Free strokes cut into pieces of one condition each, by the hand's own trace.

docs/method/strokes.md#cutting
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tactileq.modeling.arrays import Bools, Floats, Integers
from tactileq.modeling.checks import check_rate
from tactileq.modeling.errors import InputError
from tactileq.modeling.models.grid import Condition
from tactileq.modeling.recordings.recording import clipped_samples
from tactileq.rig.recording.capture.grid import NOWHERE, StrokeGrid
from tactileq.rig.shared.live.memory import CONTACT, FORCE_ASSUMED, GONE, READING, SIMULATED

SHORTEST_PART_S = 0.1
# Half of what spectra are high-passed at, so that the filter changes nothing that is modelled.
STROKE_HIGH_PASS_HZ = 5.0
# Between readings further apart the hand's motion is unknown.
LONGEST_GAP_S = 0.05
# Of the full scale: the highest step of 16 bits, and converters that stop short of it.
CLIPPED_FROM = 0.999
Readings = NDArray[np.void]


@dataclass(frozen=True, eq=False)
class StrokePart:
    """A part of a stroke during which the hand stayed in one cell of the grid.

    Parameters
    ----------
    condition : (float, float)
        Speed (mm/s) and force (N) of the cell.
    samples_g : (n,) ndarray
        Acceleration in g, high-passed at 5 Hz.
    start_s : float
        Time of the first sample, on the clock of the readings.
    mean_speed_mm_s, speed_sd_mm_s, mean_force_n, force_sd_n : float
        Of the hand within the piece.
    clipped : bool
        Whether a sample is at the limit of the input.
    silent : bool
        Whether the input gave one and the same value all the time.
    simulated, force_assumed : bool
        As the readings say.
    """

    condition: Condition
    samples_g: Floats
    start_s: float
    mean_speed_mm_s: float
    speed_sd_mm_s: float
    mean_force_n: float
    force_sd_n: float
    clipped: bool
    silent: bool
    simulated: bool
    force_assumed: bool


class _Hand(NamedTuple):
    """The hand at each of n samples; NaN where it is not known."""

    speed_mm_s: Floats
    force_n: Floats
    simulated: Bools
    force_assumed: Bools

    def part(self, begin: int, end: int) -> _Hand:
        return _Hand(
            self.speed_mm_s[begin:end],
            self.force_n[begin:end],
            self.simulated[begin:end],
            self.force_assumed[begin:end],
        )


class StrokeCutter:
    """Cuts a stream of acceleration into pieces as it comes; blocks of any size give the same.

    Parameters
    ----------
    rate_hz : float
        Of the acceleration.
    g_per_fullscale : float
        Acceleration of a sample of 1, > 0.
    longest_s : float
        Longer stays in a cell become several pieces; at least twice the shortest piece (100 ms).
    speed_delay_s : float
        By which a reading's speed is older than its time and force, ≥ 0: a filter's delay.
    """

    def __init__(
        self,
        grid: StrokeGrid,
        rate_hz: float,
        *,
        g_per_fullscale: float,
        longest_s: float = 1.0,
        speed_delay_s: float = 0.0,
    ) -> None:
        check_rate(rate_hz)
        if rate_hz * SHORTEST_PART_S < 64:
            raise InputError(
                f"expected a rate of at least {64 / SHORTEST_PART_S:g} Hz to cut pieces of "
                f"{SHORTEST_PART_S:g} s, got {rate_hz:g} Hz; record faster."
            )
        if longest_s < 2 * SHORTEST_PART_S:
            raise InputError(
                f"expected pieces of up to {2 * SHORTEST_PART_S:g} s or more, got {longest_s:g} s; "
                "record longer."
            )
        self.grid = grid
        self._scale_g = g_per_fullscale
        self._delay_s = speed_delay_s
        self._shortest = round(SHORTEST_PART_S * rate_hz)
        self._longest = round(longest_s * rate_hz)
        self._high_pass = _HighPass(rate_hz)
        self._waiting = _no_samples()
        self._readings: Readings = np.zeros(0, dtype=READING)
        self._run = _Run(NOWHERE)

    @property
    def condition(self) -> Condition | None:
        """The cell that the hand was in at the last sample that was cut."""
        cell = self._run.cell
        return None if cell == NOWHERE else self.grid.conditions[cell]

    def feed(self, samples: Floats, time_s: Floats, readings: Readings) -> list[StrokePart]:
        """Take what came since the last call; the pieces that ended in it.

        Parameters
        ----------
        samples : (n,) ndarray
            Shares of full scale; they follow on those before.
        time_s : (n,) ndarray
            When each was measured, on the clock of the readings.
        readings : (m,) ndarray of READING
            In order of time. Samples wait until a reading after them has come.
        """
        self._readings = np.concatenate((self._readings, readings))
        new = np.stack((time_s, samples, self._scale_g * self._high_pass(samples)))
        self._waiting = np.concatenate((self._waiting, new), axis=1)
        if not self._readings.size:
            return []
        # Added as in `_hand_at`: by its rounding a sample is known, or waits.
        needed_s = self._waiting[0] + self._delay_s
        known = int(np.searchsorted(needed_s, self._readings["time_s"][-1], side="right"))
        ready, self._waiting = self._waiting[:, :known], self._waiting[:, known:]
        hand = _hand_at(ready[0], self._readings, speed_delay_s=self._delay_s)
        if ready.size:
            self._forget_readings(float(ready[0, -1]))
        return self._cut(ready, hand)

    def end_stroke(self) -> list[StrokePart]:
        """End the open piece: what comes next does not follow on what came (samples were lost)."""
        self._waiting = _no_samples()
        self._high_pass.restart()
        return self._close()

    def _cut(self, ready: Floats, hand: _Hand) -> list[StrokePart]:
        pieces: list[StrokePart] = []
        cells = self.grid.cells(hand.speed_mm_s, hand.force_n)
        edges = np.flatnonzero(np.diff(cells)) + 1
        for begin, end in zip([0, *edges], [*edges, cells.size], strict=True):
            if begin == end:
                continue
            if cells[begin] != self._run.cell:
                pieces += self._close()
                self._run = _Run(int(cells[begin]))
            if self._run.cell != NOWHERE:
                self._run.add(ready[:, begin:end], hand.part(begin, end))
                pieces += self._split()
        return pieces

    def _split(self) -> list[StrokePart]:
        """The pieces of full length that the open run holds."""
        pieces = []
        while self._run.size >= self._longest:
            first, rest = self._run.split(self._longest)
            pieces.append(self._piece(first))
            self._run = rest
        return pieces

    def _close(self) -> list[StrokePart]:
        run, self._run = self._run, _Run(NOWHERE)
        return [self._piece(run)] if run.size >= self._shortest else []

    def _piece(self, run: _Run) -> StrokePart:
        samples, hand = run.whole()
        speed = np.abs(hand.speed_mm_s)
        return StrokePart(
            self.grid.conditions[run.cell],
            samples[2],
            float(samples[0, 0]),
            float(speed.mean()),
            float(speed.std()),
            float(hand.force_n.mean()),
            float(hand.force_n.std()),
            clipped=is_clipped(samples[1]),
            silent=bool(np.ptp(samples[1]) == 0),
            simulated=bool(hand.simulated.any()),
            force_assumed=bool(hand.force_assumed.any()),
        )

    def _forget_readings(self, until_s: float) -> None:
        """Drop the readings that only samples up to a time lie between."""
        after = int(np.searchsorted(self._readings["time_s"], until_s, side="right"))
        self._readings = self._readings[max(after - 1, 0) :]


class _Run:
    """Samples of one cell so far."""

    def __init__(self, cell: int) -> None:
        self.cell = cell
        self.size = 0
        self._samples: list[Floats] = []
        self._hands: list[_Hand] = []

    def add(self, samples: Floats, hand: _Hand) -> None:
        self._samples.append(samples)
        self._hands.append(hand)
        self.size += samples.shape[1]

    def whole(self) -> tuple[Floats, _Hand]:
        columns = zip(*self._hands, strict=True)
        return np.concatenate(self._samples, axis=1), _Hand(*map(np.concatenate, columns))

    def split(self, count: int) -> tuple[_Run, _Run]:
        samples, hand = self.whole()
        first, rest = _Run(self.cell), _Run(self.cell)
        first.add(samples[:, :count], hand.part(0, count))
        rest.add(samples[:, count:], hand.part(count, self.size))
        return first, rest


class _HighPass:
    """Removes gravity and the swinging of the arm from a stream, before it is cut."""

    def __init__(self, rate_hz: float) -> None:
        from scipy.signal import butter, sosfilt_zi

        self._sections = butter(4, STROKE_HIGH_PASS_HZ, btype="highpass", fs=rate_hz, output="sos")
        self._settled = sosfilt_zi(self._sections)
        self._state: Floats | None = None

    def restart(self) -> None:
        self._state = None

    def __call__(self, samples: Floats) -> Floats:
        from scipy.signal import sosfilt

        if not samples.size:
            return samples
        if self._state is None:
            self._state = self._settled * samples[0]
        filtered, self._state = sosfilt(self._sections, samples, zi=self._state)
        high: Floats = filtered
        return high


def cut_strokes(
    samples: Floats,
    time_s: Floats,
    readings: Readings,
    *,
    grid: StrokeGrid,
    rate_hz: float,
    g_per_fullscale: float = 1.0,
    longest_s: float = 1.0,
    speed_delay_s: float = 0.0,
) -> dict[Condition, list[StrokePart]]:
    """The pieces of a whole recording of strokes, by condition.

    Parameters
    ----------
    samples, time_s : (n,) ndarray
        Shares of full scale without a gap, and when each was measured.
    readings : (m,) ndarray of READING
        The hand, in order of time, on the same clock.
    g_per_fullscale : float
        Acceleration of a sample of 1, > 0.
    longest_s, speed_delay_s : float
        As of `StrokeCutter`.
    """
    cutter = StrokeCutter(
        grid,
        rate_hz,
        g_per_fullscale=g_per_fullscale,
        longest_s=longest_s,
        speed_delay_s=speed_delay_s,
    )
    pieces = [*cutter.feed(samples, time_s, readings), *cutter.end_stroke()]
    return by_condition(pieces)


def by_condition(pieces: Iterable[StrokePart]) -> dict[Condition, list[StrokePart]]:
    """Pieces under the condition that each belongs to, in their order."""
    found: dict[Condition, list[StrokePart]] = {}
    for piece in pieces:
        found.setdefault(piece.condition, []).append(piece)
    return found


def is_clipped(samples: Floats) -> bool:
    """Whether (n,) shares of full scale reach it, or pile up below it."""
    reaches = float(np.abs(samples).max(initial=0.0)) >= CLIPPED_FROM
    return reaches or bool(samples.any() and clipped_samples(samples).any())


def _no_samples() -> Floats:
    """Rows: time, share of full scale, acceleration."""
    return np.zeros((3, 0))


def _hand_at(time_s: Floats, readings: Readings, *, speed_delay_s: float) -> _Hand:
    """The hand at (n,) times, linear between readings that are near each other in time."""
    if readings.size < 2:
        nothing, never = np.full(time_s.size, np.nan), np.zeros(time_s.size, dtype=np.bool_)
        return _Hand(nothing, nothing, never, never)
    speed, flags = _between(time_s + speed_delay_s, readings, "speed_mm_s")
    force, _ = _between(time_s, readings, "force_n")
    return _Hand(speed, force, (flags & SIMULATED) > 0, (flags & FORCE_ASSUMED) > 0)


def _between(time_s: Floats, readings: Readings, name: str) -> tuple[Floats, Integers]:
    """A quantity at (n,) times, NaN where it is not known, and the flags that hold there."""
    valid = on_surface(readings)
    after = np.searchsorted(readings["time_s"], time_s, side="left").clip(1, readings.size - 1)
    before = after - 1
    first, last = readings["time_s"][before], readings["time_s"][after]
    inside = (first <= time_s) & (time_s <= last) & (last - first <= LONGEST_GAP_S)
    inside &= valid[before] & valid[after]
    values = np.where(inside, np.interp(time_s, readings["time_s"], readings[name]), np.nan)
    return values, readings["flags"][before] | readings["flags"][after]


def on_surface(readings: Any) -> Bools:
    """Which of (n,) readings are of a hand on a surface."""
    flags = readings["flags"]
    valid = np.isfinite(readings["speed_mm_s"]) & np.isfinite(readings["force_n"])
    surface: Bools = valid & (flags & CONTACT > 0) & (flags & GONE == 0)
    return surface
