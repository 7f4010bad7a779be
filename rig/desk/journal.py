"""Rows read from a rig's shared memory, kept until somebody takes them: hand, blocks played.

docs/method/live.md#shared-memory
"""

from __future__ import annotations

import threading
from dataclasses import dataclass, field
from math import inf, nan

import numpy as np

from tactileq.modeling.arrays import Floats
from tactileq.rig.shared.interface import SURFACES, HandRows, Surface
from tactileq.rig.shared.live.memory import (
    BEYOND,
    BUTTON,
    FORCE_ASSUMED,
    FORCE_COMMANDED,
    GONE,
    STALE,
    UNDERFLOW,
    Live,
    Rows,
)

LOOK_S = 1.0  # from one look to the next; the memory holds half a minute


@dataclass
class Played:
    """What the blocks of one presentation add up to.

    Parameters
    ----------
    misses, stale : int
        Blocks.
    end_s : float
        When the last sample left, by `now_s`; NaN without blocks.
    """

    frames: int = 0
    square_sum_g2: float = 0.0
    weighted_square_sum_g2: float = 0.0
    peak_g: float = 0.0
    misses: int = 0
    stale: int = 0
    end_s: float = nan

    def add(self, blocks: Rows, rate_hz: float) -> None:
        """Add n blocks (BLOCK), at least one."""
        self.frames += int(blocks["frames"].sum())
        self.square_sum_g2 += float(blocks["square_sum_g2"].sum())
        self.weighted_square_sum_g2 += float(blocks["weighted_square_sum_g2"].sum())
        self.peak_g = max(self.peak_g, float(blocks["peak_g"].max()))
        self.misses += int(np.count_nonzero(blocks["flags"] & UNDERFLOW))
        self.stale += int(np.count_nonzero(blocks["flags"] & STALE))
        self.end_s = float(blocks["dac_time_s"][-1]) + int(blocks["frames"][-1]) / rate_hz


@dataclass
class _Segment:
    """Time (by `now_s`) during which one thing was presented."""

    surface: Surface
    number: int
    start_s: float
    end_s: float = inf


@dataclass
class Journal:
    """Follows the shared memory by itself; used in a `with` block.

    Parameters
    ----------
    opened_s : float
        Zero of the rig's clock, by `now_s`.
    rate_hz : float
        Of the card.
    real_measured : bool
        Whether the hand is measured on the real surface, too.

    Attributes
    ----------
    misses, stale : int
        Blocks so far.
    lost : int
        Readings and blocks that were overwritten before they were looked at.
    """

    live: Live
    opened_s: float
    rate_hz: float
    real_measured: bool
    misses: int = 0
    stale: int = 0
    lost: int = 0
    _played: dict[int, Played] = field(default_factory=dict)
    _segments: list[_Segment] = field(default_factory=list)
    _readings: list[Rows] = field(default_factory=list)
    _button: bool = False
    _pressed: bool = False

    def __post_init__(self) -> None:
        self._seen_readings = self.live.readings_written
        self._seen_blocks = self.live.blocks_written
        self._lock = threading.RLock()
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._follow, daemon=True)

    def __enter__(self) -> Journal:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._closing.set()
        self._thread.join()

    def _follow(self) -> None:
        while not self._closing.wait(LOOK_S):
            self.look()

    def look(self) -> None:
        """Read what is new."""
        with self._lock:
            self._look_at_readings()
            self._look_at_blocks()

    def _look_at_readings(self) -> None:
        before = self._seen_readings
        self._seen_readings, rows = self.live.readings_since(before)
        self.lost += self._seen_readings - before - rows.size
        if not rows.size:
            return
        down = (rows["flags"] & BUTTON) > 0
        self._pressed |= bool(np.any(down & ~np.concatenate(([self._button], down[:-1]))))
        self._button = bool(down[-1])
        self._readings.append(rows)

    def _look_at_blocks(self) -> None:
        before = self._seen_blocks
        self._seen_blocks, rows = self.live.blocks_since(before)
        self.lost += self._seen_blocks - before - rows.size
        self.misses += int(np.count_nonzero(rows["flags"] & UNDERFLOW))
        for number in np.unique(rows["presentation"]):
            blocks = rows[rows["presentation"] == number]
            if number:
                self.stale += int(np.count_nonzero(blocks["flags"] & STALE))
                self._played.setdefault(int(number), Played()).add(blocks, self.rate_hz)

    def begin(self, surface: Surface, number: int, *, start_s: float) -> None:
        """From now on this is presented (time by `now_s`)."""
        with self._lock:
            self._segments.append(_Segment(surface, number, start_s))

    def end(self, end_s: float) -> None:
        """What was presented last ended then."""
        with self._lock:
            self._segments[-1].end_s = end_s

    def take_played(self, number: int) -> Played:
        """Of a presentation of the card that has ended."""
        with self._lock:
            self.look()
            return self._played.pop(number, Played())

    def take_pressed(self) -> bool:
        """Whether the button was pressed since the last call."""
        with self._lock:
            self.look()
            pressed, self._pressed = self._pressed, False
            return pressed

    def take_rows(self) -> HandRows:
        """The hand since the last call."""
        with self._lock:
            self.look()
            taken, self._readings = self._readings, []
            if not taken:
                return HandRows.joined([])
            rows = self._as_rows(np.concatenate(taken))
            self._segments = [segment for segment in self._segments if segment.end_s == inf]
            return rows

    def _as_rows(self, readings: Rows) -> HandRows:
        time_s: Floats = readings["time_s"]
        surface = np.zeros(readings.size, dtype=np.int_)
        presentation = np.zeros(readings.size, dtype=np.int_)
        for segment in self._segments:
            within = (time_s >= segment.start_s) & (time_s < segment.end_s)
            surface[within] = SURFACES.index(segment.surface)
            presentation[within] = segment.number
        gone = (readings["flags"] & GONE) > 0
        on_real = surface == SURFACES.index("real")
        unknown = gone | on_real if not self.real_measured else gone
        commanded = (readings["flags"] & FORCE_COMMANDED) > 0
        # What a device commands says nothing of the force on the real surface.
        no_force = unknown | (commanded & on_real)
        return HandRows(
            time_s=time_s - self.opened_s,
            speed_mm_s=np.where(unknown, nan, readings["speed_mm_s"]),
            force_n=np.where(no_force, nan, readings["force_n"]),
            surface=surface,
            presentation=presentation,
            force_assumed=((readings["flags"] & FORCE_ASSUMED) > 0) & ~unknown,
            **{
                name: np.where(gone | ~commanded, nan, readings[name])
                for name in ("x_mm", "y_mm", "depth_mm")
            },
            force_commanded=commanded & ~no_force,
            beyond_edge=(readings["flags"] & BEYOND) > 0,
        )
