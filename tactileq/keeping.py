"""What a command may replace: its own results, and nobody else's."""

from __future__ import annotations

from pathlib import Path
from typing import Any


def check_own_results(out: Path, command: str, *, contents: set[str]) -> None:
    """Refuse to replace a folder unless an earlier run of the same command made all of it."""
    from modeling.files.folders import folder_behind

    folder_behind(out)
    if not out.exists() or (out.is_dir() and not any(out.iterdir())):
        return
    foreign = "a file"
    if out.is_dir():
        marker = out / "provenance.json"
        maker = _object(marker).get("command") if marker.is_file() else None
        others = sorted({path.name for path in out.iterdir()} - contents)
        if maker == f"tactileq {command}" and not others:
            return
        foreign = f"a folder with other files in it ({(others or ['not made by this command'])[0]})"
    raise ValueError(
        f"expected a new folder or earlier results of tactileq {command} at {out}, got {foreign}; "
        "choose another folder with --out."
    )


def check_own_model(start: Path, command: str) -> None:
    """Refuse to put one command's model in the place of another's (full beside simplified).

    `start` is the model's path without its ending.
    """
    marker = Path(f"{start}_provenance.json")
    made = Path(f"{start}.json").exists() and marker.is_file()
    if made and _object(marker).get("command") != f"tactileq {command}":
        raise ValueError(
            f"expected a folder without models of another command, got {start}.json made by "
            f"{_object(marker).get('command')}; choose another folder with --out."
        )


def check_own_file(out: Path, command: str) -> Path:
    """Refuse to replace a file that is not the same command's; where its provenance goes."""
    marker = Path(f"{out}_provenance.json")
    maker = _object(marker).get("command") if marker.is_file() else None
    if out.exists() and maker != f"tactileq {command}":
        raise ValueError(
            f"expected a new file or an earlier result of tactileq {command} at {out}, got "
            "something else; choose another name."
        )
    return marker


def _object(marker: Path) -> dict[str, Any]:
    from modeling.files.documents import read_json_object

    return read_json_object(marker, advice="remove the file")
