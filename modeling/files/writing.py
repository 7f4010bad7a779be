"""Writing whole files, so that nothing half-written remains."""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path

from tactileq.modeling.files.places import behind_links, locked, unfinished_file
from tactileq.modeling.files.syncing import sync_folder


def file_stem(name: str) -> str:
    """A name as a file name: letters, digits and `-_.` stay, all else becomes `-`."""
    kept = "".join(c if c.isalnum() or c in "-_." else "-" for c in name)
    # "", "." and ".." would not be a file in the folder but another folder; a first dot hides it.
    if not kept.strip("."):
        return "-" * max(len(kept), 1)
    return f"-{kept[1:]}" if kept.startswith(".") else kept


def write_text(path: str | Path, text: str) -> None:
    """Write a text file (UTF-8) so that it is there whole or not at all."""
    write_bytes(path, text.encode("utf-8"))


def write_bytes(path: str | Path, data: bytes) -> None:
    """Write a file so that it is there whole or not at all; a link keeps leading to it."""
    write_files({Path(path): data})


def write_files(contents: Mapping[Path, bytes]) -> None:
    """Write several files so that all are there, each whole, or none; links keep leading to theirs.

    All are forced to disk before the first takes its place, in the order given; the last one, which
    may name the others, once they are in theirs for good.

    Raises
    ------
    OSError
        With the name of the file that could not be written; then nothing has changed.
    """
    targets = {behind_links(path): data for path, data in contents.items()}
    with ExitStack() as stack:
        for target in sorted(targets):  # in one order, so that no two wait for each other
            stack.enter_context(locked(target))
        ready: list[tuple[Path, Path]] = []
        for target, data in targets.items():
            if target.is_dir():
                raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(target))
            with _named(target):
                ready.append((stack.enter_context(unfinished_file(target, data)), target))
        try:
            _put(ready)
        except Exception:
            raise
        except BaseException:
            # Interrupted between two of them: some new beside some old would be worse than all new.
            if ready and not ready[0][0].exists():  # moved, but not yet from the list
                ready.pop(0)
            _put(ready)
            raise


def _put(ready: list[tuple[Path, Path]]) -> None:
    """Move files to their places, and from the list."""
    moved: set[Path] = set()
    while ready:
        hidden, target = ready[0]
        if len(ready) == 1:
            _sync(moved)
        with _named(target):
            os.replace(hidden, target)
        moved.add(target.parent)
        ready.pop(0)
    _sync(moved)


def _sync(folders: set[Path]) -> None:
    for folder in sorted(folders):
        with _named(folder):
            sync_folder(folder)


@contextmanager
def _named(target: Path) -> Iterator[None]:
    """The system's errors name the file that was asked for, not the hidden one or none."""
    try:
        yield
    except OSError as error:
        if error.errno is not None:
            error.filename, error.filename2 = str(target), None
        raise
