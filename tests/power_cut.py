"""What a disk holds after a loss of power: nothing that was not forced to it.

Names are those of the last fsync of their folder, or, as many disks do it, those of the moment;
the bytes of a file are those of its last fsync, none before the first.
"""

from __future__ import annotations

import os
import stat
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

CALLS = ("fsync", "replace", "rename", "unlink", "rmdir", "mkdir", "truncate")
Files = dict[str, bytes | None]  # None for a folder


class Disk:
    """Notes, before every call that changes a folder, what a cut would leave of it.

    Attributes
    ----------
    cuts : list of (Files, int)
        What would be left, and what `told` was then.
    told : int
        What the test has been told is safe.
    """

    def __init__(self, root: Path) -> None:
        self.root, self.told = root, 0
        self.cuts: list[tuple[Files, int]] = []
        self._names: dict[int, dict[str, int]] = {}
        self._bytes: dict[int, bytes] = {}
        # Held open, so that no number is given to another file.
        self._handles: dict[int, int] = {}
        for path in (root, *root.rglob("*")):
            self._force(path)

    def close(self) -> None:
        for handle in self._handles.values():
            os.close(handle)

    def _number(self, path: Path) -> int:
        number = path.stat().st_ino
        if number not in self._handles:
            self._handles[number] = os.open(path, os.O_RDONLY)
        return number

    def _force(self, path: Path) -> None:
        if path.is_dir():
            self._names[self._number(path)] = {p.name: self._number(p) for p in path.iterdir()}
        else:
            self._bytes[self._number(path)] = path.read_bytes()

    def forced(self, handle: int) -> None:
        path = Path(os.readlink(f"/proc/self/fd/{handle}"))
        if path.is_relative_to(self.root):
            self._force(path)

    def deleted(self, number: int) -> None:
        self._bytes.pop(number, None)

    def cut(self) -> None:
        """Note what the power would leave now."""
        now: Files = {}
        for path in sorted(self.root.rglob("*")):
            name, number = str(path.relative_to(self.root)), self._number(path)
            now[name] = None if path.is_dir() else self._bytes.get(number, b"")
        for left in (now, self._durable(self._number(self.root), "")):
            if not self.cuts or (left, self.told) not in self.cuts[-2:]:
                self.cuts.append((left, self.told))

    def _durable(self, folder: int, below: str) -> Files:
        found: Files = {}
        for name, number in self._names.get(folder, {}).items():
            if stat.S_ISDIR(os.fstat(self._handles[number]).st_mode):
                found[below + name] = None
                found |= self._durable(number, f"{below}{name}/")
            else:
                found[below + name] = self._bytes.get(number, b"")
        return found


@contextmanager
def watched(root: Path) -> Iterator[Disk]:
    """A disk that takes notes while the block works below `root`."""
    disk = Disk(root)
    with pytest.MonkeyPatch.context() as patch:
        for name in CALLS:
            patch.setattr(os, name, _noting(disk, name, getattr(os, name)))
        yield disk
    disk.cut()
    disk.close()


def _noting(disk: Disk, name: str, real: Callable[..., Any]) -> Callable[..., Any]:
    def call(*given: Any, **named: Any) -> Any:
        disk.cut()
        number = 0
        if name == "unlink":
            number = os.stat(given[0], dir_fd=named.get("dir_fd"), follow_symlinks=False).st_ino
        result = real(*given, **named)
        if name == "fsync":
            disk.forced(given[0])
        elif name == "unlink":
            disk.deleted(number)
        return result

    return call


def laid_out(files: Files, folder: Path) -> Path:
    """What a cut left, as a folder."""
    folder.mkdir()
    for name, data in sorted(files.items()):
        if data is None:
            (folder / name).mkdir(parents=True, exist_ok=True)
        else:
            (folder / name).write_bytes(data)
    return folder
