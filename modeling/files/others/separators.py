"""Which separator a table of another program has: the one by which all its lines fit the header.

docs/method/tables.md#dialects
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from tactileq.modeling.errors import InputError
from tactileq.modeling.files.others.splitting import (
    SEPARATORS,
    OpenQuote,
    TableLine,
    Text,
    split,
)


@dataclass(frozen=True)
class Parsed:
    """The lines by one separator, and which of them has the names."""

    separator: str
    lines: list[TableLine]
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


def parsed_lines(
    text: Text,
    path: Path,
    header_in: Callable[[Sequence[TableLine]], int | None],
    *,
    comments: bool = False,
) -> Parsed:
    """The lines by the separator that fits; refused where two do. `comments`: as in `split`."""
    found: list[Parsed] = []
    refusal: OpenQuote | None = None
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
            lines = split(text, separator, path, comments=comments)
        except OpenQuote as error:
            if refusal is None or error.line > refusal.line:
                refusal = error  # of the separator by which the most lines are sound
            continue
        header = header_in(lines)
        one = Parsed(separator, lines, header or 0, header is not None)
        if one.width > 1 or separator == "\t" or "\t" not in text.content:
            found.append(one)  # a tab separates, if nothing else does
    return _the_one(found, refusal, path)


def _the_one(found: Sequence[Parsed], refusal: OpenQuote | None, path: Path) -> Parsed:
    named = [one for one in found if one.has_names]
    several = [one for one in named or found if one.is_even and one.lines]
    wide = [one for one in several if one.width > 1] or several[:1]
    # Of two that fit, the one by which fewer lines stand above the header.
    wide = [one for one in wide if one.header == min(other.header for other in wide)]
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
