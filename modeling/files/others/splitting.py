"""Text of other programs' tables, split into lines of cells.

Cells are split by the csv module in strict mode: of the readers that were tried (pandas' parser,
csv, clevercsv) it alone refuses a quote that nobody closes instead of swallowing lines. What the
separator is, is not guessed from letters but decided by what fits the whole file.

docs/method/tables.md#dialects
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from tactileq.modeling.errors import InputError, shown
from tactileq.modeling.files.others.numbers import NO_NUMBER, is_number
from tactileq.modeling.files.reading import read_bytes

_ENOUGH = 5  # numbers that make a column one of numbers
SEPARATORS = {"\t": "tabs", ";": "semicolons", ",": "commas", "|": "bars", " ": "blanks"}


class OpenQuote(InputError):
    """A quote that is not closed at the end of its cell, in the line of this index."""

    def __init__(self, sentence: str, *, line: int) -> None:
        super().__init__(sentence)
        self.line = line


@dataclass(frozen=True)
class Text:
    r"""Text of a file, with \n at all line ends.

    Parameters
    ----------
    is_certain : bool
        Whether its encoding is stated by its bytes (UTF-8, or a mark); else letters beyond ASCII
        may be others.
    separator : str
        As a first line `sep=;` states it, which is not part of `content`.
    skipped : int
        Lines before `content`.
    """

    content: str
    is_certain: bool
    separator: str = ""
    skipped: int = 0


@dataclass(frozen=True)
class TableLine:
    """Cells of one line without blanks around them, and where it begins, from 1.

    Parameters
    ----------
    within : tuple of list of str
        Where quoted cells hold line ends: cells of each line of the file if quotes meant nothing.
    given : int
        How many cells the line has in the file, where others were added; else 0.
    """

    number: int
    cells: list[str]
    within: tuple[list[str], ...] = ()
    given: int = 0

    @property
    def width(self) -> int:
        """Number of cells up to the last one that is not blank."""
        return next((i for i in range(len(self.cells), 0, -1) if self.cells[i - 1]), 0)


def read_other_text(path: Path, what: str) -> Text:
    """The text of a file in UTF-8, UTF-16 with its mark, or else the Western code page.

    Raises
    ------
    InputError
        Naming `what` is expected, where the file cannot be read or is no text.
    """
    data = read_bytes(path, what)
    marked = data.startswith((b"\xff\xfe", b"\xfe\xff"))
    if not marked:
        data = data.rstrip(b"\0\x1a")  # which loggers fill a file with beforehand
    for encoding in ("utf-16",) if marked else ("utf-8-sig", "cp1252"):
        try:
            text = data.decode(encoding)
        except UnicodeDecodeError:
            continue
        if "\0" not in text:
            return _with_stated_separator(text, is_certain=encoding != "cp1252")
    raise InputError(f"expected {what} as text in {path}, got other bytes; save it as UTF-8.")


def _with_stated_separator(text: str, *, is_certain: bool) -> Text:
    content = text.replace("\r\n", "\n").replace("\r", "\n")
    first, _, rest = content.partition("\n")
    first = first.strip('"')
    if first.strip().casefold() == "sep=" or (
        first.casefold().startswith("sep=") and first[4:5] in SEPARATORS
    ):
        return Text(rest, is_certain, first[4:5] or "\t", skipped=1)
    return Text(content, is_certain)


def split(text: Text, separator: str, path: Path, *, comments: bool = False) -> list[TableLine]:
    """The lines that are not blank.

    Parameters
    ----------
    comments : bool
        Whether lines that begin with # are none.

    Raises
    ------
    InputError
        For a quote that is not closed, or that closes within a cell, naming the line that it is in.
    """
    content = text.content
    if comments:  # a quote in one of them opens no cell
        content = re.sub(r"^[ \t\"]*#.*$", "", content, flags=re.MULTILINE)
    physical = content.split("\n")
    has_quotes = '"' in content
    if not has_quotes:
        every: Iterable[tuple[int, list[str]]] = (
            (number, _blanks(line) if separator == " " else line.split(separator))
            for number, line in enumerate(physical)
        )
    else:
        every = _with_quotes(content, physical, separator, path, skipped=text.skipped)
    lines, last = [], len(physical)
    for number, cells in every:
        stripped = [cell.strip() for cell in cells]
        if not any(stripped):
            continue
        ends = sum(cell.count("\n") for cell in cells) if has_quotes else 0
        within = physical[number : min(number + ends + 1, last)] if ends else ()
        apart = tuple(line.split(separator) for line in within)
        lines.append(TableLine(number + text.skipped + 1, stripped, apart))
    return lines


def _blanks(line: str) -> list[str]:
    """Cells between runs of blanks; what else is white, such as between thousands, is none."""
    return list(filter(None, line.split(" ")))


def _with_quotes(
    content: str, physical: Sequence[str], separator: str, path: Path, *, skipped: int
) -> Iterator[tuple[int, list[str]]]:
    reader = csv.reader(
        io.StringIO(content, newline=""),
        delimiter=separator,
        strict=True,
        skipinitialspace=separator != " ",
    )
    while True:
        number = reader.line_num
        try:
            cells = next(reader)
        except StopIteration:
            return
        except csv.Error as error:
            damage = (
                f"a cell of more than {csv.field_size_limit()} characters"
                if "field larger" in str(error)
                else "in which a quote opens a cell and is not closed at its end"
            )
            raise OpenQuote(
                f"expected quotes only around whole cells in {path}, line {number + skipped + 1}, "
                f"got {shown(physical[number])}, {damage}; close or remove the quote, and double "
                "those within a cell.",
                line=number,
            ) from None
        yield number, cells


def _may_be_number(cell: str) -> bool:
    return is_number(cell) or cell.casefold() in NO_NUMBER


def check_spans(lines: Sequence[TableLine], width: int, path: Path) -> None:
    """Refuse a quoted cell that runs over lines which may be whole ones without its quotes.

    They cannot be where a column of numbers would hold something else.
    """
    columns = range(min((len(line.cells) for line in lines), default=0))
    alone = [line for line in lines if not line.within] or lines
    numeric = [
        i
        for i in columns
        if all(_may_be_number(line.cells[i]) for line in alone)
        and sum(is_number(line.cells[i]) for line in alone) >= _ENOUGH
    ]
    for line in lines:
        if not line.within or min(map(len, (line.within[0], line.within[-1]))) < width:
            continue
        last = [cell.strip(' "') for cell in line.within[-1]]
        if all(_may_be_number(last[i]) for i in numeric if i < len(last)):
            raise InputError(
                f"expected one reading of {path}, line {line.number}, got a quote that either "
                f"holds a cell of {len(line.within)} lines or was not closed, so that lines are "
                "lost; remove the quote, or the line ends in the cell."
            )
