"""A log of another program: which of its columns are times and axes, and what they hold.

Only these columns have to be numbers with names of their own; whatever else a logger writes beside
them is left alone. docs/method/recordings.md#three-axes
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Literal

import numpy as np

from tactileq.modeling import InputError
from tactileq.modeling.arrays import Floats
from tactileq.modeling.errors import shortened, shown
from tactileq.modeling.files.others.number_table import read_number_table
from tactileq.modeling.files.others.numbers import Style
from tactileq.modeling.files.others.roles import parse_roles
from tactileq.modeling.files.others.table import OtherTable, left_out_sentence, number_of
from tactileq.rig.recording.importing.headers import (
    TIME_NAMES,
    is_acceleration,
    known_unit,
    name_and_unit,
    overrange,
    role,
)
from tactileq.rig.recording.importing.times import (
    RATE_TOLERANCE,
    TimeColumn,
    since_first,
    unwrapped,
)

Axis = Literal["x", "y", "z", "dft321"]
AXES: tuple[Axis, ...] = ("x", "y", "z", "dft321")
ROLES = ("time", "x", "y", "z")
MOST_CHANNELS = 12
# Words of headers that are of no acceleration: not taken unless they are named.
_OTHERS = re.compile(
    r"gyro|mag|g[xyz]\b|temp|weight|mass|load|force|press|humid|pos|veloc|speed|angle|volume"
)
EXAMPLE = "time=Zeit,z=Beschl_Z"
_IN_BRACKETS = re.compile(r"[\[(][^\])]*[\])]")


def parse_columns(texts: str | Sequence[str]) -> dict[str, str]:
    """Which column is which: `time=Zeit,z=Beschl_Z`, or the path of a TOML file with these keys.

    Raises
    ------
    InputError
        For anything else than time, x, y and z, each with a column of its own.
    """
    given = [texts] if isinstance(texts, str) else texts
    found = parse_roles(given, roles=ROLES, example=EXAMPLE)
    if found.where or found.right:
        raise InputError(
            f"expected {', '.join(ROLES)} in the map of a recording, got where or right; remove "
            "them, since each line is a sample."
        )
    named = {name: columns[0] for name, columns in found.columns.items()}
    if len(set(named.values())) < len(named):
        raise InputError(
            f"expected each column once in the map, got {shown(', '.join(named.values()))}; "
            f"write it like {EXAMPLE}."
        )
    return named | ({"decimal": found.decimal} if found.decimal else {})


@dataclass(frozen=True, eq=False)
class CsvLog:
    """What is taken from a log.

    Parameters
    ----------
    time : TimeColumn or None
        None where the log has no times.
    axes : (k, n) ndarray
        The chosen axis, or all three, in `unit`.
    unit : str
        As the headers of the axes name it; empty where they name none.
    names : tuple of str
        Of all columns.
    warnings : tuple of str
        What was left out or is doubtful.
    """

    time: TimeColumn | None
    axes: Floats
    unit: str
    names: tuple[str, ...]
    warnings: tuple[str, ...]


def read_log(path: Path, named: Mapping[str, str], axis: Axis | None) -> CsvLog:
    """Times and axes of a CSV file.

    Columns that are named have the header of their role, and no other one has it.

    Parameters
    ----------
    named : mapping of str to str
        Columns by role, where their headers do not say it: by name, or by number (#3); and the
        sign as `decimal`, where the numbers do not show it.
    axis : {"x", "y", "z", "dft321"}, optional
        Needed where there are several.

    Raises
    ------
    InputError
        For a column that is not there or is not sound, and units that differ.
    """
    columns = {name: wanted for name, wanted in named.items() if name != "decimal"}
    table = read_number_table(path, "a CSV file", wanted=tuple(columns.values()), is_unit=_is_unit)
    table = replace(table, decimal=named.get("decimal", ""))
    headers = _headers(table, columns)
    times = [place for place, name in headers.items() if role(name) == "time"]
    clocks = [place for place in times if place not in table.numeric]
    times = [place for place in times if place in table.numeric]
    axes = _axes(
        path, {p: n for p, n in headers.items() if p not in (*times, *clocks)}, table, axis
    )
    units = {name_and_unit(headers[place])[1] for place in axes}
    if len(units) > 1:
        raise InputError(
            f"expected one unit for all axes of {path.name}, got "
            f"{shortened(' and '.join(sorted(units)))}; convert them."
        )
    is_found = axis is None and len({*table.numeric} & {*headers} - {*times}) > 1
    only = headers[axes[0]] if is_found else ""
    style = table.numbers([f"#{place + 1}" for place in (*times, *axes)])
    samples = np.array([_samples(table, place, style) for place in axes])
    every = [_time(table, place, headers[place], style) for place in times]
    if not any(4 * time.repeats < len(table.lines) for time in every):
        _check_one_channel(table)
    return CsvLog(
        _best(every),
        samples,
        units.pop(),
        tuple(headers.values()),
        tuple(
            _warnings(table, taken={*times, *axes}, clocks=[headers[c] for c in clocks], only=only)
        ),
    )


def _is_unit(cell: str) -> bool:
    return known_unit(cell) is not None or _IN_BRACKETS.fullmatch(cell) is not None


def _headers(table: OtherTable, named: Mapping[str, str]) -> dict[int, str]:
    """Header of each column with the role that it is given; without those that these replace."""
    places: dict[int, str] = {}
    for name, wanted in named.items():
        place = _place(table, wanted)
        if place in places:
            raise InputError(
                f"expected each column once in the map, got {shown(wanted)} of {table.path.name} "
                f"as {places[place]} and as {name}; correct --map."
            )
        places[place] = name
    headers: dict[int, str] = {}
    for place, header in enumerate(table.names):
        if place in places:
            unit = name_and_unit(header)[1]
            headers[place] = f"{places[place]} ({unit})" if unit else places[place]
        elif header and not (named and role(header) in named):
            headers[place] = header
    return headers


def _place(table: OtherTable, wanted: str) -> int:
    """Where a column is: by its header, or by its header without the unit."""
    name = name_and_unit(wanted)[0]
    same = [i for i, header in enumerate(table.names) if name_and_unit(header)[0] == name]
    if wanted not in table.names and not number_of(wanted) and len(same) == 1:
        return same[0]
    return table.place(wanted)


def _axes(
    path: Path, headers: Mapping[int, str], table: OtherTable, axis: Axis | None
) -> list[int]:
    """Where the chosen axis is, or all three."""
    if axis is not None:
        return _places_of(path, headers, axis)
    numeric = {place: name for place, name in headers.items() if place in table.numeric}
    others = [place for place, name in numeric.items() if _OTHERS.search(name.casefold())]
    accelerations = [p for p, name in numeric.items() if is_acceleration(name) and p not in others]
    if len(accelerations) == 1 and not any(
        role(name) for place, name in numeric.items() if place not in accelerations
    ):
        return accelerations
    if not numeric:
        raise InputError(
            f"expected a column of numbers beside the times in {path.name}, got none; name one "
            "with --map, or correct its cells."
        )
    if len(numeric) != 1:
        raise InputError(
            f"expected --axis x, y, z or dft321 for {path.name}, got none and the columns "
            f"{shortened(', '.join(numeric.values()), longest=120)}; choose an axis."
        )
    [(place, name)] = numeric.items()
    if place in others:
        raise InputError(
            f"expected a column of acceleration in {path.name}, got only {shown(name)}; name it "
            "with --map if it is one."
        )
    return [place]


def _places_of(path: Path, headers: Mapping[int, str], axis: Axis) -> list[int]:
    letters = {place: role(name) for place, name in headers.items()}
    wanted = "xyz" if axis == "dft321" else axis
    chosen = [place for letter in wanted for place, own in letters.items() if own == letter]
    if [letters[place] for place in chosen] != list(wanted):
        raise InputError(
            f"expected columns named {', '.join(wanted)} (each once) in {path.name}, got "
            f"{shortened(', '.join(headers.values()), longest=120)}; name them with --map, choose "
            "another axis, or leave --axis out where there is only one."
        )
    return chosen


def _samples(table: OtherTable, place: int, style: Style) -> Floats:
    """A column of samples, in which no number is missing."""
    name, fits = table.names[place], style.pattern.fullmatch
    for line in table.lines:
        if not fits(line.cells[place]) and overrange(line.cells[place]):
            raise InputError(
                f"expected samples within the range of the sensor in {table.where(line)}, got "
                f"{shown(line.cells[place])} in column {shown(name)}; record again with a wider "
                "range."
            )
    values = table.floats(f"#{place + 1}", style)
    for row in np.flatnonzero(np.isnan(values))[:1].tolist():
        line = table.lines[row]
        raise InputError(
            f"expected a number in column {shown(name)} of {table.where(line)}, got "
            f"{shown(line.cells[place]) if line.cells[place] else 'nothing'}; repair the file or "
            "record again."
        )
    return values


def _time(table: OtherTable, place: int, header: str, style: Style) -> TimeColumn:
    values = table.floats(f"#{place + 1}", style)
    unit = name_and_unit(header)[1]
    if name_and_unit(header)[0] in TIME_NAMES:
        values, since_1970 = since_first(values, [line.cells[place] for line in table.lines])
        unit = unit or since_1970
    return TimeColumn(table.path.name, header, unit, unwrapped(values))


def _best(every: Sequence[TimeColumn]) -> TimeColumn | None:
    """The finest column of times that gives a rate, else in its longest part, else the first one.

    Raises
    ------
    InputError
        If two give rates that differ: the log may hold two tables.
    """
    whole = sorted((time for time in every if time.has_a_rate()), key=lambda time: time.repeats)
    for other in whole[1:]:
        ratio = other.rate_hz() / whole[0].rate_hz()
        if not other.repeats and abs(ratio - 1) > RATE_TOLERANCE:
            raise InputError(
                f"expected one rate in {other.file}, got {whole[0].rate_hz():.6g} Hz by "
                f"{shown(whole[0].name)} and {other.rate_hz():.6g} Hz by {shown(other.name)}; name "
                "the right one with --time-column."
            )
    in_part = (time for time in every if time.without_gaps(None)[1])
    return whole[0] if whole else next(in_part, next(iter(every), None))


def _check_one_channel(table: OtherTable) -> None:
    """Refuse a log in long format, where a text says of which channel each row is.

    There times repeat, or there are none.
    """
    rows = len(table.lines)
    for place, name in enumerate(table.names):
        if not name or place in table.numeric:
            continue
        cells = [line.cells[place] for line in table.lines if line.cells[place]]
        changes = sum(a != b for a, b in pairwise(cells))
        if 2 <= len(set(cells)) <= MOST_CHANNELS and changes > rows / 4:
            kinds = shortened(", ".join(sorted(set(cells))))
            raise InputError(
                f"expected rows of one channel in {table.path.name}, got {kinds} in turn in column "
                f"{shown(name)}; export each channel as a column or a file of its own."
            )


def _warnings(table: OtherTable, *, taken: set[int], clocks: Sequence[str], only: str) -> list[str]:
    """What was left out, what was taken without being named, and a number that may be cut short."""
    name = table.path.name
    found = [
        *(f"{name}: {what}." for what in table.decided),
        *(
            f"{name}: {left_out_sentence(what, [f'line {n}' for n in numbers])}"
            for what, numbers in table.left_out.items()
            if numbers
        ),
    ]
    if only:
        found.append(f"{name}: its only acceleration, {shown(only)}, is taken.")
    if clocks:
        found.append(
            f"{name}: {shortened(', '.join(clocks))} is no column of numbers, and is not taken as "
            "times."
        )
    last = table.lines[-1].cells
    if not table.text.content.endswith("\n") and len(last) - 1 in taken:
        found.append(
            f"{name}: has no line end after its last row, so its last number, "
            f"{shortened(last[-1])}, may be cut short; if so, export or record it again."
        )
    return found


def only_axis_of(named: Mapping[str, str]) -> Axis | None:
    """The axis whose column was named, where it is one: the others are other channels."""
    axes = [axis for axis in AXES if axis in named]
    return axes[0] if len(axes) == 1 else None
