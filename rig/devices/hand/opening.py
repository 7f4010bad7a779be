"""A hand outside of sessions: opened with a memory of its own, and what it did since last asked."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
from numpy.typing import NDArray

from tactileq.rig.devices.hand.reader import HandReader
from tactileq.rig.devices.hand.settings import HandSettings
from tactileq.rig.shared.live.memory import Live


@contextmanager
def opened_hand(hand: HandSettings) -> Iterator[tuple[Live, HandReader]]:
    """The shared memory, and the hand that writes its readings into it."""
    with Live.create() as live, HandReader(live, hand) as reader:
        yield live, reader


def since_now(live: Live) -> Callable[[], NDArray[np.void]]:
    """Gives the readings of the hand since its last call, (n,) of `READING` (memory.py)."""
    count = live.readings_written

    def readings() -> NDArray[np.void]:
        nonlocal count
        count, rows = live.readings_since(count)
        return rows

    return readings
