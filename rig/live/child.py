"""A process of a rig that is driven by lines of JSON, watched and killed.

docs/method/live.md#processes
"""

from __future__ import annotations

import json
import os
import queue
import subprocess
import sys
import sysconfig
import tempfile
import threading
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import IO, Any

from modeling.errors import InputError

ANSWER_S = 5.0
START_S = 15.0
END_S = 2.0


class ChildLost(RuntimeError):
    """The process has ended, or does not answer; the message is a part of a sentence."""


def started(
    module: str, settings: Mapping[str, Any], *, complaints: IO[bytes]
) -> subprocess.Popen[str]:
    """`python -P -m MODULE SETTINGS`, with pipes; its standard error goes to `complaints`.

    Its rooms are those of this process, installed or not. Without -P a file `rig.py` in the working
    folder would be imported in place of the room.
    """
    rooms = str(Path(__file__).resolve().parents[2])
    others = [path for path in (os.environ.get("PYTHONPATH"),) if path]
    # Installed ones are found without, and PYTHONPATH would put their neighbours, such as an old
    # copy of a module of the standard library, before the standard library.
    if rooms not in (sysconfig.get_path("purelib"), sysconfig.get_path("platlib")):
        others.insert(0, rooms)
    return subprocess.Popen(
        [sys.executable, "-P", "-m", module, json.dumps(settings)],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(others)},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=complaints,
        text=True,
    )


def last_complaint(complaints: IO[bytes]) -> str:
    """The last line that a process wrote to its standard error, in brackets; empty for none."""
    complaints.seek(0)
    lines = complaints.read().decode(errors="replace").split("\n")
    last = [line.strip() for line in lines if line.strip()][-1:]
    return f" ({last[0]})" if last else ""


class Child:
    """A process of `started`, which answers one line for each line that it gets.

    Parameters
    ----------
    module : str
    settings : mapping
        For the command line, as JSON.

    Raises
    ------
    InputError
        If it refuses its settings: its own sentence.
    ChildLost
        If it ends or does not answer.
    """

    def __init__(self, module: str, settings: Mapping[str, Any]) -> None:
        self._complaints = tempfile.TemporaryFile()  # noqa: SIM115 (it lives as long as this)
        self._said = ""
        self._process = started(module, settings, complaints=self._complaints)
        self._answers: queue.Queue[str] = queue.Queue()
        threading.Thread(target=self._listen, daemon=True).start()
        try:
            self.ready = self._answer(START_S)
        except (InputError, ChildLost):
            self.kill()
            raise

    @property
    def pid(self) -> int:
        """Number of the process."""
        return self._process.pid

    @property
    def runs(self) -> bool:
        """Whether it has not ended."""
        return self._process.poll() is None

    def ask(self, wanted: Mapping[str, Any], *, within_s: float = ANSWER_S) -> dict[str, Any]:
        """Its answer to one line.

        Raises
        ------
        InputError
            If it refuses: its own sentence.
        ChildLost
            If it has ended, or does not answer in time.
        """
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(json.dumps(wanted) + "\n")
            self._process.stdin.flush()
        except (OSError, ValueError):
            raise ChildLost(f"it has ended{self._complaint()}") from None
        return self._answer(within_s)

    def close(self) -> None:
        """End it by the end of its input; kill it where it does not."""
        with suppress(OSError, ValueError):
            assert self._process.stdin is not None
            self._process.stdin.close()
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(END_S)
        self.kill()

    def kill(self) -> None:
        """End it at once."""
        self._process.kill()
        self._process.wait()
        for pipe in (self._process.stdin, self._process.stdout):
            with suppress(OSError, ValueError):
                assert pipe is not None
                pipe.close()
        self._said = self._complaint()
        self._complaints.close()

    def _complaint(self) -> str:
        """The last line of its standard error, after its end, too."""
        return self._said if self._complaints.closed else last_complaint(self._complaints)

    def _listen(self) -> None:
        """Pass its lines on; an empty one is its end."""
        assert self._process.stdout is not None
        with suppress(ValueError, OSError):  # closed by `kill`
            for line in self._process.stdout:
                self._answers.put(line)
        self._answers.put("")

    def _answer(self, within_s: float) -> dict[str, Any]:
        try:
            line = self._answers.get(timeout=within_s)
        except queue.Empty:
            raise ChildLost(f"it has not answered for {within_s:g} s") from None
        if not line:
            self._answers.put("")  # for who asks next
            raise ChildLost(f"it has ended{self._complaint()}")
        answer: dict[str, Any] = json.loads(line)
        if "error" in answer:
            raise InputError(answer["error"])
        return answer
