"""What the processes of a force device are started with."""

from __future__ import annotations

from tactileq.rig.machines.force.settings import ForceSettings
from tactileq.rig.shared.live.messages import Message


class RunServo(Message, frozen=True, kw_only=True):
    """For the servo: path of the shared memory, and its device.

    A missing device is refused, or reported where it is patient.
    """

    live: str
    settings: ForceSettings
    patient: bool


class Watch(Message, frozen=True, kw_only=True):
    """For the watchdog: the servo to watch, and the device to release."""

    live: str
    settings: ForceSettings


class Servo(Message, frozen=True):
    """For the watchdog: the process that has the device now; 0 for none."""

    pid: int


class Acted(Message, frozen=True):
    """From the watchdog: it has killed the servo and released the device; `seconds` after the last
    tick, or why it could not."""

    pid: int
    seconds: float
    sentence: str
