"""The audio server of tests: beside a stray one, and after a test that was killed."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[1]
HOLD = """
import time
from tests.conftest import _jack_server
with _jack_server() as server:
    print(server.process.pid, flush=True)
    time.sleep(60)
"""
Jack = Callable[..., AbstractContextManager[Any]]


def test_a_name_that_a_stray_server_has_is_left_to_it(
    jack_server: Jack, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with jack_server() as stray:
        monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))  # where nobody holds its lock
        with jack_server() as other:
            assert other.name != stray.name
            assert any("system" in port for port in other.ports())
        assert any("system" in port for port in stray.ports())


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGTERM])
def test_a_server_ends_with_the_test_that_is_killed(jack_server: Jack, how: signal.Signals) -> None:
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    with subprocess.Popen(
        [sys.executable, "-c", HOLD], env=environment, stdout=subprocess.PIPE
    ) as test:
        assert test.stdout is not None
        server = int(test.stdout.readline())
        assert is_running(server)
        test.send_signal(how)
    end = time.monotonic() + 500
    while is_running(server) and time.monotonic() < end:
        time.sleep(0.01)
    assert not is_running(server)


def is_running(pid: int) -> bool:
    """Whether this is a process that was not killed (who inherits it may not have noticed yet)."""
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rsplit(")")[-1].split()[0]
    except OSError:
        return False
    return state not in "ZX"
