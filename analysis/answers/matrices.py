"""Confusion matrices in tables of any experiment: classes, and sums that are no class.

docs/method/tables.md#matrices
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd

from tactileq.modeling import InputError
from tactileq.modeling.errors import shown
from tactileq.modeling.files.others.labels import Labels
from tactileq.modeling.files.others.numbers import is_number
from tactileq.modeling.files.others.splitting import TableLine
from tactileq.modeling.files.others.table import OtherTable

FEWEST_CLASSES, MOST_CLASSES = 2, 16
Counts = npt.NDArray[np.int64]
# As programs head sums of rows and columns (pandas, R, SPSS, spreadsheets), and means.
SUMS = {
    *("total", "totals", "sum", "sums", "gesamt", "gesamtergebnis", "insgesamt", "summe", "somme"),
    *("totale", "合計", "計", "σ", "∑", "rowsum", "colsum", "marginal"),
}
MEANS = {"mean", "means", "average", "avg", "sd", "sem", "median", "mittelwert", "moyenne", "平均"}
_OF_TRIALS = re.compile(r"n|hits?|correct|accuracy|percent|pc|.*%.*")
ANSWERS = ("answer", "respon", "predict", "reported", "judg")
MOST_COUNTED = 1e9


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
    _check_corner(table)
    used = [i for i, name in enumerate(table.names) if i and name]
    if not table.lines:
        raise InputError(
            f"expected a line for each class below the header of {table.path}, got none; give a "
            "matrix with counts."
        )
    header = TableLine(table.header_line, list(table.names))
    answered = [labels("class", table.text_of(table.names[i], header)) for i in used]
    rows = table.lines
    presented = [labels("class", table.text_of(line.cells[0], line)) for line in rows]
    counts = _counts(table, used)
    kept_rows, kept_columns, notes = _without_sums(counts, presented, answered, table)
    presented = [presented[i] for i in kept_rows]
    answered = [answered[i] for i in kept_columns]
    counts = counts[np.ix_(kept_rows, kept_columns)]
    _check_square(table, presented, answered)
    _check_others(table, counts, presented=presented, answered=answered)
    lines = [table.where(rows[i]) for i in kept_rows]
    return AnswerMatrix(
        f"{table.path}, line {table.header_line}",
        tuple(presented),
        tuple(answered),
        counts,
        tuple(lines),
        notes,
    )


def _check_corner(table: OtherTable) -> None:
    """Refuse a matrix whose corner says that its rows are answers."""
    corner = table.names[0].casefold()
    first = re.split(r"[\\/|,]", corner)[0]
    if any(word in first for word in ANSWERS) and "present" not in first:
        raise InputError(
            f"expected classes that were presented in the first column of {table.path}, got a "
            f"corner called {shown(table.names[0])}; transpose the matrix, or rename the corner."
        )


def _counts(table: OtherTable, columns: Sequence[int]) -> Counts:
    names = [f"#{i + 1}" for i in columns]
    style = table.numbers(names, whole=True)
    values = np.array([table.floats(name, style, what="a count") for name in names]).T
    values = np.nan_to_num(values.reshape(len(table.lines), len(columns)))
    for line in table.lines:
        for cell in (line.cells[i] for i in columns):
            if cell and not is_number(cell):
                raise InputError(
                    f"expected a count in {table.where(line)}, got {shown(cell)}; write 0, or "
                    "leave the cell blank where it means that."
                )
    wrong = (values < 0) | (values != np.floor(values)) | (values > MOST_COUNTED)
    for row, column in np.argwhere(wrong)[:1]:
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

    Refused where name and counts disagree, since a class may hold the sum of the others by chance;
    a last row and column that both do are no chance.
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
            by_name = _heads_sums(name)
            by_counts = name in sums and (both or by_name or name not in others)
            if by_counts != by_name and not (both and by_counts):
                what_it_is = "sums of the others" if by_counts else "other counts than sums"
                called = "called so" if by_name else "not called so"
                raise InputError(
                    f"expected sums or a class in {table.path}, got the {what} {shown(name)}, "
                    f"which holds {what_it_is} but is {called}; remove it or rename it."
                )
            if by_counts:
                notes.append(f"the {what} {shown(name)} is no class, as it holds sums")
        left_out = sums if both or (sums and _heads_sums(sums[0])) else []
        kept.append([i for i, name in enumerate(names) if name not in left_out])
    return kept[0], kept[1], tuple(notes)


def is_named_sum(name: str, *, is_level: bool = False) -> bool:
    """Whether a name says that it sums others up; a level may be called All."""
    alone = name.casefold().strip(" ():._")
    return alone in SUMS | MEANS or (alone == "all" and not is_level)


def _heads_sums(name: str) -> bool:
    """Whether a row or column of a matrix is called so: Row total, (all), sum_1."""
    words = {*re.split(r"[\W\d_]+", name.casefold()), name.casefold()}
    return not SUMS.isdisjoint(words) or is_named_sum(name)


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


def _check_others(
    table: OtherTable, counts: Counts, *, presented: Sequence[str], answered: Sequence[str]
) -> None:
    """Refuse a further column that counts hits or trials: it is no answer."""
    places = [answered.index(name) for name in presented]
    hits = counts[np.arange(len(presented)), places]
    sums = counts[:, places].sum(axis=1)
    for place, name in enumerate(answered):
        if name in presented:
            continue
        own = counts[:, place]
        is_number_of_trials = (own == own[0]).all() and (own >= sums).all()
        if (own == hits).all() or is_number_of_trials or _OF_TRIALS.fullmatch(name.casefold()):
            raise InputError(
                f"expected answers in each column of {table.path}, got {shown(name)}, which may "
                "count hits or trials; remove the column if it is no answer."
            )


def check_classes(classes: Sequence[str], where: str) -> None:
    """Refuse fewer than two classes, or more than sixteen."""
    if not FEWEST_CLASSES <= len(classes) <= MOST_CLASSES:
        raise InputError(
            f"expected {FEWEST_CLASSES} to {MOST_CLASSES} classes in {where}, got {len(classes)}; "
            "check the columns named in the map."
        )


def expected_copies(held: Sequence[Sequence[object]], place: int) -> float:
    """How many participants are expected to have answered by chance as one of them did.

    By how many of the others have the same count or answer in each place, as if places were
    independent; all who have the same everywhere are no evidence for each other.

    Parameters
    ----------
    held : sequence of sequence
        Counts or answers of each file, in order.
    """
    own = held[place]
    others = [one for one in held if len(one) == len(own) and one != own]
    same = np.array([[a == b for a, b in zip(one, own, strict=True)] for one in others])
    agree = same.sum(axis=0) if others else np.zeros(len(own))
    return float(len(held) * np.prod((agree + 1) / (len(others) + 2)))
