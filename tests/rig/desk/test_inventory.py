"""What is connected and what is missing: each fault and each remedy."""

from __future__ import annotations

import datetime
from importlib.metadata import PackageNotFoundError
from pathlib import Path
from typing import Any

import pytest

from tactileq.modeling import InputError
from tactileq.rig.desk import inventory
from tactileq.rig.desk.inventory import (
    Finding,
    connected_input,
    connected_sound,
    of_rig,
    remedies,
    versions,
)
from tactileq.rig.devices.hand.sample import ConnectedDevice
from tactileq.rig.devices.sound.devices import NoPortAudio, SoundDevice
from tests.refusals import check_refusal
from tests.rig.desk.rig_files import calibrated, rig_file, rig_text

TODAY = datetime.date.today()


def device(name: str, *, inputs: int = 2, outputs: int = 2) -> SoundDevice:
    return SoundDevice(
        index=0, name=name, host="ALSA", inputs=inputs, outputs=outputs, rate_hz=48000.0
    )


@pytest.fixture(autouse=True)
def cards(monkeypatch: pytest.MonkeyPatch) -> None:
    """One card that does 48 kHz only."""

    def find(name: str | None, direction: str, *, channels: int = 1) -> SoundDevice:
        if name not in (None, "system"):
            raise InputError(f"expected one sound device, got none called {name}.")
        return device("system")

    def check(card: SoundDevice, direction: str, *, rate_hz: float, channels: int = 1) -> None:
        if rate_hz != 48000:
            raise InputError(f"expected a rate that the card does, got {rate_hz:g} Hz.")

    monkeypatch.setattr(inventory, "find_device", find)
    monkeypatch.setattr(inventory, "check_rate", check)


def found(file: Path, *, today: datetime.date = TODAY) -> dict[str, Finding]:
    return {finding.name: finding for finding in of_rig(file, today=today)[1]}


def faults(findings: dict[str, Finding]) -> set[str]:
    return {name for name, finding in findings.items() if finding.state == "fault"}


def test_a_calibrated_rig_has_no_fault(tmp_path: Path) -> None:
    findings = found(rig_file(tmp_path).path)
    assert faults(findings) == set()
    assert "today" in findings["calibration"].sentence
    assert findings["calibration"].state == "note"  # it does not say what it rests on
    assert "median 12.0 ms, 95 % within 18.0 ms" in findings["latency"].sentence
    assert findings["accelerometer"].state == "note"
    assert "are assumed" in findings["figures"].sentence


def test_age_is_told_and_old_calibrations_are_faults(tmp_path: Path) -> None:
    file = calibrated(rig_file(tmp_path)).path
    later = found(file, today=TODAY + datetime.timedelta(days=90))["calibration"]
    assert (later.sentence.split(", ")[1], later.state) == ("90 days ago", "ok")
    old = found(file, today=TODAY + datetime.timedelta(days=91))["calibration"]
    assert old.state == "fault"


@pytest.mark.parametrize(
    ("old", "new", "where", "told"),
    [
        ('device = "system"', 'device = "USB"', "sound", "none called USB"),
        ("rate_hz = 48000", "rate_hz = 44100", "sound", "got 44100 Hz"),
        ('serials = ["V1", "C1"]', 'serials = ["V9"]', "calibration", "got that of the rig"),
        ('kind = "scripted"', 'kind = "serial"\ndevice = "/dev/none"', "hand", "no such device"),
    ],
)
def test_what_prevents_a_study_is_a_fault(
    tmp_path: Path, old: str, new: str, where: str, told: str
) -> None:
    findings = found(rig_file(tmp_path, (old, new)).path)
    assert faults(findings) == {where}
    assert told in findings[where].sentence


def test_no_calibration_is_a_fault_and_no_latency_a_note(tmp_path: Path) -> None:
    text = rig_text(tmp_path)
    start, end = text.index("[latency]"), text.index("[real_surface]")
    file = tmp_path / "rig.toml"
    file.write_text(text[:start] + text[end:])
    findings = found(file)
    assert faults(findings) == {"calibration"}
    assert findings["latency"].state == "note"


def test_a_missing_or_broken_rig_file_is_a_fault(tmp_path: Path) -> None:
    missing = found(tmp_path / "rig.toml")
    assert "desk_rig.toml" in missing[str(tmp_path / "rig.toml")].sentence
    (tmp_path / "rig.toml").write_text("version = 2\n")
    broken = found(tmp_path / "rig.toml")
    assert "version" in broken[str(tmp_path / "rig.toml")].sentence
    assert faults(missing) == faults(broken) == {str(tmp_path / "rig.toml")}


def test_without_portaudio_one_line_installs_it(monkeypatch: pytest.MonkeyPatch) -> None:
    def none() -> Any:
        raise NoPortAudio("expected PortAudio, got none; install libportaudio2 (…).")

    monkeypatch.setattr(inventory, "portaudio", none)
    monkeypatch.setattr(inventory, "sound_devices", none)
    findings = [*versions(), *connected_sound()]
    assert remedies(findings) == ["sudo apt-get install libportaudio2"]
    assert [f.name for f in findings if f.state == "fault"] == ["PortAudio"]


def test_without_psychopy_the_rig_is_checked_all_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    def none(name: str) -> str:
        raise PackageNotFoundError(name)

    monkeypatch.setattr("tactileq.modeling.files.provenance.version", none)
    found = {finding.name: finding for finding in versions()}
    assert found["psychopy"].state == "note"
    check_refusal(found["psychopy"].sentence, expected="psychopy", got="tactileq[console]")


def test_no_card_at_all_is_a_note_and_the_fault_is_that_of_a_rig_that_needs_one(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def none(*_: object, **of: object) -> Any:
        raise InputError("expected a sound device for output, got none; connect one.")

    monkeypatch.setattr(inventory, "sound_devices", list)
    monkeypatch.setattr(inventory, "find_device", none)
    (finding,) = connected_sound()
    assert finding.state == "note"
    assert faults(found(rig_file(tmp_path).path)) == {"sound"}


def connect(monkeypatch: pytest.MonkeyPatch, *devices: ConnectedDevice) -> None:
    monkeypatch.setattr(inventory, "connected_devices", lambda: devices)


def hand_finding(tmp_path: Path, text: str) -> Finding:
    return found(rig_file(tmp_path, ('kind = "scripted"', f"{text}\n{FORCE}")).path)["hand"]


@pytest.mark.parametrize(("kind", "group"), [("tablet", "input"), ("serial", "dialout")])
@pytest.mark.parametrize("named", [True, False])
def test_a_device_without_permission_asks_for_its_group(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str, group: str, named: bool
) -> None:
    path = tmp_path / "event0"
    path.touch()
    connect(monkeypatch, ConnectedDevice(str(path), "Some Device", kind, readable=False))
    monkeypatch.setattr(inventory.os, "access", lambda file, mode: False)
    finding = hand_finding(tmp_path, f'kind = "{kind}"' + f'\ndevice = "{path}"' * named)
    assert finding.state == "fault"
    assert remedies([finding])[0].startswith(f'sudo usermod -aG {group} "$USER"')


def test_a_hand_is_found_by_its_kind_and_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    connect(
        monkeypatch,
        ConnectedDevice("/dev/input/event1", "Some Keyboard", "other", readable=True),
        ConnectedDevice("/dev/input/event2", "Small Tablet Pen", "tablet", readable=True),
    )
    assert hand_finding(tmp_path, 'kind = "tablet"').state == "ok"
    assert hand_finding(tmp_path, 'kind = "tablet"\ndevice = "Small"').state == "ok"
    assert "got none" in hand_finding(tmp_path, 'kind = "tablet"\ndevice = "Large"').sentence
    assert "got none" in hand_finding(tmp_path, 'kind = "serial"').sentence
    told = [(finding.name, finding.sentence) for finding in connected_input()]
    assert told == [
        ("/dev/input/event1", "Some Keyboard, other"),
        ("/dev/input/event2", "Small Tablet Pen, tablet"),
    ]


FORCE = 'assumed_force_n = { value = 1.0, unit = "N", assumed = true, source = "x" }'


def test_nothing_to_install_where_all_is_there() -> None:
    assert remedies([Finding("sound", "libportaudio2 is there")]) == []
