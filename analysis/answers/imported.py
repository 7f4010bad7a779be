"""Answers in tables of any experiment: trials, counts, shares or matrices, read into one form.

docs/method/tables.md#what-is-read
"""

from __future__ import annotations

import re
import unicodedata
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pandas as pd

from tactileq.analysis.answers.matrices import (
    AnswerMatrix,
    answer_matrix,
    check_classes,
    expected_copies,
)
from tactileq.modeling import InputError
from tactileq.modeling.arrays import Floats
from tactileq.modeling.errors import counted, shown
from tactileq.modeling.files.others.labels import Labels, is_no_name
from tactileq.modeling.files.others.numbers import NO_NUMBER
from tactileq.modeling.files.others.roles import parse_roles
from tactileq.modeling.files.others.table import (
    OtherTable,
    left_out_sentence,
    listed,
    read_other_table,
    same_name,
)

ROLES = ("participant", "presented", "answered", "correct", "share", "value", "count")
MEASURES = ("correct", "share", "value")
# Factors of tables without such a column: which of a participant's files, by order or by name.
OF_FILES = ("session", "file")
# Names of columns of the tables that follow from these.
RESERVED = frozenset(
    {"participant_id", "presented", "answered", "correct", "value", "count", "from_file", "line"}
    | {"condition", "trials", "n", "mean", "ci_low", "ci_high"}
)
EXAMPLE = "correct=TYPE_ANS,factor=TYPE,participant=ID"
RIGHT = {"1": 1.0, "0": 0.0, "true": 1.0, "false": 0.0}
FEWEST_COPIES = 0.01  # expected number of equal matrices by chance, from which on they may be
NO_ANSWER = frozenset({"na", "null", "."})  # what may be an answer of this name, or none

Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class TableMap:
    """Which column means what; empty where the tables have no such column.

    Without correct, share, value and answered each file is one confusion matrix. Without
    participant the file's name is the participant's.

    Parameters
    ----------
    where : dict of str to tuple of str
        Only rows with one of these values in a column count.
    right : str
        The code in `correct` that means right, or the answer whose share is asked for where nothing
        was presented; empty where none is named.
    decimal : str
        The decimal sign; empty where the tables show it.
    """

    participant: str = ""
    presented: str = ""
    answered: str = ""
    correct: str = ""
    share: str = ""
    value: str = ""
    count: str = ""
    factors: tuple[str, ...] = ()
    where: dict[str, tuple[str, ...]] = field(default_factory=dict)
    right: str = ""
    decimal: str = ""

    @property
    def is_matrix(self) -> bool:
        """Whether the files are matrices."""
        return not any((self.answered, self.correct, self.share, self.value))

    @property
    def columns(self) -> dict[str, str]:
        """Role to column, of those that were named."""
        return {role: getattr(self, role) for role in ROLES if getattr(self, role)}

    @property
    def wanted(self) -> tuple[str, ...]:
        """All columns that a table has to have."""
        factors = (name for name in self.factors if name not in OF_FILES)
        return (*self.columns.values(), *factors, *self.where)


@dataclass(frozen=True, eq=False)
class ImportedAnswers:
    """Answers read from tables.

    Parameters
    ----------
    answers : DataFrame
        participant_id, a column per factor (text), presented and answered where known, `measure`
        (correct 0–1, or value in the table's own unit) and count (trials that the row stands for).
    measure : str
        correct or value.
    classes : tuple of str
        Of the confusion matrices, in order: those presented, then what else was answered.
    missed : int
        Trials without an answer; they are not among the answers.
    presented : tuple of str
        The classes that were presented.
    notes : tuple of str
        What was left out, decided or is doubtful, one sentence each.
    response : str
        The answer whose share `correct` holds, where no answer is right; else empty.
    """

    answers: pd.DataFrame
    factors: tuple[str, ...]
    measure: str
    classes: tuple[str, ...] = ()
    missed: int = 0
    presented: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    response: str = ""


def parse_map(
    texts: str | Sequence[str], *, where: Sequence[tuple[str, str]] = (), right: str = ""
) -> TableMap:
    """The map as the command line has it: `correct=TYPE_ANS,factor=TYPE,factor=SIZE`, or a file.

    Raises
    ------
    InputError
        For other words than the roles, one of them twice, or roles that do not go together.
    """
    found = parse_roles(
        [texts] if isinstance(texts, str) else texts,
        roles=(*ROLES, "factor"),
        several=("factor",),
        where=where,
        right=right,
        example=EXAMPLE,
    )
    columns = dict(found.columns)
    factors = tuple(columns.pop("factor", ()))
    mapping = TableMap(
        **{role: names[0] for role, names in columns.items()},
        factors=factors,
        where=found.where,
        right=found.right,
        decimal=found.decimal,
    )
    _check_map(mapping)
    return mapping


def _check_map(mapping: TableMap) -> None:
    measures = [role for role in MEASURES if getattr(mapping, role)]
    if len(measures) > 1:
        raise InputError(
            f"expected one measure in the map, got {' and '.join(measures)}; analyse one at a time."
        )
    if mapping.presented and not mapping.answered:
        raise InputError(
            "expected presented and answered together in the map, got only one of them; "
            "name the other column, too."
        )
    if mapping.is_matrix and (mapping.participant or mapping.count or mapping.where):
        raise InputError(
            "expected correct, share, value, or presented and answered in the map, got none of "
            f"them; write it like {EXAMPLE}."
        )
    if mapping.right and not (mapping.correct or mapping.answered):
        raise InputError(
            "expected correct or answered in the map for the code of --right, got neither; name "
            "the column that holds it, or leave --right out."
        )
    if mapping.right and mapping.presented:
        raise InputError(
            "expected presented and answered, or --right, got both; leave --right out: an answer "
            "is right where it is what was presented."
        )
    for factor in mapping.factors:
        if factor in RESERVED:
            raise InputError(
                f"expected factors of other names than {', '.join(sorted(RESERVED))}, got "
                f"{factor}; rename that column."
            )


def load_imported(files: Sequence[str | Path], mapping: TableMap) -> ImportedAnswers:
    """Read tables of one experiment.

    Parameters
    ----------
    files : sequence of str or Path
        Text as docs/method/tables.md#dialects says.

    Raises
    ------
    InputError
        Naming file and line, where a table does not hold what the map says, or has two readings.
    """
    found = _Found(mapping)
    for path in files:
        table = read_other_table(Path(path), "a table of answers", wanted=mapping.wanted)
        found.add(replace(table, decimal=mapping.decimal))
    if mapping.is_matrix:
        found.check_matrices()
    rows = pd.concat(found.rows, ignore_index=True) if found.rows else pd.DataFrame()
    if rows.empty:
        raise InputError("expected answers in the tables, got none; give files with trials.")
    rows = _by_files(rows, mapping, found)
    _check_twice(rows, mapping)
    found.check_copies(rows)
    presented, classes = found.classes(rows)
    response = ""
    if mapping.answered and not mapping.presented:
        rows, response = _share_of_response(rows, mapping, found)
    answers = rows.drop(columns=["from_file", "line"])
    return ImportedAnswers(
        answers,
        mapping.factors,
        "value" if mapping.value else "correct",
        classes,
        found.missed,
        presented,
        found.notes(rows),
        response,
    )


class _Found:
    """What the tables read so far hold, and what of them was left out."""

    def __init__(self, mapping: TableMap) -> None:
        self.mapping = mapping
        self.labels = Labels()
        self.rows: list[pd.DataFrame] = []
        self.tables: list[OtherTable] = []
        self.matrices: list[AnswerMatrix] = []
        self.missed = 0
        self.left_out: dict[str, list[str]] = {}
        self.codes: Counter[str] = Counter()
        self.decided: list[str] = []
        self.equal: list[str] = []

    def add(self, table: OtherTable) -> None:
        """Read one more table."""
        self.tables.append(table)
        self.decided.extend(table.decided)
        for what, numbers in table.left_out.items():
            self.leave_out(what, [f"{table.path.name}, line {number}" for number in numbers])
        if self.mapping.is_matrix:
            matrix = answer_matrix(table, labels=self.labels)
            self.matrices.append(matrix)
            self.decided.extend(matrix.notes)
            self.rows.append(self._of_matrix(table, matrix))
        else:
            self.rows.append(_Rows(table, self).read())

    def leave_out(self, what: str, places: Sequence[str]) -> None:
        """Count lines that are no trials."""
        if places:
            self.left_out.setdefault(what, []).extend(places)

    def _of_matrix(self, table: OtherTable, matrix: AnswerMatrix) -> pd.DataFrame:
        """The answers of one participant in one condition."""
        factors = self.mapping.factors
        who, *levels = _name_parts(table.path, factors)
        rows = matrix.rows().assign(
            participant_id=self.labels("participant", who),
            **{f: self.labels(f, level) for f, level in zip(factors, levels, strict=True)},
            from_file=str(table.path),
        )
        return rows[rows["count"] > 0]

    def check_matrices(self) -> None:
        """Refuse matrices over different classes."""
        for before, matrix in zip(self.matrices, self.matrices[1:], strict=False):
            if sorted(matrix.answered) != sorted(before.answered) or sorted(
                matrix.presented
            ) != sorted(before.presented):
                raise InputError(
                    f"expected the classes of the files before ({shown(', '.join(before.answered))}"
                    f") in {matrix.where}, got {shown(', '.join(matrix.answered))}; analyse them "
                    "on their own."
                )

    def classes(self, rows: pd.DataFrame) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """The classes that were presented, and all with what else was answered."""
        if self.matrices:
            first = self.matrices[0]
            return first.presented, (
                *first.presented,
                *(name for name in first.answered if name not in first.presented),
            )
        if not self.mapping.presented:
            return (), ()
        presented = tuple(sorted(set(rows["presented"]), key=_in_order))
        others = sorted(set(rows["answered"]) - set(presented), key=_in_order)
        names = sorted({table.path.name for table in self.tables})
        check_classes((*presented, *others), ", ".join(names[:3]))
        return presented, (*presented, *others)

    def check_copies(self, rows: pd.DataFrame) -> None:
        """Refuse two files that hold the same, unless two participants may well have answered so.

        They may where all answers of trials are alike, and where a matrix is likely to occur twice.
        """
        first: dict[tuple[tuple[str, ...], ...], int] = {}
        for place, table in enumerate(self.tables):
            held = tuple(tuple(line.cells) for line in table.lines)
            before = self.tables[first.setdefault(held, place)]
            if before is table:
                continue
            own = rows[rows["from_file"] == str(table.path)]
            measure = next(name for name in ("value", "correct", "answered") if name in own)
            alike = own[measure].nunique() < 2
            if self.matrices:
                alike = expected_copies(self.matrices, place) > FEWEST_COPIES
            if not alike:
                raise InputError(
                    f"expected different answers in each file, got the same in {before.path} and "
                    f"{table.path}; leave one out, since a copy would count as another participant."
                )
            self.equal.append(f"{before.path.name} and {table.path.name}")

    def notes(self, rows: pd.DataFrame) -> tuple[str, ...]:
        """A sentence for each kind of lines left out, and for what was decided."""
        sentences = [left_out_sentence(what, places) for what, places in self.left_out.items()]
        if self.codes:
            every = ", ".join(f"{code} ({n})" for code, n in sorted(self.codes.items()))
            sentences.append(f"Codes of the answers: {every}; right: {self.mapping.right}.")
        sentences.extend(self.labels.notes)
        sentences.extend(dict.fromkeys(self.decided))
        sentences.extend(_twice_over(self.tables))
        if self.equal:
            pairs = counted(len(self.equal), "pair")
            sentences.append(
                f"{pairs} of files that hold the same ({listed(self.equal)}); make sure that none "
                "is a copy."
            )
        if self.mapping.answered and self.mapping.presented:
            for word in sorted(set(rows["answered"]) - set(rows["presented"])):
                times = int(rows.loc[rows["answered"] == word, "count"].sum())
                sentences.append(
                    f"{shown(word)} was answered {counted(times, 'time')} and never presented; it "
                    "counts as a wrong answer."
                )
        return tuple(sentences)


def _twice_over(tables: Sequence[OtherTable]) -> list[str]:
    """A sentence for each file whose second half repeats its first."""
    found = []
    for table in tables:
        cells = [line.cells for line in table.lines]
        half = len(cells) // 2
        varied = len({tuple(row) for row in cells[:half]})
        if half > 1 and len(cells) == 2 * half and cells[:half] == cells[half:] and varied > 1:
            found.append(
                f"{table.path.name}: lines {table.lines[half].number} to {table.lines[-1].number} "
                f"repeat lines {table.lines[0].number} to {table.lines[half - 1].number} cell by "
                "cell; if the file was joined with itself, remove them."
            )
    return found


class _Rows:
    """Rows of a table with one row per trial, count or share."""

    def __init__(self, table: OtherTable, found: _Found) -> None:
        self.table, self.found, self.mapping = table, found, found.mapping
        self.factors = [
            name
            for name in self.mapping.factors
            if name not in OF_FILES or same_name(name) in map(same_name, table.names)
        ]

    def read(self) -> pd.DataFrame:
        """The trials with an answer."""
        chosen, names = self._chosen, self._names
        answer, no_answer = self._answer
        count = self._count
        levels = [role for role in names if role not in ("participant", "answered")]
        no_level = self._missing(levels)
        no_name = self._missing(["participant"] if "participant" in names else [])
        no_trial = chosen & no_answer & (no_level | no_name)
        self._refuse_first(chosen & ~no_answer & (no_level | no_name), levels)
        missed = chosen & no_answer & ~no_trial
        self.found.missed += int(np.nansum(count[missed]))
        places = [self._where(i) for i in np.flatnonzero(no_trial).tolist()]
        self.found.leave_out(f"have no answer{' and no level' * bool(levels)}", places)
        kept = chosen & ~no_answer & (self._whole(count, chosen & ~no_answer) > 0)
        columns = {role: np.array(cells, dtype=object)[kept] for role, cells in names.items()}
        own = {"participant_id": columns.pop("participant", self._own_name)}
        rows = pd.DataFrame({**columns, **{k: v[kept] for k, v in answer.items()}})
        rows = rows.assign(**own) if len(rows) else rows
        if "presented" in rows:
            rows["correct"] = (rows["presented"] == rows["answered"]).astype(float)
        where = [self._where(i, whole=True) for i in np.flatnonzero(kept).tolist()]
        return rows.assign(
            count=count[kept].astype(int), from_file=str(self.table.path), line=where
        )

    @property
    def _own_name(self) -> str:
        named = [name for name in self.mapping.factors if name == "file"]
        parts = self.table.path.stem.rsplit("_", 1) if named else [self.table.path.stem]
        return self.found.labels("participant", parts[0])

    def _where(self, place: int, *, whole: bool = False) -> str:
        line = self.table.lines[place]
        return self.table.where(line) if whole else f"{self.table.path.name}, line {line.number}"

    @cached_property
    def _names(self) -> dict[str, list[str]]:
        """Cells of the columns that hold names, by role or factor."""
        roles = {r: c for r, c in self.mapping.columns.items() if r in ("participant",)}
        roles |= {name: name for name in self.factors}
        classes = {r: c for r, c in self.mapping.columns.items() if r in ("presented", "answered")}
        names = {role: self.found.labels.of(self.table, [c], role)[0] for role, c in roles.items()}
        if classes:
            both = self.found.labels.of(self.table, list(classes.values()), "class")
            names |= dict(zip(classes, both, strict=True))
        return names

    def _missing(self, roles: Iterable[str]) -> Mask:
        none = np.zeros(len(self.table.lines), dtype=bool)
        for role in roles:
            none |= np.array([is_no_name(cell) for cell in self._names[role]], dtype=bool)
        return none

    @cached_property
    def _chosen(self) -> Mask:
        """Which rows count, by --where."""
        chosen = np.ones(len(self.table.lines), dtype=bool)
        for column, values in self.mapping.where.items():
            cells = [_key(cell) for cell in self.table.cells(column)]
            fits = np.array([cell in set(map(_key, values)) for cell in cells], dtype=bool)
            if not fits.any():
                there = ", ".join(list(dict.fromkeys(self.table.cells(column)))[:5])
                raise InputError(
                    f"expected rows with {' or '.join(values)} in column {shown(column)} of "
                    f"{self.table.path}, got none; there are {shown(there)}."
                )
            chosen &= fits
        places = [self._where(i) for i in np.flatnonzero(~chosen).tolist()]
        self.found.leave_out("have another value than --where names", places)
        return chosen

    @cached_property
    def _answer(self) -> tuple[dict[str, Floats], Mask]:
        """The measure of each row, and which rows have none."""
        if self.mapping.answered and not any(getattr(self.mapping, m) for m in MEASURES):
            cells = self._names["answered"]
            self._refuse_doubtful(cells)
            return {}, np.array([is_no_name(cell) for cell in cells], dtype=bool)
        role = next(role for role in MEASURES if getattr(self.mapping, role))
        values = self._right() if role == "correct" else self._numbers(role)
        if role == "share":
            self._refuse_where((values < 0) | (values > 1), role, "a share from 0 to 1")
        return {"value" if role == "value" else "correct": values}, np.isnan(values)

    def _refuse_doubtful(self, cells: Sequence[str]) -> None:
        """Refuse an answer that may be a name or mean that there is none."""
        presented = set(self._names.get("presented", ()))
        for place in np.flatnonzero(self._chosen).tolist():
            cell = cells[place]
            if cell.casefold() in NO_ANSWER and cell not in presented:
                raise InputError(
                    f"expected an answer in {self._where(place, whole=True)}, got "
                    f"{shown(cell)}, which is an answer of this name or a trial without one; leave "
                    "the cell empty, or choose another name."
                )

    def _numbers(self, role: str) -> Floats:
        """Numbers of the rows that count; those of others may be anything."""
        column = self.mapping.columns[role]
        measured = [r for r in ("share", "value", "count") if r in self.mapping.columns]
        part = self._part
        style = part.numbers([self.mapping.columns[r] for r in measured])
        out = np.full(len(self.table.lines), np.nan)
        out[self._chosen] = part.floats(column, style)
        return out

    @cached_property
    def _part(self) -> OtherTable:
        """The table of the rows that count."""
        lines = [line for line, own in zip(self.table.lines, self._chosen, strict=True) if own]
        return replace(self.table, lines=lines)

    def _right(self) -> Floats:
        """1 for right, 0 for wrong, NaN where there is no answer."""
        cells = self.table.cells(self.mapping.correct)
        right = _key(self.mapping.right)
        out = np.full(len(self.table.lines), np.nan)
        for place in np.flatnonzero(self._chosen).tolist():
            cell = cells[place]
            key = _key(cell)
            if key in NO_NUMBER and (not right or key != right):
                continue
            if right:
                out[place] = float(key == right)
                self.found.codes[cell] += 1
            elif key in RIGHT:
                out[place] = RIGHT[key]
            else:
                raise InputError(
                    f"expected 0 or 1, or true or false, as correct in "
                    f"{self._where(place, whole=True)}, got {shown(cell)}; name the code that "
                    "is right with --right, or a column of shares as share=."
                )
        return out

    @cached_property
    def _count(self) -> Floats:
        if not self.mapping.count:
            return np.ones(len(self.table.lines))
        return self._numbers("count")

    def _whole(self, count: Floats, rows: Mask) -> Floats:
        with np.errstate(invalid="ignore"):
            wrong = rows & ~((count >= 0) & (count == np.floor(count)) & (count < 1e15))
        self._refuse_where(wrong, "count", "a whole count from 0")
        return np.nan_to_num(count)

    def _refuse_where(self, wrong: Mask, role: str, wanted: str) -> None:
        for place in np.flatnonzero(wrong)[:1].tolist():
            cell = self.table.cells(self.mapping.columns[role])[place]
            advice = "divide per cent by 100" if role == "share" else "give the number of answers"
            raise InputError(
                f"expected {wanted} in {self._where(place, whole=True)}, got "
                f"{shown(cell) if cell else 'none'}; {advice}."
            )

    def _refuse_first(self, wrong: Mask, levels: Sequence[str]) -> None:
        for place in np.flatnonzero(wrong)[:1].tolist():
            roles = (*levels, "participant")
            role = next(r for r in roles if r in self._names and is_no_name(self._names[r][place]))
            raise InputError(
                f"expected a value of {self.mapping.columns.get(role, role)} beside the answer in "
                f"{self._where(place, whole=True)}, got none; fill it in, or choose the rows "
                "that are trials with --where."
            )


def _key(text: str) -> str:
    """What equal codes have in common: 1.0 is 1, TRUE is true."""
    key = unicodedata.normalize("NFC", text).casefold().strip()
    whole = re.fullmatch(r"(\d+)[.,]0{1,2}", key)
    return whole[1] if whole else key


def _in_order(name: str) -> tuple[bool, int, str]:
    """Numbers by size before names by letter."""
    return (False, int(name), "") if name.isdecimal() else (True, 0, name.casefold())


def _name_parts(path: Path, factors: tuple[str, ...]) -> list[str]:
    """Participant and levels of the factors from a name like P01_full_day1."""
    parts = path.stem.rsplit("_", len(factors)) if factors else [path.stem]
    if len(parts) != 1 + len(factors) or not all(parts):
        wanted = "_".join(("PARTICIPANT", *factors))
        raise InputError(
            f"expected the file of a matrix to be called {wanted}, got {path}; rename it."
        )
    return parts


def _by_files(rows: pd.DataFrame, mapping: TableMap, found: _Found) -> pd.DataFrame:
    """The rows with the factors that files stand for: which of a participant's files they are."""
    for factor in mapping.factors:
        if factor in rows or factor not in OF_FILES:
            continue
        pairs = rows[["participant_id", "from_file"]].drop_duplicates()
        if factor == "session":
            levels = (pairs.groupby("participant_id", sort=False).cumcount() + 1).astype(str)
        else:
            levels = pairs.apply(lambda pair: _without_name(*pair), axis=1)
        by_file = dict(zip(map(tuple, pairs.to_numpy()), levels, strict=True))
        cells = zip(rows["participant_id"], rows["from_file"], strict=True)
        rows[factor] = [found.labels(factor, by_file[cell]) for cell in cells]
    return rows


def _without_name(participant: str, file: str) -> str:
    """What the name of a file says beside the participant."""
    stem = Path(file).stem
    rest = re.sub(rf"(?<![A-Za-z0-9]){re.escape(participant)}(?![A-Za-z0-9])", "", stem, count=1)
    return rest.strip("_- .") or stem


def _share_of_response(
    rows: pd.DataFrame, mapping: TableMap, found: _Found
) -> tuple[pd.DataFrame, str]:
    """The rows with 1 where the answer is the one whose share is asked for."""
    answers = sorted(set(rows["answered"]), key=_in_order)
    same = [name for name in answers if _key(name) == _key(mapping.right)]
    if not same and (mapping.right or len(answers) != 2):
        got = f"{shown(mapping.right)} and " if mapping.right else ""
        raise InputError(
            f"expected one of the answers {shown(', '.join(answers))} as --right, whose share is "
            f"asked for, got {got}{counted(len(answers), 'answer')}; name one."
        )
    response = same[0] if same else answers[1]
    if not same:
        found.decided.append(
            f"No answer is right: the share of {shown(response)} is shown; --right names another."
        )
    correct = (rows["answered"] == response).astype(float)
    return rows.drop(columns="answered").assign(correct=correct), response


def _check_twice(rows: pd.DataFrame, mapping: TableMap) -> None:
    """Refuse a participant's cell in two files, or twice in a table that sums trials up."""
    cell = ["participant_id", *mapping.factors]
    elsewhere = rows.groupby(cell, sort=False)["from_file"].transform("first") != rows["from_file"]
    again = elsewhere.to_numpy()
    if not mapping.is_matrix and (mapping.count or mapping.share):
        what = [name for name in ("presented", "answered") if name in rows]
        again = again | rows.duplicated([*cell, *(what or ["correct"] * bool(mapping.correct))])
    for row in rows[again].head(1).to_dict("records"):
        raise InputError(
            f"expected each participant and condition once, got {row['participant_id']} again in "
            f"{row['line']}; remove it, name the column that distinguishes them as a factor, or "
            "give factor=session where each file is a session."
        )
