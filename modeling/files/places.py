"""Places in folders: one process at a time, and nothing left by one that was killed.

What is not finished yet lies beside its place under a hidden name (`.NAME.….unfinished`). While it
makes a file, a process holds the lock of the folder; while it fills a hidden folder, the lock in
that one. The system takes locks away when the process ends, however it ends.
"""

from __future__ import annotations

import os
import re
import secrets
import shutil
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from tactileq.modeling.errors import InputError
from tactileq.modeling.files.locks import WAIT_S, HeldError, Lock
from tactileq.modeling.files.syncing import make_folder

ENDING = ".unfinished"
LOCK_NAME = ".tactileq.lock"  # of a folder; that of a file beside it has this ending
_UNFINISHED = re.compile(r"\..*\.[a-z0-9_]{8}" + re.escape(ENDING))
# macOS' twins of files on disks of other systems, its view of a folder, and Windows'.
_OF_SYSTEMS = re.compile(r"\._.+|\.DS_Store|Thumbs\.db|desktop\.ini")
_NAME_LENGTH = 40  # characters of a place's name in a hidden one, which must not become too long


class _Held(threading.local):
    """The locks of folders that a thread holds, by device and number of the folder."""

    def __init__(self) -> None:
        self.locks: dict[tuple[int, int], Lock] = {}


_held = _Held()


def behind_links(path: str | Path) -> Path:
    """Where something written to `path` belongs: what a link leads to, so that the link stays."""
    target = Path(path)
    if not target.is_symlink():
        return target.resolve() if target.name == ".." else target
    if not target.exists():
        raise InputError(
            f"expected a place to write to, got the link {target}, which points to nothing (to "
            f"{target.readlink()}); make what it leads to, or remove it."
        )
    return target.resolve()


def is_hidden(name: str) -> bool:
    """Whether a file or folder of this name is nobody's work, and goes with the folder it is in.

    That is a lock, what a process has not finished, and what systems put beside files.
    """
    is_lock = name.startswith(".") and name.endswith(LOCK_NAME)
    return is_lock or any(kind.fullmatch(name) for kind in (_OF_SYSTEMS, _UNFINISHED))


def is_data(path: Path) -> bool:
    """Whether a file may hold data or a model: hidden ones do not, nor those in hidden folders.

    Parameters
    ----------
    path : Path
        From the folder of the data on; what that is in may be hidden.
    """
    return not any(name.startswith(".") or is_hidden(name) for name in path.parts)


def matching(folder: Path, pattern: str) -> list[Path]:
    """The files and folders of a folder that match a pattern and may be data, in order."""
    return sorted(path for path in folder.glob(pattern) if is_data(path.relative_to(folder)))


@contextmanager
def locked(path: str | Path) -> Iterator[Path]:
    """Let nobody else of this program change what is at `path` until the block ends.

    Other processes and threads wait for 30 s. The lock covers the folder that `path` is in, which
    is made if it is not there. A block may hold it again inside. A file system that knows no locks
    is used without.

    Yields
    ------
    Path
        The place behind links, with what a killed process had moved away put back.

    Raises
    ------
    InputError
        Naming the process that has held the lock for 30 s.
    """
    target = behind_links(path)
    make_folder(target.parent)
    with _folder_locked(target.parent):
        yield target


def clear_unfinished(folder: Path) -> None:
    """Remove what killed processes left in a folder, and put back what they had moved away."""
    if folder.is_dir():
        with _folder_locked(folder):
            pass


@contextmanager
def unfinished_folder(target: Path) -> Iterator[Path]:
    """A hidden folder beside `target`, of this process alone, which goes when the block ends.

    A folder NAME.old that still lies in it beside NAME goes back to where NAME is missing.
    """
    made = _hidden(target)
    with ExitStack() as stack:
        try:
            with locked(target):
                lock = Lock(made / LOCK_NAME)
                stack.callback(_give_back, lock)
                made.mkdir(0o700)
                key = _key(made)
                lock.acquire(WAIT_S)
                stack.callback(_held.locks.pop, key, None)
                _held.locks[key] = lock  # what is written right into it must not wait for this lock
            yield made
        finally:
            with suppress(OSError):
                _remove(made)


@contextmanager
def unfinished_file(target: Path, data: bytes) -> Iterator[Path]:
    """A hidden file beside `target` with these bytes, forced to disk; gone when the block ends,
    unless moved. Its folder is locked meanwhile."""
    made = _hidden(target)
    with locked(target):
        try:
            with made.open("xb") as file:
                file.write(data)
                file.flush()
                os.fsync(file.fileno())
            yield made
        finally:
            made.unlink(missing_ok=True)


def _hidden(target: Path) -> Path:
    """A name beside `target` that is chosen before anything has it: a signal that comes right
    after it was made finds who removes it."""
    name = f".{target.name[:_NAME_LENGTH]}.{secrets.token_hex(4)}{ENDING}"
    return target.with_name(name)


@contextmanager
def _folder_locked(folder: Path) -> Iterator[None]:
    """Hold the lock of a folder, and clear it up where it was not held already."""
    key = _key(folder)
    if key in _held.locks and _held.locks[key].is_held:
        yield
        return
    lock = Lock(folder / LOCK_NAME)
    try:
        _acquire(lock)
        key = _key(folder)  # another one may have taken its place meanwhile
        _held.locks[key] = lock
        if lock.is_held:
            _clear(folder)
        yield
    finally:
        _held.locks.pop(key, None)
        lock.release()


def _acquire(lock: Lock) -> None:
    try:
        lock.acquire(WAIT_S)
    except HeldError as holder:
        raise InputError(
            f"expected to write in {lock.path.parent}, got its lock, which {holder} has held for "
            f"{WAIT_S:g} s; end that process if it hangs, or wait for it, then try again."
        ) from None


def _key(folder: Path) -> tuple[int, int]:
    status = folder.stat()
    return status.st_dev, status.st_ino


def _clear(folder: Path) -> None:
    """Remove what killed processes left in a folder, whose lock this one holds."""
    with suppress(OSError):
        left = [entry for entry in folder.iterdir() if _UNFINISHED.fullmatch(entry.name)]
        for path in left:
            with suppress(OSError, HeldError, InputError):
                if path.is_dir() and not path.is_symlink():
                    _clear_folder(path)
                elif path.is_file() and not path.is_symlink():
                    path.unlink()


def _clear_folder(path: Path) -> None:
    """Remove a hidden folder; HeldError where somebody still works on it."""
    lock = Lock(path / LOCK_NAME)
    lock.acquire(wait_s=0)
    try:
        if lock.is_held:
            _remove(path)
    finally:
        _give_back(lock)


def _give_back(lock: Lock) -> None:
    """Release the lock in a hidden folder that was removed, but for the lock on Windows."""
    lock.release()
    with suppress(OSError):
        lock.path.parent.rmdir()


def _remove(path: Path) -> None:
    """Remove a hidden folder; OSError, and all of it stays, where it holds the only copy of a
    folder that cannot be put back."""
    for fresh in list(path.iterdir()):
        old, place = fresh.with_name(fresh.name + ".old"), path.parent / fresh.name
        if old.exists() and not place.exists():
            old.rename(place)
    shutil.rmtree(path, ignore_errors=True)
