"""One process at a time uses a rig."""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from modeling import InputError
from modeling.errors import shown
from modeling.files.hashes import sha256_of

if sys.platform != "win32":
    import fcntl


@contextmanager
def rig_locked(name: str) -> Iterator[None]:
    """Hold the rig of this name until the block, or the process, ends.

    Windows has no such lock: there nobody is refused.

    Raises
    ------
    InputError
        Where another process holds it, which is named by its number.
    """
    path = Path(tempfile.gettempdir()) / f"tactileq-rig-{sha256_of(name)[:16]}.lock"
    handle = _opened(path, name)
    try:
        _claim(handle, name)
        yield
    finally:
        os.close(handle)


def _opened(path: Path, name: str) -> int:
    # Left there for good: were it removed, two processes could hold two files of one name.
    with suppress(FileExistsError):
        handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o666)
        os.fchmod(handle, 0o666)  # whoever uses the rig next, whatever the mask
        return handle
    try:
        return os.open(path, os.O_RDWR)
    except OSError:
        raise InputError(
            f"expected to lock the rig {shown(name)} by {path}, got no permission; have its owner "
            "remove that file."
        ) from None


def _claim(handle: int, name: str) -> None:
    if sys.platform == "win32":
        return
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        holder = os.pread(handle, 32, 0).decode("ascii", errors="replace").strip() or "unknown"
        raise InputError(
            f"expected a rig that nobody uses, but {shown(name)} is in use by process {holder}; "
            "end that one first."
        ) from None
    os.ftruncate(handle, 0)
    os.pwrite(handle, f"{os.getpid()}\n".encode("ascii"), 0)
