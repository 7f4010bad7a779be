"""What the process that reads the hand is told, and what it reports by itself."""

from __future__ import annotations

from tactileq.rig.devices.hand.settings import HandSettings
from tactileq.rig.shared.live.messages import Done, Message


class ReadHand(Message, frozen=True, kw_only=True):
    """What it is started with: the path of the shared memory, and what measures the hand.

    One that is patient waits for a device that is not there, and reports it.
    """

    live: str
    settings: HandSettings
    patient: bool


class Unplug(Message, frozen=True):
    """Act as if the device were unplugged, or plugged in again; for tests."""

    unplugged: bool


class Ready(Message, frozen=True):
    """The device is open."""

    name: str


class HandFault(Message, frozen=True):
    """Something went wrong: one sentence."""

    sentence: str


class Counts(Message, frozen=True):
    """What was read so far and what was lost, by name."""

    counts: dict[str, int]


class Firmware(Message, frozen=True):
    """The version that the device states."""

    version: str


Report = Ready | HandFault | Counts | Firmware | Done
