"""A device that renders by itself as the hand of a rig: the law is its own (here: emulated)."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tactileq.modeling import InputError
from tactileq.rig.desk.desk_rig import DeskRig
from tactileq.rig.desk.walls import largest_of
from tactileq.rig.devices.hand.settings import HandSettings
from tactileq.rig.machines.board.emulating import Emulator
from tactileq.rig.machines.device.hand import DeviceHand
from tactileq.rig.machines.device.machine import CABLE_DEVICE
from tactileq.rig.machines.device.registers import DeviceCause, DeviceState
from tactileq.rig.machines.force.hand import ForceHand
from tactileq.rig.machines.force.settings import ForceSettings
from tactileq.rig.machines.force.states import Cause, State
from tactileq.rig.machines.force.wall import Wall
from tactileq.rig.shared.live.memory import CONTACT, FORCE_COMMANDED, GONE, SIMULATED, Live
from tactileq.rig.shared.setup.rig_file import RigFile
from tactileq.stimuli.planted.textures import planted_texture
from tests.refusals import refused
from tests.rig.desk.rig_files import failures, rig_file
from tests.rig.waiting import follow, wait_until

WALL = Wall(stiffness_n_per_mm=0.8, width_mm=100, length_mm=100)
PREFIX = """[device]
address = "ADDRESS"
simulated = true
[force]
rate_hz = 5000
delay_ms = { value = 0.2, unit = "ms", assumed = true, source = "a test" }
[latency]"""
Jack = Callable[..., AbstractContextManager[Any]]


def device_rig(folder: Path, address: str, *changes: tuple[str, str]) -> RigFile:
    """A calibrated rig whose hand is the device at this address."""
    given = (('kind = "scripted"', 'kind = "force"'), ("[latency]", PREFIX), ("ADDRESS", address))
    return rig_file(folder, *given, *changes)


@contextmanager
def opened(address: str) -> Iterator[tuple[Live, ForceHand]]:
    settings = ForceSettings(address=address, rate_hz=5000, watched=False, simulated=True)
    with Live.create() as live, DeviceHand(live, HandSettings(kind="force"), settings) as hand:
        yield live, hand


def pressed(live: Live, hand: ForceHand) -> None:
    """Show the wall, and wait until the hand presses on it."""
    hand.arm()
    hand.show(WALL)

    def presses() -> bool:
        live.heartbeat()
        reading = live.latest()
        return reading is not None and reading["force_n"] > 0.3

    wait_until(presses)


def test_it_is_armed_by_people_and_its_records_are_readings(device: Emulator) -> None:
    with opened(device.address) as (live, hand):
        assert hand.device_name.startswith("tactileq-cables")
        wait_until(lambda: hand.status.state == State.IDLE)
        with refused(InputError, expected="armed", got="without force"):
            hand.show(WALL)
        pressed(live, hand)
        seen, _ = live.readings_since(0)
        follow(0.6, live.heartbeat, every_s=0.02)
        _, rows = live.readings_since(seen)
        assert rows.size > 400  # 1000 a second
        assert set(rows["flags"]) == {CONTACT | SIMULATED | FORCE_COMMANDED}
        assert np.all(np.diff(rows["time_s"]) >= 0)
        assert rows["force_n"] == pytest.approx(0.8 * rows["depth_mm"], rel=0.1)
        assert np.ptp(rows["x_mm"]) > 10
        hand.hide()
        wait_until(lambda: live.latest()["force_n"] == 0)  # type: ignore[index]
        assert hand.faults() == ()


def test_a_session_that_hangs_is_noticed_by_the_device(device: Emulator) -> None:
    with opened(device.address) as (live, hand):
        pressed(live, hand)
        wait_until(lambda: hand.status.state == State.FAULT)
        assert hand.status.cause == Cause.HEARTBEAT
        hand.arm()  # by people: it was homed already
        assert hand.status.state == State.ARMED


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGSTOP])
def test_without_the_process_that_talks_it_lets_go_and_is_not_armed_again(
    device: Emulator, how: int
) -> None:
    with opened(device.address) as (live, hand):
        pressed(live, hand)
        first = hand.pid
        assert first is not None
        os.kill(first, how)
        wait_until(lambda: hand.pid != first)
        wait_until(lambda: not live.latest()["flags"] & GONE)  # type: ignore[index]
        assert hand.status.state == State.FAULT
        assert hand.status.cause in (Cause.LINK, Cause.HOST)
        assert live.latest()["force_n"] == 0  # type: ignore[index]
        assert any("read" in sentence for sentence in hand.faults())


def test_a_desk_rig_shows_its_wall_under_a_texture(
    jack_server: Jack, tmp_path: Path, device: Emulator
) -> None:
    with jack_server(block=128):
        rig_on = device_rig(tmp_path, device.address)
        with DeskRig(rig_on, override="a test") as rig:
            assert rig.simulated
            assert str(rig.stated["HandFirmware"]).startswith("tactileq-cables 1.2")
            rig.arm()
            rig.present_model(planted_texture("PVC"))
            follow(2.0, rig.read, every_s=0.02)
            rig.silence()
            rows = rig.take_history()
            (presentation,) = rig.take_presentations()
            faults = failures(rig.take_faults())
    on = rows.presentation == presentation.number
    assert faults == []
    assert np.nanmax(rows.depth_mm[on]) > 0.3
    assert np.all(rows.force_commanded[on])
    assert rows.force_n[on].max() > 0.2
    assert presentation.peak_g > 0.01


def test_states_and_causes_of_the_wire_are_those_of_the_servo() -> None:
    """The device's are reported as the servo's, number by number."""
    for theirs, ours in ((DeviceState, State), (DeviceCause, Cause)):
        assert {one.name: one.value for one in theirs} == {one.name: one.value for one in ours}


def test_what_a_rig_file_says_of_a_device_has_to_fit(tmp_path: Path) -> None:
    good = device_rig(tmp_path, "/dev/ttyACM0")
    assert good.simulated
    assert largest_of(good) == pytest.approx(5 / 3)
    with refused(InputError, expected="5000", got="1000"):
        device_rig(tmp_path, "/dev/ttyACM0", ("rate_hz = 5000", "rate_hz = 1000"))
    with refused(InputError, expected="[device]", got="force.library"):
        device_rig(tmp_path, "/dev/ttyACM0", ("rate_hz = 5000", 'rate_hz = 5000\nlibrary = "x"'))
    pose = "[pose]\norigin_mm = [0,0,0]\nx = [1,0,0]\nz = [0,0,1]\nmeasured_on = 2026-11-01\n"
    with refused(InputError, expected="[device]", got="[pose]"):
        device_rig(tmp_path, "/dev/ttyACM0", ("[latency]", f"{pose}[latency]"))
    unused = device_rig(tmp_path, "/dev/ttyACM0", ('kind = "force"', 'kind = "scripted"'))
    assert unused.own_device is None


def test_an_emulated_device_that_is_not_declared_is_refused() -> None:
    settings = ForceSettings(rate_hz=5000, watched=False)
    with (
        Emulator("process", CABLE_DEVICE) as device,
        Live.create() as live,
        refused(InputError, expected="a board with a hand", got="an emulated one"),
        DeviceHand(live, HandSettings(kind="force"), replace(settings, address=device.address)),
    ):
        pass
