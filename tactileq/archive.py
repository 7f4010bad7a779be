"""What an archive is known by: where its parts lie, and its seal."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path

COMMAND = "publish"
DATA, REPORT = "data", "report"


def is_archive(folder: Path) -> bool:
    """Whether a folder was written by `tactileq publish`."""
    from modeling.files.provenance import PROVENANCE_NAME

    try:
        note = json.loads((folder / PROVENANCE_NAME).read_bytes())
    except (OSError, ValueError):
        return False
    return isinstance(note, dict) and note.get("command") == f"tactileq {COMMAND}"


def seal_of_files(sha256: Mapping[str, str]) -> str:
    """8 hexadecimal digits over the names and SHA-256 of files."""
    lines = "".join(f"{name} {value}\n" for name, value in sorted(sha256.items()))
    return hashlib.sha256(lines.encode()).hexdigest()[-8:]
