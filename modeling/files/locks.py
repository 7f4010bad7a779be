"""Locks between processes: one holder at a time, whom those that wait can name.

A lock is a file of its own, never the data, and is there while somebody holds it. The system takes
the lock away when its holder ends, however it ends; the file that a killed one leaves is taken over
by the next. Children do not inherit it.
"""

from __future__ import annotations

import errno
import os
import platform
import stat
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from tactileq.modeling.errors import InputError
from tactileq.modeling.files.reading import reason_of

if TYPE_CHECKING:
    from filelock import BaseFileLock

WAIT_S = 30.0
_POLL_S = 0.01
_NO_LOCKS = (errno.ENOSYS, errno.ENOTSUP, errno.EOPNOTSUPP, errno.ENOLCK)
# Windows lets nobody else read the first byte of a locked file.
_HOLDER_FROM = 1
# Windows has neither links that anybody may plant nor pipes in folders.
_READING = os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)


class HeldError(Exception):
    """Another process holds a lock; the message names it."""


class Lock:
    """A lock of one process at a time, by a file that nothing else is in.

    A file system that knows no locks, and a folder that takes no file, are used without.

    Parameters
    ----------
    path : Path
        Of the lock file, in a folder that is there. A link is not followed.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._lock: BaseFileLock | None = None
        self._file: tuple[int, int] | None = None

    @property
    def is_held(self) -> bool:
        """Whether this process holds it; a child of `fork` does not."""
        return self._lock is not None and self._lock.is_locked

    def acquire(self, wait_s: float) -> None:
        """Hold the lock until `release`, or until the process ends.

        Parameters
        ----------
        wait_s : float
            How long to wait for another holder, ≥ 0.

        Raises
        ------
        HeldError
            If another holder, a thread of this process included, kept it for this long.
        InputError
            For a file in its place that cannot be locked, such as a link or another user's.
        """
        from filelock import FileLock, Timeout  # late: most imports of this package lock nothing

        # Others' processes may lock it after this one, so its mode is not left to the mask.
        lock = FileLock(
            self.path, mode=0o666, thread_local=False, poll_interval=_POLL_S, on_acquired=_sign
        )
        self._lock, self._file = lock, None
        try:
            lock.acquire(timeout=wait_s)
            self._file = _identity(self.path)
        except Timeout:
            raise HeldError(holder(self.path)) from None
        except OSError as error:
            if error.errno in _NO_LOCKS:
                with suppress(OSError):
                    self.path.unlink()
            elif os.path.lexists(self.path):
                got = "a link" if self.path.is_symlink() else reason_of(error)
                raise InputError(
                    f"expected a file that can be locked at {self.path}, got {got}; have its owner "
                    "remove it."
                ) from None
        except BaseException:  # a signal, whose handler may raise when the lock is held already
            if not lock.is_locked:  # or when there is only its file, which is nobody's
                with suppress(Timeout, OSError):
                    lock.acquire(timeout=0)
            self.release()
            raise

    def release(self) -> None:
        """Let others hold it, and remove the file; harmless where it is not held."""
        if self._lock is None or not self._lock.is_locked:
            return
        # While it is held: who opened it before finds it gone, and makes another. Not another
        # one's, where the folder was renamed. Windows refuses here, and removes it by itself.
        if self._file in (None, _identity(self.path)):
            with suppress(OSError):
                self.path.unlink()
        self._lock.release()


def is_held(path: Path) -> bool:
    """Whether any process holds the lock of this file; nothing is made or changed.

    To find out, the lock is held for a moment, so two that ask at once may take each other for a
    holder.
    """
    from filelock import lock_descriptor  # late: as above

    try:
        handle = os.open(path, _READING)
    except OSError:
        return False
    try:
        return not lock_descriptor(handle, blocking=False)
    except OSError:  # a file system that knows no locks
        return False
    finally:
        os.close(handle)


def _sign(handle: int) -> None:
    """Write who holds the lock into its file; a full disk does not take the lock away.

    Raises
    ------
    OSError
        For a file that has another name, too: whoever gave it this one may want it emptied.
    """
    status = os.fstat(handle)
    if not stat.S_ISREG(status.st_mode) or status.st_nlink > 1:
        raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST))
    with suppress(OSError):
        os.ftruncate(handle, 0)
        os.write(handle, b" " * _HOLDER_FROM + f"{os.getpid()} {platform.node()}\n".encode())


def holder(path: Path) -> str:
    """Who wrote into a lock file, in words."""
    try:
        handle = os.open(path, _READING)
    except OSError:
        return "another process"
    try:
        os.lseek(handle, _HOLDER_FROM, os.SEEK_SET)
        words = os.read(handle, 300).decode("utf-8", "replace").split()
    except OSError:
        words = []
    finally:
        os.close(handle)
    if len(words) != 2 or not words[0].isdecimal():
        return "another process"
    number, host = words
    return f"process {number}" + ("" if host == platform.node() else f" on {host}")


def _identity(path: Path) -> tuple[int, int] | None:
    try:
        status = os.lstat(path)
    except OSError:
        return None
    return status.st_dev, status.st_ino
