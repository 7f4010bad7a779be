"""Tables that users write by hand or export: labels, hands and thresholds, of declared columns."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from tactileq.modeling.errors import InputError
from tactileq.modeling.files.columns import MISSING, Column, names
from tactileq.modeling.files.others.named_table import read_other_table
from tactileq.modeling.files.others.numbers import PLAIN_STYLE
from tactileq.modeling.files.tables import Row, check_header, typed, unguarded


def read_user_table(path: str | Path, columns: Sequence[Column], *, what: str) -> list[Row]:
    """Rows of a user's table in any dialect, by column name; otherwise as `read_table`."""
    return [typed(cells, columns, where) for where, cells in read_user_cells(path, columns, what)]


def read_user_cells(
    path: str | Path, columns: Sequence[Column], what: str, *, only: bool = False
) -> list[tuple[str, dict[str, str]]]:
    """Cells of each row of a user's table, with its place; numbers have a decimal point.

    Parameters
    ----------
    columns : sequence of Column
        Those with limits are numbers.
    what : str
        What the file is, with its article, for messages.
    only : bool
        Whether columns that are not declared are refused.

    Raises
    ------
    InputError
        As `read_other_table`, and for a column that is missing, doubled or misspelt.
    """
    source = Path(path)
    needed = [column.name for column in columns if not column.optional]
    table = read_other_table(source, what, wanted=needed, is_declared=True)
    if not table.text.is_certain:
        raise InputError(f"expected {what} as text in {source}, got other bytes; save it as UTF-8.")
    check_header(table.names, columns, source, only=only)
    present = [name for name in names(columns) if name in table.names]
    numeric = [c.name for c in columns if c.limits is not None and c.name in present]
    # What has a decimal point throughout is as it is declared, whatever else it may look like.
    numbers = [cell for name in numeric for cell in table.cells(name) if cell not in MISSING]
    is_plain = all(map(PLAIN_STYLE.pattern.fullmatch, numbers))
    style = (
        PLAIN_STYLE
        if is_plain
        else table.numbers(numeric, advice="write a decimal point, and no thousands")
    )
    rows = []
    for line in table.lines:
        cells = dict(zip(table.names, line.cells, strict=True))
        for name in present:
            cell = cells[name]
            is_other = name in numeric and style != PLAIN_STYLE and style.pattern.fullmatch(cell)
            cells[name] = style.plain(cell) if is_other else unguarded(table.text_of(cell, line))
        rows.append((table.where(line), cells))
    return rows


def declared_text(
    path: Path, columns: Sequence[Column], *, what: str, separator: str = "\t"
) -> str:
    """The declared columns of a user's table of numbers, without comments and other columns."""
    rows = [cells for _, cells in read_user_cells(path, columns, what)]
    known = [name for name in names(columns) if rows and name in rows[0]]
    lines = [known, *([row[name] for name in known] for row in rows)]
    return "".join(separator.join(line) + "\n" for line in lines)
