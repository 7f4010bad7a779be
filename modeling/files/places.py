"""Places in folders: one process at a time, and nothing left by one that was killed.

What is not finished yet lies beside its place under a hidden name (`.NAME.….unfinished`). The
process that makes it holds a lock on it, which the system takes away when the process ends, however
it ends. Windows has no such lock: there processes do not wait for each other, and what a killed one
left stays.
"""

from __future__ import annotations

import os
import re
import shutil
import sys
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from modeling.errors import InputError

if sys.platform != "win32":
    import fcntl

ENDING = ".unfinished"
_UNFINISHED = re.compile(r"\..*\.[a-z0-9_]{8}" + re.escape(ENDING))
_NAME_LENGTH = 40  # characters of a place's name in a hidden one, which must not become too long

_threads = threading.RLock()
_held: set[tuple[int, int]] = set()


def behind_links(path: str | Path) -> Path:
    """Where something written to `path` belongs: what a link leads to, so that the link stays."""
    target = Path(path)
    if not target.is_symlink():
        return target.resolve() if target.name == ".." else target
    if not target.exists():
        raise InputError(
            f"expected a place to write to, got the link {target}, which leads nowhere (to "
            f"{target.readlink()}); make what it leads to, or remove it."
        )
    return target.resolve()


@contextmanager
def locked(path: str | Path) -> Iterator[Path]:
    """Let no other process of this program change what is at `path` until the block ends.

    Others wait. The lock covers the folder that `path` is in, which is made if it is not there. A
    block may hold it again inside. A file system that knows no locks is used without.

    Yields
    ------
    Path
        The place behind links, with what a killed process had moved away put back.
    """
    target = behind_links(path)
    target.parent.mkdir(parents=True, exist_ok=True)
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
    with locked(target):
        made = Path(tempfile.mkdtemp(dir=target.parent, prefix=_prefix(target), suffix=ENDING))
        handle, key = _claim(made), _key(made)
        _held.add(key)  # what is written right into it must not wait for this lock
    try:
        yield made
    finally:
        with suppress(OSError):
            _remove(made)
        _held.discard(key)
        _release(handle)


@contextmanager
def unfinished_file(target: Path, data: bytes) -> Iterator[Path]:
    """A hidden file beside `target` with these bytes; gone when the block ends, unless moved."""
    with locked(target):
        number, name = tempfile.mkstemp(dir=target.parent, prefix=_prefix(target), suffix=ENDING)
        handle = _claim(Path(name))
    try:
        with os.fdopen(number, "wb") as file:
            file.write(data)
        os.chmod(name, 0o644)
        yield Path(name)
    finally:
        with suppress(FileNotFoundError):
            os.unlink(name)
        _release(handle)


def _prefix(target: Path) -> str:
    return f".{target.name[:_NAME_LENGTH]}."


@contextmanager
def _folder_locked(folder: Path) -> Iterator[None]:
    """Hold the lock of a folder, and clear it up where it was not held already."""
    with _threads:
        key = _key(folder)
        if key in _held:
            yield
            return
        handle = _claim(folder, wait=True)
        _held.add(key)
        try:
            if handle is not None:
                _clear(folder)
            yield
        finally:
            _held.discard(key)
            _release(handle)


def _key(folder: Path) -> tuple[int, int]:
    status = folder.stat()
    return status.st_dev, status.st_ino


def _clear(folder: Path) -> None:
    with suppress(OSError):
        left = [entry for entry in folder.iterdir() if _UNFINISHED.fullmatch(entry.name)]
        for path in left:
            # Who still works on it holds its lock.
            handle = None if path.is_symlink() else _claim(path)
            if handle is not None:
                with suppress(OSError):
                    _remove(path)
                _release(handle)


def _remove(path: Path) -> None:
    """Remove a hidden file or folder; OSError, and all of it stays, where it holds the only copy
    of a folder that cannot be put back."""
    if not path.is_dir():
        path.unlink()
        return
    for fresh in list(path.iterdir()):
        old, place = fresh.with_name(fresh.name + ".old"), path.parent / fresh.name
        if old.exists() and not place.exists():
            old.rename(place)
    shutil.rmtree(path, ignore_errors=True)


def _claim(path: Path, *, wait: bool = False) -> int | None:
    """A handle that holds the lock of a file or folder; None where it is not to be had."""
    if sys.platform == "win32":
        return None
    handle = None
    try:
        handle = os.open(path, os.O_RDONLY)
        fcntl.flock(handle, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
    except OSError:
        _release(handle)
        return None
    except BaseException:
        _release(handle)
        raise
    return handle


def _release(handle: int | None) -> None:
    if handle is not None:
        os.close(handle)
