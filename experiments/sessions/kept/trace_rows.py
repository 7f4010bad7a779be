"""The rows of a session's traces, line by line; a damaged line is named and skipped."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from tactileq.experiments.sessions.kept.traces import (
    HAND_COLUMNS,
    PRESENTATION_COLUMNS,
    WALL_COLUMNS,
)
from tactileq.modeling import InputError
from tactileq.modeling.errors import counted
from tactileq.modeling.files.columns import Column, Columns, names
from tactileq.modeling.files.reading import read_bytes
from tactileq.modeling.files.tables import unguarded

_WHOLE = r"\d{1,9}"
# As `tables.cell` writes them: ten digits; no more than a floating-point number can have.
_NUMBER = r"-?\d{1,20}(?:\.\d{1,20})?(?:e-\d{1,3}|e\+\d{1,2})?"


@dataclass(frozen=True, kw_only=True)
class TraceRows:
    """The rows of one table that can be read.

    Parameters
    ----------
    rows : list of bytes
        Lines of cells, whole and as sessions write them.
    lines : list of int
        In which line of the file each one stands.
    damaged : tuple of str
        What cannot be read, by line and file; empty where all can.
    """

    rows: Sequence[bytes] = ()
    lines: Sequence[int] = ()
    damaged: tuple[str, ...] = ()


def hand_rows(path: Path, *, runs: Collection[int]) -> TraceRows:
    """The readings of the hand in these starts of the session; none where there is no file.

    The cells of HAND_COLUMNS; what a session on a force device has behind them is checked, too.
    """
    found = _rows(path, HAND_COLUMNS, runs=runs, further=WALL_COLUMNS)
    usual = len(HAND_COLUMNS)
    return replace(found, rows=[b"\t".join(row.split(b"\t", usual)[:usual]) for row in found.rows])


def presentation_rows(
    path: Path, *, runs: Collection[int]
) -> tuple[list[dict[str, str]], tuple[str, ...]]:
    """The presentations in these starts of the session as text, and what is damaged."""
    found = _rows(path, PRESENTATION_COLUMNS, runs=runs)
    cells = (row.decode("utf-8", "replace").split("\t") for row in found.rows)
    header = names(PRESENTATION_COLUMNS)
    shown = (map(unguarded, row) if "'" in "".join(row) else row for row in cells)
    return [dict(zip(header, row, strict=True)) for row in shown], found.damaged


def _rows(
    path: Path, columns: Columns, *, runs: Collection[int], further: Columns = ()
) -> TraceRows:
    if not path.is_file():
        return TraceRows()
    try:
        data = read_bytes(path, "a table of a session")
    except InputError as error:
        return TraceRows(damaged=(str(error),))
    # What follows the last line end is of a process that was killed.
    lines = data.split(b"\n")[:-1]
    if not lines:
        return TraceRows()
    header, *others = lines
    if header == "\t".join(names((*columns, *further))).encode():
        columns = (*columns, *further)
    if header != "\t".join(names(columns)).encode():
        return TraceRows(damaged=(f"line 1 of {path.name}, without which no other can be read",))
    row = re.compile("\t".join(f"(?:{_cell(column)})" for column in columns).encode())
    known = {str(run).encode() for run in runs}
    fits = [(found := row.fullmatch(line)) is not None and found[1] in known for line in others]
    numbers = range(2, len(others) + 2)
    wrong = [number for number, fit in zip(numbers, fits, strict=True) if not fit]
    return TraceRows(
        rows=[line for line, fit in zip(others, fits, strict=True) if fit],
        lines=[number for number, fit in zip(numbers, fits, strict=True) if fit],
        damaged=(_lines_of(wrong, path),) if wrong else (),
    )


def _cell(column: Column) -> str:
    """What its cells look like; a table of readings is too long to read them one by one."""
    if column.limits is None:
        return "|".join(map(re.escape, column.levels)) or r"[^\t]*"
    if column.whole:
        return rf"({_WHOLE})"
    return _NUMBER if column.required else rf"{_NUMBER}|n/a"


def _lines_of(lines: Sequence[int], path: Path) -> str:
    more = len(lines) - 1
    others = f" and {counted(more, 'more line')}" if more else ""
    return f"line {lines[0]}{others} of {path.name}"
