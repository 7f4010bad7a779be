"""A table that another program made: where its header is, what is a row, what a column holds.

Nothing is taken that could have been meant otherwise: header, separator and decimal sign are
decided for the whole file by what fits all its lines, and what two readings fit is refused with
both. Only columns that are asked for have to be sound. docs/method/tables.md#dialects
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import groupby, islice, zip_longest
from pathlib import Path
from statistics import mode

import numpy as np

from tactileq.modeling.arrays import Floats
from tactileq.modeling.errors import InputError, counted, shortened, shown
from tactileq.modeling.files.others.numbers import (
    NO_NUMBER,
    Numbers,
    Style,
    converted,
    fitting,
    is_number,
)
from tactileq.modeling.files.others.splitting import (
    SEPARATORS,
    Line,
    Text,
    check_spans,
    read_other_text,
    split,
)

MOST_NAMES = 200  # characters of the names of columns that a refusal lists
_MOST_PLACES = 3  # lines that a note names
_MOST_ABOVE = 3  # lines of names between the rest of a row and the first row
_SAMPLED = 200  # lines of numbers by which columns of numbers are found
_BRACKETED = re.compile(r"[\[(](.*)[\])]")
_IMPORT_ID = re.compile(
    r"\{\s*['\"]importid"
)  # Qualtrics' third line; its second one holds the questions' texts


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
    lines : list of Line
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
    lines: list[Line]
    separator: str
    text: Text
    header_line: int
    left_out: Mapping[str, list[int]] = field(default_factory=dict)
    numeric: tuple[int, ...] = ()
    has_open_row_names: bool = False
    decimal: str = ""
    decided: tuple[str, ...] = ()

    def where(self, line: Line) -> str:
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
        return "save the file as UTF-8" if guessed else "correct --map"

    def cells(self, name: str) -> list[str]:
        """Cells of a column, from top to bottom."""
        place = self.place(name)
        self._check_row_names(place)
        for line in self.lines:
            is_short = 0 < line.given < len(self.names)
            if is_short and (
                line.given <= place
                or not line.cells[place]
                or any(self.separator in cell for cell in line.cells)
            ):
                raise InputError(
                    f"expected {counted(len(self.names), 'cell')} in {self.where(line)}, got "
                    f"{line.given} and none for {shown(name)}; complete the line, or remove it if "
                    "it is none of the table."
                )
        return [line.cells[place] for line in self.lines]

    def _check_row_names(self, place: int) -> None:
        if self.has_open_row_names and place < len(self.names) - 1:
            first = self.lines[0]
            raise InputError(
                f"expected as many cells as names in {self.where(first)}, got one more: either "
                f"{shown(first.cells[0])} is the name of the row, as R writes it, or the line ends "
                "with a separator too many; name all columns in the first line."
            )

    def numbers(self, columns: Sequence[str], *, whole: bool = False) -> Style:
        """How the numbers of some columns are written; `whole`: they are counts.

        Raises
        ------
        InputError
            If two ways fit and give other numbers.
        """
        own = [self.names[self.place(name)] for name in columns]
        shown_as = [
            name if own.count(name) == 1 else given
            for name, given in zip(own, columns, strict=True)
        ]
        cells = dict(zip(shown_as, map(self.cells, columns), strict=True))
        seen = Numbers(cells, decimal=self.decimal, whole=whole)
        return seen.style(self.path, name_of=lambda name: self.names[self.place(name)] or name)

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

    def text_of(self, cell: str, line: Line) -> str:
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
        return f"{len(places)} lines were left out: they {what} ({listed(places)})."
    verb, _, rest = what.partition(" ")
    verb = "has" if verb == "have" else f"{verb}s"
    return f"1 line was left out: it {verb} {rest} ({places[0]})."


def listed(places: Sequence[str]) -> str:
    """The first few of some places, and how many more there are."""
    more = f" and {len(places) - _MOST_PLACES} more" if len(places) > _MOST_PLACES else ""
    return "; ".join(places[:_MOST_PLACES]) + more


def number_of(name: str) -> int | None:
    """The number of a column that is named by it, as in #3."""
    digits = name[1:] if name.startswith("#") else ""
    return int(digits) if digits.isdecimal() and int(digits) > 0 else None


# --- Tables of answers -----------------------------------------------------------------------


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

    def header_in(lines: Sequence[Line]) -> int | None:
        goal = set(map(same_name, named))
        usual = mode(len(line.cells) for line in lines) if lines and not named else 0
        for place, line in enumerate(lines):
            if goal <= set(map(same_name, line.cells)) and len(line.cells) >= usual:
                return place
        return None

    parsed = _parsed(text, path, header_in, comments=is_declared)
    lines, header = parsed.lines, parsed.header
    decided: tuple[str, ...] = ()
    if not named and wanted and lines:
        if _is_header(lines[header:], wanted):
            decided = (f"line {lines[header].number} is taken as names of columns",)
        else:
            width = len(lines[header].cells)
            first = Line(lines[header].number, [f"#{i}" for i in range(1, width + 1)])
            lines = [*lines[:header], first, *lines[header:]]
    if len(lines) - header < 2 - is_declared:
        raise InputError(
            f"expected {what} with a line of names and lines below it in {path}, got "
            f"{counted(len(lines), 'line')}; give a file that is not empty."
        )
    if is_declared:
        lines = _without_blank_ends(lines[header:])
        header = 0
        _check_whole(lines[1:], path, least=len(lines[0].cells), exact=True)
    table = _table(path, text, parsed.separator, lines, header=header, wanted=named)
    above = [line.number for line in lines[:header]]
    left_out = {"stand above the header": above, **table.left_out}
    return replace(table, left_out=left_out, decided=(*table.decided, *decided))


def _without_blank_ends(lines: Sequence[Line]) -> list[Line]:
    """Lines without blank cells beyond the last name."""
    width = lines[0].width
    return [
        replace(line, cells=line.cells[:width]) if line.width <= width < len(line.cells) else line
        for line in lines
    ]


def _check_whole(lines: Sequence[Line], path: Path, *, least: int, exact: bool = False) -> None:
    for line in lines:
        if len(line.cells) < least or (exact and len(line.cells) > least):
            raise InputError(
                f"expected {counted(least, 'cell')} in line {line.number} of {path}, got "
                f"{len(line.cells)}; correct it, since the table is damaged."
            )


def _is_header(lines: Sequence[Line], wanted: Sequence[str]) -> bool:
    """Whether the first line names columns: its cells are no numbers and do not occur again."""
    for name in wanted:
        place = int(name[1:]) - 1
        cells = [line.cells[place] for line in lines if place < len(line.cells)]
        if cells and (is_number(cells[0]) or cells[0] in cells[1:]):
            return False
    return True


@dataclass(frozen=True)
class _Parsed:
    """The lines by one separator, and which of them has the names."""

    separator: str
    lines: list[Line]
    header: int = 0
    has_names: bool = False

    @property
    def is_even(self) -> bool:
        """Whether every line fits the header, which has several cells, or one where all have."""
        most = max((len(line.cells) for line in self.lines[self.header :]), default=0)
        if most > self.width:
            most = max(line.width for line in self.lines[self.header :])
        row_names = self.separator in "\t " and self._are_wider
        return most <= self.width + row_names and (self.width > 1 or most == 1)

    @property
    def width(self) -> int:
        """Number of cells of the header."""
        return len(self.lines[self.header].cells) if self.lines else 0

    @property
    def _are_wider(self) -> bool:
        below = self.lines[self.header + 1 :]
        return bool(below) and all(len(line.cells) == self.width + 1 for line in below)

    @property
    def share(self) -> float:
        """Share of the lines that fit the header, and more for several columns."""
        if not self.lines:
            return -1.0
        fits = sum(line.width <= self.width for line in self.lines) / len(self.lines)
        return fits + (self.width > 1)


def _parsed(
    text: Text, path: Path, header_in: Callable[[Sequence[Line]], int | None], **options: bool
) -> _Parsed:
    """The lines by the separator that fits; refused where two do."""
    found: list[_Parsed] = []
    refusal: InputError | None = None
    separators = [text.separator] if text.separator else list(SEPARATORS)
    often = text.content.count
    for separator in sorted(separators, key=lambda one: (one == " ", -often(one))):
        if separator not in text.content and any(
            one.is_even or one.separator not in text.content for one in found
        ):
            continue  # a table of one column is the same by all that it does not hold
        if separator == " " and any(one.width > 1 for one in found):
            continue  # blanks stand in texts, too
        try:
            lines = split(text, separator, path, **options)
        except InputError as error:
            if separator != " " or not (found or refusal):
                refusal = refusal or error
            continue
        header = header_in(lines)
        found.append(_Parsed(separator, lines, header or 0, header is not None))
    return _the_one(found, refusal, path)


def _the_one(found: Sequence[_Parsed], refusal: InputError | None, path: Path) -> _Parsed:
    named = [one for one in found if one.has_names]
    several = [one for one in named or found if one.is_even and one.lines]
    wide = [one for one in several if one.width > 1] or several[:1]
    if len(wide) > 1:
        kinds = " or ".join(SEPARATORS[one.separator] for one in wide)
        raise InputError(
            f"expected one separator in {path}, got lines that fit {kinds}; save it as CSV with "
            "cells in quotes."
        )
    # A quote that is damaged by the separator of the header is told, not read by another one.
    if refusal and not any(one.width > 1 for one in named):
        raise refusal
    return wide[0] if wide else max(named or found, key=lambda one: one.share)


def _table(
    path: Path,
    text: Text,
    separator: str,
    lines: Sequence[Line],
    *,
    header: int,
    wanted: Sequence[str] = (),
) -> OtherTable:
    """The table below a header, its lines as wide as this; what is no row is left out."""
    names, below = lines[header].cells, list(lines[header + 1 :])
    left_out: dict[str, list[int]] = {}
    if len(below) > 1 and any(_IMPORT_ID.match(cell.casefold()) for cell in below[1].cells):
        left_out["explain columns (Qualtrics)"] = [line.number for line in below[:2]]
        below = below[2:]
    again = [line for line in below if _repeats(line.cells, names, wanted, path, line.number)]
    if again:
        left_out["repeat the header"] = [line.number for line in again]
        below = [line for line in below if line not in again]
    if len(names) > 1 and len(below) > 1 and _ends_table(below[-1]):
        left_out["end the table"] = [below.pop().number]
    if separator == " ":  # among blanks, no cell can be seen to be missing
        _check_whole(below, path, least=len(names))
    check_spans(below, len(names), path)
    is_open = False
    decided: tuple[str, ...] = ()
    if below and all(len(line.cells) == len(names) + 1 for line in below):
        may_be_names = _may_be_row_names([line.cells[0] for line in below])
        is_open = may_be_names and not any(line.cells[-1] for line in below)
        if may_be_names and not is_open and separator in "\t " and len(below) > 1:
            names = ["", *names]
            decided = ("the first cell of each line is taken as the name of a row",)
    _check_lengths(below, names, path)
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
    return list(cells[: Line(0, list(cells)).width])


def _may_be_row_names(cells: Sequence[str]) -> bool:
    """Whether cells are all different, and numbers only if they count the rows, as in R."""
    counted_up = [str(number) for number in range(1, len(cells) + 1)]
    return len(set(cells)) == len(cells) and (
        list(cells) == counted_up or not any(map(is_number, cells))
    )


def _check_lengths(lines: Sequence[Line], names: Sequence[str], path: Path) -> None:
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
    if short and (ends_blank or short == list(lines[-1:])):
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


def _ends_table(line: Line) -> bool:
    """Whether a last line is no row: a word alone, or END OF FILE."""
    words = " ".join(filter(None, line.cells))
    alone = len(line.cells) == 1 and words.isprintable() and not set("\t;,|") & set(words)
    alone = alone and not is_number(words)
    return alone or words.casefold() in ("end of file", "eof")


def _full_line(line: Line, width: int, path: Path) -> Line:
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


# --- Tables of numbers -----------------------------------------------------------------------


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

    def header_in(lines: Sequence[Line]) -> int | None:
        run = _run_of_numbers(lines)
        if run is None:
            return None
        named = [place for place in range(run.start) if not _holds_numbers(lines[place])]
        return named[-1] if named else (None if run.start else 0)

    parsed = _parsed(text, path, header_in)
    lines, run = parsed.lines, _run_of_numbers(parsed.lines)
    if run is None:
        got = f"{counted(len(lines), 'line')} without rows of numbers" if lines else "an empty file"
        raise InputError(
            f"expected a header and rows of numbers in {path.name}, got {got}; export or record it "
            "again."
        )
    _check_run(lines, run, path)
    header, names = _names_above(lines[: run.start], run, wanted=wanted, is_unit=is_unit)
    if not names:
        if not any(map(number_of, wanted)):
            raise InputError(
                f"expected a header line in {path.name} (time,x,y,z), got numbers; add one, or "
                "give columns by number, as in --map time=#1,z=#2."
            )
        names = [f"#{i}" for i in range(1, run.width + 1)]
    first = Line(header.number if header else lines[run.start].number, names)
    table = _table(path, text, parsed.separator, [first, *lines[run.start : run.stop]], header=0)
    before = [line for line in lines[: run.start] if not line.cells[0].startswith("#")]
    above = [line.number for line in before if line.number < first.number]
    below = [line.number for line in lines[run.stop :]]
    left_out = {"stand above the header": above, "stand below the numbers": below}
    numeric = tuple(place for place in run.columns if place < len(table.names))
    return replace(table, left_out={**left_out, **table.left_out}, numeric=numeric)


def _holds_numbers(line: Line) -> bool:
    """Whether most of its cells are numbers."""
    return 2 * sum(map(is_number, line.cells)) > line.width


@dataclass(frozen=True)
class _Run:
    """Rows of numbers: from `start` to before `stop`, their cells, and which hold numbers."""

    start: int
    stop: int
    width: int
    columns: tuple[int, ...]

    def holds(self, line: Line) -> bool:
        """Whether the columns of numbers hold numbers in this line, or nothing."""
        if len(line.cells) != self.width:
            return False
        cells = [line.cells[i] for i in self.columns]
        found = [is_number(cell) for cell in cells]
        return any(found) and all(
            number or cell.casefold() in NO_NUMBER
            for cell, number in zip(cells, found, strict=True)
        )


def _run_of_numbers(lines: Sequence[Line]) -> _Run | None:
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


def _check_run(lines: Sequence[Line], run: _Run, path: Path) -> None:
    """Refuse numbers outside of the run: a damaged line splits what was one."""
    for line in lines[run.stop :]:
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
    if len(holding) > 1:
        after = lines[holding[0] : run.start]
        raise _damaged(next(line for line in after if not run.holds(line)), run, path)


def _damaged(line: Line, run: _Run, path: Path) -> InputError:
    got = str(len(line.cells)) if len(line.cells) != run.width else shown(line.cells[0])
    return InputError(
        f"expected {counted(run.width, 'value')} in line {line.number} of {path.name}, got {got}; "
        "the file is truncated or damaged, export or record it again, or cut it there."
    )


def _names_above(
    lines: Sequence[Line], run: _Run, *, wanted: Sequence[str], is_unit: Callable[[str], bool]
) -> tuple[Line | None, list[str]]:
    """The line of names above the numbers, its names with the units below it.

    A line that begins with # is one of names only where there is no other.
    """
    named = {same_name(name) for name in wanted if number_of(name) is None}
    plain = [line for line in lines if not line.cells[0].startswith("#")] or [
        replace(line, cells=[line.cells[0].lstrip("# "), *line.cells[1:]]) for line in lines
    ]
    plain = [line for line in plain if not run.holds(line)]
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


def _bare(unit: str) -> str:
    """A unit without brackets around it."""
    found = _BRACKETED.fullmatch(unit)
    return found[1] if found else unit


def _units(
    lines: Sequence[Line], fits: Sequence[Line], *, is_unit: Callable[[str], bool]
) -> list[str]:
    """The cells of a last line of units below one of names; none where there is no such line."""
    if len(lines) < 2 or lines[-1] in fits:
        return []
    cells = [cell for cell in lines[-1].cells if cell]
    known = sum(map(is_unit, cells))
    before = lines[-2]
    if lines[-2] in fits or before.width == lines[-1].width:
        has_numbers = lines[-2] not in fits and any(map(is_number, before.cells))
        return list(lines[-1].cells) if known and not has_numbers else []
    return []
