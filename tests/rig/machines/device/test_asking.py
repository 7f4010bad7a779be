"""What a device is said to be, and why it cannot be asked."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tactileq.modeling import InputError
from tactileq.rig.machines.board.virtual import VirtualBoard, VirtualTransport
from tactileq.rig.machines.device import asking
from tactileq.rig.machines.device.asking import asked
from tactileq.rig.machines.device.definition import DEVICE
from tactileq.rig.machines.device.virtual import compiled_device
from tactileq.rig.machines.recorder.definition import RECORDER
from tactileq.rig.machines.recorder.virtual import compiled_recorder
from tactileq.rig.shared.wire.transports import Transport
from tests.refusals import refused

OLD = replace(DEVICE, firmware_version=(9, 9))
OTHER = replace(DEVICE, registers=dict(list(DEVICE.registers.items())[:-1]))


class Silent(VirtualTransport):
    """A port at whose end nothing answers."""

    def write(self, data: bytes) -> None:
        """Is lost."""


def at(monkeypatch: pytest.MonkeyPatch, transport: VirtualTransport) -> None:
    def opened(address: str, baud: int) -> Transport:
        transport.name = address
        return transport

    monkeypatch.setattr(asking, "opened_transport", opened)


def test_either_kind_is_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    for compiled, name in ((compiled_device, DEVICE.name), (compiled_recorder, RECORDER.name)):
        at(monkeypatch, VirtualTransport(VirtualBoard(compiled())))
        found = asked("a port", 0, (DEVICE, RECORDER))
        assert found.definition.name == name
        assert found.simulated


@pytest.mark.parametrize(("wanted", "facts"), [(OLD, ["9.9", "1.2"]), (OTHER, ["schema", "load"])])
def test_the_first_thing_that_is_wrong_is_told(
    monkeypatch: pytest.MonkeyPatch, wanted: object, facts: list[str]
) -> None:
    """Not that it is no recorder either."""
    at(monkeypatch, VirtualTransport(VirtualBoard(compiled_device())))
    with refused(InputError, names=["a port", *facts]):
        asked("a port", 0, (wanted, RECORDER))  # type: ignore[arg-type]


def test_a_silent_port_and_a_device_of_another_kind_are_told(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    at(monkeypatch, Silent(VirtualBoard(compiled_device())))
    with refused(InputError, names="a port", got="nothing"):
        asked("a port", 0, (DEVICE, RECORDER))
    at(monkeypatch, VirtualTransport(VirtualBoard(compiled_device())))
    other = replace(DEVICE, who_am_i=1)
    with refused(InputError, names="a port", expected=DEVICE.name, got=DEVICE.who_am_i):
        asked("a port", 0, (other, RECORDER))
