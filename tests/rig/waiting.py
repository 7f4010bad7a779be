"""Waiting for what other processes do, by the rig's clock."""

from __future__ import annotations

from collections.abc import Callable

from tactileq.rig.shared.live.clock import now_s, sleep, taking_part
from tactileq.rig.shared.live.memory import GONE, Live


def wait_until(holds: Callable[[], bool], *, seconds: float = 20, every_s: float = 0.01) -> None:
    """Until it holds; fails where it does not in this time."""
    with taking_part():
        end_s = now_s() + seconds
        while not holds():
            assert now_s() < end_s, "expected it to happen"
            sleep(every_s)


def follow(seconds: float, look: Callable[[], object], *, every_s: float = 0.01) -> None:
    """Look again and again for so long."""
    with taking_part():
        end_s = now_s() + seconds
        while now_s() < end_s:
            look()
            sleep(every_s)


def is_gone(live: Live) -> bool:
    """Whether the latest reading says that the hand's device is gone."""
    latest = live.latest()
    return latest is not None and bool(latest["flags"] & GONE)
