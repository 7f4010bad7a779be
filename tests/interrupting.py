"""Signals at the events of files: a process is ended right after its n-th call that changes a disk.

Of files that C code writes itself only opening and moving them is seen, where Python does that.
"""

from __future__ import annotations

import builtins
import io
import os
import signal
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

# What changes a disk, by the file that it is about: its first argument, or its second one.
BY_PATH = ("mkdir", "rmdir", "unlink", "remove", "truncate", "symlink", "link", "chmod")
BY_TARGET = ("replace", "rename")
BY_HANDLE = ("write", "fsync", "ftruncate")
_WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT
LONGEST_S = 120.0


class Interrupter:
    """Counts the calls of this process that change files below a folder, and signals it after one.

    Made in a process that does nothing else and is not used any more afterwards.

    Parameters
    ----------
    root : path
        What lies elsewhere is not counted.
    at : int
        After which call, from 1; none for 0.
    number : int
        The signal.
    torn : bool
        Whether that call, if it writes, writes only half.
    forced : callable, optional
        Called with the handle of each file that was forced to disk.
    """

    def __init__(
        self,
        root: Path,
        *,
        at: int = 0,
        number: int = signal.SIGKILL,
        torn: bool = False,
        forced: Callable[[int], None] = lambda handle: None,
    ) -> None:
        self.calls: list[str] = []
        self._root, self._at, self._number, self._torn = str(root), at, number, torn
        self._forced = forced
        self._lock = threading.RLock()
        for name in (*BY_PATH, *BY_TARGET, *BY_HANDLE, "open"):
            setattr(os, name, self._wrapped(name, getattr(os, name)))
        builtins.open = io.open = self._opening(builtins.open)

    def _wrapped(self, name: str, real: Callable[..., Any]) -> Callable[..., Any]:
        def call(*arguments: Any, **named: Any) -> Any:
            if name == "open" and not arguments[1] & _WRITING:
                return real(*arguments, **named)
            about = self._about(name, arguments, named)
            mine = about.startswith(self._root) and self._is_last(name, about)
            if mine and self._torn and name == "write":
                arguments = (arguments[0], arguments[1][: len(arguments[1]) // 2])
            try:
                result = real(*arguments, **named)
                if name == "fsync":
                    self._forced(arguments[0])
                return result
            finally:
                if mine:
                    self._end()

        return call

    def _opening(self, real: Callable[..., Any]) -> Callable[..., Any]:
        def call(file: Any, mode: str = "r", *arguments: Any, **named: Any) -> Any:
            writes = isinstance(file, str | os.PathLike) and set(mode) & set("wax+")
            about = os.path.abspath(file) if writes else ""
            mine = about.startswith(self._root) and self._is_last(f"open({mode})", about)
            try:
                return real(file, mode, *arguments, **named)
            finally:
                if mine:
                    self._end()

        return call

    def _about(self, name: str, arguments: tuple[Any, ...], named: dict[str, Any]) -> str:
        """The path that a call is about."""
        first = arguments[name in BY_TARGET]
        if isinstance(first, int):
            return _path_of(first)
        folder = named.get("dir_fd")
        within = os.getcwd() if folder is None else _path_of(folder)
        return os.path.join(within, os.fsdecode(first))

    def _is_last(self, name: str, about: str) -> bool:
        with self._lock:
            self.calls.append(f"{name} {os.path.relpath(about, self._root)}")
            return len(self.calls) == self._at

    def _end(self) -> None:
        os.kill(os.getpid(), self._number)
        if self._number == signal.SIGKILL:
            time.sleep(LONGEST_S)


def _path_of(handle: int) -> str:
    try:
        return os.readlink(f"/proc/self/fd/{handle}")
    except OSError:
        return ""


def forked(work: Callable[[], int | None]) -> int:
    """What a child process that does this ends with; −9 where it did not end in two minutes."""
    child = os.fork()
    if child:
        return _ended(child)
    code = 1
    try:
        code = work() or 0
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else int(end.code is not None)
    except BaseException as error:
        print(repr(error), file=sys.stderr, flush=True)
    finally:
        os._exit(code)


def _ended(child: int) -> int:
    latest_s = time.monotonic() + LONGEST_S
    pause_s = 0.0005
    while not (ended := os.waitpid(child, os.WNOHANG))[0]:
        if time.monotonic() > latest_s:
            os.kill(child, signal.SIGKILL)
            raise TimeoutError(child)
        time.sleep(pause_s)
        pause_s = min(2 * pause_s, 0.02)
    return os.waitstatus_to_exitcode(ended[1])
