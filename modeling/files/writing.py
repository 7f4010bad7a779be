"""Writing whole files, so that nothing half-written remains."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

from modeling.errors import InputError


def file_stem(name: str) -> str:
    """A name as a file name: letters, digits and `-_.` stay, all else becomes `-`."""
    kept = "".join(c if c.isalnum() or c in "-_." else "-" for c in name)
    # "", "." and ".." would not be a file in the folder but another folder.
    return kept if kept.strip(".") else "-" * max(len(kept), 1)


def write_text(path: str | Path, text: str) -> None:
    """Write a text file (UTF-8) so that it is there whole or not at all."""
    write_bytes(path, text.encode("utf-8"))


def write_bytes(path: str | Path, data: bytes) -> None:
    """Write a file so that it is there whole or not at all; a link keeps leading to it."""
    target = behind_links(path)
    target.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name}.")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
        os.chmod(name, 0o644)
        os.replace(name, target)
    except BaseException:
        os.unlink(name)
        raise


def behind_links(path: str | Path) -> Path:
    """Where something written to `path` belongs: what a link leads to, so that the link stays."""
    target = Path(path)
    if not target.is_symlink():
        return target
    if not target.exists():
        raise InputError(
            f"expected a place to write to, got the link {target}, which leads nowhere (to "
            f"{target.readlink()}); make what it leads to, or remove it."
        )
    return target.resolve()
