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

from tactileq.experiments.sessions.kept.log import read_log
from tests.rig.waiting import wait_until
from tests.two_surfaces import save_two_surfaces

WORDS = ("session", "--task", "absolute", "--study", "study.toml", "--data", "data")
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


def log_of(study: Path) -> list[dict[str, Any]]:
    found = list((study / "data/sourcedata").rglob("*_log.jsonl"))
    return [dict(event) for event in read_log(found[0]).events] if found else []


def press_until(done: Callable[[], bool], display: str, process: subprocess.Popen[str]) -> None:
    """Press Tab and Enter now and then, as who goes on to the next page, until it has happened."""

    def pressed() -> bool:
        if done():
            return True
        assert process.poll() is None, process.communicate()[1]
        subprocess.run(
            ["xdotool", "key", "Tab", "Return"], env={**os.environ, "DISPLAY": display}, check=True
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
