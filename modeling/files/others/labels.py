"""Names in other programs' tables: of participants, levels and classes."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Sequence

from tactileq.modeling.errors import InputError, shown
from tactileq.modeling.files.others.numbers import PLAIN_STYLE, Style, fitting, is_number
from tactileq.modeling.files.others.table import OtherTable, first_few

# No name; every other word is one, such as none.
NO_NAME = frozenset({"", "nan", "n/a"})
# Letters that are not seen: soft hyphen, zero-width ones, marks of direction and of order.
_UNSEEN = dict.fromkeys(map(ord, "\u00ad\u200b\u200c\u200d\u200e\u200f\u2060\ufeff"))
_HIDDEN = re.compile(r"[\u00a0\u00ad\u200b-\u200f\u2060\ufeff]|  ")
_WHOLE = re.compile(r"([0-9]+)[.,]0{1,2}")  # 1.0 among names; three zeros may be thousands


def is_no_name(cell: str) -> bool:
    """Whether a cell of a column of names says that there is none."""
    return cell.casefold() in NO_NAME


def same_label(text: str) -> str:
    """What spellings of one name have in common: case, composition, width of letters, blanks.

    Raised and other compatible forms stay apart: 10² is not 102.
    """
    wide = "".join(
        unicodedata.normalize("NFKC", letter) if "\uff00" <= letter <= "\uffef" else letter
        for letter in text
    )
    plain = unicodedata.normalize("NFC", wide).translate(_UNSEEN)
    return " ".join(plain.casefold().split())


def without_zeros(text: str) -> str:
    """A whole number without zeros behind its sign, 1.0 as 1; any other text as it is."""
    whole = _WHOLE.fullmatch(text)
    return whole[1] if whole else text


class Labels:
    """Names as they were spelt first: canvas and Canvas are one, 1.0 is 1."""

    def __init__(self) -> None:
        self._first: dict[tuple[str, str], str] = {}
        self._others: dict[str, set[str]] = {}
        self._keys: dict[str, str] = {}

    def __call__(self, column: str, text: str) -> str:
        """The name by which a spelling goes."""
        name = without_zeros(text)
        key = self._keys.setdefault(name, same_label(name))
        first = self._first.setdefault((column, key), unicodedata.normalize("NFC", name))
        if name != first and unicodedata.normalize("NFC", name) != first:
            self._others.setdefault(first, set()).add(name)
        return first

    def of(self, table: OtherTable, columns: Sequence[str], kind: str) -> list[list[str]]:
        """Cells of some columns as names of one kind; numbers without thousands.

        Raises
        ------
        InputError
            For numbers of which two readings fit, and letters whose encoding is not certain.
        """
        raw = [table.cells(column) for column in columns]
        every = [cell for cells in raw for cell in cells if not is_no_name(cell)]
        style = None
        if every and all(map(is_number, every)) and fitting(every, decimal=table.decimal):
            style = table.numbers(columns)
        return [
            [
                self(kind, table.text_of(_plain(cell, style), line))
                for cell, line in zip(cells, table.lines, strict=True)
            ]
            for cells in raw
        ]

    def check_numbers(self) -> None:
        """Refuse two names of a kind that are the same number: 0.5 and 0.50, 1 and 01.

        Raises
        ------
        InputError
        """
        values: dict[tuple[str, float], str] = {}
        for kind, name in ((kind, name) for (kind, _), name in self._first.items()):
            number = name.replace(",", ".")  # where words beside it left its sign as it is
            if PLAIN_STYLE.pattern.fullmatch(number):
                other = values.setdefault((kind, float(PLAIN_STYLE.plain(number))), name)
                if other != name:
                    raise InputError(
                        f"expected one spelling of each name of {kind}, got {shown(other)} and "
                        f"{shown(name)}, which are one number or two names; write them alike, or "
                        "with a letter before."
                    )

    @property
    def notes(self) -> list[str]:
        """A sentence where names that are spelt differently were taken as one."""
        same = [
            " = ".join(map(_ascii_where_alike, (first, *sorted(others))))
            for first, others in self._others.items()
        ]
        return [f"Taken as one name each: {first_few(same)}."] if same else []


def _ascii_where_alike(name: str) -> str:
    """A name in quotes, in which letters that are not seen are written out."""
    return repr(name) if not _HIDDEN.search(name) else ascii(name)


def _plain(cell: str, style: Style | None) -> str:
    """A number with a decimal point and without thousands, 1.00 as 1; any other cell as it is."""
    if style is None or is_no_name(cell) or style == PLAIN_STYLE:
        return cell
    return style.plain(cell)
