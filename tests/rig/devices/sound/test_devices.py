"""Sound devices by name: parts of names, one card under several sound systems."""

from __future__ import annotations

import pytest

from tactileq.modeling import InputError
from tactileq.rig.devices.sound import devices
from tactileq.rig.devices.sound.devices import SoundDevice, find_device
from tests.refusals import refused


def device(index: int, name: str, host: str, *, outputs: int = 2) -> SoundDevice:
    return SoundDevice(
        index=index, name=name, host=host, inputs=0, outputs=outputs, rate_hz=48000.0
    )


@pytest.fixture(autouse=True)
def connected(monkeypatch: pytest.MonkeyPatch) -> list[SoundDevice]:
    found = [
        device(0, "USB Audio", "MME"),
        device(1, "Speakers", "MME"),
        device(2, "USB Audio", "Windows WASAPI"),
        device(3, "Speakers", "Windows WASAPI", outputs=8),
        device(4, "Speakers and more", "Windows WASAPI"),
    ]
    monkeypatch.setattr(devices, "sound_devices", lambda: found)
    return found


@pytest.mark.parametrize(
    ("name", "index"),
    [
        ("USB Audio, MME", 0),
        ("USB Audio, Windows WASAPI", 2),
        ("usb audio, win", 2),
        ("and more", 4),
        ("Speakers and more", 4),
    ],
)
def test_one_card_is_chosen_among_those_of_several_systems(name: str, index: int) -> None:
    assert find_device(name, "output").index == index


def test_several_are_refused_with_what_tells_them_apart() -> None:
    with refused(
        InputError,
        expected=["output", "'USB Audio'"],
        got=["USB Audio, MME", "USB Audio, Windows WASAPI"],
    ):
        find_device("USB Audio", "output")


def test_none_is_refused_with_those_that_there_are() -> None:
    with refused(InputError, expected="'tape'", got=["none", "USB Audio, MME", "Speakers, MME"]):
        find_device("tape", "output")


def test_without_a_device_for_the_direction_that_is_told() -> None:
    with refused(InputError, expected=["sound device", "input"], got="none"):
        find_device(None, "input")


def test_too_few_channels_are_refused() -> None:
    with refused(InputError, expected=[4, "output"], got=["'Speakers and more'", 2]):
        find_device("and more", "output", channels=4)
    assert find_device("Speakers, Windows WASAPI", "output", channels=8).index == 3
