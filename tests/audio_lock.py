"""The lock that all of JACK's servers and clients on a machine share, watched during the tests.

Every server and client takes it as it begins and ends (a System V semaphore beside JACK's shared
memory). A process that keeps it stops all sound on the machine: once, every test of sound of a run
failed for minutes. Here it is freed after some seconds, and the summary names who kept it.
"""

from __future__ import annotations

import ctypes
import os
import signal
import sys
import threading
import time
from contextlib import suppress
from pathlib import Path

JACKS_KEY = 0x282929
SEM_GETPID, SEM_GETVAL, SEM_SETVAL = 11, 12, 16  # of <linux/sem.h>
PATIENCE_S = 5.0  # a microsecond is usual


class LockWatch:
    """Frees the lock where one process keeps it for longer than `patience_s`."""

    def __init__(self, key: int = JACKS_KEY, *, patience_s: float = PATIENCE_S) -> None:
        self.freed: list[str] = []
        self._key, self._patience_s = key, patience_s
        self._kept: tuple[int, float] | None = None  # by which process, since when
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)

    def begin(self) -> None:
        """Look again and again, on Linux."""
        if sys.platform == "linux":
            self._thread.start()

    def close(self) -> None:
        """Look no longer."""
        self._end.set()

    def _watch(self) -> None:
        libc = ctypes.CDLL(None)
        while not self._end.wait(self._patience_s / 5):
            lock = libc.semget(self._key, 0, 0)
            if lock < 0 or libc.semctl(lock, 0, SEM_GETVAL) != 0:
                self._kept = None
                continue
            last, now = libc.semctl(lock, 0, SEM_GETPID), time.monotonic()
            if self._kept is None or self._kept[0] != last:
                self._kept = (last, now)
            elif now - self._kept[1] > self._patience_s:
                self.freed.append(f"process {last} ({_described(last)})")
                with suppress(OSError):
                    os.kill(last, signal.SIGKILL)  # whereupon the system frees it
                time.sleep(0.2)
                if libc.semctl(lock, 0, SEM_GETVAL) == 0:
                    libc.semctl(lock, 0, SEM_SETVAL, 1)
                self._kept = None


def _described(pid: int) -> str:
    try:
        words = Path(f"/proc/{pid}/cmdline").read_text().replace("\0", " ").strip()
        state = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0]
    except OSError:
        return "gone"
    return f"{words}, state {state}"
