"""SHA-256 of what is saved, by which files name what they rest on."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from tactileq.modeling.files.places import matching


def sha256_of(text: str) -> str:
    """SHA-256 of a text (UTF-8), 64 hexadecimal digits."""
    return hashlib.sha256(text.encode("utf-8")).hexdigest()


def seal_over(values: Mapping[str, str]) -> str:
    """8 hexadecimal digits over named values, such as hashes of files, whatever their order."""
    return sha256_of("".join(f"{name} {value}\n" for name, value in sorted(values.items())))[-8:]


def sha256_of_values(values: Mapping[str, Any]) -> str:
    """SHA-256 of plain values, whatever the order of their names."""
    return sha256_of(json.dumps(values, sort_keys=True, ensure_ascii=False))


def sha256_of_paths(paths: Iterable[Path]) -> dict[str, str]:
    """SHA-256 of files and folders, by their paths; to be taken before they are read.

    What is no file or folder, or a file that cannot be read, is left out: who reads it says so.
    That of a file is its bytes'. That of a folder is the one of a list with a line for each file
    below it that may be data (`places.is_data`), in order: its path in the folder, a null character
    (which no path can hold) and the SHA-256 of its bytes. So what moves from a name to the bytes,
    or to another file, changes it.
    """
    hashes = {}
    for path in paths:
        if path.is_dir():
            hashes[str(path)] = _sha256_of_folder(path)
        elif path.is_file():  # a pipe would wait for its other end
            with suppress(OSError):
                hashes[str(path)] = sha256_of_file(path)
    return hashes


def _sha256_of_folder(path: Path) -> str:
    files = (file for file in matching(path, "**/*") if file.is_file())
    names = {file.relative_to(path).as_posix(): file for file in files}
    lines = []
    for name in sorted(names):
        sha256 = "not readable"
        with suppress(OSError):
            sha256 = sha256_of_file(names[name])
        lines.append(f"{name}\0{sha256}\n")
    return hashlib.sha256("".join(lines).encode("utf-8", "surrogateescape")).hexdigest()


def sha256_of_file(path: Path) -> str:
    """SHA-256 of a file's bytes, 64 hexadecimal digits."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
