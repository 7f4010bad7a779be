"""What results came from: versions, seed, settings, hashes of the inputs."""

from __future__ import annotations

import hashlib
import json
import sys
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

from modeling.files.writing import write_text


def write_provenance(
    path: Path,
    command: str,
    settings: Mapping[str, object],
    *,
    seed: int | None = None,
    inputs: Sequence[Path] = (),
) -> dict[str, Any]:
    """Write what the results came from: versions, seed, settings, hashes of the inputs."""
    libraries = ("tactileq", "numpy", "scipy", "pandas", "pingouin", "psychopy")
    values: dict[str, Any] = {
        "command": f"tactileq {command}",
        "python": sys.version.split()[0],
        "versions": {name: version(name) for name in libraries},
        "settings": dict(settings),
        "seed": seed,
        "inputs_sha256": {str(path): _hash(path) for path in inputs},
    }
    write_text(path, json.dumps(values, indent=2) + "\n")
    return values


def _hash(path: Path) -> str:
    """SHA-256 of a file, or of all files below a folder with their names."""
    digest = hashlib.sha256()
    files = [path] if path.is_file() else sorted(p for p in path.rglob("*") if p.is_file())
    for file in files:
        digest.update(str(file.relative_to(path.parent)).encode())
        digest.update(file.read_bytes())
    return digest.hexdigest()
