"""Labels of recordings that other equipment made: surface, speed, force, from a table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from unicodedata import normalize

from tactileq.modeling import InputError
from tactileq.modeling.files.columns import Column, chosen
from tactileq.modeling.files.others.declared import read_user_cells
from tactileq.modeling.files.tables import typed
from tactileq.modeling.recordings.recording_set import KNOWN_COLUMNS

LABEL_COLUMNS = (
    *chosen(KNOWN_COLUMNS, "file", "speed_mm_s", "force_n"),
    Column("texture", description="Name of the surface", optional=True),
    *chosen(KNOWN_COLUMNS, "repeat", "g_per_fullscale", "channel"),
)


@dataclass(frozen=True)
class Label:
    """What a file itself does not state: surface, speed (mm/s), force (N), which repetition.

    Of WAV files also the acceleration (g) of a full-scale sample, and the channel, from 1.
    """

    texture: str
    speed_mm_s: float
    force_n: float
    repeat: int = 1
    g_per_fullscale: float | None = None
    channel: int | None = None


def labels_from_table(
    table: Path, paths: Sequence[Path], *, texture: str | None
) -> tuple[list[Label], tuple[str, ...]]:
    """Labels by file name from a TSV with file, speed_mm_s, force_n (texture, repeat, …).

    Returns
    -------
    labels : list of Label
        One per path.
    unused : tuple of str
        The files of rows that belong to no path.

    Raises
    ------
    InputError
        For a column that is not known, a file that the table names not once, and cells that are no
        usable numbers.
    """
    rows: dict[str, tuple[str, dict[str, str]]] = {}
    for where, row in read_user_cells(table, LABEL_COLUMNS, "labels", only=True):
        typed(row, LABEL_COLUMNS[:1], where)  # others may be filled in later
        file = normalize("NFC", row["file"])  # macOS decomposes names of files
        if file in rows:
            raise InputError(
                f"expected one row for {row['file']} in {table}, got several; remove the wrong one."
            )
        rows[file] = where, row
    fallback = texture or table.parent.resolve().name
    used, labels = set(), []
    for path in paths:
        names = (normalize("NFC", path.name), normalize("NFC", str(path)))
        name = next((name for name in names if name in rows), "")
        if not name:
            raise InputError(
                f"expected a row for {path.name} in {table}, got none; add its speed and force."
            )
        where, row = rows[name]
        used.add(name)
        labels.append(_label(typed(row, LABEL_COLUMNS, where), texture=fallback))
    return labels, tuple(file for file in rows if file not in used)


def _label(row: Mapping[str, Any], *, texture: str) -> Label:
    return Label(
        normalize("NFC", row["texture"] or texture),
        row["speed_mm_s"],
        row["force_n"],
        row["repeat"] or 1,
        row["g_per_fullscale"],
        row["channel"],
    )
