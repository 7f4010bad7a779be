"""Recording by hand: a stream of acceleration and a stream of readings fill a grid.

docs/method/strokes.md
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from tactileq.modeling.arrays import Floats
from tactileq.modeling.errors import InputError
from tactileq.modeling.models.grid import Condition
from tactileq.rig.recording.capture.clock import SampleClock
from tactileq.rig.recording.capture.coverage import Coverage, advice
from tactileq.rig.recording.capture.cutting import (
    CLIPPED_FROM,
    Readings,
    StrokeCutter,
    StrokePart,
    on_surface,
)
from tactileq.rig.recording.capture.grid import NOWHERE, StrokeGrid
from tactileq.rig.recording.capture.input import InputBlock
from tactileq.rig.recording.capture.pieces import PieceStore
from tactileq.rig.shared.live.memory import FORCE_ASSUMED

RECENT_S = 1.0
# Slower than that a hand rests, or turns round.
RESTING_MM_S = 5.0
LEAST_REST_S = 0.5
LOWEST_HZ, HIGHEST_HUM_HZ = 10.0, 1000.0
MOSTLY_OUTSIDE = 0.5
# Reported once a hand has moved for this long.
JUDGED_FROM_S = 10.0


class AccelerationSource(Protocol):
    """Where blocks of acceleration come from, such as an `AudioInput` (input.py)."""

    @property
    def running(self) -> bool:
        """Whether more may come."""

    def read(self) -> list[InputBlock]:
        """The blocks since the last call."""


@dataclass(frozen=True)
class InputLevel:
    """The input lately, in g: RMS and peak over 1 s, and the RMS at rest (NaN before any)."""

    rms_g: float
    peak_g: float
    floor_g: float
    full_scale_g: float
    clipping: bool


@dataclass(frozen=True)
class HandLately:
    """The hand over the last second: speed of its strokes, its force, whether it touches."""

    speed_mm_s: float
    force_n: float
    touching: bool


class StrokeRecorder:
    """Takes new data of both streams, cuts them, keeps the pieces, and reports the progress.

    Parameters
    ----------
    readings : callable
        Gives the readings of the hand since its last call.
    store : PieceStore
        Its plan says grid and rate.
    g_per_fullscale : float
        Of the source, > 0.
    speed_delay_s : float
        By which the hand's speeds are older than their readings.
    """

    def __init__(
        self,
        source: AccelerationSource,
        readings: Callable[[], Readings],
        *,
        store: PieceStore,
        g_per_fullscale: float,
        speed_delay_s: float = 0.0,
    ) -> None:
        plan = store.plan
        self.store = store
        self.lost = 0
        self._source, self._take_readings = source, readings
        self._scale_g = g_per_fullscale
        self._clock = SampleClock(plan.rate_hz)
        self._cutter = StrokeCutter(
            plan.grid,
            plan.rate_hz,
            g_per_fullscale=g_per_fullscale,
            longest_s=plan.wanted_s,
            speed_delay_s=speed_delay_s,
        )
        self._meter = _Meter(plan.rate_hz, g_per_fullscale)
        self._trace = _Trace(plan.grid)
        self._target: Condition | None = None

    def step(self) -> None:
        """Take what has come; to be called several times a second.

        Raises
        ------
        InputError
            Once the source has ended, and for an assumed force where the grid has several.
        """
        running = self._source.running
        blocks, readings = self._source.read(), self._take_readings()
        self._trace.add(readings)
        assumed = readings[on_surface(readings) & (readings["flags"] & FORCE_ASSUMED > 0)]
        if assumed.size:
            check_assumed_force(self.store.plan.grid, float(assumed["force_n"][0]))
        for place, block in enumerate(blocks):
            self._take(block, readings if place == 0 else readings[:0])
        if not blocks and readings.size:
            self._keep(self._cutter.feed(np.zeros(0), np.zeros(0), readings))
        if not running:
            self.end()
            raise InputError(
                "expected the sound card to go on, got an end of its stream; plug it in again, or "
                "start the audio server, and record again: what was recorded is kept."
            )

    def end(self) -> None:
        """Keep the piece that is still open."""
        self._keep(self._cutter.end_stroke())
        floor_g = self._meter.level().floor_g
        about = {
            "clock_drift_ppm": round(self._clock.drift_ppm, 1),
            "clock_jitter_ms": round(1000 * self._clock.jitter_s, 3),
            "lost_at_places": self.lost,
            "rms_at_rest_g": None if np.isnan(floor_g) else floor_g,
        }
        self.store.finish({"input": about})

    @property
    def coverage(self) -> Coverage:
        """How far the grid is filled."""
        return self.store.coverage

    @property
    def level(self) -> InputLevel:
        """The input lately."""
        return self._meter.level()

    @property
    def hand(self) -> HandLately:
        """The hand lately."""
        return self._trace.lately()

    @property
    def condition(self) -> Condition | None:
        """The cell that the hand is in now."""
        return self._cutter.condition

    def target(self, coverage: Coverage) -> tuple[Condition | None, list[str]]:
        """The cell to stroke next, and what the hand has to change to come there."""
        hand = self.hand
        target = coverage.next_condition(hand.speed_mm_s, hand.force_n, current=self._target)
        if target is None or not hand.touching:
            return target, []
        self._target = target
        words = advice(coverage.grid, target, speed_mm_s=hand.speed_mm_s, force_n=hand.force_n)
        return target, words

    @property
    def outside_share(self) -> float:
        """Share (0–1) of the moving hand's readings that lie beyond the outermost cells."""
        return self._trace.outside_share

    def warnings(self) -> list[str]:
        """One warning for everything that slows the recording down or impairs it."""
        sentences = list(self.store.damaged)
        if self.lost:
            sentences.append(
                f"samples of the input were lost at {self.lost} places, and pieces end there; "
                "close other programs, or choose a lower rate."
            )
        if clipped := self.store.counts["clipped"]:
            sentences.append(
                f"{clipped} pieces were clipped and are not used; turn the gain of the input down, "
                "and its g per full scale up with it."
            )
        if silent := self.store.counts["silent"]:
            sentences.append(
                f"the input was entirely silent in {silent} pieces, which are not used; check its "
                "channel, and cable and power of the accelerometer."
            )
        if hum_hz := self._meter.hum_hz:
            sentences.append(
                f"the input at rest is mostly hum of {hum_hz:g} Hz and its multiples, which cannot "
                "be removed from strokes; use a battery, another socket or a balanced cable."
            )
        outside = self.outside_share
        if self._trace.moving_s >= JUDGED_FROM_S and outside > MOSTLY_OUTSIDE:
            (slow, fast), (light, hard) = (
                one.ravel()[[0, -1]] for one in self._cutter.grid.bounds()
            )
            sentences.append(
                f"the hand was outside of the grid ({slow:.3g} to {fast:.3g} mm/s, {light:.2g} to "
                f"{hard:.2g} N) for {outside:.0%} of the time that it moved; stroke within it, or "
                "find your own range with tactileq rig range."
            )
        return sentences

    def _take(self, block: InputBlock, readings: Readings) -> None:
        if block.lost:
            self.lost += 1
            self._keep(self._cutter.end_stroke())
            self._clock.restart()
        self._clock.add(block.position, block.time_s)
        time_s = self._clock.times_s(block.position, block.samples.size)
        self._meter.add(block.samples, resting=self._trace.resting)
        self._keep(self._cutter.feed(block.samples, time_s, readings))

    def _keep(self, pieces: list[StrokePart]) -> None:
        for piece in pieces:
            self.store.add(piece)


def check_assumed_force(grid: StrokeGrid, force_n: float) -> None:
    """Refuse a hand whose force (N) is assumed where the grid has several, or another one.

    Raises
    ------
    InputError
    """
    if grid.forces_n.size > 1:
        raise InputError(
            f"expected a hand whose force is measured for a grid of {grid.forces_n.size} forces, "
            "got one whose force is assumed; give a grid of one force (tactileq rig range), or use "
            "a tablet that measures pressure."
        )
    if grid.cells(grid.speeds_mm_s[:1], [force_n])[0] == NOWHERE:
        raise InputError(
            f"expected an assumed force within the grid's cell of {grid.forces_n[0]:g} N, got "
            f"{force_n:g} N; correct the grid or what is assumed."
        )


class _Meter:
    """InputLevel, clipping and floor of the input."""

    def __init__(self, rate_hz: float, g_per_fullscale: float) -> None:
        self._rate_hz = rate_hz
        self._scale_g = g_per_fullscale
        self._recent: deque[Floats] = deque()
        self._rest: list[Floats] = []
        self._floor_g = np.nan
        self.hum_hz = 0.0  # of the mains, where they are most of what is there at rest

    def add(self, samples: Floats, *, resting: bool) -> None:
        """Take a block; `resting`: the hand neither moves nor has just moved."""
        self._recent.append(samples)
        while sum(x.size for x in self._recent) - self._recent[0].size > self._rate_hz * RECENT_S:
            self._recent.popleft()
        self._rest = [*self._rest, samples] if resting else []
        if sum(x.size for x in self._rest) >= LEAST_REST_S * self._rate_hz:
            rest = np.concatenate(self._rest)
            self._rest = []
            found = self._scale_g * _rms(rest)
            if not found >= self._floor_g:  # the lowest so far, or the first
                self._floor_g, self.hum_hz = found, mains_in(rest, self._rate_hz)

    def level(self) -> InputLevel:
        """As it is now; all 0 before the first block."""
        samples = np.concatenate(self._recent) if self._recent else np.zeros(1)
        peak = float(np.abs(samples).max())
        return InputLevel(
            self._scale_g * _rms(samples),
            self._scale_g * peak,
            self._floor_g,
            self._scale_g,
            clipping=peak >= CLIPPED_FROM,
        )


class _Trace:
    """The hand lately, and how much of its time it is outside of the grid."""

    def __init__(self, grid: StrokeGrid) -> None:
        self.range = [float(axis.ravel()[end]) for axis in grid.bounds() for end in (0, -1)]
        self._recent: Readings | None = None
        self._moving = 0
        self._outside = 0
        self._seconds = 0.0

    def add(self, readings: Readings) -> None:
        if not readings.size:
            return
        before = readings[:0] if self._recent is None else self._recent
        last_s = before["time_s"][-1] if before.size else readings["time_s"][0]
        steps = np.diff(readings["time_s"], prepend=last_s)
        moving = on_surface(readings) & (np.abs(readings["speed_mm_s"]) > RESTING_MM_S)
        slow, fast, light, hard = self.range
        speed, force = np.abs(readings["speed_mm_s"]), readings["force_n"]
        inside = (speed >= slow) & (speed < fast) & (force >= light) & (force < hard)
        self._seconds += float(steps[moving].sum())
        self._moving += int(moving.sum())
        self._outside += int((moving & ~inside).sum())
        every = np.concatenate((before, readings))
        self._recent = every[every["time_s"] > every["time_s"][-1] - RECENT_S]

    @property
    def moving_s(self) -> float:
        """Seconds that the hand has moved on the surface."""
        return self._seconds

    @property
    def outside_share(self) -> float:
        return self._outside / max(self._moving, 1)

    @property
    def resting(self) -> bool:
        """Whether the hand has been still, or off the surface, for the last half second."""
        if self._recent is None:
            return False
        late = self._recent[self._recent["time_s"] > self._recent["time_s"][-1] - LEAST_REST_S]
        return not (on_surface(late) & (np.abs(late["speed_mm_s"]) > RESTING_MM_S)).any()

    def lately(self) -> HandLately:
        """Speed: what the strokes reach and hold, and not what they pass when turning round."""
        recent = self._recent
        touching = recent is not None and bool(on_surface(recent)[-1:].any())
        if recent is None or not on_surface(recent).any():
            return HandLately(0.0, 0.0, touching)
        there = recent[on_surface(recent)]
        speed = float(np.percentile(np.abs(there["speed_mm_s"]), 80))
        return HandLately(speed, float(np.median(there["force_n"])), touching)


def mains_in(samples: Floats, rate_hz: float) -> float:
    """50 or 60 Hz where most of the power from 10 Hz on is there and at multiples, else 0."""
    power = np.abs(np.fft.rfft(np.hanning(samples.size) * (samples - samples.mean()))) ** 2
    frequency = np.fft.rfftfreq(samples.size, 1 / rate_hz)
    power[frequency < LOWEST_HZ] = 0
    for mains_hz in (50.0, 60.0):
        apart = np.abs(frequency - mains_hz * np.maximum(np.rint(frequency / mains_hz), 1))
        near = (apart <= 2 * frequency[1]) & (frequency <= HIGHEST_HUM_HZ)
        if power[near].sum() > power.sum() / 2:
            return mains_hz
    return 0.0


def _rms(samples: Floats) -> float:
    """About the mean, since gravity is not a vibration."""
    return float(np.std(samples))
