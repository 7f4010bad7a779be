"""What was played, rendered again from the log of blocks and readings (docs/method/live.md)."""

from __future__ import annotations

from typing import Any

import numpy as np

from tactileq.modeling.models.ar_model import ARModel
from tactileq.modeling.rendering.compiled import CompiledEngine
from tactileq.modeling.rendering.limits import Limits
from tactileq.modeling.rendering.noise import stream_key
from tactileq.modeling.rendering.plan import plan_for
from tactileq.modeling.rendering.reference.engine import PythonEngine
from tactileq.modeling.rendering.reference.lattice import LatticeFilter
from tactileq.rig.shared.live.memory import GONE, OLDEST_READING_S, Live, Rows

PIECE = 256  # samples that the callback renders in one go


def engine_of(
    made: Any, rate_hz: float, *, block: int, seed: int, stream: int, limits: Limits
) -> CompiledEngine | PythonEngine:
    """What renders a model in a rig."""
    plan = plan_for(
        made.rate_hz, rate_hz=rate_hz, limits=limits, hold_s=OLDEST_READING_S + block / rate_hz
    )
    key = stream_key(seed, stream)
    if isinstance(made, ARModel):
        return PythonEngine(LatticeFilter(made, plan), plan, key=key)
    return CompiledEngine(made, plan, key=key)


class Log:
    """The readings so far, and how blocks took them in."""

    def __init__(self, live: Live, rate_hz: float) -> None:
        self._count, self._readings = live.readings_since(0)
        self._rate_hz = rate_hz

    def taken(self, block: np.void) -> list[tuple[float, float, float]]:
        """How many samples before the block, and the speed and force, of each reading."""
        first = self._count - self._readings.size
        last = int(block["readings"])
        rows = self._readings[last - int(block["taken"]) - first : last - first]
        hands = [
            (
                float((block["hand_s"] - row["time_s"]) * self._rate_hz),
                float(row["speed_mm_s"]),
                float(row["force_n"]),
            )
            for row in rows[rows["flags"] & GONE == 0]
        ]
        return [*hands, (0.0, 0.0, 0.0)] if not block["force_n"] > 0 else hands

    def played(self, blocks: Rows, number: int, engine: Any) -> np.ndarray[Any, np.dtype[Any]]:
        """A presentation among these blocks (BLOCK), before its fades; readings precede it."""
        ours = np.flatnonzero(blocks["presentation"] == number)
        latest: tuple[float, float, float] | None = None
        for block in blocks[: ours[0]]:
            for hand in self.taken(block):
                latest = hand
            for size in _pieces(int(block["frames"])):
                latest = latest and (latest[0] + size, *latest[1:])
        parts = []
        for index in ours:
            hands = self.taken(blocks[index])
            if index == ours[0]:  # a voice begins with the latest
                hands = hands[-1:] or ([latest] if latest else [])
            for ago, speed, force in hands:
                engine.read(ago, speed, force)
            parts.append(engine.render_on(int(blocks[index]["frames"])))
        return np.concatenate(parts)


def _pieces(frames: int) -> list[int]:
    return [min(PIECE, frames - done) for done in range(0, frames, PIECE)]
