"""tactileq session as it is used: a real window, an experimenter's terminal, signals."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tactileq.commands.study.session import models_of_study
from tactileq.experiments.sessions.kept.files import lock_of
from tactileq.experiments.sessions.kept.log import read_log
from tactileq.experiments.sessions.loop.people import SessionAborted
from tactileq.experiments.sessions.loop.running import run_session
from tactileq.experiments.sessions.loop.trial_loop import People
from tactileq.experiments.sessions.store.withdrawing import drop_out
from tactileq.experiments.study.study import Study
from tactileq.experiments.tasks import task_named
from tactileq.modeling.files.locks import Lock
from tactileq.rig.desk.twin import SimulatedRig
from tests.experiments.scripted import Ready, Scripted
from tests.rig.waiting import wait_until
from tests.two_surfaces import save_two_surfaces

WORDS = ("session", "--task", "absolute", "--study", "study.toml", "--data", "data")
# In the middle of a screen of 1920 x 1080: the left button of a page, and beside that of others.
YES = ("760", "732")
SECONDS = 500.0  # for a hang, not for speed


@pytest.fixture
def study(tmp_path: Path) -> Path:
    save_two_surfaces(tmp_path)
    return tmp_path


@pytest.fixture
def begin(study: Path, display: str) -> Any:
    """Starts a session in a process of its own."""
    environment = {**os.environ, "DISPLAY": display}

    def process(*words: str) -> subprocess.Popen[str]:
        return subprocess.Popen(
            [sys.executable, "-m", "tactileq", *WORDS, *words],
            cwd=study,
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    return process


class Person(Scripted):
    """Answers by rote, and stops before this trial."""

    simulated = False

    def __init__(self, stops: int | None = None) -> None:
        super().__init__()
        self._stops = stops

    def wait(self, until: Callable[[], bool]) -> None:
        if self.answered == self._stops:
            raise SessionAborted("tired")


@pytest.fixture
def take_part(study: Path) -> Callable[..., Path]:
    """Runs a person's session without a window; its log."""
    plan = Study.load(study / "study.toml")
    sets, _ = models_of_study(plan, study / "study.toml", models=None, simplified=None, scene=None)

    def session(respondent: Scripted, *, subject: int = 1) -> Path:
        _, manifest = run_session(
            task_named("absolute"),
            plan,
            subject=subject,
            session=1,
            models=sets,
            rig=SimulatedRig(),
            people=People(respondent=respondent, experimenter=Ready()),
            data_folder=study / "data",
        )
        return manifest.with_name(manifest.name.replace("manifest.json", "log.jsonl"))

    return session


@pytest.fixture
def refuse(
    study: Path, main: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> Callable[..., str]:
    """Asks for a session where neither a display nor PsychoPy can be had; the refusal."""
    for name in [name for name in sys.modules if name.split(".")[0] == "psychopy"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "psychopy", None)
    monkeypatch.delenv("DISPLAY", raising=False)

    def session(*words: str) -> str:
        before = sorted(study.rglob("*"))
        done = main(*WORDS, *words)
        assert done.returncode == 1
        assert done.stderr.startswith("error: expected ")
        assert done.stderr.count("\n") == 1
        assert sorted(study.rglob("*")) == before
        return done.stderr

    return session


def test_a_session_that_was_begun_is_refused_before_a_window_is_opened(
    take_part: Callable[..., Path], refuse: Callable[..., str]
) -> None:
    name = "_ses-01_task-absolute"
    assert f"sub-01{name}_manifest.json" in refuse("--resume")  # there is none yet
    take_part(Person())
    for words in ((), ("--resume",)):
        told = refuse(*words)
        assert f"sub-01{name}" in told
        assert "complete" in told
    log = take_part(Person(stops=1), subject=2)
    told = refuse("--subject", "2")
    assert f"sub-02{name}" in told
    assert "continue with --resume" in told
    (lock := Lock(lock_of(log))).acquire(1.0)
    assert "another console" in refuse("--subject", "2", "--resume")
    lock.release()
    log.write_bytes(log.read_bytes().replace(b'"utc"', b'"utx"'))
    for words in ((), ("--resume",)):
        assert log.name in refuse("--subject", "2", *words)


def test_who_cannot_take_part_is_refused_before_a_window_is_opened(
    study: Path, take_part: Callable[..., Path], refuse: Callable[..., str]
) -> None:
    take_part(Person(stops=1))
    take_part(Person(stops=1), subject=2)
    assert "subject 3" in refuse("--subject", "3")  # the study has two slots
    assert "session" in refuse("--session", "2")  # and one session of each
    assert "pilot" in refuse("--subject", "2", "--resume", "--pilot")
    drop_out(study / "data", 2)
    assert "dropped out" in refuse("--subject", "2", "--resume")
    (study / "study.toml").write_text((study / "study.toml").read_text().replace("= 3", "= 4"))
    assert "seed" in refuse("--resume")


def test_a_session_that_can_begin_is_refused_for_want_of_a_window_alone(
    take_part: Callable[..., Path], refuse: Callable[..., str]
) -> None:
    assert "psychopy" in refuse()
    take_part(Person(stops=1))
    assert "psychopy" in refuse("--resume")


def log_of(study: Path) -> list[dict[str, Any]]:
    found = list((study / "data/sourcedata").rglob("*_log.jsonl"))
    return [dict(event) for event in read_log(found[0]).events] if found else []


def press_until(done: Callable[[], bool], display: str, process: subprocess.Popen[str]) -> None:
    """Go on to the next page now and then until it has happened: by Enter, which on the page that
    asks for the code has no button to press, and by the mouse where that page has its yes."""

    def pressed() -> bool:
        if done():
            return True
        assert process.poll() is None, process.communicate()[1]
        subprocess.run(
            ["xdotool", "mousemove", *YES, "click", "1", "key", "Return"],
            env={**os.environ, "DISPLAY": display},
            check=True,
        )
        time.sleep(0.1)
        return False

    wait_until(pressed, seconds=SECONDS)


def test_a_session_that_is_ended_by_a_signal_goes_on_and_ends_with_its_terminal(
    begin: Any, study: Path, display: str
) -> None:
    first = begin()

    def asked(run: int) -> bool:
        events = ((event["event"], event["run"]) for event in log_of(study))
        return ("mount_requested", run) in events

    press_until(lambda: asked(1), display, first)
    first.send_signal(signal.SIGTERM)
    first.wait(timeout=SECONDS)  # its terminal stays open until then
    _, told = first.communicate(timeout=SECONDS)
    assert first.returncode == 128 + signal.SIGTERM
    assert "interrupted by SIGTERM" in told
    ended = log_of(study)[-2]
    assert (ended["event"], ended["status"]) == ("ended", "aborted")
    assert (ended["by"], ended["reason"]) == ("signal", "SIGTERM")

    again = begin("--resume")
    press_until(lambda: asked(2), display, again)
    assert again.stdin is not None
    shown, told = again.communicate(timeout=SECONDS)  # which closes what the terminal reads
    assert again.returncode == 0, told
    assert "Tray " in shown
    assert "ended early (the experimenter's terminal was closed)" in shown
    assert "MDF" not in shown
    assert "simplified" not in shown
    ended = log_of(study)[-2]
    assert (ended["status"], ended["by"]) == ("aborted", "experimenter")
    (table,) = study.glob("data/sub-01/ses-01/beh/*_beh.tsv")
    assert len(table.read_text().splitlines()) == 1  # nobody has answered


@pytest.mark.long("the times of this machine")
def test_the_self_test_times_screen_rig_and_disk_against_limits(
    begin: Any, study: Path, display: str
) -> None:
    process = begin("--selftest")
    shown, told = process.communicate(timeout=SECONDS)
    for name, limit in (
        ("frames", "25.0 ms"),
        ("presentations", "100.0 ms"),
        ("answers", "50.0 ms"),
    ):
        row = next(line for line in shown.splitlines() if name in line)
        assert limit in row
        assert ("ok" in row) is not ("too slow" in row)
    assert process.returncode == ("too slow" in shown)
    assert ("within the limit" in told) is ("too slow" in shown)
    assert "the rig is simulated" in shown
    assert not list((study / "data").iterdir())
