"""What results came from: versions, seed, settings, hashes of the inputs."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from tactileq.modeling.files.hashes import sha256_of_file
from tactileq.modeling.files.places import matching
from tactileq.modeling.files.writing import write_text

PROVENANCE_NAME = "provenance.json"
NOT_INSTALLED = "not installed"


def provenance_of(
    command: str,
    settings: Mapping[str, object],
    *,
    seed: int | None = None,
    inputs: Mapping[str, str] | None = None,
) -> dict[str, Any]:
    """What results come from: versions, seed, settings, hashes of the inputs.

    `inputs` are `hashes.sha256_of_paths` of them, taken before they were read: what is edited
    meanwhile must not stand beside results of what was there before.
    """
    libraries = ("tactileq", "numpy", "scipy", "pandas", "pingouin", "psychopy")
    return {
        "command": f"tactileq {command}",
        "python": sys.version.split()[0],
        "versions": {name: version_of(name) or NOT_INSTALLED for name in libraries},
        "settings": dict(settings),
        "seed": seed,
        "inputs_sha256": dict(inputs or {}),
    }


def version_of(package: str) -> str | None:
    """The version of an installed package; None where it is not installed."""
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def write_provenance(
    path: Path,
    command: str,
    settings: Mapping[str, object],
    *,
    seed: int | None = None,
    inputs: Mapping[str, str] | None = None,
) -> None:
    """Write what the results beside `path` came from."""
    write_text(path, provenance_text(provenance_of(command, settings, seed=seed, inputs=inputs)))


def seal_folder(folder: Path, provenance: Mapping[str, Any]) -> None:
    """Write a folder's provenance, with the names and SHA-256 of all files that it holds by now.

    By the names a later run knows what it may replace, by the hashes `verify` what changed.
    """
    hashes = sha256_of_files(folder)
    listed = {"files": list(hashes), "sha256": hashes}
    write_text(folder / PROVENANCE_NAME, provenance_text({**provenance, **listed}))


def sha256_of_files(folder: Path) -> dict[str, str]:
    """SHA-256 of each file in a folder that may be data by its path there, in their order."""
    paths = [path for path in matching(folder, "**/*") if not path.is_dir()]
    hashes = {path.relative_to(folder).as_posix(): sha256_of_file(path) for path in paths}
    return dict(sorted(hashes.items()))


def provenance_text(values: Mapping[str, Any]) -> str:
    """The text of a file of provenance."""
    return json.dumps(values, indent=2) + "\n"
