"""Tables as text: one reader of their declared columns, one writer of TSV, numbers in cells."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path

from tactileq.modeling.errors import InputError, shortened, shown
from tactileq.modeling.files.columns import Column, Value, names
from tactileq.modeling.files.reading import read_text
from tactileq.modeling.files.writing import write_text

# A spreadsheet would calculate what begins so, whatever it names; a number or a lone dash stays.
_FORMULA = re.compile(r"'*(?:[=+@]|-(?!(?:(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|inf)?\Z))")

Row = dict[str, Value]


def guarded(cell: str) -> str:
    """A cell that spreadsheets do not read as a formula: with ' before a leading =, +, - or @.

    For tables that people open. Those that other programs compare with a description, as of BIDS,
    hold values as they are (docs/data.md).
    """
    return f"'{cell}" if _FORMULA.match(cell) else cell


def unguarded(cell: str) -> str:
    """A cell as it was before `guarded`."""
    return cell[1:] if cell.startswith("'") and _FORMULA.match(cell) else cell


# --- Written ---------------------------------------------------------------------------------


def write_table(
    path: str | Path, columns: Sequence[Column], rows: Iterable[Mapping[str, object]]
) -> None:
    """Write a TSV with a header line; cells must not hold tabs or line ends."""
    write_text(path, table_text(columns, rows))


def table_text(
    columns: Sequence[Column], rows: Iterable[Mapping[str, object]], *, missing: str = "n/a"
) -> str:
    """The text of a TSV, as `write_table` writes it: true or false, all digits of a number.

    Parameters
    ----------
    rows : iterable of mapping
        The values by column; `guarded`.
    missing : str
        What stands where a row has none.
    """
    lines = ["\t".join(names(columns))]
    for row in rows:
        cells = [_cell(row.get(column.name), missing) for column in columns]
        if any(c in cell for cell in cells for c in "\t\r\n"):
            raise InputError(f"expected cells without tabs and line ends, got {cells}; rename.")
        lines.append("\t".join(cells))
    return "\n".join(lines) + "\n"


def _cell(value: object, missing: str) -> str:
    if value is None:
        return missing
    return str(value).lower() if isinstance(value, bool) else guarded(str(value))


# --- Read ------------------------------------------------------------------------------------


def read_table(
    path: str | Path,
    columns: Sequence[Column],
    *,
    what: str = "a table",
    bids: bool = False,
    only: bool = False,
    advice: str = "correct it",
) -> list[Row]:
    """Rows of a table by column name: numbers, text, None where there is no value.

    Columns that are not declared stay text.

    Parameters
    ----------
    columns : sequence of Column
        An optional one that the table does not have is None in each row.
    what : str
        What the file is, for messages.
    bids : bool
        Cells may be quoted as in CSV, hold values as they are, and every line is a row; else they
        are `guarded`, and lines that are empty or begin with # are none.
    only : bool
        Whether columns that are not declared are refused; else those that are nearly an optional
        one that is not there, which would be ignored silently.
    advice : str
        What to do about a damaged row.

    Raises
    ------
    InputError
        If the file cannot be read, is empty, lacks a column, names one twice or a misspelt one, or
        a row has another number of cells than the header, or a cell that its column does not hold.
    """
    return [
        typed(cells, columns, where, advice=advice)
        for where, cells in read_cells(
            path,
            columns,
            what=what,
            bids=bids,
            only=only,
            advice=advice,
        )
    ]


def typed(
    cells: Mapping[str, str], columns: Sequence[Column], where: str, *, advice: str = "correct it"
) -> Row:
    """The values of a row's cells; InputError, naming column and `where`, for one that is none."""
    row: Row = {name: cell if cell != "n/a" else None for name, cell in cells.items()}
    for column in columns:
        given = column.name in cells or not column.optional
        text = cells.get(column.name, "")
        row[column.name] = column.read(text, where, advice=advice) if given else None
    return row


def read_cells(
    path: str | Path,
    columns: Sequence[Column],
    *,
    what: str = "a table",
    bids: bool = False,
    only: bool = False,
    advice: str = "correct it",
) -> list[tuple[str, dict[str, str]]]:
    """As `read_table`, but each row is text, with its place: where rows are checked one by one."""
    source = Path(path)
    text = read_text(source, what)
    if not text:
        raise InputError(f"expected {what} in {source}, got an empty file; restore it from a copy.")
    # Not splitlines(): that would also break cells at characters that may stand in them.
    lines = [
        (f"line {number} of {source}", line)
        for number, line in enumerate(text.removesuffix("\n").split("\n"), start=1)
        if bids or (line.strip() and not line.startswith("#"))
    ]
    split_lines = [(w, csv_cells(line, w) if bids else line.split("\t")) for w, line in lines]
    header = split_lines[0][1] if split_lines else []
    check_header(header, columns, source, only=only)
    for where, cells in split_lines[1:]:
        if len(cells) != len(header):
            raise InputError(
                f"expected {len(header)} cells in {where}, got {len(cells)}; {advice}, since the "
                f"table is damaged or not separated by tabs."
            )
    value = str if bids else unguarded
    return [
        (where, dict(zip(header, map(value, cells), strict=True)))
        for where, cells in split_lines[1:]
    ]


def check_header(
    header: Sequence[str], columns: Sequence[Column], source: Path, *, only: bool
) -> None:
    """Refuse columns that are missing, doubled, or not known: those would be ignored silently."""
    missing = [c.name for c in columns if c.name not in header and not c.optional]
    if missing:
        several = "what is missing" if len(missing) > 3 else ", ".join(missing)
        needed = ", ".join(c.name for c in columns if not c.optional)
        raise InputError(
            f"expected the columns {needed} in {source}, got "
            f"{shortened(', '.join(header)) or 'an empty file'}; add {several}."
        )
    for name in header:
        if header.count(name) > 1:
            raise InputError(
                f"expected each column once in {source}, got {shown(name)} twice; rename one."
            )
        absent = [c.name for c in columns if c.name not in header]
        near = get_close_matches(name, absent, n=1, cutoff=0.6 if only else 0.7)
        if name not in names(columns) and (only or near):
            advice = f"rename it to {near[0]!r} or remove it" if near else "remove it"
            raise InputError(
                f"expected columns among {', '.join(names(columns))} in {source}, got "
                f"{shown(name)}; {advice}."
            )


def csv_cells(line: str, where: str) -> list[str]:
    """The cells of one line that are separated by tabs and may be quoted.

    Line by line, since a quote that nobody closed would swallow all lines up to the next one.

    Parameters
    ----------
    where : str
        Which line, for the message.

    Raises
    ------
    InputError
        For a quote that is not closed, or within a cell.
    """
    if '"' not in line:
        return line.split("\t")
    try:
        return next(csv.reader([line], delimiter="\t", strict=True))
    except csv.Error:
        raise InputError(
            f"expected quotes only around whole cells in {where}, got {shown(line)}; close or "
            "remove the quote."
        ) from None
