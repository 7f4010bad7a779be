"""Servo, watchdog and host of a force device as real processes, on the stand-in."""

from __future__ import annotations

import ctypes.util
import json
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from math import hypot
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tactileq.modeling import InputError
from tactileq.rig.desk.desk_rig import DeskRig
from tactileq.rig.devices.hand.settings import HandSettings
from tactileq.rig.machines.force.dhd import DhdLibrary
from tactileq.rig.machines.force.hand import ForceHand
from tactileq.rig.machines.force.settings import ForceSettings
from tactileq.rig.machines.force.standin import StandIn
from tactileq.rig.machines.force.states import SENTENCES, Cause, State
from tactileq.rig.machines.force.wall import Wall
from tactileq.rig.shared.live.clock import now_s, sleep, taking_part
from tactileq.rig.shared.live.memory import (
    BUTTON,
    CONTACT,
    FORCE_COMMANDED,
    GONE,
    HEARTBEAT_S,
    SIMULATED,
    Live,
)
from tactileq.stimuli.planted.textures import planted_texture
from tests.rig.machines.force.rig_files import force_rig
from tests.rig.waiting import follow, wait_until

HERE = Path(__file__).parent
pytestmark = pytest.mark.usefixtures("given_clock")
WALL = Wall(stiffness_n_per_mm=0.6, width_mm=100, length_mm=100)
SETTINGS = ForceSettings(library="stand-in", late_s=0.019, simulated=True)
Jack = Callable[..., AbstractContextManager[Any]]


@contextmanager
def opened(settings: ForceSettings = SETTINGS) -> Iterator[tuple[Live, ForceHand]]:
    """The device's processes, not armed."""
    with Live.create() as live, ForceHand(live, HandSettings(kind="force"), settings) as hand:
        yield live, hand


def refused(call: Callable[..., object], *given: object) -> str:
    """The sentence with which a call is refused."""
    with pytest.raises(InputError) as caught:
        call(*given)
    return str(caught.value)


def size_n(device: StandIn) -> float:
    """What the motors push with now."""
    return hypot(*device.force_n(now_s()))


def pressed(device: StandIn, live: Live, hand: ForceHand) -> None:
    """Show the wall, and wait until the hand presses on it."""
    hand.arm()
    hand.show(WALL)

    def presses() -> bool:
        live.heartbeat()
        return size_n(device) > 0.5

    wait_until(presses)


def seconds_to_zero(device: StandIn, do: Callable[[], object]) -> float:
    """How long the motors push on after something was done; they stay without force."""
    with taking_part():  # else time goes on while this process is late
        begin_s = now_s()
        do()
        wait_until(lambda: size_n(device) == 0, seconds=5, every_s=0.0005)
        found = now_s() - begin_s
    sleep(0.1)
    assert size_n(device) == 0
    return found


def test_it_begins_without_force_and_pushes_once_it_is_armed_and_shown(device: StandIn) -> None:
    with opened() as (live, hand):
        assert hand.device_name.startswith("stand-in")
        wait_until(lambda: hand.status.state == State.IDLE)
        assert "expected an armed force device" in refused(hand.show, WALL)
        device.fields.button = 1
        pressed(device, live, hand)

        def strokes_on_all_of_the_wall() -> bool:
            live.heartbeat()
            reading = live.latest()
            assert reading is not None
            whole = abs(reading["force_n"] / reading["depth_mm"] - 0.6) < 0.03
            return whole and abs(reading["speed_mm_s"]) > 50 and reading["flags"] == flags

        flags = CONTACT | BUTTON | SIMULATED | FORCE_COMMANDED
        wait_until(strokes_on_all_of_the_wall)
        assert seconds_to_zero(device, hand.hide) < SETTINGS.show_s + 0.3
        assert hand.status.state == State.ARMED
        assert hand.faults() == ()
        assert device.fields.most_n <= SETTINGS.most_n
    assert size_n(device) == 0
    assert not device.fields.is_open


def test_readings_come_a_thousand_times_a_second_and_in_order(device: StandIn) -> None:
    with opened(ForceSettings(**{**vars(SETTINGS), "rate_hz": 2000.0})) as (live, hand):
        wait_until(lambda: hand.status.state == State.IDLE)
        with taking_part():
            first, ticks, start_s = live.readings_written, hand.control.ticks, now_s()
            sleep(0.5)
            passed = now_s() - start_s
            _, rows = live.readings_since(first)
            ticks = hand.control.ticks - ticks
        assert 500 < rows.size / passed < 1100
        assert 1000 < ticks / passed < 2100
        assert np.all(np.diff(rows["time_s"]) > 0)


FAULTS: dict[Cause, dict[str, float]] = {
    Cause.NOT_READ: {"fail_reads": 3},
    Cause.NOT_A_NUMBER: {"nan_reads": 3},
    Cause.JUMP: {"jump": 0.05, "jump_reads": 3},
    Cause.FROZEN: {"freezes": 1},
    Cause.NOT_WRITTEN: {"fail_pushes": 1},
}


def check_released(device: StandIn, hand: ForceHand, cause: Cause, fault: dict[str, float]) -> None:
    """After a fault it lets go for this cause, says so once, and stays without force."""

    def fail() -> None:
        for name, value in fault.items():
            setattr(device.fields, name, value)
        wait_until(lambda: hand.status.state in (State.RELEASING, State.FAULT), seconds=2)

    assert seconds_to_zero(device, fail) < 0.5
    status = hand.status
    assert status.cause == cause
    assert hand.faults() == (status.sentence,)
    device.fields.freezes = 0
    assert refused(hand.show, WALL) == status.sentence
    sleep(0.05)
    assert size_n(device) == 0


def test_what_goes_wrong_with_the_device_lets_go_until_people_arm_it_again(
    device: StandIn,
) -> None:
    with opened(ForceSettings(**{**vars(SETTINGS), "frozen_s": 0.1})) as (live, hand):
        for cause, fault in FAULTS.items():
            pressed(device, live, hand)
            check_released(device, hand, cause, fault)
        pressed(device, live, hand)


@pytest.mark.parametrize(
    ("cause", "fault", "mended"),
    [
        (Cause.OFF_SWITCH, {"switched_off": 1}, {"switched_off": 0}),
        (Cause.OFF_SPEED, {"most_m_s": 0.01}, {"most_m_s": 0.0}),
        (Cause.FORCES_OFF, {"force_on": 0, "off_cause": 4}, {}),
    ],
)
def test_a_device_that_switches_its_forces_off_is_a_fault_at_once_and_comes_back_as_a_ramp(
    device: StandIn, cause: Cause, fault: dict[str, float], mended: dict[str, float]
) -> None:
    with opened() as (live, hand):
        pressed(device, live, hand)
        with taking_part():
            begin_s = now_s()
            for name, value in fault.items():
                setattr(device.fields, name, value)
            wait_until(lambda: hand.status.cause == cause, seconds=1, every_s=0.0005)
            took_s = now_s() - begin_s
        assert took_s < 0.005
        wait_until(lambda: hand.status.state == State.FAULT)
        assert hand.faults() == (hand.status.sentence,)
        if mended and cause == Cause.OFF_SWITCH:  # not yet: it is not armed
            assert refused(hand.arm) == hand.status.sentence
        for name, value in mended.items():
            setattr(device.fields, name, value)
        first = live.readings_written
        pressed(device, live, hand)
        _, rows = live.readings_since(first)
        wall = rows["force_n"][rows["force_n"] > 0]
        assert wall[0] < SETTINGS.contact_n + 0.03  # 3 N in 0.2 s
        assert np.abs(np.diff(wall)).max() < 0.1


def test_a_hiccup_that_trips_the_devices_own_watchdog_is_a_fault_and_no_wall_without_force(
    device: StandIn,
) -> None:
    """It switches its forces off, whatever it is told to push with, until they are enabled."""
    device.fields.has_watchdog = 1
    settings = ForceSettings(**{**vars(SETTINGS), "watched": False})
    with opened(settings) as (live, hand):
        pressed(device, live, hand)
        device.fields.stall_s = 0.05
        wait_until(lambda: hand.status.state == State.FAULT)
        assert hand.status.cause in (Cause.LATE, Cause.OFF_WATCHDOG)
        assert not device.fields.force_on
        pressed(device, live, hand)  # what the motors give, not what was commanded
        sleep(0.5)
        live.heartbeat()
        reading = live.latest()
        assert reading is not None
        assert size_n(device) == pytest.approx(reading["force_n"], abs=0.1)
        # One that is too short for the servo to be late.
        device.fields.watchdog = 80  # 10 ms
        device.fields.stall_s = 0.015
        wait_until(lambda: hand.status.state == State.FAULT)
        assert hand.status.cause == Cause.OFF_WATCHDOG


def test_a_device_that_says_nothing_new_is_as_late_as_its_readings(device: StandIn) -> None:
    """Sooner than its time guard it gives the last position once more, and says so."""
    settings = ForceSettings(**{**vars(SETTINGS), "late_s": 0.006})
    for guard_s, cause in ((0.0009, Cause.NONE), (0.002, Cause.SLOW), (0.008, Cause.LATE)):
        with opened(settings) as (live, hand):
            device.fields.guard_s = 0.0
            pressed(device, live, hand)
            device.fields.guard_s = guard_s - 0.0002
            follow(0.2, live.heartbeat)
            assert hand.status.cause == cause


def test_a_tool_that_answers_the_wrong_way_or_not_at_all_is_not_armed(device: StandIn) -> None:
    with opened(ForceSettings(**{**vars(SETTINGS), "probe_n": 1.0})) as (live, hand):
        device.fields.flipped = 1
        sleep(0.05)  # the jump of its position is a fault of its own, which arming clears
        assert refused(hand.arm) == SENTENCES[Cause.UNANSWERED]
        device.fields.flipped = 0
        device.fields.mass = 50.0
        sleep(0.05)
        assert refused(hand.arm) == SENTENCES[Cause.UNANSWERED]
        device.fields.mass = 0.2
        sleep(0.5)  # until the hand has caught up with it
        pressed(device, live, hand)
        assert hand.faults() == ()


def test_a_reading_that_stalls_for_five_milliseconds_is_late(device: StandIn) -> None:
    with opened(ForceSettings(**{**vars(SETTINGS), "late_s": 0.004})) as (_, hand):
        wait_until(lambda: hand.status.state == State.IDLE)
        hand.arm()  # a machine that is late by itself shows the same
        check_released(device, hand, Cause.LATE, {"stall_s": 0.005})


def test_a_fault_that_lasts_is_no_state_to_arm_from(device: StandIn) -> None:
    with opened() as (live, hand):
        pressed(device, live, hand)
        device.fields.nan_reads = 1_000_000
        wait_until(lambda: hand.status.state == State.FAULT)
        assert refused(hand.arm) == SENTENCES[Cause.NOT_A_NUMBER]


def test_a_device_that_is_unplugged_is_opened_again_and_not_armed(device: StandIn) -> None:
    with opened() as (live, hand):
        pressed(device, live, hand)
        device.fields.fail_reads = 1_000_000
        device.fields.devices = 0
        wait_until(lambda: hand.status.state == State.FAULT)
        wait_until(lambda: any("got none; check its cable" in told for told in hand.faults()))
        assert live.latest()["flags"] & GONE  # type: ignore[index]
        device.fields.fail_reads, device.fields.devices = 0, 1
        wait_until(lambda: hand.status.state == State.IDLE)
        assert size_n(device) == 0
        pressed(device, live, hand)


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_a_servo_that_ends_or_stands_still_keeps_no_force(
    device: StandIn, number: signal.Signals
) -> None:
    with opened() as (live, hand):
        pressed(device, live, hand)
        servo = hand.pid
        assert servo is not None
        took_s = seconds_to_zero(device, lambda: os.kill(servo, number))
        assert took_s < 0.1 + SETTINGS.release_s
        wait_until(lambda: hand.pid != servo and hand.status.state == State.IDLE)
        told = hand.faults()
        assert any("stood still and was killed" in sentence for sentence in told)
        assert size_n(device) == 0
        pressed(device, live, hand)


def test_a_device_with_a_watchdog_of_its_own_ends_its_force_itself(device: StandIn) -> None:
    device.fields.has_watchdog = 1
    settings = ForceSettings(**{**vars(SETTINGS), "watched": False})
    with opened(settings) as (live, hand):
        assert "its own watchdog" in hand.device_name
        pressed(device, live, hand)
        servo = hand.pid
        assert servo is not None
        assert seconds_to_zero(device, lambda: os.kill(servo, signal.SIGSTOP)) < 0.1


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_without_its_watchdog_a_servo_lets_go(
    device: StandIn, monkeypatch: pytest.MonkeyPatch, number: signal.Signals
) -> None:
    with opened() as (live, hand):
        pressed(device, live, hand)
        dog, start, may_start = hand.watchdog_pid, hand._start_watchdog, threading.Event()
        assert dog is not None
        # On a fast computer another one would be there before the servo lets go.
        monkeypatch.setattr(hand, "_start_watchdog", lambda: (may_start.wait(), start()))
        took_s = seconds_to_zero(device, lambda: os.kill(dog, number))
        assert took_s < 0.15 + SETTINGS.release_s
        assert hand.status.cause == Cause.WATCHDOG
        may_start.set()
        wait_until(lambda: any("ended by SIGKILL" in told for told in hand.faults()))
        wait_until(lambda: hand.watchdog_pid != dog)
        pressed(device, live, hand)


def test_without_a_heartbeat_the_wall_is_released(device: StandIn) -> None:
    with opened() as (live, hand):
        pressed(device, live, hand)
        took_s = seconds_to_zero(device, live.heartbeat)
        assert HEARTBEAT_S <= took_s < HEARTBEAT_S + SETTINGS.release_s + 0.1
        assert hand.status.cause == Cause.HEARTBEAT


class Host:
    """tests/rig/machines/force/host.py and its processes."""

    def __init__(self, rig: Path) -> None:
        self.process = subprocess.Popen(
            [sys.executable, str(HERE / "host.py"), str(rig)],
            stdout=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )
        assert self.process.stdout is not None
        told = json.loads(self.process.stdout.readline())
        self.live = Live.attach(told.pop("live"))
        self.pids: dict[str, int] = {"host": self.process.pid, **told}

    def close(self) -> None:
        """End what is left of it."""
        self.live.close()
        for name in ("host", "sound", "servo", "watchdog"):
            try:
                os.kill(self.pids[name], signal.SIGKILL)
            except ProcessLookupError:
                continue
        self.process.wait()


@pytest.mark.parametrize("number", [signal.SIGHUP, signal.SIGTERM])
def test_a_signal_to_all_processes_as_of_a_closed_terminal_leaves_no_force(
    device: StandIn, jack_server: Jack, tmp_path: Path, number: signal.Signals
) -> None:
    rig = force_rig(tmp_path)
    with jack_server(block=128):
        host = Host(rig.path)
        try:
            wait_until(lambda: size_n(device) > 0.5, seconds=5)
            took_s = seconds_to_zero(device, lambda: os.killpg(host.process.pid, number))
            assert took_s < 0.1 + SETTINGS.release_s + 0.05
            wait_until(lambda: not device.fields.is_open)  # the servo has closed it itself
        finally:
            host.close()


@pytest.mark.parametrize(
    ("whose", "number", "most_s"),
    [
        ("host", signal.SIGKILL, 0.1),
        ("host", signal.SIGSTOP, HEARTBEAT_S),
        ("sound", signal.SIGKILL, 0.1),
        ("sound", signal.SIGSTOP, 0.1),
    ],
)
def test_no_process_of_a_session_that_ends_leaves_force_behind(
    device: StandIn,
    jack_server: Jack,
    tmp_path: Path,
    whose: str,
    number: signal.Signals,
    most_s: float,
) -> None:
    rig = force_rig(tmp_path)
    with jack_server(block=128):
        host = Host(rig.path)
        try:
            wait_until(lambda: size_n(device) > 0.5, seconds=5)
            took_s = seconds_to_zero(device, lambda: os.kill(host.pids[whose], number))
            assert took_s < most_s + SETTINGS.release_s + 0.05
        finally:
            host.close()


def test_the_sound_process_renders_from_the_servo_without_a_stale_block(
    device: StandIn, jack_server: Jack, tmp_path: Path
) -> None:
    with jack_server(block=128), DeskRig(force_rig(tmp_path), override="a test") as rig:
        rig.arm()
        rig.present_model(planted_texture("PVC"))
        follow(2, rig.read)
        assert rig.read().force_n > 0.3
        rig.present_real("PVC")
        follow(0.5, rig.read)
        rig.silence()
        assert rig.take_faults() == ()
        rows, shown = rig.take_history(), rig.take_presentations()
    virtual, real = shown
    assert virtual.stale_blocks == 0
    assert virtual.played_s > 1.5
    assert virtual.rms_g > 0
    on_wall = (rows.surface == 2) & (rows.depth_mm > 0.5)
    assert on_wall.sum() > 500
    assert rows.force_commanded[on_wall].all()
    settled = on_wall & (rows.time_s > virtual.start_s + 1)
    stiffness = rig.stated["Walls"]["the wall"]["stiffness_n_per_mm"]  # type: ignore[index]
    assert np.median(rows.force_n[settled] / rows.depth_mm[settled]) == pytest.approx(
        stiffness, rel=0.02
    )
    assert np.isnan(rows.force_n[rows.presentation == real.number]).all()  # nothing senses it


def refuses(device: StandIn, change: dict[str, int], **settings: Any) -> str:
    """What is said when such a device is opened."""
    for name, value in change.items():
        setattr(device.fields, name, value)
    with Live.create() as live:
        hand = ForceHand(
            live, HandSettings(kind="force"), ForceSettings(**{**vars(SETTINGS), **settings})
        )
        return refused(hand.open)


def test_a_device_that_cannot_be_used_is_refused_in_one_sentence(device: StandIn) -> None:
    assert "got none; check its cable" in refuses(device, {"devices": 0})
    assert "expected one force device, got 2; give force.serial" in refuses(device, {"devices": 2})
    assert "of serial number 7, got 2 others" in refuses(device, {}, serial=7)
    assert "waits for it; home it" in refuses(device, {"devices": 1, "needs_home": 1})
    assert "expected version 3.3 or later" in refuses(device, {"needs_home": 0, "minor": 1})
    device.fields.minor = 17
    with opened():
        assert "got: device already in use" in refuses(device, {})
    with opened(ForceSettings(**{**vars(SETTINGS), "serial": 1})) as (_, hand):
        assert hand.device_name


def test_a_library_that_is_missing_or_another_one_is_refused(device: StandIn) -> None:
    told = refuses(device, {}, library="/nowhere/libdhd.so")
    assert "got none as '/nowhere/libdhd.so'" in told
    assert "force.library" in told
    libm = ctypes.util.find_library("m")
    assert libm is not None
    assert "without it; install version 3.3" in refused(DhdLibrary, libm)


def test_a_late_limit_beyond_the_watchdog_is_refused() -> None:
    with Live.create() as live:
        settings = ForceSettings(late_s=0.03)
        told = refused(ForceHand, live, HandSettings(kind="force"), settings)
    assert "between one period (1 ms) and the watchdog's 20 ms, got 30 ms" in told
