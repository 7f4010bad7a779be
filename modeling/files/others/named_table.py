"""Tables whose header is found by the names of the columns that are taken.

docs/method/tables.md#dialects
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from statistics import mode

from tactileq.modeling.errors import InputError, counted
from tactileq.modeling.files.others.numbers import is_number
from tactileq.modeling.files.others.rows import table_below
from tactileq.modeling.files.others.separators import Parsed, parsed_lines
from tactileq.modeling.files.others.splitting import TableLine, read_other_text
from tactileq.modeling.files.others.table import OtherTable, number_of, same_name


def read_other_table(
    path: Path,
    what: str,
    *,
    wanted: Sequence[str] = (),
    is_declared: bool = False,
) -> OtherTable:
    """A table of answers: its header is the first line that has all wanted names.

    Parameters
    ----------
    what : str
        What the file is, with its article, for messages.
    wanted : sequence of str
        Columns by name, or by number (#3): then a first line that is like those below it is one of
        them, and the table has no header.
    is_declared : bool
        Whether the columns are declared: then a header alone is a table, lines that begin with #
        are none, and each line has all cells.

    Raises
    ------
    InputError
        If the file is no table, has several readings, or is damaged.
    """
    text = read_other_text(path, what)
    named = [name for name in wanted if number_of(name) is None]

    def header_in(lines: Sequence[TableLine]) -> int | None:
        goal = set(map(same_name, named))
        usual = mode(len(line.cells) for line in lines) if lines and not named else 0
        for place, line in enumerate(lines):
            if goal <= set(map(same_name, line.cells)) and len(line.cells) >= usual:
                return place
        return None

    parsed = parsed_lines(text, path, header_in, comments=is_declared)
    lines, header = parsed.lines, parsed.header
    decided: tuple[str, ...] = ()
    if not named and wanted and lines:
        if _is_header(lines[header:], wanted):
            decided = (f"line {lines[header].number} is taken as names of columns",)
        else:
            width = len(lines[header].cells)
            first = TableLine(lines[header].number, [f"#{i}" for i in range(1, width + 1)])
            lines = [*lines[:header], first, *lines[header:]]
    if len(lines) - header < 2 - is_declared:
        raise InputError(
            f"expected {what} with a line of names and lines below it in {path}, got "
            f"{counted(len(lines), 'line')}; give a file that is not empty."
        )
    if is_declared:
        lines = _without_blank_ends(lines[header:])
        header = 0
        _check_whole(lines, path)
    table = table_below(Parsed(parsed.separator, lines, header), text, path, wanted=named)
    above = [line.number for line in lines[:header]]
    left_out = {"stand above the header": above, **table.left_out}
    return replace(table, left_out=left_out, decided=(*table.decided, *decided))


def _without_blank_ends(lines: Sequence[TableLine]) -> list[TableLine]:
    """Lines without blank cells beyond the last name."""
    width = lines[0].width
    return [
        replace(line, cells=line.cells[:width]) if line.width <= width < len(line.cells) else line
        for line in lines
    ]


def _check_whole(lines: Sequence[TableLine], path: Path) -> None:
    """Refuse lines that have another number of cells than the first one."""
    width = len(lines[0].cells)
    for line in lines[1:]:
        if len(line.cells) != width:
            raise InputError(
                f"expected {counted(width, 'cell')} in line {line.number} of {path}, got "
                f"{len(line.cells)}; correct it, since the table is damaged."
            )


def _is_header(lines: Sequence[TableLine], wanted: Sequence[str]) -> bool:
    """Whether the first line names columns: its cells are no numbers and do not occur again.

    But for the whole line, which joined tables hold again.
    """
    others = [line for line in lines[1:] if line.cells != lines[0].cells]
    for name in wanted:
        place = int(name[1:]) - 1
        cells = [line.cells[place] for line in (lines[0], *others) if place < len(line.cells)]
        if cells and (is_number(cells[0]) or cells[0] in cells[1:]):
            return False
    return True
