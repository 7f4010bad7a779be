"""The simulated vibrator as a client of JACK: `python -m tactileq.rig.devices.simulated.process`.

It says once that it runs, and ends with its parent. To PortAudio it is a device of its own: what is
played on it comes back as its input, shaken and measured.
"""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np

from tactileq.modeling.arrays import Floats
from tactileq.modeling.errors import InputError, shown
from tactileq.rig.devices.simulated.vibrator import SimulatedAccelerometer, SimulatedTransducers
from tactileq.rig.devices.sound.devices import SoundDevice, portaudio, sound_devices
from tactileq.rig.shared.live.driven import Parent
from tactileq.rig.shared.live.messages import Done, Message

CHANNELS = 2


class Card(Message, frozen=True):
    """What it is started with."""

    vibrator: SimulatedTransducers
    name: str


def main() -> None:
    """Run until the parent is gone."""
    with Parent() as parent:
        card = parent.settings(Card)
        stream = _stream(card.vibrator, name=card.name)
        stream.start()
        parent.send(Done())
        parent.serve(Done, lambda done: done)


def _stream(vibrator: SimulatedTransducers, *, name: str) -> Any:
    """A stream that drives the vibrator from the first channel and returns its accelerometer.

    The other channel comes back as it is played.
    """
    library = portaudio()
    _name_client(library, name)
    card = _jack_device()
    accelerometer = SimulatedAccelerometer(vibrator, rate_hz=card.rate_hz)

    def shake(played: Floats, measured: Floats, *_: object) -> None:
        measured[:] = played
        measured[:, 0] = accelerometer.give(played[:, 0])

    return library.Stream(
        samplerate=card.rate_hz,
        device=card.index,
        channels=CHANNELS,
        dtype=np.float32,
        blocksize=0,  # as the server has it: no delay of its own
        callback=shake,
    )


def _name_client(library: Any, name: str) -> None:
    """Under this name the server, and PortAudio in other programs, list this process."""
    portaudio_itself = ctypes.CDLL(library._libname)
    if not hasattr(portaudio_itself, "PaJack_SetClientName"):
        raise InputError(
            "expected PortAudio with JACK, got one without; the simulated vibrator runs on Linux "
            "with libportaudio2 and jackd2."
        )
    if portaudio_itself.PaJack_SetClientName(name.encode()) != 0:
        raise InputError(
            f"expected a short name of the simulated vibrator, got {shown(name)}; shorten it."
        )
    library._terminate()  # the client is opened when PortAudio starts
    library._initialize()


def _jack_device() -> SoundDevice:
    """The server's own device."""
    for device in sound_devices():
        if "JACK" in device.host and device.name == "system":
            return device
    raise InputError(
        "expected a JACK server for the simulated vibrator, got none; start one: jackd -d dummy -r "
        "48000 -p 128."
    )


if __name__ == "__main__":
    main()
