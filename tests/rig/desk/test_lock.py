"""Two processes at one rig: the second is refused."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from modeling import InputError
from rig.desk.lock import rig_locked

ROOT = Path(__file__).parents[3]
HOLDING = """
import sys
from rig.desk.lock import rig_locked
with rig_locked(sys.argv[1]):
    print("held", flush=True)
    sys.stdin.read()
"""


def test_the_second_is_told_who_holds_the_rig_until_that_one_is_gone(tmp_path: Path) -> None:
    name = str(tmp_path)
    words = [sys.executable, "-c", HOLDING, name]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen(words, cwd=ROOT, **pipes) as holder:  # type: ignore[call-overload]
        assert holder.stdout.readline() == b"held\n"
        told = rf"in use by process {holder.pid}; end that one"
        with pytest.raises(InputError, match=told), rig_locked(name):
            raise AssertionError
        with rig_locked(name + " (another)"):
            pass
        holder.kill()
    with rig_locked(name):
        pass
    with rig_locked(name):
        pass
