"""Logs of numbers: their header is above the longest run of rows of numbers.

docs/method/recordings.md#logs-of-other-programs
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import groupby, islice, zip_longest
from pathlib import Path

import numpy as np

from tactileq.modeling.errors import InputError, counted, shown
from tactileq.modeling.files.others.numbers import NO_NUMBER, fitting, is_number
from tactileq.modeling.files.others.rows import table_below
from tactileq.modeling.files.others.separators import Parsed, parsed_lines
from tactileq.modeling.files.others.splitting import TableLine, read_other_text
from tactileq.modeling.files.others.table import OtherTable, number_of, same_name

_MOST_ABOVE = 3  # lines of names between the rest of a row and the first row
_SAMPLED = 200  # lines of numbers by which columns of numbers are found
_BRACKETED = re.compile(r"[\[(](.*)[\])]")


def read_number_table(
    path: Path, what: str, *, wanted: Sequence[str] = (), is_unit: Callable[[str], bool]
) -> OtherTable:
    """A log of numbers: its header is above the longest run of rows of numbers.

    Parameters
    ----------
    what : str
        What the file is, with its article, for messages.
    wanted : sequence of str
        Columns by name, or by number (#3), which needs no header.
    is_unit : callable
        Whether a cell is a unit: a line of those between the names and the numbers belongs to them.

    Raises
    ------
    InputError
        If the file is no table, has several readings, or a row has another number of cells.
    """
    text = read_other_text(path, what)

    def header_in(lines: Sequence[TableLine]) -> int | None:
        run = _run_of_numbers(lines)
        if run is None:
            return None
        named = [place for place in range(run.start) if not _holds_numbers(lines[place])]
        return named[-1] if named else (None if run.start else 0)

    parsed = parsed_lines(text, path, header_in)
    lines, run = parsed.lines, _run_of_numbers(parsed.lines)
    if run is None:
        got = f"{counted(len(lines), 'line')} without rows of numbers" if lines else "an empty file"
        raise InputError(
            f"expected a header and rows of numbers in {path.name}, got {got}; export or record it "
            "again."
        )
    header, names = _names_above(lines[: run.start], run, wanted=wanted, is_unit=is_unit)
    _check_run(lines, run, path, begins=header.number if header else 0)
    if not names:
        if not any(map(number_of, wanted)):
            raise InputError(
                f"expected a header line in {path.name} (time,x,y,z), got numbers; add one, or "
                "give columns by number, as in --map time=#1,z=#2."
            )
        names = [f"#{i}" for i in range(1, run.width + 1)]
    first = TableLine(header.number if header else lines[run.start].number, names)
    rows = [first, *lines[run.start : run.stop]]
    table = table_below(Parsed(parsed.separator, rows), text, path)
    before = [line for line in lines[: run.start] if not line.cells[0].startswith("#")]
    above = [line.number for line in before if line.number < first.number]
    below = [line.number for line in lines[run.stop :]]
    left_out = {"stand above the header": above, "stand below the numbers": below}
    numeric = tuple(place for place in run.columns if place < len(table.names))
    return replace(table, left_out={**left_out, **table.left_out}, numeric=numeric)


def _is_word(cell: str) -> bool:
    return cell.replace(" ", "").rstrip(":").isalpha()


def _holds_numbers(line: TableLine) -> bool:
    """Whether most of its cells are numbers."""
    return 2 * sum(map(is_number, line.cells)) > line.width


@dataclass(frozen=True)
class _Run:
    """Rows of numbers: from `start` to before `stop`, their cells, and which hold numbers."""

    start: int
    stop: int
    width: int
    columns: tuple[int, ...]

    def holds(self, line: TableLine) -> bool:
        """Whether the columns of numbers hold numbers in this line, or nothing."""
        if len(line.cells) != self.width:
            return False
        cells = [line.cells[i] for i in self.columns]
        found = [is_number(cell) for cell in cells]
        return any(found) and all(
            number or cell.casefold() in NO_NUMBER
            for cell, number in zip(cells, found, strict=True)
        )


def _run_of_numbers(lines: Sequence[TableLine]) -> _Run | None:
    """The longest run of lines of one width, from its first row of numbers to its last one."""
    start = stop = 0
    for width, group in groupby(enumerate(lines), key=lambda item: len(item[1].cells)):
        places = [place for place, _ in group]
        if len(places) > stop - start:
            start, stop, most = places[0], places[-1] + 1, width
    if stop == start:
        return None
    sample = lines[start + max((stop - start) // 4, stop - start > 1) : stop]
    sample = sample[:: max(1, len(sample) // _SAMPLED)]
    shares = [np.mean([is_number(line.cells[i]) for line in sample]) for i in range(most)]
    columns = tuple(place for place, share in enumerate(shares) if share >= 0.5)
    run = _Run(start, stop, most, columns)
    if not columns or (most == 1 and not fitting([line.cells[0] for line in sample[-9:]])):
        return None  # 0.5,1.25 is no number, though it looks like one
    rows = list(islice((p for p in range(start, stop) if run.holds(lines[p])), 2))
    if not rows:
        return None
    if len(rows) > 1 and 1 < rows[1] - rows[0] <= _MOST_ABOVE:
        del rows[0]  # the rest of a row that was sent before the names were
    last = next(p for p in range(stop - 1, start - 1, -1) if run.holds(lines[p]))
    return replace(run, start=rows[0], stop=last + 1)


def _check_run(lines: Sequence[TableLine], run: _Run, path: Path, *, begins: int) -> None:
    """Refuse numbers outside of the run: a damaged line splits what was one.

    But for one line above that of names, whose number is `begins`: the rest of a row.
    """
    for line in lines[run.stop :]:
        if _is_word(line.cells[min(run.columns[0], len(line.cells) - 1)]):
            continue  # Mean,0.95: what sums the rows up is none of them
        inside = [line.cells[i] for i in run.columns if len(line.cells) == run.width]
        others = [cell for cell in inside if not is_number(cell)]
        if inside and not others:
            raise InputError(
                f"expected one run of rows of numbers in {path.name}, got more of them from line "
                f"{line.number} on; cut the file into one for each."
            )
        if inside and len(others) < len(inside):
            raise InputError(
                f"expected numbers in line {line.number} of {path.name}, got {shown(others[0])}; "
                "correct that cell, or remove the line if it is no row."
            )
        if any(map(is_number, line.cells)):
            raise _damaged(line, run, path)
    holding = [
        place
        for place, line in enumerate(lines[: run.start])
        if run.holds(line) or sum(map(is_number, line.cells)) > max(1, run.width // 2)
    ]
    if len(holding) > 1 or (holding and lines[holding[0]].number > begins):
        after = lines[holding[0] : run.start]
        other = next((line for line in after if not run.holds(line)), after[0])
        raise _damaged(other, run, path)


def _damaged(line: TableLine, run: _Run, path: Path) -> InputError:
    got = str(len(line.cells)) if len(line.cells) != run.width else shown(line.cells[0])
    return InputError(
        f"expected {counted(run.width, 'value')} in line {line.number} of {path.name}, got {got}; "
        "the file is truncated or damaged, export or record it again, or cut it there."
    )


def _names_above(
    lines: Sequence[TableLine], run: _Run, *, wanted: Sequence[str], is_unit: Callable[[str], bool]
) -> tuple[TableLine | None, list[str]]:
    """The line of names above the numbers, its names with the units below it.

    A line that begins with # is one of names only where there is no other.
    """
    named = {same_name(name) for name in wanted if number_of(name) is None}
    plain = [line for line in lines if not line.cells[0].startswith("#")] or [
        replace(line, cells=_without_mark(line.cells, run.width)) for line in lines
    ]
    plain = [line for line in plain if not _holds_numbers(line)]
    by_number = bool(wanted) and not named
    if not plain or (by_number and len(plain[-1].cells) != run.width):
        return None, []
    fits = [line for line in plain if named and named <= set(map(same_name, line.cells))]
    units = _units(plain, fits, is_unit=is_unit)
    above = plain[:-1] if units else plain
    alike = len(above) > 1 and above[-1].width > 1 and len(set(above[-1].cells)) == 1
    header = fits[-1] if fits else above[-2 if alike else -1]
    with_units = [
        f"{name} ({_bare(unit)})" if unit else name
        for name, unit in zip_longest(header.cells[: header.width], units, fillvalue="")
    ]
    return header, with_units


def _without_mark(cells: Sequence[str], width: int) -> list[str]:
    """Cells without the # that begins their line, and without its cell where it has its own."""
    first = cells[0].lstrip("# ")
    return [first, *cells[1:]] if first or len(cells) <= width else list(cells[1:])


def _bare(unit: str) -> str:
    """A unit without brackets around it."""
    found = _BRACKETED.fullmatch(unit)
    return found[1] if found else unit


def _units(
    lines: Sequence[TableLine], fits: Sequence[TableLine], *, is_unit: Callable[[str], bool]
) -> list[str]:
    """The cells of a last line of units below one of names; none where there is no such line."""
    if len(lines) < 2 or lines[-1] in fits:
        return []
    cells = [cell for cell in lines[-1].cells if cell]
    known = sum(map(is_unit, cells))
    before = lines[-2]
    if lines[-2] in fits or before.width >= lines[-1].width:
        has_numbers = lines[-2] not in fits and any(map(is_number, before.cells))
        return list(lines[-1].cells) if known and not has_numbers else []
    return []
