"""Confusion matrices in tables of any experiment: classes, and sums that are no class.

docs/method/tables.md#matrices
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd

from tactileq.modeling import InputError
from tactileq.modeling.errors import shown
from tactileq.modeling.files.others.labels import Labels
from tactileq.modeling.files.others.table import OtherTable

FEWEST_CLASSES, MOST_CLASSES = 2, 16
Counts = npt.NDArray[np.int64]
# As programs head sums of rows and columns (pandas, R, SPSS, spreadsheets).
SUMS = frozenset(
    {"all", "total", "totals", "sum", "sums", "gesamt", "summe", "σ", "∑", "合計", "計"}
)


@dataclass(frozen=True, eq=False)
class AnswerMatrix:
    """Counts of answers (presented, answered) of one file."""

    where: str
    presented: tuple[str, ...]
    answered: tuple[str, ...]
    counts: Counts
    lines: tuple[str, ...]
    notes: tuple[str, ...] = ()

    def rows(self) -> pd.DataFrame:
        """A row per cell."""
        return pd.DataFrame(
            {
                "presented": np.repeat(self.presented, len(self.answered)),
                "answered": np.tile(self.answered, len(self.presented)),
                "count": self.counts.ravel(),
                "line": np.repeat(self.lines, len(self.answered)),
            }
        ).assign(correct=lambda table: (table["presented"] == table["answered"]).astype(float))


def answer_matrix(table: OtherTable, *, labels: Labels) -> AnswerMatrix:
    """The matrix of a table: classes in its first row (answered) and column (presented).

    Raises
    ------
    InputError
        For counts that are none, numbers without a class, classes that are presented but are no
        column, and sums that are not.
    """
    used = [i for i, name in enumerate(table.names) if i and name]
    answered = [labels("class", table.text_of(table.names[i], table.lines[0])) for i in used]
    rows = [line for line in table.lines if any(line.cells)]
    presented = [labels("class", table.text_of(line.cells[0], line)) for line in rows]
    counts = _counts(table, used)
    kept_rows, kept_columns, notes = _without_sums(counts, presented, answered, table)
    presented = [presented[i] for i in kept_rows]
    answered = [answered[i] for i in kept_columns]
    _check_square(table, presented, answered)
    lines = [table.where(rows[i]) for i in kept_rows]
    return AnswerMatrix(
        f"{table.path}, line {table.header_line}",
        tuple(presented),
        tuple(answered),
        counts[np.ix_(kept_rows, kept_columns)],
        tuple(lines),
        notes,
    )


def _counts(table: OtherTable, columns: Sequence[int]) -> Counts:
    names = [f"#{i + 1}" for i in columns]
    style = table.numbers(names)
    values = np.array([table.floats(name, style, what="a count") for name in names]).T
    values = np.nan_to_num(values.reshape(len(table.lines), len(columns)))
    for row, column in np.argwhere((values < 0) | (values != np.floor(values)))[:1]:
        line = table.lines[row]
        raise InputError(
            f"expected a whole count from 0 in {table.where(line)}, got "
            f"{shown(line.cells[columns[column]])}; give the number of answers."
        )
    return np.asarray(values, dtype=np.int64)


def _without_sums(
    counts: Counts, presented: Sequence[str], answered: Sequence[str], table: OtherTable
) -> tuple[list[int], list[int], tuple[str, ...]]:
    """Rows and columns that are classes; those of sums, which are none, are left out.

    Refused where name and counts disagree, since a class may hold the sum of the others by chance.
    """
    row = _place_of_sum(counts.T)
    column = _place_of_sum(counts)
    both = row is not None and column is not None
    kept, notes = [], []
    for place, names, others, what in (
        (row, presented, answered, "row"),
        (column, answered, presented, "column"),
    ):
        sums = [names[place]] if place is not None else []
        for name in names:
            is_sum = name in sums and (both or name not in others or _is_named_sum(name))
            if is_sum != _is_named_sum(name):
                raise InputError(
                    f"expected sums or a class in {table.path}, got the {what} {shown(name)}, "
                    "which is the one by its name and the other by its counts; remove it or rename "
                    "it."
                )
            if is_sum:
                notes.append(f"The {what} {shown(name)} is no class: it holds sums.")
        kept.append([i for i, name in enumerate(names) if not _is_named_sum(name)])
    return kept[0], kept[1], tuple(notes)


def _is_named_sum(name: str) -> bool:
    return not SUMS.isdisjoint(name.casefold().split())


def _place_of_sum(counts: Counts) -> int | None:
    """The last or first column that holds the sum of the other ones in every row."""
    total = counts.sum(axis=1)
    columns = counts.shape[1]
    for place in (columns - 1, 0):
        if columns > 2 and total.any() and (2 * counts[:, place] == total).all():
            return place
    return None


def _check_square(table: OtherTable, presented: Sequence[str], answered: Sequence[str]) -> None:
    """Refuse classes that occur twice, or are presented but are no column."""
    unique = len(set(answered)) == len(answered) and len(set(presented)) == len(presented)
    # Further columns are answers that are no class, such as "don't know": fewer than the classes.
    if not unique or not set(presented) <= set(answered) or len(answered) >= 2 * len(presented):
        raise InputError(
            f"expected the same classes, each once, in the first row and column of {table.path}, "
            f"got {shown(', '.join(answered))} and {shown(', '.join(presented))}; make the matrix "
            "square."
        )
    check_classes(presented, f"{table.path}, line {table.header_line}")


def check_classes(classes: Sequence[str], where: str) -> None:
    """Refuse fewer than two classes, or more than sixteen."""
    if not FEWEST_CLASSES <= len(classes) <= MOST_CLASSES:
        raise InputError(
            f"expected {FEWEST_CLASSES} to {MOST_CLASSES} classes in {where}, got {len(classes)}; "
            "check the columns named in the map."
        )


def expected_copies(matrices: Sequence[AnswerMatrix], place: int) -> float:
    """How many participants are expected to have answered by chance as one of them did.

    By how many of the other participants have the same count in each cell, as if cells were
    independent; all who have the same matrix are no evidence for each other.
    """
    counts = np.array([matrix.counts for matrix in matrices])
    same = counts == counts[place]
    others = same[~same.all(axis=(1, 2))]
    shares = (others.sum(axis=0) + 1) / (len(others) + 2)
    return float(len(matrices) * np.prod(shares))
