"""Which files of a folder a command opened, compared with what its provenance names."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from itertools import dropwhile
from operator import not_
from pathlib import Path
from typing import Any

import pytest

from tactileq.modeling.files import hashes
from tactileq.modeling.files.hashes import sha256_of_paths


class Watched:
    """Files that this process opens while it is on, and whether that was to hash them."""

    def __init__(self) -> None:
        self.on = self.hashing = False
        self.opened: list[tuple[Path, bool]] = []

    def hear(self, event: str, arguments: tuple[Any, ...]) -> None:
        if self.on and event == "open" and isinstance(arguments[0], str | bytes | os.PathLike):
            path = Path(os.path.realpath(os.fsdecode(arguments[0])))
            self.opened.append((path, self.hashing))

    def hash_paths(self, paths: Any) -> dict[str, str]:
        self.hashing = True
        try:
            return sha256_of_paths(paths)
        finally:
            self.hashing = False


@cache
def watched() -> Watched:
    """One for the process: what hears its events cannot be taken away again."""
    found = Watched()
    sys.addaudithook(found.hear)
    return found


@contextmanager
def compared_with_provenance(
    folder: Path, patch: pytest.MonkeyPatch, note: str = "**/*provenance.json"
) -> Iterator[None]:
    """What runs meanwhile in this process opens no file that was in the folder before but those
    that a provenance then names by SHA-256, and all of those; each is read once it is hashed.

    It may have been read before, too, for instance to learn what else there is to hash. What C
    libraries and other processes open is not heard; of a WAV file its header is.
    """
    before = {path for path in folder.rglob("*") if path.is_file()}
    notes = {path: path.read_bytes() for path in before if path.name.endswith("provenance.json")}
    watch = watched()
    patch.setattr(hashes, "sha256_of_paths", watch.hash_paths)
    watch.opened, watch.on = [], True
    try:
        yield
    finally:
        watch.on = False
    opened = [(path, hashed) for path, hashed in watch.opened if path in before]
    written = [path for path in folder.glob(note) if path.read_bytes() != notes.get(path)]
    assert written, "no provenance was written"
    read = {path for path, hashed in opened if not hashed and path not in written}
    assert read, "nothing was read"
    named = {sha256 for path in written for sha256 in _inputs(path).values()}
    around = {path: [p for p in (path, *path.parents) if folder in p.parents] for path in read}
    found = sha256_of_paths({place for places in around.values() for place in places})
    for path, places in sorted(around.items()):
        turns = (hashed for one, hashed in opened if one == path)
        assert False in dropwhile(not_, turns), f"{path} was not read after it was hashed"
        here = {found[str(place)] for place in places}
        assert named & here, f"{path} was read, and no provenance names it"
    assert named <= set(found.values()), "a provenance names what was not read"


def _inputs(note: Path) -> dict[str, str]:
    """SHA-256 of the inputs that a provenance names."""
    return dict(json.loads(note.read_text(encoding="utf-8"))["inputs_sha256"])
