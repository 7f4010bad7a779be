"""A clock that is given: who it waits for, in which order all go on, and who may not have it."""

from __future__ import annotations

import os
import queue
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from math import inf, nan

import pytest

from tactileq.modeling import InputError
from tactileq.rig.devices.hand.settings import HandSettings
from tactileq.rig.machines.force.hand import ForceHand
from tactileq.rig.machines.force.settings import ForceSettings
from tactileq.rig.shared.live.clock import (
    GivenClock,
    next_of,
    now_s,
    readable,
    sleep,
    taking_part,
    wait_for,
)
from tactileq.rig.shared.live.compiled import compiled
from tactileq.rig.shared.live.memory import Live
from tests.refusals import refused

TICKS = """
from tactileq.rig.shared.live.clock import sleep, taking_part
with taking_part():
    print("ticks", flush=True)
    while True:
        sleep(0.001)
"""


@pytest.fixture
def clock() -> Iterator[GivenClock]:
    with GivenClock() as given:
        yield given


def test_it_stands_still_while_who_takes_part_is_late(clock: GivenClock) -> None:
    with taking_part():
        before_s = now_s()
        time.sleep(0.2)
        assert now_s() == before_s
        sleep(0.25)
        assert now_s() == pytest.approx(before_s + 0.25, abs=1e-9)
    at_s = now_s()
    time.sleep(0.2)
    assert now_s() > at_s  # nobody is waited for any more


def test_all_go_on_in_the_order_of_their_times_however_late_one_is(clock: GivenClock) -> None:
    begin_s, woken = now_s() + 0.05, list[tuple[float, str]]()

    def follow(name: str, period_s: float, late_s: float) -> None:
        with taking_part():
            for tick in range(10):
                sleep(begin_s + tick * period_s - now_s())
                woken.append((now_s() - begin_s, name))
                time.sleep(late_s)

    threads = [
        threading.Thread(target=follow, args=of) for of in (("a", 3e-3, 0.02), ("b", 7e-3, 0.0))
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert [at_s for at_s, _ in woken] == sorted(at_s for at_s, _ in woken)
    for name, period_s in (("a", 3e-3), ("b", 7e-3)):
        own = [at_s for at_s, whose in woken if whose == name]
        assert own == pytest.approx([tick * period_s for tick in range(10)], abs=1e-9)
    assert clock.hung == ""


def test_a_process_that_is_suspended_or_killed_is_not_waited_for(clock: GivenClock) -> None:
    with subprocess.Popen([sys.executable, "-c", TICKS], stdout=subprocess.PIPE) as other:
        assert other.stdout is not None
        assert other.stdout.readline() == b"ticks\n"
        with taking_part():
            for how in (signal.SIGSTOP, signal.SIGCONT, signal.SIGKILL):
                os.kill(other.pid, how)
                before_s = now_s()
                sleep(0.1)
                assert now_s() == pytest.approx(before_s + 0.1, abs=1e-9)
    assert clock.hung == ""


SUSPENDED = """
import os, signal, time
from tactileq.rig.shared.live.clock import now_s, sleep, taking_part
with taking_part():
    sleep(0.01)
    os.kill(os.getpid(), signal.SIGSTOP)
    before_s = 0.0
    while now_s() > before_s:  # the clock may take a moment to see that this process goes on
        before_s = now_s()
        time.sleep(0.3)
    time.sleep(0.5)
    print(now_s() - before_s)
"""


def test_who_goes_on_after_it_was_suspended_is_waited_for_again(clock: GivenClock) -> None:
    with subprocess.Popen([sys.executable, "-c", SUSPENDED], stdout=subprocess.PIPE) as other:
        os.waitid(os.P_PID, other.pid, os.WSTOPPED)
        sleep(0.1)
        other.send_signal(signal.SIGCONT)
        told, _ = other.communicate(timeout=500)
    assert float(told) == pytest.approx(0, abs=1e-9)


def test_what_waits_for_an_event_a_queue_or_bytes_waits_by_it(clock: GivenClock) -> None:
    never, nothing = threading.Event(), queue.Queue[int]()
    out, into = os.pipe()
    with taking_part():
        for wait in (
            lambda: wait_for(never.wait, 0.1),
            lambda: bool(next_of(nothing, 0.1)),
            lambda: readable(out, 0.1)[0],
        ):
            before_s = now_s()
            assert not wait()
            assert now_s() - before_s == pytest.approx(0.1, abs=2e-3)
        never.set()
        nothing.put(3)
        os.write(into, b"x")
        before_s = now_s()
        assert wait_for(never.wait, 10.0)
        assert next_of(nothing, 10.0) == (3,)
        assert readable(out, 10.0) == (True, False)
        assert now_s() - before_s < 0.01
    os.close(out)
    os.close(into)


def test_it_is_the_same_in_a_process_that_is_started_and_ends_with_the_block() -> None:
    command = [
        sys.executable,
        "-c",
        "from tactileq.rig.shared.live.clock import is_given; print(is_given())",
    ]
    with GivenClock() as given:
        assert subprocess.run(command, capture_output=True, check=True).stdout == b"True\n"
    assert not given.path.exists()
    assert subprocess.run(command, capture_output=True, check=True).stdout == b"False\n"
    before_s = time.perf_counter()
    assert before_s <= now_s() <= time.perf_counter()


def test_nothing_that_is_not_simulated_runs_by_it(clock: GivenClock) -> None:
    with (
        Live.create() as live,
        refused(InputError, expected="computer's clock", got="TACTILEQ_CLOCK"),
    ):
        ForceHand(live, HandSettings(kind="force"), ForceSettings(simulated=False))


@pytest.mark.long("a minute in which all wait")
def test_who_hangs_is_waited_for_no_longer_and_named(clock: GivenClock) -> None:
    done = threading.Event()

    def hang() -> None:
        with taking_part():
            done.wait()

    thread = threading.Thread(target=hang)
    thread.start()
    time.sleep(0.1)
    sleep(0.05)
    assert clock.hung == f"thread {thread.native_id} of process {os.getpid()}"
    done.set()
    thread.join()


@pytest.mark.parametrize("time_s", [nan, -inf, -1.0, -1e300])
def test_a_moment_that_is_over_or_none_is_not_waited_for(time_s: float) -> None:
    compiled().lib.tq_sleep_until(time_s)
    assert compiled().lib.tq_wait_readable(-1, -1, time_s if time_s == time_s else 0.0) == 0


@pytest.mark.parametrize("time_s", [inf, 1e300, 1e19])
def test_a_moment_that_never_comes_ends_no_wait_but_what_is_waited_for_does(time_s: float) -> None:
    reading, writing = os.pipe()
    try:
        os.write(writing, b"x")
        assert compiled().lib.tq_wait_readable(reading, -1, time_s) == 1
    finally:
        os.close(reading)
        os.close(writing)
