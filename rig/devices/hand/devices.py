"""Opens the device that measures the hand, according to the settings."""

from __future__ import annotations

import sys
from contextlib import suppress

from tactileq.modeling.errors import InputError
from tactileq.modeling.extras import MissingExtra
from tactileq.rig.devices.hand.sample import ConnectedDevice, Device
from tactileq.rig.devices.hand.scripted import ScriptedHand
from tactileq.rig.devices.hand.settings import HandSettings


def open_device(settings: HandSettings) -> Device:
    """The device of these settings, open.

    Raises
    ------
    InputError
        If it is not there, may not be read, or cannot be used.
    """
    if settings.kind == "scripted":
        return ScriptedHand.open(settings)
    if settings.kind == "serial":
        from tactileq.rig.devices.hand.serial_sensor import (
            SerialSensor,  # pyserial, which others do not need
        )

        return SerialSensor.open(settings)
    if settings.kind in ("tablet", "mouse") and sys.platform == "linux":
        from tactileq.rig.devices.hand.evdev import (
            EventDevice,  # which needs calls that only Linux has
        )

        return EventDevice.open(settings)
    if settings.kind == "force":
        raise InputError(
            "expected a hand that only measures here, got a force device, whose servo runs in "
            "sessions, tactileq feel and tactileq rig monitor; take another hand for this."
        )
    raise InputError(
        f"expected a hand that this system can read, got a {settings.kind} on {sys.platform}; take "
        'kind = "window" or "serial".'
    )


def connected_devices() -> tuple[ConnectedDevice, ...]:
    """What is connected that may measure a hand: input devices of Linux, and serial ports.

    Without the extra rig no port is known.
    """
    ports: tuple[ConnectedDevice, ...] = ()
    with suppress(MissingExtra):
        from tactileq.rig.devices.hand.serial_sensor import serial_ports

        ports = serial_ports()
    if sys.platform != "linux":
        return ports
    from tactileq.rig.devices.hand.evdev import input_devices

    return input_devices() + ports
