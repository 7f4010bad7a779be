"""A calibration holds for the rig that it was made on: what the level rests on is in it."""

from __future__ import annotations

import re
from collections.abc import Callable
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from tactileq.app import app
from tactileq.experiments.feel.opening import desk
from tactileq.modeling import InputError
from tactileq.rig.desk import parts
from tactileq.rig.desk.calibration import measuring
from tactileq.rig.desk.calibration.level import level_of
from tactileq.rig.desk.calibration.measuring import Accelerometer
from tactileq.rig.desk.calibration.opening import opened_sound
from tactileq.rig.desk.calibration.steps import (
    level_figures,
    measure_gain,
    measure_vibrator,
    save_vibrator,
)
from tactileq.rig.desk.desk_rig import DeskRig
from tactileq.rig.desk.parts import vibration_output
from tactileq.rig.devices.simulated.vibrator import SimulatedTransducers
from tactileq.rig.shared.live.memory import Live
from tactileq.rig.shared.setup.rig_file import RigFile
from tactileq.stimuli.planted.vibrators import planted_vibrator
from tests.refusals import refused
from tests.rig.desk.calibration.card import CalculatedCard
from tests.rig.desk.calibration.card import rig_file as rig_of_card
from tests.rig.desk.rig_files import calibrated, rig_file
from tests.rig.machines.device.test_renders_in_a_rig import rendering_rig

TODAY = date.today()
ACCELEROMETER = """[accelerometer]
device = "USB"
channel = 2
rate_hz = 48000
g_per_fullscale = { value = 50.0, unit = "g", assumed = true, source = "data sheet" }
[latency]"""
GIVEN = (
    ('device = "system"', 'device = "system"\nvibration_channel = 1'),
    ("[latency]", ACCELEROMETER),
    ("[vibrator]", '[vibrator]\nfile = "vibrator.json"'),
)


def changed(rig: RigFile, old: str, new: str) -> RigFile:
    text = rig.path.read_text(encoding="utf-8")
    assert old in text
    rig.path.write_text(text.replace(old, new, 1), encoding="utf-8")
    return RigFile.load(rig.path)


@pytest.fixture
def rig(tmp_path: Path) -> RigFile:
    planted_vibrator().save(tmp_path / "vibrator.json")
    planted_vibrator(frequency_hz=90.0).save(tmp_path / "other.json")
    planted_vibrator().save(tmp_path / "same.json")
    return calibrated(rig_file(tmp_path, *GIVEN))


@pytest.mark.parametrize(
    ("old", "new", "was", "now"),
    [
        ("fullscale_v = { value = 1.0", "fullscale_v = { value = 4.0", "1 V", "4 V"),
        ('device = "system"', 'device = "other"', "system", "other"),
        ('device = "system"\n', "", "system", "none"),
        ("rate_hz = 48000", "rate_hz = 96000", 48000, 96000),
        ("vibration_channel = 1", "vibration_channel = 2", 1, 2),
        ("simulated = true", "simulated = false", "true", "false"),
        ("g_per_volt = { value = 20", "g_per_volt = { value = 21", "20 g/V", "21 g/V"),
        ('file = "vibrator.json"', 'file = "other.json"', "SHA-256", "SHA-256"),
        ('file = "vibrator.json"\n', "", "SHA-256", "none"),
        ('device = "USB"', 'device = "built in"', "USB", "built in"),
        ("\nchannel = 2", "\nchannel = 1", "accelerometer.channel = 2", 1),
        ("g_per_fullscale = { value = 50", "g_per_fullscale = { value = 5", "50 g", "5 g"),
    ],
)
def test_what_the_level_rests_on_is_refused_where_it_changed_and_named(
    rig: RigFile, old: str, new: str, was: object, now: object
) -> None:
    rig.check_calibration()
    before = rig.path.read_text(encoding="utf-8")
    other = changed(rig, old, new)
    with refused(InputError, names=rig.path, expected=was, got=now):
        other.check_calibration()
    rig.path.write_text(before, encoding="utf-8")
    RigFile.load(rig.path).check_calibration()  # it may be undone


def test_what_it_does_not_rest_on_changes_nothing(rig: RigFile) -> None:
    for old, new in (
        ('source = "voltmeter"', 'source = "another voltmeter"'),
        ("[sound]", "# a comment\n[sound]\nblock = 256"),
        ("value = 1.0", "value = 1"),
        ("peak_g = { value = 5.0", "peak_g = { value = 4.0"),
        ('file = "vibrator.json"', 'file = "same.json"'),
        ("p95_ms = { value = 18.0", "p95_ms = { value = 19.0"),
        ('kind = "scripted"', 'kind = "scripted"\nscript = "hold"'),
    ):
        rig = changed(rig, old, new)
        rig.check_calibration()
    text = rig.path.read_text(encoding="utf-8")
    start, end = text.index("[accelerometer]"), text.index("[latency]")
    changed(rig, text[start:end], "").check_calibration()  # it was there when it was needed


def test_another_vibrator_in_the_file_of_the_same_name_is_noticed(rig: RigFile) -> None:
    (rig.path.parent / "other.json").replace(rig.path.parent / "vibrator.json")
    with refused(InputError, expected="vibrator.file", got="vibrator.file"):
        RigFile.load(rig.path).check_calibration()


def test_a_calibration_that_does_not_say_what_it_rests_on_holds_as_before(tmp_path: Path) -> None:
    rig = rig_file(tmp_path)
    changed(rig, "fullscale_v = { value = 1.0", "fullscale_v = { value = 4.0").check_calibration()


def test_of_a_device_that_renders_its_own_scale_counts_and_no_sound_card(tmp_path: Path) -> None:
    rig = calibrated(rendering_rig(tmp_path, "/dev/ttyACM0"))
    rig = changed(rig, "fullscale_v = { value = 1.0", "fullscale_v = { value = 4.0")
    rig.check_calibration()
    louder = changed(rig, 'value = 2.0, unit = "V/g"', 'value = 3.0, unit = "V/g"')
    with refused(InputError, expected=["device.volts_per_g", "2 V/g"], got="3 V/g"):
        louder.check_calibration()
    rig = changed(louder, 'value = 3.0, unit = "V/g"', 'value = 2.0, unit = "V/g"')
    with refused(InputError, expected=["device.renders", "true"], got="false"):
        changed(rig, "renders = true", "renders = false").check_calibration()


def test_a_level_before_the_vibrator_has_to_be_measured_again_and_is_then_right(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The order that gave 3.8 dB less than was asked for, unnoticed."""
    monkeypatch.setattr(measuring, "AROUND_S", 0.0)
    truth = SimulatedTransducers(
        frequency_hz=150.0, bandwidth_hz=40.0, height=3.0, g_per_fullscale=5.0
    )

    def gain(rig: RigFile, seed: int = 0) -> float:
        card = CalculatedCard(rig, truth)
        return measure_gain(rig, card, Accelerometer(card), rms_g=0.1, seed=seed).gain

    def levelled(rig: RigFile) -> RigFile:
        level = level_of([gain(rig, seed) for seed in range(3)])
        figures = level_figures(rig, level, band_hz=(100, 500), today=TODAY)
        return RigFile.updated(rig.path, figures)

    rig = levelled(rig_of_card(tmp_path))
    rig.check_calibration()
    card = CalculatedCard(rig, truth)
    found = measure_vibrator(rig, card, Accelerometer(card), rms_g=0.1)
    rig = RigFile.updated(rig.path, save_vibrator(rig, found, "vibrator.json"))
    assert gain(rig) < 0.8  # what is asked for is not what comes
    with Live.create() as live, refused(InputError, expected="vibrator.file", got="SHA-256"):
        vibration_output(rig, live)
    rig = levelled(rig)
    rig.check_calibration()
    np.testing.assert_allclose(gain(rig), 1.0, rtol=0.02)


def test_a_vibrator_that_is_identified_ends_an_older_calibration_too(tmp_path: Path) -> None:
    rig = rig_file(tmp_path)
    assert rig.calibration is not None
    assert rig.calibration.rests_on is None
    named = save_vibrator(rig, planted_vibrator(), "vibrator.json")
    with refused(InputError, expected=["vibrator.file", "none"], got="SHA-256"):
        RigFile.updated(rig.path, named).check_calibration()


@pytest.fixture
def stale(tmp_path: Path) -> RigFile:
    rig = calibrated(rig_file(tmp_path, ("[latency]", ACCELEROMETER)))
    return changed(rig, "fullscale_v = { value = 1.0", "fullscale_v = { value = 4.0")


def opened(rig: RigFile) -> None:
    with Live.create() as live, opened_sound(rig, live):
        pass


def felt(rig: RigFile) -> None:
    with desk(rig.path):
        pass


@pytest.mark.parametrize("gives_g", [opened, felt, DeskRig])
def test_nothing_plays_on_a_rig_whose_calibration_no_longer_fits(
    stale: RigFile, gives_g: Callable[[RigFile], Any]
) -> None:
    with refused(InputError, expected=["sound.fullscale_v", "1 V"], got="4 V"):
        gives_g(stale)


@pytest.mark.parametrize(
    "words",
    [
        ("play", "--tone", "250"),
        ("monitor",),
        ("latency",),
        ("calibrate", "level"),
        ("calibrate", "vibrator"),
    ],
)
def test_only_commands_that_calibrate_play_on_it(
    stale: RigFile, monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...]
) -> None:
    """Here no card is there: those that may play get as far as that."""

    class NoCard(Exception):
        pass

    def no_card(*_: Any, **of: Any) -> Any:
        raise NoCard

    class Silent:
        def __init__(self, *_: Any) -> None: ...

        def __enter__(self) -> Silent:
            return self

        def __exit__(self, *_: object) -> None: ...

    monkeypatch.setattr("tactileq.rig.desk.calibration.opening.AudioInput", Silent)
    monkeypatch.setattr(parts, "sound_output", no_card)
    monkeypatch.setattr(parts, "HandReader", lambda *_: Silent())
    done = CliRunner().invoke(app, ["rig", *words, "--rig", str(stale.path)])
    if words[0] == "calibrate":
        assert isinstance(done.exception, NoCard)
    else:
        assert isinstance(done.exception, InputError)
        assert re.search(r"fullscale_v = 1 V.*got sound\.fullscale_v = 4 V", str(done.exception))
