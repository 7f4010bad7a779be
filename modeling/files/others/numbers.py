"""Numbers in other programs' tables: decimal sign and thousands decided for a column or file.

A cell alone does not say whether 1,020 is a thousand. Every way of writing numbers that fits all
cells of the columns is tried; where two are left that give other numbers, both are named.

docs/method/tables.md#numbers
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property
from math import isfinite
from typing import NamedTuple

import numpy as np

from tactileq.modeling.arrays import Floats
from tactileq.modeling.errors import InputError, shown

# No name: what programs write where a number is missing.
NO_NUMBER = frozenset(
    {"", "nan", "na", "n/a", "#n/a", "null", "none", ".", "-nan(ind)", "-nan", "nan(ind)"}
)
_THOUSANDS = (",", ".", "'", "\u2019", " ", "\u00a0", "\u202f", "\u2009")
_SIGNS = {".": "point", ",": "comma"}


class Style(NamedTuple):
    """A way of writing numbers: the decimal sign, and what stands between thousands."""

    decimal: str
    thousands: str

    @property
    def pattern(self) -> re.Pattern[str]:
        """What matches such a number; one with an exponent has no thousands."""
        point = re.escape(self.decimal)
        fraction = rf"(?:{point}[0-9]*)?"
        number = rf"(?:[0-9]+{fraction}|{point}[0-9]+)(?:[eE][+\-]?[0-9]+)?"
        if self.thousands:
            groups = rf"[1-9][0-9]{{0,2}}(?:{re.escape(self.thousands)}[0-9]{{3}})+{fraction}"
            number = f"(?:{groups}|{number})"
        return re.compile(rf"[+\-\u2212]?{number}")

    def plain(self, cell: str) -> str:
        """A number of this style, as Python writes it."""
        if self.thousands:
            cell = cell.replace(self.thousands, "")
        if self.decimal != ".":
            cell = cell.replace(self.decimal, ".")
        return cell if cell.isascii() else cell.replace("\u2212", "-")

    def reading(self, cell: str) -> str:
        """What a cell is by this style: `1020`."""
        return f"{float(self.plain(cell)):.12g}"

    def describe(self, cell: str) -> str:
        """What a cell is by this style, with the reason."""
        has_thousands = bool(self.thousands) and self.thousands in cell
        why = "as thousands" if has_thousands else f"with a decimal {_SIGNS[self.decimal]}"
        return f"{self.reading(cell)} {why}"


PLAIN_STYLE = Style(".", "")
_ANY = re.compile(r"[+\-\u2212]?[.,]?[0-9][0-9.,'\u2019 \u00a0\u202f\u2009]*(?:[eE][+\-]?[0-9]+)?")


def is_number(cell: str) -> bool:
    """Whether a cell is a number by any style, or looks like one."""
    return bool(_ANY.fullmatch(cell))


class Numbers:
    """The ways of writing numbers that fit all cells which were seen.

    Parameters
    ----------
    columns : mapping of str to list of str
        Cells by the name of their column; missing ones count for nothing.
    decimal : str
        The decimal sign, where it is known; else both are tried.
    whole : bool
        Whether they are counts: readings that are not whole are then none.
    """

    def __init__(
        self, columns: Mapping[str, Iterable[str]], *, decimal: str = "", whole: bool = False
    ) -> None:
        self.seen = {
            name: dict.fromkeys(cell for cell in cells if cell.casefold() not in NO_NUMBER)
            for name, cells in columns.items()
        }
        self.decimal = decimal
        self.whole = whole

    @cached_property
    def styles(self) -> list[Style]:
        """All that fit, the plainest first."""
        cells = [cell for column in self.seen.values() for cell in column]
        found = fitting(cells, decimal=self.decimal)
        whole = [style for style in found if all(float(style.plain(c)) % 1 == 0 for c in cells)]
        return whole if self.whole and whole else found

    @property
    def open_cell(self) -> tuple[str, str] | None:
        """Column and cell of a number that has several readings, if there is one."""
        if len(self.styles) < 2:
            return None
        for name, cells in self.seen.items():
            for cell in cells:
                if len({style.reading(cell) for style in self.styles}) > 1:
                    return name, cell
        return None

    def style(self, path: object, *, name_of: Callable[[str], str], advice: str) -> Style:
        """The one way that fits; the plainest where none does, since a cell is then refused.

        Raises
        ------
        InputError
            Naming both readings, where the cells allow two.
        """
        if found := self.open_cell:
            name, cell = found
            by_reading = {style.reading(cell): style for style in self.styles}
            readings = " or ".join(style.describe(cell) for style in by_reading.values())
            raise InputError(
                f"expected one reading of the numbers in column {shown(name_of(name))} of "
                f"{path}, got {shown(cell)}, which is {readings}; {advice}."
            )
        return self.styles[0] if self.styles else self._nearest

    @property
    def _nearest(self) -> Style:
        """The style that most cells fit."""
        cells = [cell for column in self.seen.values() for cell in column]
        every = (PLAIN_STYLE, Style(self.decimal or ".", ""), *_possible(cells))
        candidates = [style for style in every if self.decimal in ("", style.decimal)]
        return max(candidates, key=lambda style: sum(_fits(style, cell) for cell in cells))


def _fits(style: Style, cell: str) -> bool:
    return bool(style.pattern.fullmatch(cell))


def _possible(cells: Sequence[str]) -> list[Style]:
    letters = set().union(*cells)
    signs = [sign for sign in ".," if sign in letters] or ["."]
    between = ["", *(sign for sign in _THOUSANDS if sign in letters)]
    return [Style(d, t) for t in between for d in dict.fromkeys((*signs, ".")) if d != t] + (
        [Style(",", ".")] if "." in letters and "," not in letters else []
    )


def fitting(cells: Sequence[str], *, decimal: str = "") -> list[Style]:
    """The styles of writing numbers that fit all cells, none of which is missing."""
    return [
        style
        for style in dict.fromkeys(_possible(cells) if cells else [PLAIN_STYLE])
        if decimal in ("", style.decimal) and all(map(style.pattern.fullmatch, cells))
    ]


def converted(cells: Sequence[str], style: Style) -> tuple[Floats, int]:
    """Numbers (n,), NaN where they are missing; and the place of the first that is none, or −1."""
    if all(map(style.pattern.fullmatch, cells)):
        whole = np.array([style.plain(cell) for cell in cells], dtype=np.float64)
        if np.isfinite(whole).all():
            return whole, -1
    pattern, out = style.pattern, np.full(len(cells), np.nan)
    for place, cell in enumerate(cells):
        if pattern.fullmatch(cell) and isfinite(value := float(style.plain(cell))):
            out[place] = value
        elif cell.casefold() not in NO_NUMBER:
            return out, place
    return out, -1
