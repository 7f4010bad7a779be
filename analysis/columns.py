"""The content of a table's columns, declared beside the function that computes it.

A declaration lists a table's columns in their order. The report shows all or some of them, in the
words and with the digits that they carry.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

import pandas as pd

from analysis.labels import ALL_LAYERS, ALL_TEXTURES
from modeling.files.tables import guarded

HASH_DIGITS = 12
SHA256 = re.compile(r"[0-9a-f]{64}")


@dataclass(frozen=True)
class Column:
    """A column: its name in the file, and how it is shown.

    Parameters
    ----------
    name : str
    label : str
        The heading without the unit; where empty, the name in words.
    unit : str
        Empty where the values have none, or different ones.
    format : str
        Format specification of its numbers; where empty, about three significant digits.
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
    is_p_value: bool = False
    is_name: bool = False
    is_hash: bool = False
    total: str = ""

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
        if math.isnan(value):
            return "n/a"
        if math.isinf(value):
            return "∞" if value > 0 else "−∞"
        if self.is_p_value:
            return p_value(value)
        shown = f"{value:{self.format}}" if self.format else _three_digits(value)
        if not set(shown) & set("123456789"):
            shown = shown.lstrip("-")  # a zero has no sign
        return shown.replace("-", "−")

    def tooltip(self, value: object) -> str:
        """The whole value where `text` shows only its beginning, else nothing."""
        shortened = self.is_hash and isinstance(value, str) and self.text(value) != value
        return str(value) if shortened else ""

    def is_total(self, value: object) -> bool:
        """Whether this value marks a row over all others."""
        return bool(self.total) and value == self.total


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


def p_value(p: float) -> str:
    """A probability with three decimals, `< .001` below."""
    return "< .001" if p < 0.001 else f"{p:.3f}".replace("0.", ".", 1)


def _three_digits(value: float) -> str:
    size = abs(value)
    digits = 0 if size >= 100 else 1 if size >= 10 else 2 if size >= 1 else 3
    # Below 1e-12 is what sums of thirds leave of a zero.
    tiny = 1e-12 < size < 0.0005
    return f"{value:.1e}" if tiny else f"{value:.{digits}f}"


def shortened_hash(text: str) -> str:
    """The first digits of a SHA-256, enough to distinguish files; any other text as it is."""
    return f"{text[:HASH_DIGITS]}…" if SHA256.fullmatch(text) else text


# Columns of more than one table.
TEXTURE = Column("texture", is_name=True, total=ALL_TEXTURES)
MODEL = Column("model", is_name=True)
ESTIMATOR = Column("estimator", is_name=True)
LAYER = Column("layer", is_name=True, total=ALL_LAYERS)
CONDITIONS = Column("conditions")
P = Column("p", is_p_value=True)
SIMULATED = Column("simulated")


def tsv_text(table: pd.DataFrame) -> str:
    """A table as the text of a TSV; what is missing is n/a, text as `files.tables.guarded`."""
    safe = table.map(lambda value: guarded(value) if isinstance(value, str) else value)
    return str(safe.to_csv(sep="\t", index=False, na_rep="n/a", lineterminator="\n"))
