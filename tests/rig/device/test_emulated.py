"""The firmware in a process and in QEMU: a client of its own, killed hosts, idling, samples."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benches.rendering.rivals import layered_texture
from modeling import InputError
from rig.device.definition import DEVICE
from rig.device.emulating import KINDS, Emulator, Kind, build_firmware, check_baud
from rig.device.models import device_model
from rig.device.registers import DeviceCommand, DeviceSource, DeviceState
from rig.wire.conversation import Conversation
from rig.wire.transports import Transport, opened_transport
from stimuli.planted.textures import planted_texture
from tests.refusals import refused
from tests.rig.device.independent_client import Client
from tests.rig.device.killing import BAUD, ticks_after_kill
from tests.rig.device.talking import joined
from tests.rig.device.test_models import hosts_samples

DOCS = Path(__file__).parents[3] / "docs"
HAS_QEMU = all(map(shutil.which, ("qemu-system-arm", "arm-none-eabi-gcc")))
FAST = 4_000_000  # carries a record at every tick
BAND = 0.2  # for other versions of the compiler


class BuiltEmulator(Emulator):
    """Its firmware was compiled before, by one worker for all."""

    def __init__(
        self, kind: Kind, once_per_run: Callable[..., Any], *, recorder: bool = False
    ) -> None:
        super().__init__(kind, baud=FAST if kind == "stm32" else None, recorder=recorder)
        self._once = once_per_run

    def _built(self) -> Path:
        def build(folder: Path) -> Path:
            file = folder / "firmware.elf"
            return build_firmware(self._kind, file, baud=self._baud, recorder=self._recorder)

        return Path(self._once(f"firmware-{'recorder-' * self._recorder}{self._kind}", build))


@pytest.fixture(scope="module", params=KINDS)
def device(request: pytest.FixtureRequest, once_per_run: Callable[..., Any]) -> Iterator[Emulator]:
    if request.param != "process" and not HAS_QEMU:
        pytest.skip("qemu-system-arm and arm-none-eabi-gcc are not installed")
    with BuiltEmulator(request.param, once_per_run) as emulator:
        yield emulator


@pytest.mark.parametrize("device", ["process", "stm32"], indirect=True)
def test_it_renders_the_bits_of_the_host(device: Emulator) -> None:
    """In its own precision: of an STM32F405 single, against the kernel on this computer."""
    model = planted_texture("canvas")
    transport = opened_transport(device.address, BAUD)
    try:
        talk = Conversation(transport, DEVICE)
        hello = talk.hello()
        upload = device_model(model, hello)
        for command in (DeviceCommand.HOME, DeviceCommand.ARM, DeviceCommand.SHOW):
            talk.write("Command", command)
        talk.write("EventRate", 5000 if hello.real_size == 4 else 1000)
        talk.upload(upload.data, upload.hash)
        talk.write("Source", DeviceSource.MODEL)
        blocks, end_s = talk.blocks(), time.monotonic() + 1.6
        while time.monotonic() < end_s:
            talk.write("Heartbeat", 1)
            talk.listen(0.02)
            blocks += talk.blocks()
        begin = talk.read("ModelTick")
        talk.write("EventRate", 0)
        talk.write("Source", DeviceSource.NOTHING)
        talk.write("Command", DeviceCommand.STOP)
        time.sleep(0.1)
        talk.write("Command", DeviceCommand.CLEAR)
    finally:
        transport.close()
    assert isinstance(begin, int)
    every, values = blocks[0].every, joined(blocks)
    host = hosts_samples(model, blocks, begin, single=hello.real_size == 4)
    host = host[::every]
    first = (begin - blocks[0].tick) // every
    device_samples = values["vibration_g"][first:]
    size = min(host.size, device_samples.size)
    assert size > 300
    assert np.abs(host[:size]).max() > 0.02
    assert np.array_equal(device_samples[:size], host[:size].astype(np.float32))
    print(f"\n{8 * hello.real_size} bits: {size} samples, all equal")


def test_a_client_written_from_the_page_alone_talks_to_it(device: Emulator) -> None:
    client = Client(device.address)
    try:
        assert client.hello()["SchemaHash"] == DEVICE.schema_hash
        for command in (6, 1, 2):
            client.write(10, bytes([command]))
        assert client.read(8) == bytes([DeviceState.RUNNING])
        client.write(16, (500).to_bytes(2, "little"))
        records = client.records(0.3)
        client.write(16, bytes(2))
        client.write(10, bytes([5]))
        numbers, ticks, *_, flags = zip(*records, strict=True)
        assert list(numbers) == list(range(len(records)))
        assert set(np.diff(ticks)) == {10}
        assert all(flag & 32 for flag in flags)
        time.sleep(0.1)
        assert client.read(8) == bytes([DeviceState.FAULT])
        client.write(10, bytes([4]))
    finally:
        client.close()


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGSTOP])
def test_a_killed_or_stopped_host_costs_heartbeat_and_ramp(how: int) -> None:
    """601 ticks by the device's own clock; a hundred of them: tests.rig.device.large."""
    with Emulator("process") as emulator:
        assert abs(ticks_after_kill(emulator.address, 3, how) - 601) <= 1


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
    """Counted by QEMU, one nanosecond each; at most 1500 a tick with four layers."""
    page = (DOCS / "device.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (.+?) \| (\d+) \|$", page, flags=re.MULTILINE)
    stated = {name: int(count) for name, count in rows}
    with counting_board(device.firmware) as transport:
        talk = Conversation(transport, DEVICE)
        hello = talk.hello()
        counted = {}
        for command in (DeviceCommand.HOME, DeviceCommand.ARM, DeviceCommand.SHOW):
            talk.write("Command", command)
        counted["force alone"] = per_tick(talk)
        for layers in (1, 4, 8):
            upload = device_model(layered_texture(layers), hello)
            talk.upload(upload.data, upload.hash)
            talk.write("Source", DeviceSource.MODEL)
            counted[f"{layers} layer{'s' * (layers > 1)}"] = per_tick(talk)
    print("\ninstructions per tick:", {name: round(count) for name, count in counted.items()})
    for name, count in counted.items():
        assert count == pytest.approx(stated[name], rel=BAND)
    assert counted["4 layers"] <= 1500


@contextmanager
def counting_board(firmware: Path | None) -> Iterator[Transport]:
    """An STM32F405 in QEMU whose every instruction takes a nanosecond."""
    command = ["qemu-system-arm", "-M", "netduinoplus2", "-display", "none", "-monitor", "none"]
    command += ["-serial", "pty", "-kernel", str(firmware), "-icount", "shift=0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT) as qemu:
        try:
            assert qemu.stdout is not None
            path = qemu.stdout.readline().decode().split("redirected to ")[1].split()[0]
            transport = opened_transport(path, BAUD)
            yield transport
            transport.close()
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


@pytest.mark.parametrize(
    ("kind", "baud"), [("m7", 9000), ("m7", 1_515_000), ("stm32", 6_000_000), ("stm32", 0)]
)
def test_a_baud_rate_that_the_board_cannot_have_is_refused(kind: Kind, baud: int) -> None:
    with refused(InputError, expected="baud", got=baud):
        check_baud(kind, baud)


def test_usual_baud_rates_are_taken() -> None:
    for kind in KINDS:
        for baud in (115_200, 500_000):
            check_baud(kind, baud)
