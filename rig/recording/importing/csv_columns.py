"""Columns of a CSV file: read in any usual encoding, and what each of them is.

docs/method/recordings.md#three-axes
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Literal

import numpy as np

from tactileq.modeling import InputError
from tactileq.modeling.arrays import Floats
from tactileq.modeling.errors import counted, shortened, shown
from tactileq.modeling.files.columns import number_in
from tactileq.modeling.files.reading import read_bytes
from tactileq.modeling.files.tables import csv_cells
from tactileq.rig.recording.importing.headers import TIME_NAMES as _TIME_NAMES
from tactileq.rig.recording.importing.headers import is_acceleration
from tactileq.rig.recording.importing.headers import name_and_unit as _name_and_unit
from tactileq.rig.recording.importing.headers import role as _role
from tactileq.rig.recording.importing.times import TimeColumn, since_first, unwrapped

Axis = Literal["x", "y", "z", "dft321"]
ROLES = ("time", "x", "y", "z")
_UNIT_ALONE = re.compile(r"\s*[\[(][^\])]*[\])]\s*")  # a line below the header: (ms),(V)


def parse_columns(text: str) -> dict[str, str]:
    """Which column is which: `time=Zeit,z=Beschl_Z`.

    Raises
    ------
    InputError
        For anything else than time, x, y and z, each with a column of its own.
    """
    found: dict[str, str] = {}
    for part in text.split(","):
        role, equals, column = (piece.strip() for piece in part.partition("="))
        if role not in ROLES or not (equals and column) or role in found:
            raise InputError(
                f"expected {', '.join(ROLES)}, each once, with = and a column, got {shown(part)}; "
                "write --map time=Zeit,z=Beschl_Z."
            )
        found[role] = column
    return found


def read_lines(path: Path) -> tuple[list[str], bool]:
    """Lines that are neither empty nor comments, and whether the last one has its end."""
    text = _decoded(path)
    if text.startswith("LabVIEW Measurement"):
        raise InputError(
            f"expected a CSV file with a header line, got a LabVIEW measurement file (LVM) at "
            f"{path}; save it as CSV, or remove all lines above the one that begins with X_Value "
            "and give --map time=X_Value,x= and the column of the axis."
        )
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    if len(lines) < 2:
        raise InputError(
            f"expected a header and rows of numbers in {path.name}, got "
            f"{counted(len(lines), 'line')}; "
            "export or record it again."
        )
    return lines, text.endswith(("\n", "\r"))


def _check_last_row(path: Path, row: Sequence[str], header: Sequence[str]) -> str:
    """Refuse a row without a line end that is not whole; else a warning that it may not be."""
    if len(row) != len(header) or number_in(row[-1].replace(",", ".")) is None:
        raise InputError(
            f"expected {path.name} to end with a whole row, got {shown(','.join(row))} without a "
            "line end; the file is truncated, export or record it again."
        )
    return (
        f"{path.name}: has no line end after its last row, so its last number, "
        f"{shortened(row[-1])}, may be cut short; if so, export or record it again."
    )


def _decoded(path: Path) -> str:
    """The text of a file in UTF-8, UTF-16 with its mark, or the Western code page."""
    data = read_bytes(path, "a CSV file")
    marked = data.startswith((b"\xff\xfe", b"\xfe\xff"))
    for encoding in ("utf-16",) if marked else ("utf-8-sig", "cp1252"):
        try:
            text = data.decode(encoding)
        except UnicodeDecodeError:
            continue
        if "\0" not in text:
            return text
    raise InputError(f"expected a text file, got other bytes in {path}; export CSV.")


def read_columns(path: Path, named: Mapping[str, str]) -> tuple[dict[str, Floats], tuple[str, ...]]:
    """Columns of numbers by their header, and what to be warned of.

    Those that are named have the header of their role, and no other one has it. Times since 1970
    have the unit that they are in.
    """
    lines, ended = read_lines(path)
    delimiter = max(",;\t", key=lines[0].count)
    rows = [
        csv_cells(line, f"line {number} of {path.name}", delimiter=delimiter)
        for number, line in enumerate(lines, start=1)
    ]
    header = [cell.strip() for cell in rows[0]]
    if len(rows) > 2 and all(_UNIT_ALONE.fullmatch(cell) for cell in rows[1]):
        header = [f"{name} {unit.strip()}" for name, unit in zip(header, rows.pop(1), strict=False)]
    if all(number_in(cell) is not None for cell in header):
        raise InputError(
            f"expected a header line in {path.name} (time,x,y,z), got numbers; add one."
        )
    if len(set(header)) < len(header):
        raise InputError(
            f"expected each column name once in {path.name}, got "
            f"{shortened(', '.join(header))}; rename."
        )
    warnings = () if ended else (_check_last_row(path, rows[-1], header),)
    for line, row in enumerate(rows[1:], start=2):
        if len(row) != len(header):
            raise InputError(
                f"expected {len(header)} values in line {line} of {path.name}, got {len(row)}; "
                "the file is truncated or damaged, export or record it again."
            )
    if delimiter == ";":
        rows = [[c if "." in c else c.replace(",", ".") for c in row] for row in rows]
    try:
        values = np.array(rows[1:], dtype=np.float64)
    except ValueError:
        other = next((cell for row in rows[1:] for cell in row if number_in(cell) is None), "text")
        raise InputError(
            f"expected numbers below the header of {path.name}, got {shown(other)}; correct the "
            "file."
        ) from None
    columns = {}
    for place, name in enumerate(_roles(path, header, named)):
        if name is not None:
            note, column = name, values[:, place]
            kind, unit = _name_and_unit(name)
            if kind in _TIME_NAMES:
                column, since_1970 = since_first(column, [row[place] for row in rows[1:]])
                note = f"{name} ({since_1970})" if since_1970 and not unit else name
            columns[note] = column
    return columns, warnings


def _roles(path: Path, header: Sequence[str], named: Mapping[str, str]) -> list[str | None]:
    """The header with the roles that columns are given; None for one that a role replaces."""
    roles: list[str | None] = [None if named and _role(name) in named else name for name in header]
    for role, wanted in named.items():
        same = [name for name in header if name == wanted] or [
            name for name in header if _name_and_unit(name)[0] == _name_and_unit(wanted)[0]
        ]
        if len(same) != 1:
            raise InputError(
                f"expected a column {shown(wanted)} in {path.name}, got "
                f"{shortened(', '.join(header), longest=120)}; correct --map or --time-column."
            )
        unit = _name_and_unit(same[0])[1]
        roles[header.index(same[0])] = f"{role} ({unit})" if unit else role
    return roles


def _times_in(columns: Mapping[str, Floats]) -> list[str]:
    return [name for name in columns if _role(name) == "time"]


def time_column(path: Path, columns: Mapping[str, Floats]) -> TimeColumn | None:
    """The first column of times that gives a rate, else in its longest part, else the first one."""
    every = [
        TimeColumn(path.name, name, _name_and_unit(name)[1], unwrapped(columns[name]))
        for name in _times_in(columns)
    ]
    whole = [time for time in every if time.has_a_rate()]
    in_part = [time for time in every if time.without_gaps(None)[1]]
    return next(iter((*whole, *in_part, *every)), None)


def chosen_axes(path: Path, columns: dict[str, Floats], axis: Axis | None) -> tuple[Floats, str]:
    """The chosen axis (1, n), or all three (3, n), as recorded, and the unit in their header."""
    times = _times_in(columns)
    others = [name for name in columns if name not in times]
    accelerations = [name for name in others if is_acceleration(name)]
    if len(accelerations) == 1 and not any(map(_role, {*others} - {*accelerations})):
        others = accelerations if axis is None else others
    if axis is None and len(others) != 1:
        raise InputError(
            f"expected --axis x, y, z or dft321 for {path.name}, got none and the columns "
            f"{shortened(', '.join(others), longest=120)}; choose an axis."
        )
    chosen = others if axis is None else _names_of_axes(path, others, axis)
    units = {_name_and_unit(name)[1] for name in chosen}
    if len(units) > 1:
        raise InputError(
            f"expected one unit for all axes of {path.name}, got "
            f"{shortened(' and '.join(sorted(units)))}; "
            "convert them."
        )
    samples = np.array([columns[name] for name in chosen])
    if not np.isfinite(samples).all():
        raise InputError(
            f"expected finite samples in {path.name}, got NaN or inf; repair or record again."
        )
    return samples, units.pop()


def only_axis_of(named: Mapping[str, str]) -> Axis | None:
    """The axis whose column was named, where it is one: the others are other channels."""
    axes = [axis for axis in AXES if axis in named]
    return axes[0] if len(axes) == 1 else None


def _names_of_axes(path: Path, names: Sequence[str], axis: Axis) -> list[str]:
    """The columns of the axis, or of all three."""
    letters = {name: letter for name in names if (letter := _role(name)) in ("x", "y", "z")}
    wanted = "xyz" if axis == "dft321" else axis
    chosen = [name for letter in wanted for name in letters if letters[name] == letter]
    if [letters[name] for name in chosen] != list(wanted):
        raise InputError(
            f"expected columns named {', '.join(wanted)} (each once) in {path.name}, got "
            f"{shortened(', '.join(names), longest=120)}; rename them, choose another axis, or "
            "leave --axis out where "
            "there is only one."
        )
    return chosen


AXES: tuple[Axis, ...] = ("x", "y", "z", "dft321")
