"""A folder of recordings that is filled one after another: what it holds, and what is damaged."""

from __future__ import annotations

from pathlib import Path

from tactileq.modeling.errors import InputError
from tactileq.modeling.files.places import locked, matching
from tactileq.modeling.files.tables import write_table
from tactileq.modeling.models.grid import Condition
from tactileq.modeling.recordings.recording_set import (
    INDEX_COLUMNS,
    INDEX_NAME,
    listed,
    load_usable,
    stated,
)


def check_continues(folder: Path, *ours: str) -> None:
    """Refuse a folder that is neither new or empty, nor holds a recording set or one of `ours`."""
    if not folder.exists():
        return
    there = {path.name for path in matching(folder, "*")}
    if not folder.is_dir() or (there and not {INDEX_NAME, *ours} & there):
        raise InputError(
            f"expected a new folder, or one of recordings to go on with, got {folder}, which is "
            "something else; choose another name."
        )


def begin_index(folder: Path) -> str:
    """Make the folder a recording set, as yet of none, so that recordings can be added.

    Returns
    -------
    str
        The beginning of a sentence about recordings whose index is gone; else empty.
    """
    if (folder / INDEX_NAME).is_file():
        return ""
    lost = sorted(p.name for ending in ("wav", "csv") for p in folder.glob(f"[0-9]*.{ending}"))
    with locked(folder / INDEX_NAME) as index:
        write_table(index, INDEX_COLUMNS, [])
    if not lost:
        return ""
    where = f"{INDEX_NAME} beside {lost[0]} in {folder}"
    return f"expected {where}, got none, so no recording there counts"


def recorded_conditions(folder: Path, texture: str, repeat: int) -> set[Condition]:
    """Conditions of which the set holds this repeat."""
    if not (folder / INDEX_NAME).is_file():
        return set()
    rows = [stated(folder, cells) for cells in listed(folder) if cells["texture"] == texture]
    return {(row["speed_mm_s"], row["force_n"]) for row in rows if (row["repeat"] or 1) == repeat}


def unusable_recordings(folder: Path, texture: str) -> tuple[str, ...]:
    """A sentence for each recording of the texture that its index lists and nobody can read."""
    try:
        return load_usable(folder, texture=texture)[1]
    except InputError as error:
        return (str(error),)
