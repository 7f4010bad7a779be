"""A process of a rig that is driven by messages, watched and killed.

docs/method/live.md#processes
"""

from __future__ import annotations

import os
import queue
import signal
import subprocess
import sys
import sysconfig
import tempfile
import threading
from contextlib import suppress
from pathlib import Path
from typing import IO, Any, TypeVar

from tactileq.modeling.errors import InputError
from tactileq.rig.shared.live.clock import next_of, wait_for
from tactileq.rig.shared.live.messages import Message, Refused, decoded, received, send

ANSWER_S = 5.0
START_S = 15.0
END_S = 2.0
Reply = TypeVar("Reply", bound=Message)


class ChildLost(RuntimeError):
    """The process has ended, or does not answer; the message is a part of a sentence."""


def _started(module: str, complaints: IO[bytes]) -> subprocess.Popen[bytes]:
    """`python -P -m MODULE`, with pipes; its standard error goes to `complaints`.

    Its rooms are those of this process, installed or not. Without -P a file `numpy.py` in the
    working folder would be imported in place of the library.
    """
    rooms = str(Path(__file__).parents[4])
    others = [path for path in (os.environ.get("PYTHONPATH"),) if path]
    # Installed ones are found without, and PYTHONPATH would put their neighbours, such as an old
    # copy of a module of the standard library, before the standard library.
    if rooms not in (sysconfig.get_path("purelib"), sysconfig.get_path("platlib")):
        others.insert(0, rooms)
    return subprocess.Popen(
        [sys.executable, "-P", "-m", module],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(others)},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=complaints,
    )


def _last_line(complaints: IO[bytes]) -> str:
    """The last line that a process wrote to its standard error, in brackets; empty for none."""
    complaints.seek(0)
    text = complaints.read().decode(errors="replace").strip()
    return f" ({text.splitlines()[-1].strip()})" if text else ""


class Child:
    """A process with a `Parent` (driven.py) at its other end; it is started at once.

    Parameters
    ----------
    settings : object
        What it gets first: a frozen type that msgspec knows.
    """

    def __init__(self, module: str, settings: object) -> None:
        self._complaints = tempfile.TemporaryFile()  # noqa: SIM115 (it lives as long as this)
        self._ending = threading.Lock()
        self._end = ""
        self._process = _started(module, self._complaints)
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._stdin, self._stdout = self._process.stdin, self._process.stdout
        self._heard: queue.Queue[bytes | None] = queue.Queue()
        threading.Thread(target=self._listen, daemon=True).start()
        with suppress(OSError):  # `ready` says why
            send(self._stdin, settings)

    @property
    def pid(self) -> int:
        """Number of the process."""
        return self._process.pid

    @property
    def runs(self) -> bool:
        """Whether it has not ended."""
        return self._process.poll() is None

    def ready(self, kind: type[Reply], *, within_s: float = START_S) -> Reply:
        """Its first message; without one it is killed.

        Raises
        ------
        InputError
            If it refuses its settings: its own sentence.
        ChildLost
            If it ends or does not answer.
        """
        try:
            return self.hear(kind, within_s=within_s)  # type: ignore[no-any-return]
        except (InputError, ChildLost):
            self.kill()
            raise

    def ask(self, request: Message, kind: type[Reply], *, within_s: float = ANSWER_S) -> Reply:
        """Its answer, of this kind, to a request.

        Raises
        ------
        InputError
            If it refuses: its own sentence.
        ChildLost
            If it has ended, does not answer in time or answers something else.
        """
        self.send(request)
        return self.hear(kind, within_s=within_s)  # type: ignore[no-any-return]

    def send(self, request: Message) -> None:
        """Send a request; ChildLost if it has ended, or does not take it in time."""
        # A process that is suspended reads nothing, and a long message fills the pipe: only its
        # end lets the writer go on.
        watch = threading.Timer(ANSWER_S, self._process.kill)
        watch.start()
        try:
            send(self._stdin, request)
        except (OSError, ValueError):
            raise ChildLost(f"it has ended {self.end()}") from None
        finally:
            watch.cancel()

    def hear(self, kinds: Any, *, within_s: float | None = None) -> Any:
        """Its next message, one of these types (a union or a type); raises what `ask` does."""
        taken = (self._heard.get(),) if within_s is None else next_of(self._heard, within_s)
        if not taken:
            raise ChildLost(f"it has not answered for {within_s:g} s")
        (heard,) = taken
        if heard is None:
            self._heard.put(None)  # for who asks next
            raise ChildLost(f"it has ended {self.end()}")
        try:
            message = decoded(heard, kinds | Refused)
        except InputError as error:
            self.kill(f" ({error})")
            raise ChildLost(f"it was killed ({error})") from None
        if isinstance(message, Refused):
            raise InputError(message.sentence)
        return message

    def close(self) -> None:
        """End it by the end of its input; kill it where it does not."""
        with suppress(OSError, ValueError):
            self._stdin.close()
        self.end()

    def end(self) -> str:
        """Wait for its end, kill it where it does not come.

        Returns
        -------
        str
            By which signal or with which code it ended, and its last complaint.
        """
        wait_for(self._ended, END_S)
        self.kill()
        return self._end

    def _ended(self, within_s: float) -> bool:
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(within_s)
        return not self.runs

    def kill(self, why: str = "") -> None:
        """End it at once."""
        self._process.kill()
        code = self._process.wait()
        for pipe in (self._stdin, self._stdout):
            with suppress(OSError, ValueError):
                pipe.close()
        with self._ending:
            if not self._complaints.closed:
                how = f"by {signal.Signals(-code).name}" if code < 0 else f"with code {code}"
                self._end = how + (why or _last_line(self._complaints))
                self._complaints.close()

    def _listen(self) -> None:
        """Pass its messages on; None is its end."""
        with suppress(ValueError, OSError):  # closed by `kill`
            for data in received(self._stdout):
                self._heard.put(data)
        self._heard.put(None)
