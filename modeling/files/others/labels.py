"""Names in other programs' tables: of participants, levels and classes."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Sequence

from tactileq.modeling.errors import shown
from tactileq.modeling.files.others.numbers import Style, fitting, is_number
from tactileq.modeling.files.others.table import OtherTable

# No name; every other word is one, such as none.
NO_NAME = frozenset({"", "nan", "n/a"})
_WHOLE = re.compile(r"([0-9]+)[.,]0{1,2}")  # 1.0 among names; three zeros may be thousands


def is_no_name(cell: str) -> bool:
    """Whether a cell of a column of names says that there is none."""
    return cell.casefold() in NO_NAME


class Labels:
    """Names as they were spelt first: canvas and Canvas are one, 1.0 is 1."""

    def __init__(self) -> None:
        self._first: dict[tuple[str, str], str] = {}
        self._others: dict[str, set[str]] = {}

    def __call__(self, column: str, text: str) -> str:
        """The name by which a spelling goes."""
        whole = _WHOLE.fullmatch(text)
        name = unicodedata.normalize("NFC", whole[1] if whole else text)
        first = self._first.setdefault((column, name.casefold()), name)
        if name != first:
            self._others.setdefault(first, set()).add(name)
        return first

    def of(self, table: OtherTable, columns: Sequence[str], kind: str) -> list[list[str]]:
        """Cells of some columns as names of one kind; numbers by their value.

        Raises
        ------
        InputError
            For numbers of which two readings fit, and letters whose encoding is not certain.
        """
        raw = [table.cells(column) for column in columns]
        seen = {
            c: [x for x in cells if not is_no_name(x)]
            for c, cells in zip(columns, raw, strict=True)
        }
        every = [cell for cells in seen.values() for cell in cells]
        style = None
        if every and all(map(is_number, every)) and fitting(every, decimal=table.decimal):
            style = table.numbers(columns)
        return [
            [
                self(kind, table.text_of(_by_value(cell, style), line))
                for cell, line in zip(cells, table.lines, strict=True)
            ]
            for cells in raw
        ]

    @property
    def notes(self) -> list[str]:
        """A sentence where names that are spelt differently were taken as one."""
        return [
            f"{shown(first)} and {', '.join(map(shown, sorted(others)))} are taken as one name."
            for first, others in self._others.items()
        ]


def _by_value(cell: str, style: Style | None) -> str:
    """A number without separators of thousands and zeros at its end; any other cell as it is."""
    if style is None or is_no_name(cell) or "e" in cell.casefold():
        return cell
    whole, _, fraction = style.plain(cell).partition(".")
    fraction = fraction.rstrip("0")
    return f"{whole}.{fraction}" if fraction else whole
