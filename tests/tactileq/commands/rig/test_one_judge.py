"""`tactileq rig check` says that a study can run on just those rigs that its sessions accept."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from datetime import date
from pathlib import Path

import pytest
import soundfile
from typer.testing import CliRunner

from tactileq.app import app
from tactileq.commands.study.session import models_of_study, rig_of
from tactileq.experiments.study.rigs import requirements_of
from tactileq.experiments.study.study import Study
from tactileq.modeling import InputError
from tactileq.modeling.models.texture_model import TextureModel
from tactileq.rig.desk import inventory
from tactileq.rig.desk.checks import Requirements, check_rig
from tactileq.rig.desk.desk_rig import DeskRig
from tactileq.rig.devices.sound.devices import SoundDevice
from tactileq.rig.machines.force.standin import PLACE
from tactileq.rig.shared.setup.rig_file import RigFile
from tactileq.stimuli.planted.vibrators import planted_vibrator
from tests.rig.desk.rig_files import calibrated, rig_file
from tests.rig.machines.force.rig_files import force_rig
from tests.two_surfaces import save_two_surfaces

Make = Callable[[Path], RigFile]
CARD = SoundDevice(index=0, name="system", host="JACK", inputs=2, outputs=2, rate_hz=48000.0)
TODAY = date.today()
FORCE = 'assumed_force_n = { value = 1.0, unit = "N", assumed = true, source = "" }'
STEPS = 'counts_per_mm = { value = 4.0, unit = "counts/mm", assumed = true, source = "" }'


@pytest.fixture(autouse=True)
def machine(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Everything is connected and installed, so what is left is what the files say."""

    class Library:
        version = (3, 17)
        simulated = True

        def __init__(self, library: str | None) -> None: ...

        def find(self, serial: int | None) -> None: ...

    monkeypatch.setattr(inventory, "DhdLibrary", Library)
    monkeypatch.setenv(PLACE, str(tmp_path / "device"))  # no other test opens it meanwhile
    monkeypatch.setattr(inventory, "versions", list)
    monkeypatch.setattr(inventory, "sound_devices", lambda: [CARD])
    monkeypatch.setattr(inventory, "find_device", lambda *_, **of: CARD)
    monkeypatch.setattr(inventory, "check_rate", lambda *_, **of: None)
    mouse = inventory.ConnectedDevice("/dev/input/event0", "Mouse", "mouse", readable=True)
    monkeypatch.setattr(inventory, "connected_devices", lambda: [mouse])
    monkeypatch.setenv("COLUMNS", "250")


def of(*changes: tuple[str, str], made: Callable[..., RigFile] = rig_file) -> Make:
    return lambda folder: made(folder, *changes)


def after_calibration(*changes: tuple[str, str], made: Callable[..., RigFile] = rig_file) -> Make:
    """A rig that is changed after it was calibrated."""

    def make(folder: Path) -> RigFile:
        path = calibrated(made(folder)).path
        text = path.read_text(encoding="utf-8")
        for old, new in changes:
            assert old in text
            text = text.replace(old, new, 1)
        path.write_text(text, encoding="utf-8")
        planted_vibrator().save(folder / "vibrator.json")
        return RigFile.load(path)

    return make


def without_calibration(folder: Path) -> RigFile:
    path = rig_file(folder).path
    text = path.read_text(encoding="utf-8")
    start, end = text.index("[calibration]"), text.index("[real_surface]")
    path.write_text(text[:start] + text[end:], encoding="utf-8")
    return RigFile.load(path)


def another_rig(folder: Path) -> RigFile:
    path = rig_file(folder).path
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("\nname = ", '\nname = "x"\n#', 1), encoding="utf-8")
    return RigFile.load(path)


MOUSE = ('kind = "scripted"', f'kind = "mouse"\n{STEPS}\n{FORCE}')
WINDOW = ('kind = "scripted"', f'kind = "window"\n{STEPS}\n{FORCE}')
DATE = f"date = {TODAY.isoformat()}"
FINE: dict[str, Make] = {
    "calibrated": after_calibration(),
    "calibration that does not say what it rests on": of(),
    "40 ms": of(("p95_ms = { value = 18.0", "p95_ms = { value = 40.0")),
    "an assumed force": of(MOUSE),
    "a force device": of(made=force_rig),
}
BROKEN: dict[str, tuple[Make, str]] = {
    "41 ms": (of(("p95_ms = { value = 18.0", "p95_ms = { value = 41.0")), "latency"),
    "never calibrated": (without_calibration, "calibration"),
    "calibrated long ago": (of((DATE, "date = 2020-02-01")), "calibration"),
    "calibrated tomorrow": (of((DATE, "date = 2999-02-01")), "calibration"),
    "of other serials": (of(('serials = ["V1", "C1"]', 'serials = ["V2"]')), "calibration"),
    "of another rig": (another_rig, "calibration"),
    "changed since": (
        after_calibration(("fullscale_v = { value = 1.0", "fullscale_v = { value = 2.0")),
        "calibration",
    ),
    "another vibrator since": (
        after_calibration(("[vibrator]", '[vibrator]\nfile = "vibrator.json"')),
        "calibration",
    ),
    "a window": (of(WINDOW), "hand"),
    "limits beyond the card": (
        of(("g_per_volt = { value = 20", "g_per_volt = { value = 4")),
        "output",
    ),
    "an undamped wall": (
        of(("damping = { value = 2.0", "damping = { value = 0.0"), made=force_rig),
        "wall",
    ),
    "too small a workspace": (
        of(("[force]", "[force]\nlow_mm = [-10.0, -10.0, -10.0]"), made=force_rig),
        "wall",
    ),
}


def checked(rig: RigFile, *words: str | Path) -> tuple[int, list[str]]:
    """The exit code of `rig check`, and what prevents a study."""
    done = CliRunner().invoke(app, ["rig", "check", "--rig", str(rig.path), *map(str, words)])
    assert ("A study can run on this rig." in done.output) == (done.exit_code == 0), done.output
    refused = re.findall(r"^no study can run: ([^:]+):", done.output, flags=re.MULTILINE)
    assert bool(refused) == (done.exit_code == 1), done.output
    return done.exit_code, refused


@pytest.mark.parametrize("name", [*FINE, *BROKEN])
def test_without_a_study_it_judges_as_one_that_says_nothing(tmp_path: Path, name: str) -> None:
    make, part = BROKEN.get(name, (FINE.get(name), None))
    assert make is not None
    rig = make(tmp_path)
    refuses = False
    try:
        DeskRig(rig, requirements=Requirements())
    except InputError:
        refuses = True
    assert refuses == (part is not None)
    assert checked(rig) == ((1, [part]) if part else (0, []))


def arbitrary(folder: Path) -> None:
    file = folder / "models/MDF.json"
    replace(TextureModel.load(file), unit="arbitrary").save(file)


def stimuli_of_5_khz(folder: Path) -> None:
    """A set of sound files in place of the simplified models, at another rate than the card's."""
    recipe = (
        'version = 1\n[set]\nname = "two"\nrate_hz = [5000]\nformat = "float32"\nduration_s = 0.2\n'
        '[[model]]\npath = "simplified"\nlabel = "simplified"\n[[trajectory]]\n'
        "speed_mm_s = 100\nforce_n = 1.0\n"
    )
    (folder / "recipe.toml").write_text(recipe)
    words = ["stimuli", str(folder / "recipe.toml"), "--out", str(folder / "set")]
    assert CliRunner().invoke(app, words).exit_code == 0
    (wav, *_) = (folder / "set").glob("*.wav")
    assert soundfile.info(wav).samplerate == 5000
    study = folder / "study.toml"
    models = '[models]\nfull = "models"\nsimplified = "set"\n[trays]'
    study.write_text(study.read_text().replace("[trays]", models))


def nothing(folder: Path) -> None:
    """The study's own models."""


WALL = "[wall]\nstiffness_n_per_mm = 2.5"
MEASURED = "measured_force = true"
OF_STUDY: dict[str, tuple[str, Callable[[Path], None], Make, str | None]] = {
    "fine": ("", nothing, of(), None),
    "30 days": ("calibration_days = 30", nothing, of(), None),
    "old but allowed": ("calibration_days = 3650", nothing, of((DATE, "date = 2020-02-01")), None),
    "force is measured": (MEASURED, nothing, of(), None),
    "force is assumed": (MEASURED, nothing, of(MOUSE), "hand"),
    "no force device": ("[wall]", nothing, of(), "wall"),
    "a wall": ("[wall]", nothing, of(made=force_rig), None),
    "a stiff wall": (WALL, nothing, of(made=force_rig), "wall"),
    "not in g": ("", arbitrary, of(), "models"),
    "a slow card": ("", nothing, of(("rate_hz = 48000", "rate_hz = 4000")), "models"),
    "stimuli of another rate": ("", stimuli_of_5_khz, of(), "models"),
    "changed since": ("", nothing, BROKEN["changed since"][0], "calibration"),
    "slow": ("", nothing, BROKEN["41 ms"][0], "latency"),
}


@pytest.mark.parametrize("name", OF_STUDY)
def test_with_a_study_it_judges_as_its_sessions_do(tmp_path: Path, name: str) -> None:
    more, spoil, make, part = OF_STUDY[name]
    save_two_surfaces(tmp_path, "" if more.startswith("[") else more)
    study = tmp_path / "study.toml"
    if more.startswith("["):
        study.write_text(study.read_text() + more)
    spoil(tmp_path)
    rig = make(tmp_path)
    plan = Study.load(study)
    sets, _ = models_of_study(plan, study, models=None, simplified=None, scene=None)
    refuses = False
    try:
        device = rig_of(plan, sets, rig=rig.path, override=None)
        for stimulus in sets.stimuli:  # as a session does before anybody sits down
            device.check_stimulus(stimulus)
    except InputError:
        refuses = True
    assert refuses == (part is not None)
    assert checked(rig, "--study", study) == ((1, [part]) if part else (0, []))


def test_every_reason_is_told_and_models_that_are_not_there_are_one(tmp_path: Path) -> None:
    save_two_surfaces(tmp_path, MEASURED)
    (tmp_path / "models/MDF.json").unlink()
    rig = rig_file(tmp_path, MOUSE, ("p95_ms = { value = 18.0", "p95_ms = { value = 41.0"))
    assert checked(rig, "--study", tmp_path / "study.toml")[1] == ["latency", "hand", "models"]
    assert checked(rig, "--study", tmp_path / "none.toml")[1] == ["study"]


def test_defaults_are_those_of_a_study_that_says_nothing_and_they_are_told(tmp_path: Path) -> None:
    save_two_surfaces(tmp_path)
    assert requirements_of(Study.load(tmp_path / "study.toml")) == Requirements()
    rig = rig_file(tmp_path)
    done = CliRunner().invoke(app, ["rig", "check", "--rig", str(rig.path)])
    assert "a calibration of the last 90 days" in done.output
    check_rig(rig, Requirements(), today=TODAY)
