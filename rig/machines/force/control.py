"""What host, servo and watchdog of a force device write into the memory that they share."""

from __future__ import annotations

from typing import Any

from tactileq.rig.machines.force.states import Ask, Status
from tactileq.rig.machines.force.wall import Wall
from tactileq.rig.shared.live.clock import now_s, sleep
from tactileq.rig.shared.live.compiled import compiled
from tactileq.rig.shared.live.memory import Live

ANSWER_S = 0.1
_LOOK_S = 0.0005


class Control:
    """The words of a force device in shared memory; one process at a time asks.

    Parameters
    ----------
    live : Live
        Has to outlive this.
    """

    def __init__(self, live: Live) -> None:
        self._live = live
        self._lib: Any = compiled().lib
        self._dog = compiled().ffi.new("tq_watchdog *")

    @property
    def status(self) -> Status:
        """What the servo last reported."""
        return Status.from_word(self._word(self._lib.TQ_WORD_STATE))

    @property
    def ticks(self) -> int:
        """How many there ever were."""
        return self._word(self._lib.TQ_WORD_TICKS)

    @property
    def tick_s(self) -> float:
        """When the servo last ticked, by `now_s`; 0 before."""
        return self._figure(self._lib.TQ_WORD_TICK)

    @property
    def longest_mean_s(self) -> float:
        """Largest running mean of the servo's period since it began; 0 before."""
        return self._figure(self._lib.TQ_WORD_PERIOD)

    @property
    def depth_mm(self) -> float:
        """Of the tool below the wall's height; negative above."""
        return self._figure(self._lib.TQ_WORD_DEPTH)

    @property
    def watched_s(self) -> float:
        """When the watchdog last looked, by `now_s`; 0 before."""
        return self._figure(self._lib.TQ_WORD_WATCHDOG)

    def ask(self, what: Ask, *, within_s: float = ANSWER_S) -> Status:
        """Ask the servo for something; its status once that was done, or after this time."""
        word = self._lib.TQ_WORD_ASKED
        count = ((self._word(word) >> 8) + 1) & 0xFFFFFF
        asked = count << 8 | what
        self._lib.tq_put_word(self._live.address, word, asked)
        until_s = now_s() + within_s
        while (status := self.status).asked != asked and now_s() < until_s:
            sleep(_LOOK_S)
        return status

    def set_wall(self, wall: Wall) -> None:
        """The wall that is shown next."""
        figures = (
            wall.height_mm,
            wall.stiffness_n_per_mm,
            1e-3 * wall.damping_n_s_per_m,
            wall.width_mm / 2,
            wall.length_mm / 2,
        )
        for place, figure in enumerate(figures, start=self._lib.TQ_WORD_WALL):
            self._lib.tq_put_figure(self._live.address, place, figure)

    def press(self, force_n: float) -> None:
        """Push into the surface while a wall is shown, to measure its stiffness."""
        self._lib.tq_put_figure(self._live.address, self._lib.TQ_WORD_PRESS, force_n)

    def missed(self, look_s: float, *, missed_s: float, since_s: float, every_s: float) -> bool:
        """Watch the servo for so long; whether it stood still (`tq_watch`)."""
        live, dog = self._live.address, self._dog
        return bool(self._lib.tq_watch(live, dog, look_s, missed_s, since_s, every_s))

    def stood_still(self) -> None:
        """Have the state say that the watchdog has ended the servo."""
        self._lib.tq_stood_still(self._live.address)

    def _word(self, which: int) -> int:
        return int(self._lib.tq_word(self._live.address, which))

    def _figure(self, which: int) -> float:
        return float(self._lib.tq_figure(self._live.address, which))
