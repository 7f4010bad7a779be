"""Signals end the program in order, and its workers with it."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tactileq import app
from tactileq.interruption import Interrupted, ended_by_signals
from tactileq.telling import sentence_of


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_ends_a_command_with_one_sentence(
    main, monkeypatch: pytest.MonkeyPatch, number: signal.Signals, code: int
) -> None:
    cleaned, handler = [], signal.getsignal(number)

    def interrupted(**_: object) -> None:
        try:
            os.kill(os.getpid(), number)
            time.sleep(10)
        finally:
            os.kill(os.getpid(), number)  # some senders send twice
            cleaned.append(number)

    monkeypatch.setattr(app, "app", interrupted)
    done = main("demo")
    assert done.returncode == code
    assert done.stderr == f"interrupted by {number.name}; no file was left half written.\n"
    assert cleaned == [number]
    assert signal.getsignal(number) is handler


def test_what_nohup_ignores_stays_ignored() -> None:
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with ended_by_signals():
            os.kill(os.getpid(), signal.SIGHUP)
        assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
        signal.signal(signal.SIGHUP, signal.SIG_DFL)
        with pytest.raises(Interrupted) as ended, ended_by_signals():
            signal.raise_signal(signal.SIGHUP)
        assert ended.value.code == 128 + signal.SIGHUP
    finally:
        signal.signal(signal.SIGHUP, before)


def test_a_signal_in_a_destructor_is_not_lost() -> None:
    """Python ignores exceptions there (seen in a callback of a WeakSet while a window flipped)."""

    class Destroyed:
        def __del__(self) -> None:
            signal.raise_signal(signal.SIGTERM)
            reached.append("after the signal")

    def work() -> None:
        with ended_by_signals():
            Destroyed()
            wait_for(lambda: False)

    reached = list[str]()
    hook = sys.unraisablehook
    with pytest.raises(Interrupted) as ended:
        work()
    assert ended.value.signal_name == "SIGTERM"
    assert reached == []
    assert sys.unraisablehook is hook


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_workers_end_with_their_parent(tmp_path: Path, number: signal.Signals) -> None:
    script = Path(__file__).with_name("long_work.py")
    parent = subprocess.Popen([sys.executable, script, tmp_path], stderr=subprocess.PIPE)
    pids = [tmp_path / "a.pid", tmp_path / "b.pid"]
    wait_for(lambda: all(path.exists() and path.read_text() for path in pids))
    parent.send_signal(number)
    assert parent.wait(30) == (143 if number == signal.SIGTERM else -number)
    workers = [int(path.read_text()) for path in pids]
    wait_for(lambda: not any(map(lives, workers)))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.pid", "b.pid"]


def wait_for(happened) -> None:
    for _ in range(600):
        if happened():
            return
        time.sleep(0.05)
    raise AssertionError("it did not happen")


def lives(pid: int) -> bool:
    """Whether a process has not ended; one that nobody has fetched yet has."""
    listed = subprocess.run(["ps", "-o", "stat=", "-p", str(pid)], capture_output=True, text=True)
    return bool(listed.stdout.strip()) and not listed.stdout.strip().startswith("Z")


def test_the_systems_errors_are_told_in_a_sentence() -> None:
    assert sentence_of(OSError(28, "No space left on device")) == (
        "expected to read or write a file, got a full disk; check the path, its permissions and "
        "the space on the disk."
    )
