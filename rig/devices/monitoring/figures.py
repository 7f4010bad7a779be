"""Figures of a running rig from its shared memory."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from tactileq.modeling.arrays import Floats
from tactileq.rig.shared.live.memory import (
    BLOCK,
    FORCE_ASSUMED,
    GONE,
    SIMULATED,
    STALE,
    UNDERFLOW,
    Live,
    Rows,
    reading_ages_s,
)

LEVEL_S = 0.5
AT_LIMIT = 0.999
_COUNTED = ("blocks", "misses", "stale_blocks", "limited_blocks")
Range = tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class Snapshot:
    """A rig now, and since it is watched.

    Parameters
    ----------
    speed_mm_s, force_n : float
        Of the hand; NaN before its first reading.
    hand : str
        "gone", "simulated" or "force assumed" where it is so, else empty.
    in_grid : bool, optional
        Whether the hand is within what was recorded; None where nothing plays.
    rms_g, peak_g : float
        Over the last half second.
    limit_g : float
        Of the peak.
    limited_blocks : int
        Blocks so far whose peak was at the limit.
    blocks, misses, stale_blocks : int
        So far: all, those that the card had to do without, those without a fresh reading.
    reading_ms, output_ms : float
        Medians of the last half second: age of the reading in a block, and from the block to the
        output as the driver states it.
    share_p50, share_p999 : float
        Of a block's time that the callback took, since the beginning.
    """

    speed_mm_s: float
    force_n: float
    hand: str
    in_grid: bool | None
    rms_g: float
    peak_g: float
    limit_g: float
    limited_blocks: int
    blocks: int
    misses: int
    stale_blocks: int
    reading_ms: float
    output_ms: float
    share_p50: float
    share_p999: float


class Monitor:
    """Follows a rig through its shared memory; other processes are not touched.

    Parameters
    ----------
    rate_hz : float
        Of the card.
    peak_g : float
        The limit.
    grid : ((low, high), (low, high)), optional
        Speeds and forces of the model that plays.
    """

    def __init__(
        self, live: Live, *, rate_hz: float, peak_g: float, grid: tuple[Range, Range] | None = None
    ) -> None:
        self._live, self._rate_hz, self._limit_g, self._grid = live, rate_hz, peak_g, grid
        self._blocks, self._readings = live.blocks_written, live.readings_written
        self._recent_blocks: Rows = np.zeros(0, dtype=BLOCK)
        self._recent_readings: Floats = np.zeros(0)
        self._shares: list[Floats] = []
        self._counts: dict[str, Any] = dict.fromkeys(_COUNTED, 0)

    def look(self) -> Snapshot:
        """The rig now."""
        before = self._blocks
        self._blocks, blocks = self._live.blocks_since(self._blocks)
        self._readings, readings = self._live.readings_since(self._readings)
        self._count(blocks, self._blocks - before)
        self._recent_blocks = self._recent(np.concatenate([self._recent_blocks, blocks]))
        times = np.concatenate([self._recent_readings, readings["time_s"]])
        self._recent_readings = times[-2000:]
        return Snapshot(**self._hand(), **self._level(), **self._delays(), **self._counts)

    def _count(self, blocks: Rows, written: int) -> None:
        self._counts["blocks"] += written
        self._counts["misses"] += int(np.count_nonzero(blocks["flags"] & UNDERFLOW))
        self._counts["stale_blocks"] += int(np.count_nonzero(blocks["flags"] & STALE))
        limited = blocks["peak_g"] >= AT_LIMIT * self._limit_g
        self._counts["limited_blocks"] += int(np.count_nonzero(limited))
        self._shares.append(blocks["seconds"] / (blocks["frames"] / self._rate_hz))

    def _recent(self, blocks: Rows) -> Rows:
        if not blocks.size:
            return blocks
        recent: Rows = blocks[blocks["time_s"] > blocks["time_s"][-1] - LEVEL_S]
        return recent

    def _hand(self) -> dict[str, Any]:
        reading = self._live.latest()
        if reading is None:
            return {"speed_mm_s": np.nan, "force_n": np.nan, "hand": "gone", "in_grid": None}
        flags = int(reading["flags"])
        marks = {GONE: "gone", SIMULATED: "simulated", FORCE_ASSUMED: "force assumed"}
        speed, force = float(reading["speed_mm_s"]), float(reading["force_n"])
        return {
            "speed_mm_s": speed,
            "force_n": force,
            "hand": ", ".join(words for flag, words in marks.items() if flags & flag),
            "in_grid": None if self._grid is None else _within(abs(speed), force, self._grid),
        }

    def _level(self) -> dict[str, Any]:
        rows = self._recent_blocks
        frames = int(rows["frames"].sum())
        mean_square = float(rows["square_sum_g2"].sum()) / frames if frames else 0.0
        peak = float(rows["peak_g"].max()) if rows.size else 0.0
        return {"rms_g": float(np.sqrt(mean_square)), "peak_g": peak, "limit_g": self._limit_g}

    def _delays(self) -> dict[str, Any]:
        rows = self._recent_blocks
        ages = reading_ages_s(self._recent_readings, rows)
        shares = np.concatenate(self._shares)
        self._shares = [shares]
        p50, p999 = np.quantile(shares, [0.5, 0.999]) if shares.size else (np.nan, np.nan)
        return {
            "reading_ms": 1e3 * float(np.median(ages)) if ages.size else np.nan,
            "output_ms": 1e3 * float(np.median(rows["dac_time_s"] - rows["time_s"]))
            if rows.size
            else np.nan,
            "share_p50": float(p50),
            "share_p999": float(p999),
        }


def _within(speed_mm_s: float, force_n: float, grid: tuple[Range, Range]) -> bool:
    (slow, fast), (light, heavy) = grid
    return slow <= speed_mm_s <= fast and light <= force_n <= heavy
