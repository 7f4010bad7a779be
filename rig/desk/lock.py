"""One process at a time uses a rig."""

from __future__ import annotations

import os
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from tactileq.modeling import InputError
from tactileq.modeling.errors import shown
from tactileq.modeling.files.hashes import sha256_of
from tactileq.modeling.files.locks import HeldError, Lock, holder, is_held

_SHARED = 0o1777  # as that of the folder for temporary files itself


@contextmanager
def rig_locked(name: str) -> Iterator[None]:
    """Hold the rig of this name until the block, or the process, ends.

    All users of a machine share a folder for it, in that for temporary files, in which each has a
    lock of his own: none may remove what another one left, nor open it for writing. So who holds
    his looks whether another user holds another; two that begin at once may both be refused.

    Raises
    ------
    InputError
        If another process holds it, which is named by its number, or where something else is
        in the place of the lock.
    """
    rig = sha256_of(name)[:16]
    lock = Lock(_folder() / f"{rig}-{os.getuid() if hasattr(os, 'getuid') else 0}.lock")
    try:
        lock.acquire(wait_s=0)
        _check_others(lock, f"{rig}-*.lock")
    except HeldError as holding:
        lock.release()
        raise InputError(
            f"expected a rig that nobody uses, but {shown(name)} is in use by {holding}; end that "
            "one first."
        ) from None
    try:
        yield
    finally:
        lock.release()


def _check_others(lock: Lock, pattern: str) -> None:
    """HeldError where another user holds the same rig."""
    for path in sorted(lock.path.parent.glob(pattern)):
        if path != lock.path and is_held(path):
            raise HeldError(holder(path))


def _folder() -> Path:
    """That of the locks, in which every user may write, and remove what is his own."""
    folder = Path(tempfile.gettempdir(), "tactileq-rigs")
    with suppress(FileExistsError):
        folder.mkdir()
    if folder.is_symlink():
        got = "a link"
    elif not folder.is_dir():
        got = "a file"
    else:
        mode = _shared_mode(folder)
        got = "" if mode == _SHARED else f"one of mode {mode:o}"
    if got:
        raise InputError(
            f"expected a folder for the locks of rigs at {folder}, of mode {_SHARED:o} so that all "
            f"users share it, got {got}; have its owner remove it."
        )
    return folder


def _shared_mode(folder: Path) -> int:
    """Its mode, after its owner has given it that of a shared one, whatever the mask."""
    if not hasattr(os, "O_DIRECTORY"):  # Windows: each user has a folder of his own
        return _SHARED
    mode = stat.S_IMODE(folder.lstat().st_mode)
    if mode != _SHARED:
        with suppress(OSError):  # another one's
            # Not by its name: there might be a link by now, to a folder that is nobody else's.
            handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
            try:
                os.fchmod(handle, _SHARED)
                mode = stat.S_IMODE(os.fstat(handle).st_mode)
            finally:
                os.close(handle)
    return mode
