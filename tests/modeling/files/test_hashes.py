"""SHA-256 of files and folders, by which results name what they rest on."""

from __future__ import annotations

import hashlib
import os
import shutil
from collections.abc import Mapping
from pathlib import Path

from tactileq.modeling.files.hashes import sha256_of_paths
from tactileq.modeling.files.places import locked, unfinished_folder


def folder_of(place: Path, files: Mapping[str, bytes]) -> str:
    """The hash of a folder with these files."""
    for name, data in files.items():
        (place / name).parent.mkdir(parents=True, exist_ok=True)
        (place / name).write_bytes(data)
    return sha256_of_paths([place])[str(place)]


def test_no_two_folders_have_the_same_hash(tmp_path: Path) -> None:
    folders: tuple[Mapping[str, bytes], ...] = (
        {"a": b"bc"},
        {"ab": b"c"},
        {"a": b"", "b": b"c"},
        {"a/b": b"c"},
        {"a": b"b", "c": b""},
        {"a": b"bc", "d": b""},
        {"a\n": b"bc"},
    )
    hashes = [folder_of(tmp_path / str(n), files) for n, files in enumerate(folders)]
    assert len(set(hashes)) == len(folders)
    shutil.copytree(tmp_path / "2", tmp_path / "copy")
    assert folder_of(tmp_path / "copy", {}) == hashes[2]
    with locked(tmp_path / "copy" / "a"), unfinished_folder(tmp_path / "copy" / "a") as begun:
        (begun / "a").write_text("what another process has not finished")
        assert len(list((tmp_path / "copy").rglob("*"))) > 3
        assert folder_of(tmp_path / "copy", {}) == hashes[2]


def test_that_of_a_file_is_its_bytes_and_what_is_none_is_left_to_who_reads_it(
    tmp_path: Path,
) -> None:
    file, pipe = tmp_path / "a", tmp_path / "pipe"
    file.write_bytes(b"bc")
    os.mkfifo(pipe)
    found = sha256_of_paths([file, pipe, tmp_path / "nothing"])
    assert found == {str(file): hashlib.sha256(b"bc").hexdigest()}
