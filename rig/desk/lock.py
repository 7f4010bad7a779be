"""One process at a time uses a rig."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from modeling import InputError
from modeling.errors import shown
from modeling.files.hashes import sha256_of
from modeling.files.locks import HeldError, Lock


@contextmanager
def rig_locked(name: str) -> Iterator[None]:
    """Hold the rig of this name until the block, or the process, ends.

    The lock lies in the folder for temporary files, so that all users of a machine share it.

    Raises
    ------
    InputError
        Where another process holds it, which is named by its number, or where something else is
        in the place of the lock.
    """
    lock = Lock(Path(tempfile.gettempdir()) / f"tactileq-rig-{sha256_of(name)[:16]}.lock")
    try:
        lock.acquire(wait_s=0)
    except HeldError as holder:
        raise InputError(
            f"expected a rig that nobody uses, but {shown(name)} is in use by {holder}; end that "
            "one first."
        ) from None
    try:
        yield
    finally:
        lock.release()
