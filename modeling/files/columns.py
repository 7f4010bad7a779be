"""Columns of tables, each declared once.

What reads a table and writes it, its sidecar, the report and docs/data.md follow from its columns.
A declaration lists them in their order, beside the code that makes the table.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field, replace
from math import inf, isinf, isnan
from typing import Any

from tactileq.modeling.checks import is_number, is_whole
from tactileq.modeling.errors import InputError, shown

MISSING = ("", "n/a")
ABOVE_0 = 5e-324  # the lower limit of what has to be above 0
HASH_DIGITS = 12
SHA256 = re.compile(r"[0-9a-f]{64}")

Value = float | int | str | None


@dataclass(frozen=True)
class Column:
    """A column: its name in the file, what may stand in it, and how it is shown.

    Parameters
    ----------
    label : str
        The heading without the unit; where empty, the name in words.
    unit : str
        Empty where the values have none, or different ones.
    format : str
        Format specification of its numbers in the report; where empty, about three significant
        digits.
    description : str
        As sidecars and docs/data.md have it.
    limits : (float, float), optional
        Least and largest value of a column of numbers, which are finite; without it the report
        shows numbers as they come, and what is read is text.
    whole : bool
        Its numbers are whole.
    nan : bool
        A number may be NaN.
    silence : bool
        A level may be −inf.
    levels : mapping of value to its meaning
        The only values that a column of text may hold; any text without it. Where none has a
        meaning, the description says all.
    required : bool
        Whether every row has a value.
    optional : bool
        Whether a table may be without the column, as those of earlier versions are.
    is_p_value : bool
        Its numbers are written as p values.
    is_name : bool
        Its values are names, which stay on one line.
    is_hash : bool
        Its values may be SHA-256 hashes, of which the first digits are shown.
    total : str
        The value that marks a row over all others; empty where there is none.
    """

    name: str
    label: str = ""
    unit: str = ""
    format: str = ""
    _: KW_ONLY
    description: str = ""
    limits: tuple[float, float] | None = None
    whole: bool = False
    nan: bool = False
    silence: bool = False
    levels: Mapping[str, str] = field(default_factory=dict, hash=False)
    required: bool = False
    optional: bool = False
    is_p_value: bool = False
    is_name: bool = False
    is_hash: bool = False
    total: str = ""

    # --- What may stand in it ---

    def holds(self, value: object) -> bool:
        """Whether this may stand in the column; None where nothing was answered."""
        if value is None or value == "":
            return not self.required
        if self.limits is not None:
            return is_number(value) and (is_whole(value) or not self.whole) and self._allows(value)
        text = str(value).lower() if isinstance(value, bool) else str(value)
        return not self.levels or text in self.levels

    def _allows(self, number: float) -> bool:
        if number != number:
            return self.nan
        assert self.limits is not None
        low, high = self.limits
        if self.silence and number == -inf:
            return True
        return low <= number <= high and abs(number) < inf and not (self.whole and number % 1)

    @property
    def wanted(self) -> str:
        """What may stand in it, in words: `a number from 0 to 100`, `real or virtual`."""
        if self.limits is None:
            return " or ".join(self.levels) or "a value"
        low, high = self.limits
        bounds = f" of at least {low:g}" if high == inf else f" from {low:g} to {high:g}"
        if low == ABOVE_0:
            bounds = " above 0" if high == inf else f" above 0, at most {high:g}"
        bounded = bounds if low > -inf else " in" * (self.unit not in ("", "arbitrary"))
        unit = f" {self.unit}" if self.unit != "arbitrary" else ""
        silence = ", -inf for silence" * self.silence
        return f"a {'whole ' * self.whole}number{bounded}{unit.rstrip()}{silence}"

    def read(self, cell: str, where: str, *, advice: str = "correct it") -> Value:
        """The value of a cell: a number, text, or None where there is none.

        Parameters
        ----------
        where : str
            Line and file, for the message.

        Raises
        ------
        InputError
            For a cell that the column does not hold.
        """
        text = cell if self.limits is None else cell.strip()
        if text in MISSING:
            if not self.required:
                return None
        elif self.limits is not None:
            number = number_in(text)
            if number is not None and self._allows(number):
                if not self.whole:
                    return number
                return int(text) if text.isdecimal() else int(number)
        elif not self.levels:
            return text
        else:
            for level in (text, text.lower()):  # spreadsheets write TRUE
                if level in self.levels:
                    return level
        raise self.refusal(cell, where, advice=advice)

    def refusal(self, cell: str, where: str, *, advice: str = "correct it") -> InputError:
        """What says that this cell cannot stand in the column."""
        got = shown(cell) if cell.strip() else "nothing"
        return InputError(
            f"expected {self.wanted} in column {self.name}, {where}, got {got}; {advice}."
        )

    # --- How it is shown ---

    @property
    def heading(self) -> str:
        """Label with unit: `worst speed (mm/s)`."""
        label = self.label or self.name.replace("_", " ")
        return f"{label} ({self.unit})" if self.unit else label

    def text(self, value: object) -> str:
        """A value as shown, `n/a` where there is none; the exact one is in the file."""
        if self.is_hash and isinstance(value, str):
            return shortened_hash(value)
        if not isinstance(value, float):
            return str(value)
        if isnan(value):
            return "n/a"
        if isinf(value):
            return "∞" if value > 0 else "−∞"
        if self.is_p_value:
            return p_value(value)
        digits = f"{value:{self.format}}" if self.format else _three_digits(value)
        if not set(digits) & set("123456789"):
            digits = digits.lstrip("-")  # a zero has no sign
        return digits.replace("-", "−")

    def tooltip(self, value: object) -> str:
        """The whole value where `text` shows only its beginning, else nothing."""
        shortened = self.is_hash and isinstance(value, str) and self.text(value) != value
        return str(value) if shortened else ""

    def is_total(self, value: object) -> bool:
        """Whether this value marks a row over all others."""
        return bool(self.total) and value == self.total

    def sidecar(self) -> dict[str, Any]:
        """The column as a BIDS sidecar describes it."""
        described: dict[str, Any] = {"Description": self.description}
        if any(self.levels.values()):
            described["Levels"] = dict(self.levels)
        if self.unit:
            described["Units"] = self.unit
        return described


Columns = tuple[Column, ...]


def names(columns: Sequence[Column]) -> list[str]:
    """Their names, in order."""
    return [column.name for column in columns]


def chosen(columns: Sequence[Column], *which: str) -> Columns:
    """The columns of these names, in the order of the names; each must be declared."""
    by_name = {column.name: column for column in columns}
    return tuple(by_name[name] for name in which)


def without(columns: Sequence[Column], *which: str) -> Columns:
    """All but the columns of these names, each of which must be declared."""
    out = chosen(columns, *which)
    return tuple(column for column in columns if column not in out)


def sidecar(columns: Sequence[Column]) -> dict[str, dict[str, Any]]:
    """All columns as a BIDS sidecar describes them."""
    return {column.name: column.sidecar() for column in columns}


def markdown(columns: Sequence[Column]) -> str:
    """A table of the columns for the documentation: name, meaning, unit, values."""
    rows: list[tuple[str, ...]] = [("column", "meaning", "unit", "values"), ("---",) * 4]
    for column in columns:
        levels = [f"`{level}` {meaning}".strip() for level, meaning in column.levels.items()]
        numbers = replace(column, unit="").wanted  # which stands beside them
        values = "; ".join(levels) or (numbers if column.limits is not None else "text")
        may_be = [*["n/a"] * (not column.required), *["no column"] * column.optional]
        allowed = ", or ".join([values, *may_be])
        cells = (f"`{column.name}`", column.description, column.unit, allowed)
        rows.append(tuple(cell.replace("|", "\\|") for cell in cells))
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


def p_value(p: float) -> str:
    """A probability with three decimals, `< .001` below."""
    return "< .001" if p < 0.001 else f"{p:.3f}".replace("0.", ".", 1)


def shortened_hash(text: str) -> str:
    """The first digits of a SHA-256, enough to distinguish files; any other text as it is."""
    return f"{text[:HASH_DIGITS]}…" if SHA256.fullmatch(text) else text


def number_in(text: str) -> float | None:
    """The number that a text is, None where it is none."""
    try:
        return float(text)
    except ValueError:
        return None


def _three_digits(value: float) -> str:
    size = abs(value)
    digits = 0 if size >= 100 else 1 if size >= 10 else 2 if size >= 1 else 3
    # Below 1e-12 is what sums of thirds leave of a zero.
    tiny = 1e-12 < size < 0.0005
    return f"{value:.1e}" if tiny else f"{value:.{digits}f}"
