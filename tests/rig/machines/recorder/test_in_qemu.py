"""The recorder's firmware on emulated micro-controllers: a record, a stop, its instructions."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from tactileq.rig.machines.board.virtual import TICK_HZ
from tactileq.rig.machines.recorder.definition import RECORDER
from tactileq.rig.machines.recorder.driver import DriverRecord, LinkedWire, Recorder, RecordRefused
from tactileq.rig.machines.recorder.law import RecorderLaw, WantedRecord
from tactileq.rig.machines.recorder.machine import SURFACE_RECORDER
from tactileq.rig.machines.recorder.recording import REPEATED
from tactileq.rig.machines.recorder.registers import RecorderCause, RecorderCommand, RecorderState
from tactileq.rig.shared.wire.conversation import Conversation
from tactileq.rig.shared.wire.definition import Value
from tactileq.rig.shared.wire.link import Link
from tactileq.rig.shared.wire.transports import opened_transport
from tests.rig.conftest import PATIENCE_S
from tests.rig.machines.device.killing import BAUD
from tests.rig.machines.device.test_in_qemu import (
    BAND,
    HAS_QEMU,
    BuiltEmulator,
    counting_board,
    per_tick,
)

PAGE = Path(__file__).parents[4] / "docs/recorder.md"
SHORT = WantedRecord(speed_mm_s=200.0, force_n=2.0, run_in_s=0.05, duration_s=0.2)
HELD = (200.0, 2.0, 40.0, 0.05, 60.0)  # the register Wanted
STM32_HZ = 168e6

pytestmark = [
    pytest.mark.long("chips that QEMU emulates in real time"),
    pytest.mark.usefixtures("patient"),
    pytest.mark.skipif(
        not HAS_QEMU, reason="qemu-system-arm and arm-none-eabi-gcc are not installed"
    ),
]


@pytest.fixture(scope="module", params=["m7", "stm32"])
def emulator(request: pytest.FixtureRequest, once_per_run: Callable[..., Any]) -> Iterator[Any]:
    with BuiltEmulator(request.param, SURFACE_RECORDER, once_per_run) as emulator:
        yield emulator


@pytest.fixture
def wire(emulator: BuiltEmulator) -> Iterator[LinkedWire]:
    link = Link(lambda: opened_transport(emulator.address, BAUD), RECORDER)
    link.open()
    try:
        yield LinkedWire(link)
    finally:
        link.close()


def wait_for(done: Callable[[], bool], pause: Callable[[], object]) -> None:
    end_s = time.monotonic() + PATIENCE_S
    while not done():
        assert time.monotonic() < end_s
        pause()


def floats(value: Value) -> tuple[float, ...]:
    assert isinstance(value, tuple)
    return value


def records(wire: LinkedWire | Conversation) -> bool:
    """Whether it does; begins where nothing runs: a host was here before, or was too slow."""
    state = wire.read("State")
    if state == RecorderState.FAILS:
        wire.write("Command", RecorderCommand.CLEAR)
    if state in (RecorderState.FAILS, RecorderState.RESTS):
        wire.write("Wanted", HELD)
        wire.write("Command", RecorderCommand.START)
    return state == RecorderState.RECORDS


def recorded(recorder: Recorder) -> DriverRecord:
    """A record, after however many attempts: a busy computer loses the link."""
    end_s = time.monotonic() + PATIENCE_S
    while True:
        try:
            return recorder.record(SHORT)
        except RecordRefused as refused:
            if refused.cause not in REPEATED or time.monotonic() > end_s:
                raise


def test_a_record_on_the_board_holds_speed_and_force(wire: LinkedWire) -> None:
    """Judged by the mechanics' own means; an STM32F405 reckons in single precision."""
    recorder = Recorder(wire, RecorderLaw())
    assert recorder.simulated
    found = recorded(recorder)
    true_speed, true_force = recorder.emerged()
    assert found.speed_mm_s == pytest.approx(true_speed, rel=0.02)
    assert found.force_n == pytest.approx(true_force, rel=0.02)
    print(f"\n{wire.read('RealSize')} bytes: {found}, true {true_speed}, {true_force}")


def test_a_stop_leaves_no_current(wire: LinkedWire) -> None:
    """As the board says it, and as its turntable, which runs down."""
    recorder = Recorder(wire, RecorderLaw())
    before: list[Value] = []

    def stopped() -> bool:
        wait_for(lambda: records(wire), lambda: wire.pause(0.02))
        before[:] = wire.read("Now"), wire.read("Tick")
        recorder.stop()
        return wire.read("Cause") == RecorderCause.STOPPED

    wait_for(stopped, lambda: wire.pause(0.02))  # it stops by itself if this computer is late
    pushed, tick = before
    assert all(floats(pushed)[3:])
    assert floats(wire.read("Now"))[3:] == (0.0, 0.0)
    wait_for(lambda: floats(wire.read("Now"))[0] < 1.0, lambda: wire.pause(0.02))
    assert floats(wire.read("Now"))[3:] == (0.0, 0.0)
    assert recorder.state == RecorderState.FAILS
    zero = wire.read("ZeroTick")
    assert zero == wire.read("FaultTick")
    assert isinstance(tick, int)
    assert isinstance(zero, int)
    assert tick <= zero


@pytest.mark.parametrize("emulator", ["stm32"], indirect=True)
def test_instructions_are_those_of_the_page(emulator: BuiltEmulator) -> None:
    """Of the law and its outputs alone; one instruction in a clock is what a Cortex-M4F may do."""
    rows = re.findall(r"^\| (.+?) \| (\d+) \|$", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    stated = {name: int(count) for name, count in rows}
    counted = {}
    with counting_board(emulator.firmware) as transport:
        talk = Conversation(transport, RECORDER)
        talk.hello()
        counted["at rest"] = per_tick(talk)

        def beat() -> None:
            talk.write("Heartbeat", 1)
            talk.listen(0.02)

        def counted_while_it_records() -> bool:
            wait_for(lambda: records(talk), beat)
            counted["while it records"] = per_tick(talk)
            return talk.read("State") == RecorderState.RECORDS

        wait_for(counted_while_it_records, beat)  # a busy computer loses the link
    print("\ninstructions per tick:", {name: round(count) for name, count in counted.items()})
    for name, count in counted.items():
        assert count == pytest.approx(stated[name], rel=BAND)
        assert count < STM32_HZ / TICK_HZ
