"""One process at a time uses a rig."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from tactileq.modeling import InputError
from tactileq.modeling.errors import shown
from tactileq.modeling.files.hashes import sha256_of
from tactileq.modeling.files.locks import HeldError, Lock


@contextmanager
def rig_locked(name: str) -> Iterator[None]:
    """Hold the rig of this name until the block, or the process, ends.

    All users of a machine share the lock, in a folder of its own in that for temporary files. There
    none may open what another one left (which is how Linux and filelock see to it); here they may.

    Raises
    ------
    InputError
        If another process holds it, which is named by its number, or where something else is
        in the place of the lock.
    """
    lock = Lock(_folder() / f"{sha256_of(name)[:16]}.lock")
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


def _folder() -> Path:
    """That of the locks, in which every user may write and lock the files of others."""
    folder = Path(tempfile.gettempdir(), "tactileq-rigs")
    with suppress(FileExistsError):
        folder.mkdir()
        folder.chmod(0o777)  # whatever the mask
    if folder.is_symlink() or not folder.is_dir():
        raise InputError(
            f"expected a folder for the locks of rigs at {folder}, got "
            f"{'a link' if folder.is_symlink() else 'a file'}; have its owner remove it."
        )
    return folder
