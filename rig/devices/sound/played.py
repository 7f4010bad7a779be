"""What the log of blocks says of what was played: misses, halts, and how long it has been felt.

docs/method/live.md#heartbeat
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tactileq.modeling.rendering.limits import Limits
from tactileq.rig.shared.live.clock import now_s
from tactileq.rig.shared.live.memory import NO_HEARTBEAT, UNDERFLOW, Live, Rows

STALLED_S = 0.5  # without a block: the server is gone


class PlayedBlocks:
    """The blocks that the sound process wrote into the live memory, counted as they are looked at.

    Who looks is alive: looking is the heartbeat without which the callback halts what plays. A
    vibration counts as one dose until a pause, because the skin recovers only then; the renderer
    keeps the limit while it renders, and `felt_s` is for what is asked for next, which it cannot
    foresee.

    Parameters
    ----------
    limits : Limits
        Of the vibration; its pause and its silence.
    block_s : float
        Duration of a block.

    Attributes
    ----------
    misses : int
        Blocks so far that came too late, according to the driver.
    halted : bool
        Whether the last block was halted for want of a heartbeat.
    """

    def __init__(self, live: Live, limits: Limits, *, block_s: float) -> None:
        self._live, self._limits, self._block_s = live, limits, block_s
        self._seen = live.blocks_written
        self._last_block_s = 0.0
        self.misses = 0
        self.halted = False
        # The vibration that has had no pause yet: since when and until when it was felt.
        self._felt_since_s = self._felt_until_s = 0.0

    def look(self) -> tuple[Rows, int]:
        """The blocks since the last look, and how many halts began in them."""
        self._live.heartbeat()
        self._seen, rows = self._live.blocks_since(self._seen)
        halts = 0
        if rows.size:
            self._last_block_s = float(rows["time_s"][-1])
            self.misses += int(np.count_nonzero(rows["flags"] & UNDERFLOW))
            halts = self._halts_begun((rows["flags"] & NO_HEARTBEAT) > 0)
            self._follow_vibration(rows)
        return rows, halts

    def begin(self) -> None:
        """A process begins to play: its first block may be as late as any other."""
        self._last_block_s = now_s()

    @property
    def stalled(self) -> bool:
        """Whether blocks have stopped to come."""
        return now_s() - self._last_block_s > STALLED_S

    def pause_needed(self, seconds: float) -> bool:
        """Whether so much more, without a pause before it, would be longer than the limit."""
        felt_s = self._felt_until_s - self._felt_since_s
        too_long = felt_s + seconds > self._limits.duration_s
        return too_long and now_s() <= self.silent_until_s

    @property
    def silent_until_s(self) -> float:
        """When the pause after what was felt last is over."""
        return self._felt_until_s + self._limits.pause_s + 2 * self._block_s

    def _halts_begun(self, halted: NDArray[np.bool_]) -> int:
        """Each halt counts once; (n,), whether it holds in each block."""
        before = np.concatenate(([self.halted], halted[:-1]))
        self.halted = bool(halted[-1])
        return int(np.count_nonzero(halted & ~before))

    def _follow_vibration(self, rows: Rows) -> None:
        """Since when, and until when, it was felt without a pause."""
        felt_s = rows["time_s"][rows["peak_g"] > self._limits.silence]
        if not felt_s.size:
            return
        before_s = np.concatenate(([self._felt_until_s], felt_s[:-1] + self._block_s))
        pauses = np.flatnonzero(felt_s - before_s >= self._limits.pause_s)
        if pauses.size:
            self._felt_since_s = float(felt_s[pauses[-1]])
        self._felt_until_s = float(felt_s[-1]) + self._block_s
