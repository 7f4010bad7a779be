"""How long a force device pushes on without its servo, by this machine's clock.

Beside it how late a thread wakes up that does nothing else. `make test` asserts the same by a given
clock (tests/rig/machines/force/test_processes.py).
"""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path
from typing import Any

import pytest

from tactileq.modeling import InputError
from tactileq.rig.machines.force.hand import ForceHand
from tactileq.rig.machines.force.standin import StandIn
from tactileq.rig.machines.force.states import State
from tactileq.rig.shared.live.clock import now_s
from tactileq.rig.shared.live.memory import Live
from tests.rig.machines.force.rig_files import standing_in
from tests.rig.machines.force.test_processes import WALL, opened, size_n

pytestmark = pytest.mark.long("the times of this machine")
PATIENCE_S = 120.0


def press(device: StandIn, live: Live, hand: ForceHand) -> int:
    """Until the hand presses on the wall, armed anew where this machine was late; the servo."""
    end_s = now_s() + PATIENCE_S
    while size_n(device) <= 0.5:
        assert now_s() < end_s
        live.heartbeat()
        try:
            if hand.status.state != State.RUNNING:
                hand.arm()
                hand.show(WALL)
        except InputError:
            time.sleep(0.1)
        time.sleep(0.005)
    assert hand.pid is not None
    return hand.pid


def test_from_a_killed_servo_to_no_force(
    benchmark: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with standing_in(tmp_path, monkeypatch) as device, opened() as (live, hand):

        def pressing() -> tuple[tuple[int], dict[str, Any]]:
            return (press(device, live, hand),), {}

        def end(servo: int) -> None:
            os.kill(servo, signal.SIGKILL)
            while size_n(device) > 0:
                time.sleep(0.0002)

        benchmark.pedantic(end, setup=pressing, rounds=5)
        assert size_n(device) == 0


def test_a_thread_that_wakes_up_after_a_millisecond(benchmark: Any) -> None:
    def slept_s() -> float:
        begin_s = now_s()
        time.sleep(1e-3)
        return now_s() - begin_s

    assert benchmark(slept_s) >= 1e-3
