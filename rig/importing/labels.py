"""Labels of recordings that other equipment made: surface, speed, force, from a table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from modeling import InputError
from modeling.files.tables import check_columns, number, read_table, whole_number
from modeling.files.wav import full_scale

LABEL_COLUMNS = (
    *("file", "speed_mm_s", "force_n"),
    *("texture", "repeat", "g_per_fullscale", "channel"),
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
    rows: dict[str, dict[str, str]] = {}
    for row in read_table(table, LABEL_COLUMNS[:3]):
        check_columns(row, LABEL_COLUMNS, table)
        if row["file"] in rows:
            raise InputError(
                f"expected one row for {row['file']} in {table}, got several; remove the wrong one."
            )
        rows[row["file"]] = row
    fallback = texture or table.parent.resolve().name
    used, labels = set(), []
    for path in paths:
        if not (found := rows.get(path.name) or rows.get(str(path))):
            raise InputError(
                f"expected a row for {path.name} in {table}, got none; add its speed and force."
            )
        used.add(found["file"])
        labels.append(_label(path, found, texture=fallback))
    return labels, tuple(file for file in rows if file not in used)


def _label(path: Path, row: Mapping[str, str], *, texture: str) -> Label:
    scale, channel = row.get("g_per_fullscale"), row.get("channel")
    return Label(
        row.get("texture") or texture,
        number(row["speed_mm_s"], f"speed_mm_s of {path.name}"),
        number(row["force_n"], f"force_n of {path.name}"),
        whole_number(row.get("repeat") or "1", f"repeat of {path.name}"),
        full_scale(number(scale, f"g_per_fullscale of {path.name}"), path.name) if scale else None,
        whole_number(channel, f"channel of {path.name}") if channel else None,
    )
