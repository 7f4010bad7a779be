"""The firmware in QEMU: a client of its own, idling, samples, counted instructions."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, closing, contextmanager, nullcontext
from pathlib import Path
from typing import Any

import pytest

from tactileq.benches.rendering.rivals import layered_texture
from tactileq.rig.machines.board.emulating import KINDS, Emulator, Kind, Machine, build_firmware
from tactileq.rig.machines.device.definition import DEVICE
from tactileq.rig.machines.device.machine import CABLE_DEVICE
from tactileq.rig.machines.device.models import device_model
from tactileq.rig.machines.device.registers import DeviceCause, DeviceCommand, DeviceSource
from tactileq.rig.shared.wire.conversation import Conversation, DeviceRefused
from tactileq.rig.shared.wire.transports import Transport, opened_transport
from tests.rig.machines.device.independent_client import Refused
from tests.rig.machines.device.killing import BAUD
from tests.rig.machines.device.test_process import (
    check_bits_of_the_host,
    check_client_of_the_page,
    until_idle,
)

DOCS = Path(__file__).parents[4] / "docs"
HAS_QEMU = all(map(shutil.which, ("qemu-system-arm", "arm-none-eabi-gcc")))
pytestmark = [
    pytest.mark.long("chips that QEMU emulates in real time"),
    pytest.mark.usefixtures("patient"),
]
FAST = 4_000_000  # carries a record at every tick
BAND = 0.2  # for other versions of the compiler


class BuiltEmulator(Emulator):
    """Its firmware was compiled before, by one worker for all."""

    def __init__(self, kind: Kind, machine: Machine, once_per_run: Callable[..., Any]) -> None:
        super().__init__(kind, machine, baud=FAST if kind == "stm32" else None)
        self._once = once_per_run

    def _built(self) -> Path:
        def build(folder: Path) -> Path:
            file = folder / "firmware.elf"
            return build_firmware(self._kind, self._machine, file, baud=self._baud)

        return Path(self._once(f"{self._machine.process}-{self._kind}", build))


@pytest.fixture(scope="module", params=KINDS)
def device(request: pytest.FixtureRequest, once_per_run: Callable[..., Any]) -> Iterator[Emulator]:
    if request.param != "process" and not HAS_QEMU:
        pytest.skip("qemu-system-arm and arm-none-eabi-gcc are not installed")
    with BuiltEmulator(request.param, CABLE_DEVICE, once_per_run) as emulator:
        yield emulator


@pytest.mark.parametrize("device", ["stm32"], indirect=True)
def test_it_renders_the_bits_of_the_host(device: Emulator) -> None:
    """In its own precision: of an STM32F405 single, against the kernel on this computer."""

    def check() -> None:
        device.close()
        device.open()  # its first model: a later one goes on with other noise
        check_bits_of_the_host(device)

    in_time(check, lambda: closing(opened_transport(device.address, BAUD)))


@pytest.mark.parametrize("device", ["m7", "stm32"], indirect=True)
def test_a_client_written_from_the_page_alone_talks_to_it(device: Emulator) -> None:
    in_time(
        lambda: check_client_of_the_page(device),
        lambda: closing(opened_transport(device.address, BAUD)),
    )


def in_time(
    check: Callable[[], object], transport: Callable[[], AbstractContextManager[Transport]]
) -> None:
    """Check again while the device let go meanwhile as this computer was late to talk to it."""
    while True:
        try:
            check()
        except (AssertionError, DeviceRefused, Refused):
            with transport() as to:
                if not let_go_unheard(to):
                    raise
        else:
            return


def let_go_unheard(transport: Transport) -> bool:
    """Whether the device last let go because it had heard nothing for long."""
    talk = Conversation(transport, DEVICE)
    talk.hello()
    return talk.read("Cause") in (DeviceCause.LINK, DeviceCause.HEARTBEAT)


def used_s(pid: int) -> float:
    """Processor time of a process and its children."""
    fields = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    children = Path(f"/proc/{pid}/task/{pid}/children").read_text(encoding="ascii").split()
    own = (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    return own + sum(used_s(int(child)) for child in children)


def test_one_that_waits_sleeps(device: Emulator) -> None:
    """At most a quarter of a core, by the kernel's count of its processor time."""
    before, look_s = used_s(device.pid), 0.6
    time.sleep(look_s)
    assert used_s(device.pid) - before <= 0.25 * look_s


@pytest.mark.parametrize("device", ["stm32"], indirect=True)
def test_instructions_are_those_of_the_page(device: Emulator) -> None:
    """Counted by QEMU, one nanosecond each; at most 1600 a tick with four layers."""
    page = (DOCS / "device.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (.+?) \| (\d+) \|$", page, flags=re.MULTILINE)
    stated = {name: int(count) for name, count in rows}

    def check(transport: Transport) -> None:
        counted = counted_with(Conversation(transport, DEVICE))
        print("\ninstructions per tick:", {name: round(each) for name, each in counted.items()})
        for name, count in counted.items():
            assert count == pytest.approx(stated[name], rel=BAND)
        assert counted["4 layers"] <= 1600

    with counting_board(device.firmware) as transport:
        in_time(lambda: check(transport), lambda: nullcontext(transport))


def counted_with(talk: Conversation) -> dict[str, float]:
    """Instructions per tick without a texture, and with one of so many layers."""
    hello = talk.hello()
    until_idle(talk)
    for command in (DeviceCommand.HOME, DeviceCommand.ARM, DeviceCommand.SHOW):
        talk.write("Command", command)
    per_tick(talk), per_tick(talk)  # the small force after ARM has ended
    counted = {"force alone": per_tick(talk)}
    for layers in (1, 4, 8):
        upload = device_model(layered_texture(layers), hello)
        talk.upload(upload.data, upload.hash)
        talk.write("Source", DeviceSource.MODEL)
        counted[f"{layers} layer{'s' * (layers > 1)}"] = per_tick(talk)
    return counted


@contextmanager
def counting_board(firmware: Path | None) -> Iterator[Transport]:
    """An STM32F405 in QEMU whose every instruction takes a nanosecond."""
    command = ["qemu-system-arm", "-M", "netduinoplus2", "-display", "none", "-monitor", "none"]
    command += ["-serial", "pty", "-kernel", str(firmware), "-icount", "shift=0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT) as qemu:
        try:
            assert qemu.stdout is not None
            path = qemu.stdout.readline().decode().split("redirected to ")[1].split()[0]
            with closing(opened_transport(path, BAUD)) as transport:
                yield transport
        finally:
            qemu.kill()


def per_tick(talk: Conversation) -> float:
    """Mean over a while: clocks of 168 MHz in ns."""
    talk.read("TickClocks")
    for _ in range(12):
        talk.write("Heartbeat", 1)
        talk.listen(0.02)
    mean, _ = talk.read("TickClocks")  # type: ignore[misc]
    return float(mean) / 168e6 * 1e9
