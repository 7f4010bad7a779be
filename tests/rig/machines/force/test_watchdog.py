"""What a watchdog makes of a servo without a tick, when it was late itself, and when not."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tactileq.rig.machines.force.control import Control
from tactileq.rig.machines.force.settings import MISSED_S
from tactileq.rig.machines.force.states import State
from tactileq.rig.shared.live.clock import now_s, sleep, taking_part
from tactileq.rig.shared.live.compiled import compiled
from tactileq.rig.shared.live.memory import Live


@pytest.fixture
def live(given_clock: object) -> Iterator[Live]:
    """Of a servo that is running, and has ticked just now."""
    with Live.create() as live:
        lib = compiled().lib
        lib.tq_put_word(live.address, lib.TQ_WORD_STATE, int(State.RUNNING))
        with taking_part():
            tick(live)
            yield live


def tick(live: Live) -> None:
    compiled().lib.tq_put_figure(live.address, compiled().lib.TQ_WORD_TICK, now_s())


def missed(control: Control, look_s: float, *, every_s: float = 0.002) -> bool:
    return control.missed(look_s, missed_s=MISSED_S, since_s=0.0, every_s=every_s)


def test_a_watchdog_that_is_late_at_every_look_still_ends_a_servo_without_ticks(live: Live) -> None:
    start_s = now_s()
    assert missed(Control(live), 1.0, every_s=0.75 * MISSED_S)
    assert now_s() - start_s < 4 * MISSED_S


def test_where_both_stood_still_the_servo_may_tick_first(live: Live) -> None:
    control = Control(live)
    for _ in range(3):
        assert not missed(control, 0.01)
        sleep(0.1)  # between two calls: neither of the two has a chance
        assert not missed(control, 0.01)
        tick(live)
    assert missed(control, 0.1)
