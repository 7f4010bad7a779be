"""Which lines below a header are rows of a table, and which cell of them belongs to which column.

A cell too many tells a separator within a cell, one too few a line end: what would shift cells is
refused. docs/method/tables.md#dialects
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from tactileq.modeling.errors import InputError, counted, shown
from tactileq.modeling.files.others.numbers import is_number
from tactileq.modeling.files.others.separators import Parsed
from tactileq.modeling.files.others.splitting import TableLine, Text, check_spans
from tactileq.modeling.files.others.table import OtherTable, same_name

# In Qualtrics' third line; its second one holds the questions' texts.
_IMPORT_ID = re.compile(r"\{\s*['\"]importid")


def table_below(
    parsed: Parsed, text: Text, path: Path, *, wanted: Sequence[str] = ()
) -> OtherTable:
    """The table below a header, its lines as wide as this; what is no row is left out.

    Parameters
    ----------
    wanted : sequence of str
        Names of columns that are taken: a line that has these again is none.

    Raises
    ------
    InputError
        Naming the line in which a separator or a line end may stand in a cell.
    """
    separator, lines, header = parsed.separator, parsed.lines, parsed.header
    names, below = lines[header].cells, list(lines[header + 1 :])
    left_out: dict[str, list[int]] = {}
    if len(below) > 1 and any(_IMPORT_ID.match(cell.casefold()) for cell in below[1].cells):
        left_out["explain columns (Qualtrics)"] = [line.number for line in below[:2]]
        below = below[2:]
    again = [line for line in below if _repeats(line.cells, names, wanted, path, line.number)]
    if again:
        left_out["repeat the header"] = [line.number for line in again]
        numbers = set(left_out["repeat the header"])
        below = [line for line in below if line.number not in numbers]
    if len(names) > 1 and len(below) > 1 and _ends_table(below[-1], separator):
        left_out["end the table"] = [below.pop().number]
    check_spans(below, len(names), path)
    is_open = False
    decided: tuple[str, ...] = ()
    if below and all(len(line.cells) == len(names) + 1 for line in below):
        may_be_names = _may_be_row_names([line.cells[0] for line in below])
        # If the last column is taken, its cells are there, and the blank ones are beyond it.
        last_taken = same_name(names[-1]) in map(same_name, wanted)
        ends_blank = not any(line.cells[-1] for line in below)
        is_open = may_be_names and ends_blank and not last_taken
        if may_be_names and not ends_blank and separator in "\t " and len(below) > 1:
            names = ["", *names]
            decided = ("the first cell of each line is taken as the name of a row",)
    _check_lengths(below, names, path, separator=separator)
    full = [_full_line(line, len(names), path) for line in below]
    return OtherTable(
        path,
        tuple(names),
        full,
        separator,
        text,
        lines[header].number,
        left_out=left_out,
        has_open_row_names=is_open,
        decided=decided,
    )


def _repeats(
    cells: Sequence[str], names: Sequence[str], wanted: Sequence[str], path: Path, number: int
) -> bool:
    """Whether a line has the names of the header again, those that are taken at least.

    Refused where it has them in another order: what follows is another table.
    """
    begins = names[0] in cells[:2]  # or behind the name of a row
    if begins and _trimmed(names) in map(_trimmed, (cells, cells[1:])):
        return True
    if not wanted:
        return False
    goal = set(map(same_name, wanted))
    first = next((place for place, name in enumerate(names) if same_name(name) in goal), len(cells))
    if first >= len(cells) or same_name(cells[first]) not in goal:
        return False
    if not goal <= set(map(same_name, cells)):
        return False
    pairs = [(same_name(a), same_name(b)) for a, b in zip(names, cells, strict=False)]
    if any(a != b and a in goal for a, b in pairs):
        raise InputError(
            f"expected one table in {path}, got the names of columns again in line {number}, in "
            "another order; cut the file into one for each."
        )
    return True


def _trimmed(cells: Sequence[str]) -> list[str]:
    """Cells up to the last one that is not blank."""
    return list(cells[: TableLine(0, list(cells)).width])


def _may_be_row_names(cells: Sequence[str]) -> bool:
    """Whether cells are all different, and numbers only if they count the rows, as in R."""
    counted_up = [str(number) for number in range(1, len(cells) + 1)]
    return len(set(cells)) == len(cells) and (
        list(cells) == counted_up or not any(map(is_number, cells))
    )


def _check_lengths(
    lines: Sequence[TableLine], names: Sequence[str], path: Path, *, separator: str
) -> None:
    """Refuse lines of other lengths, unless the program leaves out blank cells at their ends.

    A cell too many, even a blank one, tells a separator within a cell; one too few, a line end.
    """
    lengths = [len(line.cells) for line in lines]
    most = max(lengths, default=0)
    short = [line for line in lines if len(line.cells) < most]
    ends_blank = any(len(line.cells) == most and not line.cells[-1] for line in lines)
    if most > len(names) and short:
        wrong = next(line for line in lines if len(line.cells) > len(names))
        raise InputError(
            f"expected {counted(len(names), 'cell')} in {path}, line {wrong.number}, as its header "
            f"has, got {len(wrong.cells)}; put cells that hold the separator in quotes, or name "
            "all columns."
        )
    if short and separator != " " and (ends_blank or short == list(lines[-1:])):
        raise InputError(
            f"expected {counted(most, 'cell')} in {path}, line {short[0].number}, as in other "
            f"lines, got {len(short[0].cells)}: either a line that was cut, or one that is no row; "
            "complete or remove it."
        )
    for place, name in enumerate(names):
        held = [line for line in lines if place < len(line.cells) and line.cells[place]]
        if place and not name and held:
            raise InputError(
                f"expected a name above each column in {path}, got none above "
                f"{shown(held[0].cells[place])} in line {held[0].number}; name it."
            )


def _ends_table(line: TableLine, separator: str) -> bool:
    """Whether a last line is no row: a word alone, or END OF FILE."""
    words = " ".join(filter(None, line.cells))
    is_word = len(line.cells) == 1 and not is_number(words) and not set("\t;,|") & set(words)
    return (is_word and separator != " ") or words.casefold() in ("end of file", "eof")


def _full_line(line: TableLine, width: int, path: Path) -> TableLine:
    """The line with as many cells as the header; spreadsheets add and drop empty ones."""
    if len(line.cells) == width:
        return line
    if line.width > width:
        raise InputError(
            f"expected {counted(width, 'cell')} in {path}, line {line.number}, as its header has, "
            f"got {line.width}; name all columns, or put cells that hold the separator in quotes."
        )
    cells = [*line.cells[:width], *[""] * (width - len(line.cells))]
    return replace(line, cells=cells, given=len(line.cells))
