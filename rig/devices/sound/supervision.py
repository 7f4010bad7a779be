"""The process that plays: started when it is needed, watched, killed and replaced.

docs/method/live.md#processes
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from tactileq.modeling.errors import InputError
from tactileq.rig.devices.sound.messages import Mask, Playing, SoundSettings
from tactileq.rig.devices.sound.played import STALLED_S, PlayedBlocks
from tactileq.rig.shared.live.child import Child, ChildLost, Reply
from tactileq.rig.shared.live.clock import now_s, sleep
from tactileq.rig.shared.live.memory import HEARTBEAT_S, Rows
from tactileq.rig.shared.live.messages import Done, Message

_POLL_S = 0.001
HALTED = (
    f"expected the program to poll the rig at least every {HEARTBEAT_S:g} s, got a longer "
    "time without; the vibration was stopped, and nothing is felt until something is presented "
    "again."
)


class SoundLost(OSError):
    """Nothing can be played, or not to its end; the message is one sentence."""


class SoundProcess:
    """The process that plays, or none.

    What happens to it, and what follows; there is no other way from one state to another:

    ==========  ============================================  =======  ===========================
    state       event                                         next     besides
    ==========  ============================================  =======  ===========================
    none        something is to be played, or `start`         playing  starts with the last masking
    none        it cannot start, or its device is refused     none     `SoundLost` or `InputError`
    playing     `close`                                       none     fades to silence
    playing     it has ended, or does not answer in time      none     killed; a fault is reported
    playing     no block for `STALLED_S`                      none     killed; a fault is reported
    playing     a block without a heartbeat                   playing  a fault is reported, once
    ==========  ============================================  =======  ===========================

    Parameters
    ----------
    block_s : float
        Duration of a block.
    """

    def __init__(self, settings: SoundSettings, played: PlayedBlocks, *, block_s: float) -> None:
        self._settings, self._played, self._block_s = settings, played, block_s
        self._child: Child | None = None
        self._latency_s = float("nan")
        self._masking = 0.0
        self._faults: list[str] = []

    @property
    def pid(self) -> int | None:
        """Number of the process, None where there is none."""
        return None if self._child is None else self._child.pid

    @property
    def latency_s(self) -> float:
        """Of the output, as PortAudio states it; NaN where there is no process."""
        return float("nan") if self._child is None else self._latency_s

    def start(self) -> Child:
        """The process that plays; InputError or SoundLost where there can be none."""
        if self._child is not None:
            return self._child
        child = Child("tactileq.rig.devices.sound.process", self._settings)
        try:
            self._latency_s = child.ready(Playing).latency_s
            self._child = child
            self._played.begin()
            self.wait(lambda rows: rows["frames"] > 0)
            if self._masking:
                child.ask(Mask(self._masking), Done)
            return child
        except ChildLost as lost:
            self.close()
            raise SoundLost(
                f"expected a sound process that plays, got: {lost}; check the sound device "
                "(tactileq rig check)."
            ) from None

    def close(self) -> None:
        """Fade to silence and end the process."""
        if self._child is not None:
            self._child.close()
            self._child = None

    def mask(self, level: float) -> None:
        """Masking noise of this level, of this process and of all that follow."""
        self._masking = level
        self.reply(Mask(level), Done)

    def begin(self, wanted: Message, presentation: int) -> np.void:
        """Ask for something; the block with its first sample. Once more where it is lost."""
        for _ in range(2):
            try:
                self.start().ask(wanted, Done)
                return self.wait(lambda rows: rows["presentation"] == presentation)
            except ChildLost as lost:
                self.lose(str(lost))
            except InputError as error:  # of a new process: the device has changed
                raise SoundLost(str(error)) from None
        raise SoundLost(
            "expected a sound process that plays, got two that did not; check the sound device "
            "(tactileq rig check)."
        )

    def reply(self, request: Message, kind: type[Reply]) -> Reply | None:
        """The process' answer; None where there is no process, or it is lost."""
        try:
            return None if self._child is None else self._child.ask(request, kind)
        except ChildLost as lost:
            self.lose(str(lost))
            return None

    def wait(self, found: Callable[[Rows], Any], *, within_s: float = STALLED_S + 0.5) -> np.void:
        """The first new block for which this holds, once its first sample has left."""
        end_s = now_s() + within_s + 4 * self._block_s
        while now_s() < end_s:
            rows = self.look()
            fitting = rows[np.asarray(found(rows), dtype=bool)]
            if fitting.size:
                sleep(max(0.0, float(fitting[0]["dac_time_s"]) - now_s()))
                return fitting[0]  # type: ignore[no-any-return]
            if self._child is not None and not self._child.runs:
                raise ChildLost("it has ended")
            sleep(_POLL_S)
        raise ChildLost("it plays no blocks")

    def look(self) -> Rows:
        """The blocks since the last look; halts are reported."""
        rows, halts = self._played.look()
        self._faults += [HALTED] * halts
        return rows

    def faults(self) -> tuple[str, ...]:
        """What went wrong since the last call, one sentence each."""
        self.look()
        if self._child is not None and not self._child.runs:
            self.lose("it has ended")
        elif self._child is not None and self._played.stalled:
            self.lose(f"no block for {STALLED_S:g} s, so its server is gone or suspended")
        faults, self._faults = tuple(self._faults), []
        return faults

    def lose(self, why: str) -> None:
        """Kill the process, and report it."""
        self._faults.append(
            f"expected the sound process to play, got: {why}; nothing is felt until something is "
            "presented again, by another process."
        )
        if self._child is not None:
            self._child.kill()
            self._child = None
