"""Tests that need the machine in time, repeated where it stood still meanwhile.

A test with a live audio server or a live hand cannot pass while all processes stand still. Beside
them a process that does nothing else wakes up once a block (`rig.monitoring.bare_thread`). Where a
test fails and this one missed wake-ups meanwhile, too, the test is begun again, twice at the most;
where it missed none, the failure counts at once. The summary names what was repeated.
"""

from __future__ import annotations

from collections.abc import Iterable

import pytest

from rig.live.child import Child
from rig.live.messages import Done
from rig.monitoring.bare_thread import Look, WakeUps

REPEATS = 2
PERIOD_S = 128 / 48000  # a block of the audio server, which is as short of time
ANSWER_S = 60.0
ROOMS = ("hand/", "live/", "monitoring/", "capture/", "desk/", "force/", "wire/test_link")
DEVICE = ("device/test_emulated", "device/test_in_a_rig", "device/test_renders")  # others: virtual
LIVE = tuple(f"tests/rig/{place}" for place in (*ROOMS, *DEVICE, "recorder/test_emulated"))


class BareProcess:
    """How often a process that does nothing else woke up too late in the current test."""

    def __init__(self) -> None:
        self._child: Child | None = None
        self._before = 0

    def begin(self) -> None:
        """Count from now on."""
        self._before = self._misses()

    def missed(self) -> bool:
        """Whether it woke up too late since."""
        return self._misses() > self._before

    def close(self) -> None:
        """End it."""
        if self._child is not None:
            self._child.close()

    def _misses(self) -> int:
        if self._child is None:
            self._child = Child("rig.monitoring.bare_thread", PERIOD_S)
            self._child.ready(Done, within_s=ANSWER_S)
        return self._child.ask(Look(), WakeUps, within_s=ANSWER_S).misses


def needs_time(item: pytest.Item) -> bool:
    """Whether a test uses the audio server or belongs to a room that follows a hand."""
    asked = getattr(item, "fixturenames", ())
    return bool({"jack_server", "force_device"} & set(asked)) or item.nodeid.startswith(LIVE)


def repeat_where_the_machine_stood_still(items: Iterable[pytest.Item], bare: BareProcess) -> None:
    """Mark those tests."""
    for item in items:
        if needs_time(item):
            item.add_marker(pytest.mark.flaky(reruns=REPEATS, condition=bare.missed))
