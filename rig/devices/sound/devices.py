"""Sound devices by name, and the rates that they do."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

from tactileq.modeling.errors import InputError, shown
from tactileq.modeling.extras import extra

Direction = Literal["input", "output"]
USUAL_RATES_HZ = (8000, 16000, 22050, 32000, 44100, 48000, 88200, 96000, 176400, 192000)
PORTAUDIO_HINT = "install libportaudio2 (sudo apt-get install libportaudio2)"


class NoPortAudio(InputError):
    """The library that knows all sound devices is missing."""


@dataclass(frozen=True, kw_only=True)
class SoundDevice:
    """A sound device as PortAudio knows it.

    Parameters
    ----------
    host : str
        Which sound system it belongs to.
    inputs, outputs : int
        Channels.
    rate_hz : float
        Its usual rate.
    """

    index: int
    name: str
    host: str
    inputs: int
    outputs: int
    rate_hz: float

    @property
    def full_name(self) -> str:
        """With its sound system, since some list one card under several."""
        return f"{self.name}, {self.host}"

    def channels(self, direction: Direction) -> int:
        """Channels in this direction."""
        return self.inputs if direction == "input" else self.outputs


def portaudio() -> Any:
    """The module sounddevice.

    Raises
    ------
    NoPortAudio
        If the sound library is missing.
    MissingExtra
        If the package is.
    """
    try:
        with extra("rig"):
            import sounddevice
    except OSError:
        raise NoPortAudio(
            f"expected the sound library PortAudio, got none; {PORTAUDIO_HINT}."
        ) from None
    return sounddevice


def sound_devices() -> list[SoundDevice]:
    """All sound devices that are connected now."""
    library = portaudio()
    hosts = library.query_hostapis()
    return [
        SoundDevice(
            index=index,
            name=device["name"],
            host=hosts[device["hostapi"]]["name"],
            inputs=device["max_input_channels"],
            outputs=device["max_output_channels"],
            rate_hz=device["default_samplerate"],
        )
        for index, device in enumerate(library.query_devices())
    ]


def find_device(name: str | None, direction: Direction, *, channels: int = 1) -> SoundDevice:
    """The device of this name, or the system's usual one.

    Parameters
    ----------
    name : str, optional
        Its name, or a part of it that no other device's name contains. Where a system lists one
        card several times, "NAME, HOST" chooses, such as "USB Audio, Windows WASAPI".
    direction : {"input", "output"}
    channels : int
        How many it must have, at least.

    Raises
    ------
    InputError
        For no such device, several, or one with too few channels.
    """
    fitting = [device for device in sound_devices() if device.channels(direction) > 0]
    if not fitting:
        raise InputError(
            f"expected a sound device for {direction}, got none; connect one, or start the sound "
            "server."
        )
    listed = "; ".join(device.full_name for device in fitting)
    if name is None:
        chosen = _usual(fitting, direction)
    else:
        same = [device for device in fitting if name in (device.name, device.full_name)]
        chosen = same or [d for d in fitting if name.casefold() in d.full_name.casefold()]
    if len(chosen) != 1:
        got = "none" if not chosen else "; ".join(device.full_name for device in chosen)
        wanted = "a usual one" if name is None else shown(name)
        raise InputError(
            f"expected one sound device for {direction} that is {wanted}, got {got}; connected "
            f"are: {listed}."
        )
    if chosen[0].channels(direction) < channels:
        raise InputError(
            f"expected a sound device with {channels} {direction} channels, got "
            f"{shown(chosen[0].name)} with {chosen[0].channels(direction)}; choose another device "
            "or channel."
        )
    return chosen[0]


def _usual(fitting: list[SoundDevice], direction: Direction) -> list[SoundDevice]:
    index = portaudio().default.device[0 if direction == "input" else 1]
    if index < 0:
        hosts = portaudio().query_hostapis()
        usual = [host[f"default_{direction}_device"] for host in hosts]
        index = next((number for number in usual if number >= 0), -1)
    return [device for device in fitting if device.index == index]


def does_rate(device: SoundDevice, direction: Direction, *, rate_hz: float, channels: int) -> bool:
    """Whether a device takes 32-bit floats at this rate."""
    library = portaudio()
    check = getattr(library, f"check_{direction}_settings")
    try:
        check(device=device.index, channels=channels, dtype="float32", samplerate=rate_hz)
    except library.PortAudioError:
        return False
    return True


def check_rate(
    device: SoundDevice, direction: Direction, *, rate_hz: float, channels: int = 1
) -> None:
    """InputError, with the rates that it does, where a device does not do this one."""
    if does_rate(device, direction, rate_hz=rate_hz, channels=channels):
        return
    rates = sorted({*USUAL_RATES_HZ, round(device.rate_hz)})
    done = [
        str(rate) for rate in rates if does_rate(device, direction, rate_hz=rate, channels=channels)
    ]
    raise InputError(
        f"expected a rate that {shown(device.name)} does with {channels} {direction} channel(s), "
        f"got {rate_hz:g} Hz; it does {', '.join(done) or 'none of the usual ones'}."
    )
