"""Forcing files and their names to disk, so that they survive a loss of power."""

from __future__ import annotations

import errno
import os
from pathlib import Path


def make_folder(folder: Path) -> None:
    """Make a folder and those that it is in, forced to disk."""
    # A missing drive has no folder above it; creating files on it reports that.
    if folder.is_dir() or folder.parent == folder:
        return
    make_folder(folder.parent)
    folder.mkdir(exist_ok=True)
    sync_folder(folder.parent)


def sync_file(path: Path) -> None:
    """Force the contents of a file to disk; its name is forced there with its folder."""
    # Windows asks for the right to write, which a copy of a protected file elsewhere may lack.
    handle = os.open(path, os.O_RDWR if os.name == "nt" else os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def sync_folder(folder: Path) -> None:
    """Force the names of a folder's files to disk (Windows and some network disks do so alone)."""
    if os.name == "nt":
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.ENOTSUP):
            raise
    finally:
        os.close(handle)


def sync_tree(folder: Path) -> None:
    """Force all files below a folder to disk, and their names."""
    for here, _, names in os.walk(folder):
        for path in (Path(here, name) for name in names):
            if not path.is_symlink():
                sync_file(path)
        sync_folder(Path(here))
