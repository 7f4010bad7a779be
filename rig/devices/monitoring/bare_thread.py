"""A process whose thread does nothing but wake up in time.

Its misses are due to the machine; they are shown beside those of the audio callback.
It is started with its period in seconds.
"""

from __future__ import annotations

import threading
import time

from tactileq.rig.shared.live.driven import Parent
from tactileq.rig.shared.live.messages import Done, Message


class WakeUps(Message, frozen=True):
    """How often it woke up so far, and how often too late."""

    periods: int
    misses: int


class Look(Message, frozen=True):
    """How often did it wake up?"""


class BareThread:
    """Wakes up every period; it misses where it wakes up later than the next one is due.

    Parameters
    ----------
    period_s : float
        Above 0.
    """

    def __init__(self, period_s: float) -> None:
        self._period_s = period_s
        self.periods = 0
        self.misses = 0

    def run(self) -> None:
        """Wake up until the process ends."""
        due_s = time.monotonic()
        while True:
            due_s += self._period_s
            time.sleep(max(0.0, due_s - time.monotonic()))
            due_s += self.woke(time.monotonic() - due_s)

    def woke(self, late_s: float) -> float:
        """Count one wake-up; gives the time of the periods that were slept over."""
        over = max(0, int(late_s / self._period_s))
        self.periods += 1 + over
        self.misses += over
        return over * self._period_s


def main() -> None:
    """Wake up until the parent is gone."""
    with Parent() as parent:
        thread = BareThread(parent.settings(float))
        threading.Thread(target=thread.run, daemon=True).start()
        parent.send(Done())
        parent.serve(Look, lambda _: WakeUps(thread.periods, thread.misses))


if __name__ == "__main__":
    main()
