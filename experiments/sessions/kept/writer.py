"""The thread that writes a session's log, so that drawing never waits for a disk."""

from __future__ import annotations

import errno
import os
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from queue import Empty, SimpleQueue
from threading import Event as Signal
from threading import Thread
from typing import Any

from tactileq.experiments.sessions.kept.log import line_of, sealed_line
from tactileq.modeling.files.reading import reason_of


class StoreError(OSError):
    """The disk did not store a file or a line; the message is one sentence for the user."""


SAFE = "what was answered before is safe: free disk space, then continue with --resume"
# Of another person's files, in whose group the folder may be.
_NOT_ALLOWED = (errno.EACCES, errno.EPERM)
_ALLOW = (
    "nothing more was stored: let its owner allow it (chmod -R g+w, and umask 002 from now on), or "
    "choose another data folder"
)


def store_error(error: OSError, path: Path, advice: str = SAFE) -> StoreError:
    """The error for a disk that stored nothing; `advice` says what is safe, and what to do.

    It is about a disk that is full or fails; where the system does not allow it, that is said.
    """
    advice = _ALLOW if error.errno in _NOT_ALLOWED else advice
    if error.errno in _NOT_ALLOWED and isinstance(error.filename, str | Path):
        path = Path(error.filename)
    return StoreError(f"expected to write to {path}, got {reason_of(error)}; {advice}.")


class _Receipt:
    """Set once its event is on disk, or never will be: then with an error."""

    def __init__(self) -> None:
        self.given = Signal()
        self.error: StoreError | None = None


_Queued = tuple[Mapping[str, Any] | None, _Receipt | None]


class LogWriter:
    """Appends events to a log by a thread of its own: what is queued in one write and one fsync.

    After a write that failed, every later one fails, too: what is on disk then stays as it is.

    Parameters
    ----------
    handle : int
        Of the file, open for appending; belongs to the writer from now on.
    path : Path
        For messages.
    first : int
        The number of the next event.
    seal : str, optional
        Of the line before, empty for the first; None for a log that an earlier version began
        without seals.

    Attributes
    ----------
    seal : str or None
        Of the last line on disk.
    """

    def __init__(self, handle: int, path: Path, *, first: int, seal: str | None = "") -> None:
        self._handle, self._path, self._next, self.seal = handle, path, first, seal
        # Its put may be interrupted by a signal whose handler puts something, too.
        self._queue: SimpleQueue[_Queued] = SimpleQueue()
        self._error: StoreError | None = None
        self._closed = False
        self._thread = Thread(target=self._work, name="tactileq log", daemon=True)
        self._thread.start()

    def put(self, event: Mapping[str, Any]) -> None:
        """Queue an event; its number is given when it is written.

        Raises
        ------
        StoreError
            If an earlier one could not be written.
        """
        self._check()
        self._queue.put((event, None))

    def put_safely(self, event: Mapping[str, Any]) -> None:
        """Queue an event and return once it, and all before it, is forced to disk.

        Raises
        ------
        StoreError
            If it, or an earlier one, could not be written; then it is not in the file.
        """
        self._check()
        self._wait_for(event)

    def close(self) -> None:
        """Write what is queued, and close the file; harmless when closed already.

        Raises
        ------
        StoreError
            If something queued could not be written.
        """
        if self._closed:
            return
        self._closed = True
        self._queue.put((None, None))
        self._thread.join()
        os.close(self._handle)
        if self._error:
            raise self._error

    def _check(self) -> None:
        if self._error:
            raise self._error
        if self._closed:
            raise StoreError(f"expected a log that is open, got {self._path}, which was closed.")

    def _wait_for(self, event: Mapping[str, Any]) -> None:
        receipt = _Receipt()
        self._queue.put((event, receipt))
        receipt.given.wait()
        if receipt.error:
            raise receipt.error

    def _work(self) -> None:
        ended = False
        while not ended:
            batch = [self._queue.get()]
            with suppress(Empty):
                while True:
                    batch.append(self._queue.get_nowait())
            ended = any(event is None for event, _ in batch)
            self._write([queued for queued in batch if queued[0] is not None])

    def _write(self, batch: list[_Queued]) -> None:
        safe = 0
        try:
            if batch and self._error is None:
                lines, seals = [], [self.seal]
                for n, (event, _) in enumerate(batch, self._next):
                    line, seal = self._sealed({"n": n, **(event or {})}, seals[-1])
                    lines.append(line)
                    seals.append(seal)
                safe = self._append(lines)
                self.seal = seals[safe]
        except Exception as error:  # whatever it is: who waits must not wait indefinitely
            self._error = self._error or StoreError(
                f"expected to write to {self._path}, got {error!r}; report this as an error."
            )
        self._next += safe
        for place, (_, receipt) in enumerate(batch):
            if receipt:
                receipt.error = self._error if place >= safe else None
                receipt.given.set()

    def _sealed(self, event: Mapping[str, Any], before: str | None) -> tuple[bytes, str | None]:
        return (line_of(event), None) if before is None else sealed_line(event, before)

    def _append(self, lines: list[bytes]) -> int:
        """Write lines and force them to disk; how many are safe there. The rest is cut off."""
        before = os.fstat(self._handle).st_size
        data, written = b"".join(lines), 0
        try:
            while written < len(data):
                written += os.write(self._handle, data[written:])
            os.fsync(self._handle)
        except OSError as error:
            self._error = store_error(error, self._path)
            if written == len(data):
                written = 0  # a disk that failed to keep lines says so once: trust none of them
            return self._cut_back(before, data[:written])
        return len(lines)

    def _cut_back(self, before: int, written: bytes) -> int:
        """Leave only whole lines; how many of what was written are safe."""
        whole = written[: written.rfind(b"\n") + 1]
        try:
            os.ftruncate(self._handle, before + len(whole))
            os.fsync(self._handle)
        except OSError:
            with suppress(OSError):
                os.ftruncate(self._handle, before)
            return 0
        return whole.count(b"\n")
