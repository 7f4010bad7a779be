"""What decides whether a failed test in real time is begun again."""

from __future__ import annotations

import os
import signal
import time
from types import SimpleNamespace
from typing import Any

import pytest

from tests.real_time import BareProcess, needs_time


def test_missed_wake_ups_count_from_the_beginning_of_a_test(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    misses = iter((3, 3, 3, 5))
    bare = BareProcess()
    monkeypatch.setattr(bare, "_misses", lambda: next(misses))
    bare.begin()
    assert not bare.missed()
    bare.begin()
    assert bare.missed()


def test_a_process_that_stood_still_has_missed() -> None:
    bare = BareProcess()
    bare.begin()
    assert bare._child is not None
    os.kill(bare._child.pid, signal.SIGSTOP)
    time.sleep(0.1)
    os.kill(bare._child.pid, signal.SIGCONT)
    time.sleep(0.1)
    assert bare.missed()
    bare.close()


@pytest.mark.parametrize(
    ("file", "fixtures", "needed"),
    [
        ("tests/rig/hand/test_reader.py", [], True),
        ("tests/end_to_end/test_feel_command.py", ["jack_server"], True),
        ("tests/modeling/test_hand.py", ["tmp_path"], False),
        ("tests/rig/test_inventory.py", [], False),
    ],
)
def test_only_what_runs_live_is_repeated(file: str, fixtures: list[str], needed: bool) -> None:
    item: Any = SimpleNamespace(nodeid=f"{file}::test", fixturenames=fixtures)
    assert needs_time(item) is needed
