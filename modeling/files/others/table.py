"""A table that another program made: its columns by name or number, and what they hold.

docs/method/tables.md#dialects
"""

from __future__ import annotations

import unicodedata
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

from tactileq.modeling.arrays import Floats
from tactileq.modeling.errors import InputError, counted, shortened, shown
from tactileq.modeling.files.others.numbers import Numbers, Style, converted
from tactileq.modeling.files.others.splitting import TableLine, Text

DECIMAL_ADVICE = "add decimal=point or decimal=comma to --map"
MOST_NAMES = 200  # characters of the names of columns that a refusal lists
_MOST_PLACES = 3  # lines that a note names


def same_name(name: str) -> str:
    """What two spellings of a column's name have in common: letters' case, width, composition."""
    return unicodedata.normalize("NFKC", name).casefold().strip("\ufeff\u200b \t\u00a0")


@dataclass(frozen=True, eq=False)
class OtherTable:
    """Lines of a table by its header.

    Parameters
    ----------
    names : tuple of str
        Of the columns, blank where the header is.
    lines : list of TableLine
        Below the header, each with a cell per column.
    header_line : int
        Number of the line of names.
    left_out : mapping of str to list of int
        Numbers of lines that are no rows, by what they do.
    numeric : tuple of int
        Columns that hold numbers; only of tables of numbers.
    has_open_row_names : bool
        Whether each line has a blank cell more than the header, so that its first one may be a name
        of the row.
    decimal : str
        The decimal sign, where the user states it.
    decided : tuple of str
        What was decided where another reading is possible.
    """

    path: Path
    names: tuple[str, ...]
    lines: list[TableLine]
    separator: str
    text: Text
    header_line: int
    left_out: Mapping[str, list[int]] = field(default_factory=dict)
    numeric: tuple[int, ...] = ()
    has_open_row_names: bool = False
    decimal: str = ""
    decided: tuple[str, ...] = ()

    def where(self, line: TableLine) -> str:
        """Place of a line, for messages."""
        return f"{self.path}, line {line.number}"

    def place(self, name: str) -> int:
        """Index of a column: by its name, by its number (#3), or by its name spelt otherwise.

        Raises
        ------
        InputError
            If there is no such column, or more than one; or if it is open which columns the cells
            belong to.
        """
        if (number := number_of(name)) is not None and name not in self.names:
            if number > len(self.names):
                raise InputError(
                    f"expected a column {name} in {self.path}, got {len(self.names)} columns; "
                    "correct the map."
                )
            return number - 1
        same = [i for i, own in enumerate(self.names) if own == name]
        same = same or [i for i, own in enumerate(self.names) if same_name(own) == same_name(name)]
        if len(same) != 1:
            what = f"{len(same)} columns of that name" if same else "no such column"
            there = shortened(", ".join(filter(None, self.names)), longest=MOST_NAMES)
            raise InputError(
                f"expected one column {shown(name)} in {self.path}, line {self.header_line}, got "
                f"{what}; there are {there or 'none'}; {self._advice(same)}."
            )
        return same[0]

    def _advice(self, same: Sequence[int]) -> str:
        """What to do about a column that is not there, or several times."""
        if same:
            return f"name it by its number, as #{same[0] + 1}"
        guessed = not self.text.is_certain and not "".join(self.names).isascii()
        return "save the file as UTF-8" if guessed else "correct --map or --where"

    def cells(self, name: str, *, may_be_cut: bool = False) -> list[str]:
        """Cells of a column, from top to bottom.

        Parameters
        ----------
        may_be_cut : bool
            Whether lines may have fewer cells, as where they are only chosen by this column.

        Raises
        ------
        InputError
            If it is open which cells are those of the column.
        """
        place = self.place(name)
        self._check_row_names(place)
        for line in () if may_be_cut else self._short_lines:
            if (
                self.separator == " "  # among which no cell can be seen to be missing
                or line.given <= place
                or not line.cells[place]
                or any(self.separator in cell for cell in line.cells)
            ):
                raise InputError(
                    f"expected {counted(len(self.names), 'cell')} in {self.where(line)}, got "
                    f"{line.given} and none for {shown(name)}; complete the line, remove it, "
                    "or leave it out by --where."
                )
        return [line.cells[place] for line in self.lines]

    @cached_property
    def _short_lines(self) -> list[TableLine]:
        """Lines with fewer cells than names."""
        return [line for line in self.lines if 0 < line.given < len(self.names)]

    def _check_row_names(self, place: int) -> None:
        if self.has_open_row_names and place < len(self.names) - 1:
            first = self.lines[0]
            raise InputError(
                f"expected as many cells as names in {self.where(first)}, got one more: either "
                f"{shown(first.cells[0])} is the name of the row, as R writes it, or the line ends "
                "with a separator too many; name all columns in the first line."
            )

    def numbers(
        self, columns: Sequence[str], *, whole: bool = False, advice: str = DECIMAL_ADVICE
    ) -> Style:
        """How the numbers of some columns are written; `whole`: they are counts.

        Raises
        ------
        InputError
            If two ways fit and give other numbers.
        """
        cells = {name: self.cells(name) for name in columns}
        seen = Numbers(cells, decimal=self.decimal, whole=whole)
        return seen.style(
            self.path,
            name_of=lambda name: self.names[self.place(name)] or name,
            advice=advice,
        )

    def floats(self, name: str, style: Style, *, what: str = "a number") -> Floats:
        """The numbers of a column (n,), NaN where they are missing.

        Raises
        ------
        InputError
            For a cell that is no number, with its line.
        """
        cells = self.cells(name)
        values, wrong = converted(cells, style)
        if wrong >= 0:
            where = f"column {shown(self.names[self.place(name)] or name)} of "
            raise InputError(
                f"expected {what} in {where}{self.where(self.lines[wrong])}, got "
                f"{shown(cells[wrong])}; correct that cell."
            )
        return values

    def text_of(self, cell: str, line: TableLine) -> str:
        """A cell that is taken as a name; refused where its letters are not certain."""
        if not self.text.is_certain and not cell.isascii():
            other = cell.encode("cp1252", "replace").decode("mac-roman", "replace")
            raise InputError(
                f"expected names in UTF-8 in {self.where(line)}, got bytes that are "
                f"{shown(cell)} or, in other code pages, {shown(other)}; save the file as UTF-8."
            )
        return cell


def left_out_sentence(what: str, places: Sequence[str]) -> str:
    """That lines were left out, and why: `2 lines were left out: they repeat the header (…).`"""
    if len(places) != 1:
        return f"{len(places)} lines were left out: they {what} ({first_few(places)})."
    verb, _, rest = what.partition(" ")
    verb = "has" if verb == "have" else f"{verb}s"
    return f"1 line was left out: it {verb} {rest} ({places[0]})."


def first_few(places: Sequence[str]) -> str:
    """The first few of some places, and how many more there are."""
    more = f" and {len(places) - _MOST_PLACES} more" if len(places) > _MOST_PLACES else ""
    return "; ".join(places[:_MOST_PLACES]) + more


def number_of(name: str) -> int | None:
    """The number of a column that is named by it, as in #3."""
    digits = name[1:] if name.startswith("#") else ""
    return int(digits) if digits.isdecimal() and int(digits) > 0 else None
