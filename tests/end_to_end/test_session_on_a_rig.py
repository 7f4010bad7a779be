"""A session on a desk rig: its real processes fail one after the other, and what the data say."""

from __future__ import annotations

import ctypes
import json
import os
import signal
import time
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from tactileq.analysis.answers.loading import load_responses
from tactileq.experiments.sessions.kept.log import read_log
from tactileq.experiments.sessions.kept.manifest import SessionManifest
from tactileq.experiments.sessions.loop.people import Choice, Rating
from tactileq.experiments.sessions.loop.surfaces import Surfaces
from tactileq.experiments.verification.verifying import verify_data
from tactileq.rig.desk.lock import rig_locked
from tactileq.rig.shared.setup.rig_file import RigFile
from tactileq.stimuli.planted.textures import planted_texture
from tests.experiments.scripted import Ready, Scripted
from tests.rig.desk.rig_files import rig_text

STUDY = """
name = "Two surfaces"
seed = 3
textures = ["MDF", "PVC"]
[models]
full = "models"
simplified = "fewer"
[trays]
MDF = "A"
PVC = "B"
[absolute]
participants = 1
schedule = "interleaved"
training_trials = 1
[relative]
participants = 2
schedule = "by-day"
training_trials = 1
repeats = 1
"""
FILES = ("--subject", 1, "--study", "study.toml", "--data", "data")
WORDS = ("--task", "absolute", *FILES)


@pytest.fixture
def study(tmp_path: Path) -> Path:
    for name in ("MDF", "PVC"):
        model = planted_texture(name)
        for folder, kept in (("models", model), ("fewer", model.with_layers([0]))):
            (tmp_path / folder).mkdir(exist_ok=True)
            kept.save(tmp_path / folder / f"{name}.json")
    (tmp_path / "study.toml").write_text(STUDY)
    (tmp_path / "rig.toml").write_text(rig_text(tmp_path / "rig.toml"))
    return tmp_path


class Unlucky(Scripted):
    """A person at whose rig something happens in each trial."""

    simulated = False

    def __init__(self, happens: dict[int, Any]) -> None:
        super().__init__()
        self._happens = happens

    def rate(self, trial: Any, surfaces: Surfaces) -> Rating:
        surfaces.start()
        self._feel(surfaces, 0.15)
        surfaces.present_virtual()
        self._feel(surfaces, 0.15)
        self._happens.get(trial.trial, lambda parts: None)(surfaces._rig.parts)
        self._feel(surfaces, 0.15)
        surfaces.present_real()
        for scale, value in (("magnitude", 70.0), ("frequency", 30.0)):  # as the console does
            surfaces.note("slider", scale=scale, value=value)
        return Rating(
            magnitude_similarity=70,
            frequency_similarity=30,
            response_time_s=surfaces.response_time_s,
        )

    def choose(self, trial: Any, surfaces: Surfaces) -> Choice:
        surfaces.start()
        for button in range(surfaces.count):
            surfaces.present_virtual(button)
            self._feel(surfaces, 0.15)
        surfaces.present_real()
        surfaces.choose(1)
        return Choice(button=1, response_time_s=surfaces.response_time_s)

    def _feel(self, surfaces: Surfaces, seconds: float) -> None:
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            surfaces.follow_rig_button()
            time.sleep(0.005)


def hold_the_interpreter(parts: Any) -> None:
    """For longer than a rig plays unattended, no thread of this process runs Python."""
    ctypes.PyDLL(None).usleep(3_000_000)  # a given clock may be slower


def kill_the_sound(parts: Any) -> None:
    os.kill(parts.sound.pid, signal.SIGKILL)


def pull_the_plug(parts: Any) -> None:
    parts.reader.unplug()
    time.sleep(0.3)
    parts.reader.unplug(False)
    wait_for_hand(parts)


def kill_the_reader(parts: Any) -> None:
    pid = parts.reader.pid
    os.kill(pid, signal.SIGKILL)
    end = time.monotonic() + 500
    while parts.reader.pid == pid:
        assert time.monotonic() < end
        time.sleep(0.02)
    wait_for_hand(parts)


def wait_for_hand(parts: Any) -> None:
    end = time.monotonic() + 500
    while not abs(parts.live.latest()["force_n"]) > 0:
        assert time.monotonic() < end
        time.sleep(0.02)


def sit_down(monkeypatch: pytest.MonkeyPatch, someone: Scripted) -> Ready:
    """Somebody sits at the screen, and at the terminal an experimenter who is always ready."""
    experimenter = Ready()
    monkeypatch.setattr(
        "tactileq.commands.study.session.open_console", lambda *_, **of: nullcontext(someone)
    )
    monkeypatch.setattr("tactileq.commands.study.experimenter.Terminal", lambda: experimenter)
    return experimenter


@pytest.fixture
def answered(
    main: Any, study: Path, jack_server: Any, monkeypatch: pytest.MonkeyPatch
) -> tuple[Path, str]:
    """The study after a session that stands still once and loses three parts, and what it said."""
    someone = Unlucky(
        {1: hold_the_interpreter, 2: kill_the_sound, 3: pull_the_plug, 4: kill_the_reader}
    )
    experimenter = sit_down(monkeypatch, someone)
    with jack_server(block=128):
        done = main("session", *WORDS, "--rig", "rig.toml")
    assert done.returncode == 0, done.stderr
    assert len(experimenter.called) >= 4
    return study, done.stdout


def test_what_fails_in_a_session_is_in_its_data_and_repeated(answered: tuple[Path, str]) -> None:
    study, said = answered
    stem = study / "data/sourcedata/sub-01/ses-01/sub-01_ses-01_task-absolute"
    answers = pd.read_csv(
        study / "data/sub-01/ses-01/beh/sub-01_ses-01_task-absolute_beh.tsv", sep="\t"
    )
    # On a loaded machine the hand may be read too late in other trials, too.
    failed = set(answers.loc[answers["valid"] == 0, "trial"])
    assert failed >= {1, 2, 3, 4}
    assert f"the rig failed in {len(failed)} trials" in said
    assert "completed: data/sourcedata/sub-01" in said
    repeated = [int(number) for number in answers["repeats"].dropna()]
    assert repeated == sorted(number for number in failed if number <= 5)
    assert set(answers["simulated"].astype(str)) == {"True"}  # the hand is scripted
    responses = load_responses(study / "data")  # refuses any other order of repeats
    assert f"{len(failed)} of {len(answers)} answers left out" in responses.warnings[0]
    assert not set(responses.answers["absolute"]["trial"]) & failed
    assert verify_data(study / "data").differences == ()
    assert f"for the checklist: {read_log(Path(f'{stem}_log.jsonl')).seal[-8:]}" in said
    check_log(read_log(Path(f"{stem}_log.jsonl")).events, failed)
    check_traces(
        pd.read_csv(f"{stem}_hand.tsv", sep="\t"),
        pd.read_csv(f"{stem}_presentations.tsv", sep="\t"),
        failed,
    )
    check_what_is_said_of_the_rig(study)


def check_log(events: Any, failed: set[int]) -> None:
    of: dict[int, str] = {}
    for event in events:
        if event["event"] == "fault":
            of[event["trial"]] = of.get(event["trial"], "") + event["told"]
    assert set(of) == failed
    assert "poll the rig" in of[1]
    assert "sound process" in of[2]
    assert "unplugged" in of[3]
    assert "ended by SIGKILL" in of[4]


def check_traces(hand: pd.DataFrame, shown: pd.DataFrame, failed: set[int]) -> None:
    assert set(shown.groupby("trial").size()) == {3}
    virtual, real = shown[shown["surface"] == "virtual"], shown[shown["surface"] == "real"]
    fine = virtual[~virtual["trial"].isin(failed)]
    assert (fine["dose_g2_s"] > 0).all()
    assert (fine["stale_blocks"] == 0).all()
    assert (real["dose_g2_s"] == 0).all()
    for number in (3, 4):
        assert virtual.loc[virtual["trial"] == number, "stale_blocks"].max() > 0
    assert set(shown.loc[shown["faults"].notna(), "trial"]) == failed
    for number, rows in hand.groupby("trial"):
        felt = rows[rows["surface"] == "virtual"]
        if number not in failed:
            assert len(felt) / np.ptp(felt["time_s"]) >= 200
            assert felt["speed_mm_s"].notna().all()
        assert rows.loc[rows["surface"] == "real", "speed_mm_s"].isna().all()
    for number in (3, 4):
        lost = hand[(hand["trial"] == number) & (hand["surface"] == "virtual")]
        assert lost["speed_mm_s"].isna().any()
    # A second in which this process stood still is there: another process reads the hand.
    during = hand[(hand["trial"] == 1) & (hand["surface"] == "virtual")]
    assert np.ptp(during["time_s"]) > 1
    assert len(during) > 200


def check_what_is_said_of_the_rig(study: Path) -> None:
    file = RigFile.load(study / "rig.toml")
    sidecar = json.loads(
        (study / "data/sub-01/ses-01/beh/sub-01_ses-01_task-absolute_beh.json").read_text()
    )
    assert sidecar["SimulatedRig"] is True
    assert sidecar["Rig"]["SHA256"] == file.sha256
    assert set(sidecar["Rig"]["Assumed"]) == set(dict(file.assumed()))
    assert sidecar["Rig"]["Override"] == "n/a"
    (manifest,) = (study / "data/sourcedata").rglob("*_manifest.json")
    assert SessionManifest.load(manifest).rig["SHA256"] == file.sha256


def test_a_rig_that_does_not_do_is_refused_before_anything_is_written(
    main: Any, study: Path
) -> None:
    text = (study / "rig.toml").read_text()
    (study / "slow.toml").write_text(text.replace("value = 18.0", "value = 50.0"))
    (study / "old.toml").write_text(text.replace(text.split("date = ")[1][:10], "2020-02-01"))
    (study / "rate.toml").write_text(text.replace("rate_hz = 48000", "rate_hz = 2000"))
    before = sorted(study.rglob("*"))
    for words, told in (
        (("--rig", "none.toml"), "expected a rig file at none.toml"),
        (("--rig", "study.toml"), "in a rig file, got"),
        (("--rig", "slow.toml"), "got latency.p95_ms of 50 ms"),
        (("--rig", "old.toml"), "calibration of the last 90 days"),
        (("--rig", "rate.toml"), "at most sound.rate_hz, 2000 Hz"),
        (("--rig", "slow.toml", "--override", " "), "a reason in words after --override"),
    ):
        done = main("session", *WORDS, *words)
        assert done.returncode == 1, done.stdout
        assert done.stderr.count("\n") == 1
        assert told in done.stderr
        assert sorted(study.rglob("*")) == before


def test_a_forced_choice_on_a_rig_that_is_slow_for_a_reason(
    main: Any, study: Path, jack_server: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = (study / "rig.toml").read_text()
    (study / "slow.toml").write_text(text.replace("value = 18.0", "value = 50.0"))
    sit_down(monkeypatch, Unlucky({}))
    words = ("--task", "relative", *FILES, "--rig", "slow.toml")
    with jack_server(block=128):
        done = main("session", *words, "--override", "only a pilot")
    assert done.returncode == 0, done.stderr
    beh = study / "data/sub-01/ses-01/beh/sub-01_ses-01_task-relative_beh"
    assert json.loads(Path(f"{beh}.json").read_text())["Rig"]["Override"] == "only a pilot"
    answers = pd.read_csv(f"{beh}.tsv", sep="\t")
    assert set(answers.loc[answers["repeats"].isna(), "trial"]) == {1, 2, 3}
    assert (answers["response_time_s"] > 0.3).all()
    shown = pd.read_csv(
        study / "data/sourcedata/sub-01/ses-01/sub-01_ses-01_task-relative_presentations.tsv",
        sep="\t",
    )
    for number, of_trial in shown.groupby("trial"):
        layout = answers.loc[answers["trial"] == number, "layout"].item().split("|")
        real = answers.loc[answers["trial"] == number, "texture"].item()
        assert of_trial["texture"].tolist() == [real, *layout, real]
        assert of_trial["surface"].tolist() == ["real", "virtual", "virtual", "real"]


def test_a_rig_in_use_is_refused_and_nothing_is_written(
    main: Any, study: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sit_down(monkeypatch, Unlucky({}))
    before = sorted(study.rglob("*"))
    with rig_locked(RigFile.load(study / "rig.toml").rig.name):
        done = main("session", *WORDS, "--rig", "rig.toml")
    assert done.returncode == 1
    assert f"in use by process {os.getpid()}; end that one first" in done.stderr
    assert done.stderr.count("\n") == 1
    assert sorted(study.rglob("*")) == before
