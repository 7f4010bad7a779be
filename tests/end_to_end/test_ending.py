"""Signals end the program in order, and its workers with it."""

from __future__ import annotations

import ctypes
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

import pytest

from tactileq import app, interruption
from tactileq.interruption import Interrupted, ended_by_signals
from tactileq.printing import sentence_of


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


def caught_by_a_library() -> None:
    try:
        signal.raise_signal(signal.SIGTERM)
    except BaseException:
        return


def turned_into_no_such_name() -> None:
    class Name:
        def __getattr__(self, name: str) -> None:
            try:
                signal.raise_signal(signal.SIGTERM)
            except BaseException as error:
                raise AttributeError(name) from error

    assert not hasattr(Name(), "any")


@pytest.mark.parametrize("lose", [caught_by_a_library, turned_into_no_such_name])
def test_a_signal_whose_exception_was_caught_on_its_way_is_not_lost(
    monkeypatch: pytest.MonkeyPatch, lose: Callable[[], None]
) -> None:
    monkeypatch.setattr(interruption, "LOOK_S", 0.05)
    reached = list[str]()

    def work() -> None:
        with ended_by_signals():
            lose()
            reached.append("after the signal")
            for _ in range(3):  # and again, for as long as it is lost
                with suppress(BaseException):
                    wait_for(lambda: False)
            wait_for(lambda: False)

    with pytest.raises(Interrupted) as ended:
        work()
    assert ended.value.signal_name == "SIGTERM"
    assert reached == ["after the signal"]


def test_an_error_that_ctypes_makes_of_a_signal_counts_as_the_signal() -> None:
    class Argument:
        @property
        def _as_parameter_(self) -> int:
            signal.raise_signal(signal.SIGTERM)
            return 1

    with pytest.raises(Interrupted) as ended, ended_by_signals():
        ctypes.pythonapi.Py_IncRef(Argument())
    assert isinstance(ended.value.__cause__, ctypes.ArgumentError)


def test_an_error_in_cleaning_up_is_reported() -> None:
    def work() -> None:
        try:
            signal.raise_signal(signal.SIGTERM)
        finally:
            raise OSError("full")

    with pytest.raises(OSError, match="full"), ended_by_signals():
        work()


@contextmanager
def cleaning(done: list[str], seconds: float) -> Iterator[None]:
    """What a context cleans up: in a handler, with errors of its own, and at its end."""
    try:
        yield
    except BaseException:
        time.sleep(seconds)
        done.append("in a handler")
        raise
    finally:
        try:
            raise FileNotFoundError
        except FileNotFoundError:
            time.sleep(seconds)
        time.sleep(seconds)
        done.append("at the end")


def test_what_cleans_up_is_left_in_peace(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(interruption, "LOOK_S", 0.02)
    done = list[str]()

    def work() -> None:
        with ended_by_signals(), ExitStack() as stack:
            stack.callback(done.append, "in a stack")
            stack.callback(time.sleep, 0.1)
            with cleaning(done, 0.1):
                signal.raise_signal(signal.SIGTERM)

    with pytest.raises(Interrupted):
        work()
    assert done == ["in a handler", "at the end", "in a stack"]


def test_who_accepts_a_signal_ends_in_peace(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(interruption, "LOOK_S", 0.02)
    with ended_by_signals():
        try:
            signal.raise_signal(signal.SIGTERM)
        except Interrupted as end:
            end.accept()
        time.sleep(0.2)
    with ended_by_signals(), pytest.raises(Interrupted):  # what came before counts no longer
        signal.raise_signal(signal.SIGTERM)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_workers_end_with_their_parent(tmp_path: Path, number: signal.Signals) -> None:
    script = Path(__file__).with_name("long_work.py")
    parent = subprocess.Popen([sys.executable, script, tmp_path], stderr=subprocess.PIPE)
    pids = [tmp_path / "a.pid", tmp_path / "b.pid"]
    wait_for(lambda: all(path.exists() and path.read_text() for path in pids))
    parent.send_signal(number)
    assert parent.wait(500) == (143 if number == signal.SIGTERM else -number)
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
