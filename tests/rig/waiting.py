"""Waiting for what other processes do."""

from __future__ import annotations

import time
from collections.abc import Callable

from rig.live.memory import GONE, Live


def wait_until(holds: Callable[[], bool], *, seconds: float = 20) -> None:
    """Until it holds; fails where it does not in this time."""
    end = time.monotonic() + seconds
    while not holds():
        assert time.monotonic() < end, "expected it to happen"
        time.sleep(0.01)


def is_gone(live: Live) -> bool:
    """Whether the latest reading says that the hand's device is gone."""
    latest = live.latest()
    return latest is not None and bool(latest["flags"] & GONE)
