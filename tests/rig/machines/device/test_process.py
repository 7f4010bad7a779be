"""The device's process at its pseudo-terminal: a client of its own, killed hosts, samples."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tactileq.rig.machines.board.emulating import Emulator
from tactileq.rig.machines.board.virtual import TICK_HZ
from tactileq.rig.machines.device.definition import DEVICE
from tactileq.rig.machines.device.machine import CABLE_DEVICE
from tactileq.rig.machines.device.models import device_model
from tactileq.rig.machines.device.registers import DeviceCommand, DeviceSource, DeviceState
from tactileq.rig.shared.live.clock import now_s, readable, sleep, taking_part
from tactileq.rig.shared.wire.conversation import Conversation
from tactileq.rig.shared.wire.transports import opened_transport
from tactileq.stimuli.planted.textures import planted_texture
from tests.rig.machines.device import independent_client
from tests.rig.machines.device.independent_client import Client
from tests.rig.machines.device.killing import BAUD, ticks_after_kill
from tests.rig.machines.device.talking import joined
from tests.rig.machines.device.test_models import hosts_samples


def check_bits_of_the_host(device: Emulator) -> None:
    """In its own precision: of an STM32F405 single, against the kernel on this computer."""
    model = planted_texture("canvas")
    transport = opened_transport(device.address, BAUD)
    try:
        talk = Conversation(transport, DEVICE)
        hello = talk.hello()
        upload = device_model(model, hello)
        until_idle(talk)
        for command in (DeviceCommand.HOME, DeviceCommand.ARM, DeviceCommand.SHOW):
            talk.write("Command", command)
        talk.write("EventRate", 5000 if hello.real_size == 4 else 1000)
        talk.upload(upload.data, upload.hash)
        talk.write("Source", DeviceSource.MODEL)
        blocks = talk.blocks()
        while not blocks or blocks[-1].tick < blocks[0].tick + 1.6 * TICK_HZ:
            talk.write("Heartbeat", 1)
            talk.listen(0.02)
            blocks += talk.blocks()
        begin = talk.read("ModelTick")
        talk.write("EventRate", 0)
        talk.write("Source", DeviceSource.NOTHING)
        talk.write("Command", DeviceCommand.STOP)
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


def until_idle(talk: Conversation) -> None:
    """Until it can be armed, whatever it let go for before."""
    while (state := talk.read("State")) != DeviceState.IDLE:
        if state == DeviceState.FAULT:
            talk.write("Command", DeviceCommand.CLEAR)
        sleep(0.01)


def check_client_of_the_page(device: Emulator) -> None:
    """A client written from the page alone talks to it."""
    client = Client(device.address)
    try:
        assert client.hello()["SchemaHash"] == DEVICE.schema_hash
        while (state := client.read(8)) != bytes([DeviceState.IDLE]):
            if state == bytes([DeviceState.FAULT]):
                client.write(10, bytes([4]))
            sleep(0.01)
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
        while client.read(8) == bytes([DeviceState.RELEASING]):
            sleep(0.01)
        assert client.read(8) == bytes([DeviceState.FAULT])
    finally:
        client.close()


@pytest.fixture
def device(given_clock: None) -> Iterator[Emulator]:
    with Emulator("process", CABLE_DEVICE) as emulator:
        yield emulator


def test_it_renders_the_bits_of_the_host(device: Emulator) -> None:
    with taking_part():
        check_bits_of_the_host(device)


def by_the_clock(reads: list[int], writes: list[int], _: list[int], seconds: float) -> Any:
    """As select.select, of one descriptor, by the rig's clock."""
    return (reads if reads and readable(reads[0], seconds)[0] else [], writes, [])


def test_a_client_written_from_the_page_alone_talks_to_it(
    device: Emulator, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(independent_client, "time", SimpleNamespace(monotonic=now_s))
    monkeypatch.setattr(independent_client, "select", SimpleNamespace(select=by_the_clock))
    with taking_part():
        check_client_of_the_page(device)


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGSTOP])
@pytest.mark.usefixtures("given_clock")
def test_a_killed_or_stopped_host_costs_heartbeat_and_ramp(how: int) -> None:
    """601 ticks by the device's own clock; a hundred of them: tests.rig.machines.device.large."""
    with Emulator("process", CABLE_DEVICE) as emulator:
        assert abs(ticks_after_kill(emulator.address, 3, how) - 601) <= 1
