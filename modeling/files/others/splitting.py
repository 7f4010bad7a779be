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
from tactileq.modeling.files.reading import read_bytes

SEPARATORS = {"\t": "tabs", ";": "semicolons", ",": "commas", "|": "bars", " ": "blanks"}


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
    widths : tuple of int
        Where quoted cells hold line ends: how many cells each line of the file would have if quotes
        meant nothing.
    given : int
        How many cells the line has in the file, where others were added; else 0.
    """

    number: int
    cells: list[str]
    widths: tuple[int, ...] = ()
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
        widths = tuple(len(line.split(separator)) for line in within)
        lines.append(TableLine(number + text.skipped + 1, stripped, widths))
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
            raise InputError(
                f"expected quotes only around whole cells in {path}, line {number + skipped + 1}, "
                f"got {shown(physical[number])}, {damage}; close or remove the quote."
            ) from None
        yield number, cells


def check_spans(lines: Sequence[TableLine], width: int, path: Path) -> None:
    """Refuse a quoted cell over several lines with the separators of two rows or more.

    Without its quotes these lines could be rows: an opening quote would have swallowed them.
    """
    for line in lines:
        if line.widths and sum(line.widths) - len(line.widths) >= 2 * (width - 1):
            raise InputError(
                f"expected one reading of {path}, line {line.number}, got a quote that either "
                f"holds a cell of {len(line.widths)} lines or was not closed, so that lines are "
                "lost; close or remove the quote."
            )
