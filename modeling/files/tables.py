"""Small tab-separated tables, and numbers in their cells."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Sequence
from difflib import get_close_matches
from pathlib import Path

from modeling.errors import InputError, shortened, shown
from modeling.files.reading import read_text
from modeling.files.writing import write_text

# A spreadsheet would calculate what begins so, whatever it names.
_FORMULA = re.compile(r"'*[=+@]")


def guarded(cell: str) -> str:
    """A cell that spreadsheets do not read as a formula: with ' before a leading =, + or @."""
    return f"'{cell}" if _FORMULA.match(cell) else cell


def unguarded(cell: str) -> str:
    """A cell as it was before `guarded`."""
    return cell[1:] if cell.startswith("'") and _FORMULA.match(cell) else cell


def write_table(path: str | Path, columns: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Write a TSV with a header line; cells must not hold tabs or line ends."""
    write_text(path, table_text(columns, rows))


def table_text(columns: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """The text of a TSV, as `write_table` writes it; see `guarded`."""
    lines = ["\t".join(columns)]
    for row in rows:
        cells = [guarded(str(cell)) for cell in row]
        if any(c in cell for cell in cells for c in "\t\r\n"):
            raise InputError(f"expected cells without tabs and line ends, got {cells}; rename.")
        lines.append("\t".join(cells))
    return "\n".join(lines) + "\n"


def read_table(path: str | Path, required: Sequence[str]) -> list[dict[str, str]]:
    """Rows of a TSV as dictionaries by column name; lines that begin with # are comments.

    Raises
    ------
    InputError
        If the file cannot be read, is empty, lacks a required column, names one twice, or a row
        has another number of cells than the header.
    """
    source = Path(path)
    text = read_text(source, "a table")
    # Not splitlines(): that would also break cells at characters that `write_table` allows.
    lines = [line for line in text.split("\n") if line.strip() and not line.startswith("#")]
    if not text:
        raise InputError(
            f"expected a table in {source}, got an empty file; restore it from a copy."
        )
    header = lines[0].split("\t") if lines else []
    missing = [name for name in required if name not in header]
    if missing:
        several = "what is missing" if len(missing) > 3 else ", ".join(missing)
        raise InputError(
            f"expected the columns {', '.join(required)} in {source}, got "
            f"{shortened(', '.join(header)) or 'an empty file'}; add {several} (tab-separated)."
        )
    check_named_once(header, source)
    rows = []
    for line in lines[1:]:
        cells = line.split("\t")
        if len(cells) != len(header):
            raise InputError(
                f"expected {len(header)} cells in each row of {source}, got {len(cells)} in "
                f"{shown(line)}; the table is damaged or not tab-separated."
            )
        rows.append(dict(zip(header, map(unguarded, cells), strict=True)))
    return rows


def check_columns(names: Iterable[str], known: Sequence[str], table: str | Path) -> None:
    """Refuse a column that is not known: a misspelt one would be ignored silently.

    Raises
    ------
    InputError
        Naming the column, the nearest known one, and all that are known.
    """
    for name in names:
        if name in known:
            continue
        near = get_close_matches(name, known, n=1)
        advice = f"rename it to {near[0]!r} or remove it" if near else "remove it"
        raise InputError(
            f"expected columns among {', '.join(known)} in {table}, got {shown(name)}; {advice}."
        )


def check_named_once(header: Sequence[str], source: Path) -> None:
    """Refuse a table with two columns of one name."""
    twice = [name for name in header if header.count(name) > 1]
    if twice:
        raise InputError(
            f"expected each column once in {source}, got {shown(twice[0])} twice; rename one."
        )


def csv_cells(line: str, where: str, *, delimiter: str = ",") -> list[str]:
    """The cells of one line of a CSV.

    Line by line, since a quote that nobody closed would swallow all lines up to the next one.

    Parameters
    ----------
    line : str
    where : str
        Which line, for the message.
    delimiter : str

    Raises
    ------
    InputError
        For a quote that is not closed, or within a cell.
    """
    if '"' not in line:
        return line.split(delimiter)
    try:
        return next(csv.reader([line], delimiter=delimiter, strict=True))
    except csv.Error:
        raise InputError(
            f"expected quotes only around whole cells in {where}, got {shown(line)}; close or "
            "remove the quote."
        ) from None


def is_number(text: str) -> bool:
    """Whether a text reads as a number."""
    try:
        float(text)
    except ValueError:
        return False
    return True


def number(text: str, name: str) -> float:
    """A number from a table's cell.

    Raises
    ------
    InputError
        Naming `name`, where the cell is empty or no number.
    """
    if not is_number(text):
        got = shown(text) if text.strip() else "nothing"
        raise InputError(f"expected a number for {name}, got {got}; fill it in.")
    return float(text)


def whole_number(text: str, name: str) -> int:
    """A whole number of at least 1 from a table's cell; InputError naming `name` otherwise."""
    value = number(text, name)
    if not (value.is_integer() and value >= 1):
        raise InputError(
            f"expected a whole number for {name}, at least 1, got {shortened(text)}; correct it."
        )
    return int(value)
