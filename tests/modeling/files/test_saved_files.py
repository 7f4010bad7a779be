"""Saved files of every kind load, and come out again with the same bytes."""

from __future__ import annotations

from pathlib import Path

import pytest

from tactileq.modeling import InputError
from tests.refusals import refused
from tests.saved_files import READERS, SAVED, reader

FILES = sorted(SAVED.glob("*.json"))


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_a_saved_file_loads_and_is_written_as_it_was(path: Path, tmp_path: Path) -> None:
    loaded = reader(path).load(path)
    loaded.save(tmp_path / path.name)
    assert (tmp_path / path.name).read_bytes() == path.read_bytes()
    assert reader(path).load(tmp_path / path.name) == loaded


def test_there_is_a_file_of_every_kind() -> None:
    assert {reader(path) for path in FILES} == set(READERS)


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
@pytest.mark.parametrize(
    ("old", "new"),
    [('"version": 1', '"version": 2'), ('"format": "tactileq.', '"format": "other.')],
)
def test_another_format_or_version_is_refused(
    path: Path, old: str, new: str, tmp_path: Path
) -> None:
    other = tmp_path / path.name
    other.write_text(path.read_text(encoding="utf-8").replace(old, new, 1), encoding="utf-8")
    kind = reader(path)
    with refused(InputError, names=other, expected=[kind.FORMAT, "version 1"], got="version"):
        kind.load(other)
