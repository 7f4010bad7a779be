"""What a device says of itself, asked once."""

from __future__ import annotations

from dataclasses import dataclass

from modeling.errors import InputError
from rig.device.definition import DEVICE
from rig.device.registers import DeviceCause, DeviceState
from rig.wire.conversation import Conversation, Hello
from rig.wire.definition import Value
from rig.wire.transports import TransportLost, opened_transport

ASKED = ("Simulated", "State", "Cause", "Tick", "ModelHash", "FramesBad", "RecordsLost")


@dataclass(frozen=True)
class Asked:
    """A device's hello and some of its registers by name."""

    hello: Hello
    values: dict[str, Value]

    @property
    def simulated(self) -> bool:
        """Whether there is no board or no hand."""
        return bool(self.values["Simulated"])

    @property
    def name(self) -> str:
        """Firmware, schema and precision."""
        hello = self.hello
        precision = "double" if hello.real_size == 8 else "single"
        version = ".".join(map(str, hello.firmware_version))
        return (
            f"{DEVICE.name}, firmware {version}, schema {hello.schema_hash:016x}, "
            f"{hello.tick_rate_hz:g} Hz, {precision} precision"
        )

    @property
    def state(self) -> str:
        """State and last cause."""
        state, cause = self.values["State"], self.values["Cause"]
        assert isinstance(state, int)
        assert isinstance(cause, int)
        return f"state {DeviceState(state).name}, last cause {DeviceCause(cause).name}"


def asked(address: str, baud: int) -> Asked:
    """Say hello to a device, which lets go of what was armed, and read what it is.

    Raises
    ------
    InputError
        If nothing is there, or another device.
    """
    transport = opened_transport(address, baud)
    try:
        talk = Conversation(transport, DEVICE)
        return Asked(talk.hello(), {name: talk.read(name) for name in ASKED})
    except TransportLost as lost:
        raise InputError(
            f"expected a device that stays at {address}, got an end: {lost} Check its cable and "
            "power."
        ) from None
    finally:
        transport.close()
