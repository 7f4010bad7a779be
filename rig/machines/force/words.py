"""The servo's side of the words that it shares with a host, for one that is written in Python."""

from __future__ import annotations

from math import nan
from typing import Any

from tactileq.rig.machines.force.states import Ask, Cause, State
from tactileq.rig.shared.live.clock import now_s
from tactileq.rig.shared.live.compiled import compiled
from tactileq.rig.shared.live.memory import FORCE_COMMANDED, GONE, SIMULATED, Live


class ServoWords:
    """What a servo reads and reports; `tactileq.rig.machines.force.control` is the other side.

    Parameters
    ----------
    live : Live
        Has to outlive this.
    """

    def __init__(self, live: Live) -> None:
        self._live = live
        self._lib: Any = compiled().lib
        self._asked = self._word(self._lib.TQ_WORD_ASKED)  # of an earlier servo: it is over
        self.report(State.BOOT, Cause.NONE, time_s=now_s())

    def take_asked(self) -> Ask | None:
        """What was asked for since the last call; None for nothing."""
        asked = self._word(self._lib.TQ_WORD_ASKED)
        if asked == self._asked:
            return None
        self._asked = asked
        return Ask(asked & 255)

    def report(self, state: State, cause: Cause, *, time_s: float) -> None:
        """The state, also that what was asked last is done."""
        self._lib.tq_put_figure(self._live.address, self._lib.TQ_WORD_TICK, time_s)
        word = self._asked << 16 | cause << 8 | state
        self._lib.tq_put_word(self._live.address, self._lib.TQ_WORD_STATE, word)

    def passed(self, ticks: int, *, depth_mm: float) -> None:
        """So many readings more, the last of them at this depth."""
        which = self._lib.TQ_WORD_TICKS
        self._lib.tq_put_word(self._live.address, which, self._word(which) + ticks)
        self._lib.tq_put_figure(self._live.address, self._lib.TQ_WORD_DEPTH, depth_mm)

    def wall(self) -> tuple[float, ...]:
        """The wall asked for: height, stiffness, damping (N·s/mm), half width and length."""
        first = self._lib.TQ_WORD_WALL
        return tuple(self._figure(place) for place in range(first, first + 5))

    @property
    def heartbeat_s(self) -> float:
        """When the session last looked after it, by `now_s`."""
        return float(self._lib.tq_heartbeat_s(self._live.address))

    def write_gone(self, *, simulated: bool) -> None:
        """A reading that says that there is no device."""
        flags = GONE | FORCE_COMMANDED | (SIMULATED if simulated else 0)
        self._live.write_reading(now_s(), nan, y_mm=nan, speed_mm_s=0.0, force_n=0.0, flags=flags)

    def _word(self, which: int) -> int:
        return int(self._lib.tq_word(self._live.address, which))

    def _figure(self, which: int) -> float:
        return float(self._lib.tq_figure(self._live.address, which))
