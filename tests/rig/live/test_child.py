"""Processes that are driven by lines of JSON, watched and killed."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

from modeling import InputError
from rig.live import child
from rig.live.child import Child, ChildLost
from tests.refusals import refused

ROOT = Path(__file__).parents[3]

PROGRAM = """
import json, sys, time
settings = json.loads(sys.argv[1])
if settings.get("refuses"):
    print(json.dumps({"error": "expected another setting, got this; change it."}), flush=True)
    raise SystemExit
if settings.get("fails"):
    raise ValueError("what went wrong")
print(json.dumps({"settings": settings}), flush=True)
for line in sys.stdin:
    wanted = json.loads(line)
    if wanted == {"do": "sleep"}:
        time.sleep(60)
    if wanted == {"do": "end"}:
        break
    answer = {"error": "expected sense, got none."} if wanted == {"do": "err"} else wanted
    print(json.dumps(answer), flush=True)
if settings.get("lingers"):
    time.sleep(60)
"""


@pytest.fixture(autouse=True)
def program(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "driven.py").write_text(PROGRAM)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), *sys.path]))


def test_it_answers_line_by_line_and_ends_with_its_input() -> None:
    process = Child("driven", {"text": 'quotes " and μ'})
    assert process.ready == {"settings": {"text": 'quotes " and μ'}}
    assert process.ask({"a": [1, 2.5]}) == {"a": [1, 2.5]}
    assert process.ask({"large": "x" * 1_000_000})["large"] == "x" * 1_000_000
    assert process.runs
    process.close()
    assert not process.runs


def test_its_refusals_are_its_own_sentences() -> None:
    with pytest.raises(InputError, match=r"^expected another setting, got this; change it\.$"):
        Child("driven", {"refuses": True})
    process = Child("driven", {})
    with refused(InputError, expected="sense", got="none"):
        process.ask({"do": "err"})
    assert process.ask({"go": "on"}) == {"go": "on"}
    process.close()


def test_what_it_says_when_it_fails_is_passed_on() -> None:
    with refused(ChildLost, names=["ended", "ValueError: what went wrong"]):
        Child("driven", {"fails": True})


def test_one_that_has_ended_is_lost() -> None:
    process = Child("driven", {})
    with refused(ChildLost, names="ended"):
        process.ask({"do": "end"})
    with refused(ChildLost, names="ended"):
        process.ask({"more": 1})
    process.close()


def test_one_that_does_not_answer_is_lost_and_can_be_killed() -> None:
    process = Child("driven", {})
    with refused(ChildLost, names="0.1 s"):
        process.ask({"do": "sleep"}, within_s=0.1)
    process.kill()
    assert not process.runs


def test_one_that_does_not_end_is_killed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(child, "END_S", 0.2)
    process = Child("driven", {"lingers": True})
    began = time.monotonic()
    process.close()
    assert not process.runs
    assert time.monotonic() - began < 30


def test_its_rooms_are_those_of_its_parent_though_not_installed_and_though_files_have_their_names(
    tmp_path: Path,
) -> None:
    """A copy of the rooms, found by the parent's path alone; the working folder has a rig.py."""
    house, work = tmp_path / "house", tmp_path / "work"
    for room in ("modeling", "rig/live"):
        kept_out = shutil.ignore_patterns("__pycache__", "[a-z]*")  # but __init__.py
        shutil.copytree(ROOT / room, house / room, ignore=kept_out)
    for file in ("rig/__init__.py", "rig/live/child.py", "modeling/face.py", "modeling/errors.py"):
        shutil.copy(ROOT / file, house / file)
    (house / "rig/telling.py").write_text(
        "import json, modeling.errors\nprint(json.dumps({'told': modeling.errors.__file__}))\n"
    )
    work.mkdir()
    for room in ("rig", "modeling"):
        (work / f"{room}.py").write_text("raise SystemExit('not this one')\n")
    program = (
        f"import sys; sys.path.insert(0, {str(house)!r}); from rig.live.child import Child; "
        "child = Child('rig.telling', {}); print(child.ready['told']); child.close()"
    )
    told = subprocess.run(
        [sys.executable, "-P", "-c", program],
        cwd=work,
        env={name: value for name, value in os.environ.items() if name != "PYTHONPATH"},
        capture_output=True,
        text=True,
    )
    assert told.stdout.strip() == str(house / "modeling/errors.py"), told.stderr
