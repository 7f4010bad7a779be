"""What a device says of itself, asked once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from tactileq.modeling.errors import InputError
from tactileq.rig.machines.device.definition import DEVICE
from tactileq.rig.shared.wire.conversation import Conversation, Hello, OtherDevice
from tactileq.rig.shared.wire.definition import Definition, Value
from tactileq.rig.shared.wire.transports import TransportLost, opened_transport

STATED = ("Simulated", "State", "Cause")
RANGES = ("VibrationRange",)
COUNTED = ("Tick", "ModelHash", "Number", "FramesBad", "RecordsLost")


@dataclass(frozen=True)
class Asked:
    """What a device is, its hello and some of its registers by name."""

    definition: Definition
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
            f"{self.definition.name}, firmware {version}, schema {hello.schema_hash:016x}, "
            f"{hello.tick_rate_hz:g} Hz, {precision} precision"
        )

    @property
    def state(self) -> str:
        """State and last cause."""
        return f"state {self._named('State')}, last cause {self._named('Cause')}"

    @property
    def reach(self) -> float:
        """What the vibrator's converter takes at most, in its own unit."""
        most = self.values["VibrationRange"]
        assert isinstance(most, float)
        return most

    @property
    def counts(self) -> dict[str, Value]:
        """Its counters by name, as many as it has."""
        return {name: self.values[name] for name in COUNTED if name in self.values}

    def _named(self, mask: str) -> str:
        members = self.definition.masks[mask].members
        return next(name for name, (value, _) in members.items() if value == self.values[mask])


def asked(address: str, baud: int, definitions: Sequence[Definition] = (DEVICE,)) -> Asked:
    """Say hello to a device, which lets go of what was armed, and read what it is.

    Parameters
    ----------
    definitions : sequence of Definition
        Of the devices that it may be.

    Raises
    ------
    InputError
        If nothing is there, another device, or one of them with other firmware.
    """
    transport = opened_transport(address, baud)
    others: list[OtherDevice] = []
    try:
        for definition in definitions:
            talk = Conversation(transport, definition)
            try:
                hello = talk.hello()
            except OtherDevice as error:  # it may be the next one; all else is wrong with it
                others.append(error)
                continue
            names = [name for name in (*STATED, *RANGES, *COUNTED) if name in definition.registers]
            return Asked(definition, hello, {name: talk.read(name) for name in names})
        raise others[0]
    except TransportLost as lost:
        raise InputError(
            f"expected a device that stays at {address}, got an end: {lost} Check its cable and "
            "power."
        ) from None
    finally:
        transport.close()
