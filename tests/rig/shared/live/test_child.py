"""Processes that are driven by messages, watched and killed."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tactileq.modeling import InputError
from tactileq.rig.devices.sound.messages import Mask, Silence
from tactileq.rig.shared.live import child
from tactileq.rig.shared.live.child import Child, ChildLost
from tactileq.rig.shared.live.messages import Done, Message, Refused
from tests.refusals import refused

ROOT = Path(__file__).parents[4]

PROGRAM = """
import os, sys, time
from tactileq.modeling.errors import InputError
from tactileq.rig.shared.live.driven import Parent
from tactileq.rig.shared.live.messages import Done, Message, Refused

class Say(Message, frozen=True):
    text: str
    number: float = 0.0

def answer(wanted):
    match wanted.text:
        case "refuse":
            raise InputError("expected sense, got none.")
        case "sleep":
            time.sleep(60)
        case "end":
            os._exit(3)
        case "half":
            os.write(parent._answers.fileno(), bytes([0, 0, 1, 0]) + b"half")
            os._exit(3)
        case "write":
            os.write(parent._answers.fileno(), b"what is no message")
        case "print":
            print("a library says something", flush=True)
    return wanted

with Parent() as parent:
    text = parent.settings(str)
    if text == "refuses":
        raise InputError("expected another setting, got this; change it.")
    if text == "fails":
        raise ValueError("what went wrong")
    parent.send(Say(text))
    parent.serve(Say, answer)
    if text == "lingers":
        time.sleep(60)
"""


class Say(Message, frozen=True):
    """What is said, and answered."""

    text: str
    number: float = 0.0


@pytest.fixture(autouse=True)
def program(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "driven.py").write_text(PROGRAM)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), *sys.path]))


def started(settings: object = "") -> Child:
    process = Child("driven", settings)
    process.ready(Say)
    return process


def test_it_answers_message_by_message_and_ends_with_its_input() -> None:
    process = Child("driven", 'quotes " and μ')
    assert process.ready(Say) == Say('quotes " and μ')
    assert process.ask(Say("a", float("inf")), Say) == Say("a", float("inf"))
    assert process.ask(Say("x" * 1_000_000), Say).text == "x" * 1_000_000
    assert process.runs
    process.close()
    assert not process.runs
    assert process.end() == "with code 0"


def test_its_refusals_are_its_own_sentences() -> None:
    with pytest.raises(InputError, match=r"^expected another setting, got this; change it\.$"):
        started("refuses")
    process = started()
    with refused(InputError, expected="sense", got="none"):
        process.ask(Say("refuse"), Say)
    assert process.ask(Say("on"), Say) == Say("on")
    process.close()


def test_settings_and_requests_that_it_does_not_know_are_refused_and_it_goes_on() -> None:
    with refused(InputError, expected="message", got="int"):
        started(3)
    process = started()
    for unknown, got in ((Mask(0.1), "Mask"), (Silence(), "Silence"), (Refused("no"), "Refused")):
        with refused(InputError, expected="message", got=got):
            process.ask(unknown, Done)
    assert process.ask(Say("on"), Say) == Say("on")
    process.close()


def test_one_that_answers_what_was_not_asked_for_is_killed() -> None:
    process = started()
    with refused(ChildLost, names=["expected", "Say"]):
        process.ask(Say("on"), Done)
    assert not process.runs
    with refused(ChildLost, names=["ended by SIGKILL", "Say"]):
        process.ask(Say("on"), Say)


def test_one_that_writes_what_is_no_message_is_killed() -> None:
    process = started()
    with refused(ChildLost, names=["expected", "another"]):
        process.ask(Say("write"), Say)
    assert not process.runs


def test_what_its_libraries_print_is_no_message() -> None:
    process = started()
    assert process.ask(Say("print"), Say) == Say("print")
    process.close()
    assert "a library says something" in process.end()


def test_what_it_says_when_it_fails_is_passed_on() -> None:
    with refused(ChildLost, names=["ended with code 1", "ValueError: what went wrong"]):
        started("fails")


@pytest.mark.parametrize("end", ["end", "half"])
def test_one_that_has_ended_is_lost(end: str) -> None:
    process = started()
    with refused(ChildLost, names="ended with code 3"):
        process.ask(Say(end), Say)
    with refused(ChildLost, names="ended with code 3"):
        process.ask(Say("more"), Say)
    process.close()


def test_one_that_does_not_answer_is_lost_and_can_be_killed() -> None:
    process = started()
    with refused(ChildLost, names="0.1 s"):
        process.ask(Say("sleep"), Say, within_s=0.1)
    process.kill()
    assert not process.runs


def test_one_that_does_not_end_is_killed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(child, "END_S", 0.2)
    process = started("lingers")
    began = time.monotonic()
    process.close()
    assert not process.runs
    assert time.monotonic() - began < 30


def test_its_rooms_are_those_of_its_parent_though_not_installed_and_though_files_have_their_names(
    tmp_path: Path,
) -> None:
    """A copy of the rooms, found by the parent's path alone; the working folder has a numpy.py."""
    house, work = tmp_path / "house", tmp_path / "work"
    names = [
        f"rig/shared/live/{name}" for name in ("child", "clock", "compiled", "driven", "messages")
    ]
    names += ["__init__", "rig/__init__", "rig/shared/live/__init__"]
    names += [f"modeling/{name}" for name in ("__init__", "face", "errors")]
    for file in (f"tactileq/{name}.py" for name in names):
        (house / file).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / file, house / file)
    (house / "tactileq/rig/telling.py").write_text(
        "import tactileq.modeling.errors, numpy\n"
        "from tactileq.rig.shared.live.driven import Parent\n"
        "raise SystemExit(tactileq.modeling.errors.__file__)\n"
    )
    work.mkdir()
    for name in ("tactileq", "numpy"):
        (work / f"{name}.py").write_text("raise SystemExit('not this one')\n")
    program = (
        f"import sys; sys.path.insert(0, {str(house)!r})\n"
        "from tactileq.rig.shared.live.child import Child\n"
        "child = Child('tactileq.rig.telling', None); print(child.end()); child.close()"
    )
    told = subprocess.run(
        [sys.executable, "-P", "-c", program],
        cwd=work,
        env={name: value for name, value in os.environ.items() if name != "PYTHONPATH"},
        capture_output=True,
        text=True,
    )
    assert f"({house / 'tactileq/modeling/errors.py'})" in told.stdout, told.stderr


def test_a_suspended_process_does_not_hold_up_who_sends_it_a_long_message(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """It reads nothing, and the pipe is full long before the message's end."""
    monkeypatch.setattr("tactileq.rig.shared.live.child.ANSWER_S", 0.3)
    process = started()
    os.kill(process.pid, signal.SIGSTOP)
    with pytest.raises(ChildLost, match="SIGKILL"):
        process.send(Say("x" * 1_000_000))
    assert not process.runs
