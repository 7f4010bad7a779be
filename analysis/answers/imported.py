"""Answers in tables of any experiment: trials, counts, shares or matrices, read into one form.

docs/method/tables.md#what-is-read
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import pandas as pd

from tactileq.modeling import InputError
from tactileq.modeling.errors import shortened, shown
from tactileq.modeling.files.reading import read_text

ROLES = ("participant", "presented", "answered", "correct", "share", "value", "count")
# Names of columns of the tables that follow from these.
RESERVED = frozenset(
    {"participant_id", "presented", "answered", "correct", "value", "count", "file", "where"}
    | {"condition", "trials", "n", "mean", "ci_low", "ci_high"}
)
FEWEST_CLASSES, MOST_CLASSES = 3, 16
MISSING = frozenset({"", "nan", "na", "n/a", "#n/a", "null", "none", "."})
WHOLE_WITH_DECIMALS = re.compile(r"(\d+)[.,]0+")  # 1.0, as programs write whole numbers
MOST_NAMES = 200  # characters of the names of columns that a refusal lists
MAP_ADVICE = "write it like correct=TYPE_ANS,factor=TYPE,participant=ID"


@dataclass(frozen=True)
class TableMap:
    """Which column means what; empty where the tables have no such column.

    Without correct, share, value, presented and answered each file is one confusion matrix.
    Without participant the file's name is the participant's.
    """

    participant: str = ""
    presented: str = ""
    answered: str = ""
    correct: str = ""
    share: str = ""
    value: str = ""
    count: str = ""
    factors: tuple[str, ...] = ()

    @property
    def is_matrix(self) -> bool:
        """Whether the files are matrices."""
        return not any((self.presented, self.correct, self.share, self.value))

    @property
    def columns(self) -> dict[str, str]:
        """Role to column, of those that were named."""
        return {role: getattr(self, role) for role in ROLES if getattr(self, role)}


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
        Of the confusion matrices, in order; empty where there are none.
    missed : int
        Trials without an answer; they are not among the answers.
    presented : tuple of str
        Classes that were presented, in order; empty: all of them.
    notes : tuple of str
        What was decided while reading, a sentence each.
    response : str
        Where no answer is right, the response whose share `correct` holds; else empty.
    """

    answers: pd.DataFrame
    factors: tuple[str, ...]
    measure: str
    classes: tuple[str, ...] = ()
    missed: int = 0
    presented: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    response: str = ""


@dataclass(frozen=True)
class _Line:
    """Cells of one line, without blanks around them, and where it stands."""

    where: str
    cells: list[str]


@dataclass(frozen=True)
class _File:
    path: Path
    header: _Line
    lines: list[_Line]
    decimal_comma: bool


def parse_map(text: str) -> TableMap:
    """The map as the command line has it: `correct=TYPE_ANS,factor=TYPE,factor=SIZE`.

    Raises
    ------
    InputError
        For other words than the roles, one of them twice, or roles that do not go together.
    """
    columns: dict[str, str] = {}
    factors: list[str] = []
    for part in filter(None, (part.strip() for part in text.split(","))):
        role, equals, column = (piece.strip() for piece in part.partition("="))
        if not equals or not column or role not in (*ROLES, "factor"):
            raise InputError(
                f"expected factor or one of {', '.join(ROLES)}, = and a column in the map, got "
                f"{shown(part)}; {MAP_ADVICE}."
            )
        if column in factors or role in columns:
            raise InputError(
                f"expected each column once in the map, got {shown(part)} again; {MAP_ADVICE}."
            )
        if role == "factor":
            factors.append(column)
        else:
            columns[role] = column
    mapping = TableMap(**columns, factors=tuple(factors))
    _check_map(mapping)
    return mapping


def _check_map(mapping: TableMap) -> None:
    measures = [role for role in ("correct", "share", "value") if getattr(mapping, role)]
    if len(measures) > 1:
        raise InputError(
            f"expected one measure in the map, got {' and '.join(measures)}; analyse one at a time."
        )
    if bool(mapping.presented) != bool(mapping.answered):
        raise InputError(
            "expected presented and answered together in the map, got only one of them; "
            "name the other column, too."
        )
    if mapping.is_matrix and (mapping.participant or mapping.count):
        raise InputError(
            "expected correct, share, value, or presented and answered in the map, got none of "
            f"them; {MAP_ADVICE}."
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
        Text in UTF-8, with or without a byte order mark; columns are separated by commas,
        semicolons (then numbers may have a decimal comma) or tabs.

    Raises
    ------
    InputError
        Naming file and line, where a table does not hold what the map says.
    """
    labels = _Labels()
    tables: list[pd.DataFrame] = []
    classes: tuple[str, ...] = ()
    missed = 0
    for path in files:
        file = _read(Path(path))
        if mapping.is_matrix:
            table, classes = _matrix(file, mapping.factors, labels=labels, classes=classes)
        else:
            table, without_answer = _rows(file, mapping, labels=labels)
            missed += without_answer
        tables.append(table)
    rows = pd.concat(tables, ignore_index=True) if tables else pd.DataFrame()
    if rows.empty:
        raise InputError("expected answers in the tables, got none; give files with trials.")
    _check_twice(rows, mapping)
    if mapping.presented:
        classes = tuple(sorted({*rows["presented"], *rows["answered"]}, key=_in_order))
        _check_classes(classes, ", ".join(sorted({Path(path).name for path in files})[:3]))
    measure = "value" if mapping.value else "correct"
    answers = rows.drop(columns=["file", "where"])
    return ImportedAnswers(answers, mapping.factors, measure, classes, missed)


class _Labels:
    """Names as they were spelt first: canvas and Canvas are one, 1.0 is 1."""

    def __init__(self) -> None:
        self.first: dict[tuple[str, str], str] = {}

    def __call__(self, column: str, text: str) -> str:
        whole = WHOLE_WITH_DECIMALS.fullmatch(text)
        name = whole[1] if whole else text
        return self.first.setdefault((column, name.casefold()), name)


def _in_order(name: str) -> tuple[bool, int, str]:
    """Numbers by size before names by letter."""
    return (False, int(name), "") if name.isdecimal() else (True, 0, name.casefold())


def _read(path: Path) -> _File:
    text = read_text(path, "a table of answers")
    first = text.lstrip("\n").split("\n", 1)[0]
    delimiter = max("\t;,", key=first.count)
    reader = csv.reader(io.StringIO(text), delimiter=delimiter)
    lines = []
    try:
        for cells in reader:
            stripped = [cell.strip() for cell in cells]
            if any(stripped):
                lines.append(_Line(f"{path}, line {reader.line_num}", stripped))
    except csv.Error as error:
        raise InputError(
            f"expected a table in {path}, line {reader.line_num}, got {error}; save it as CSV."
        ) from None
    if len(lines) < 2:
        raise InputError(
            f"expected a line of names and lines of answers in {path}, got "
            f"{len(lines)} lines; give a file with answers."
        )
    header, *rest = lines
    full = [_full_line(line, len(header.cells)) for line in rest]
    return _File(path, header, full, decimal_comma=delimiter != ",")


def _full_line(line: _Line, width: int) -> _Line:
    """The line with as many cells as the first one; spreadsheets add and drop empty ones."""
    extra = line.cells[width:]
    if any(extra):
        raise InputError(
            f"expected {width} columns in {line.where}, got {len(line.cells)}; "
            "make all lines as long as the first."
        )
    cells = [*line.cells[:width], *[""] * (width - len(line.cells))]
    return replace(line, cells=cells)


def _place(file: _File, column: str) -> int:
    """Where a column is: by its name, else by its name in other letters' case."""
    names = file.header.cells
    same = [i for i, name in enumerate(names) if name == column]
    same = same or [i for i, name in enumerate(names) if name.casefold() == column.casefold()]
    if len(same) != 1:
        what = "no such column" if not same else f"{len(same)} columns of that name"
        there = shortened(", ".join(name for name in names if name), longest=MOST_NAMES)
        raise InputError(
            f"expected one column {shown(column)} in {file.header.where}, got {what}; "
            f"there are {there}."
        )
    return same[0]


def _is_missing(text: str) -> bool:
    return text.casefold() in MISSING


def _rows(file: _File, mapping: TableMap, *, labels: _Labels) -> tuple[pd.DataFrame, int]:
    """The answers of a file with one row per trial, count or share; and trials without one."""
    columns = {**mapping.columns, **{f"factor {name}": name for name in mapping.factors}}
    places = {role: _place(file, column) for role, column in columns.items()}
    rows, missed = [], 0
    for line in file.lines:
        cells = {role: line.cells[place] for role, place in places.items()}
        count = _count(cells.get("count", "1"), line.where, decimal_comma=file.decimal_comma)
        for role in ("participant", "presented", *(f"factor {f}" for f in mapping.factors)):
            if role in cells and _is_missing(cells[role]):
                raise InputError(
                    f"expected a value of {columns[role]} in {line.where}, got none; "
                    "fill it in or remove the line."
                )
        answer = [cells[r] for r in ("answered", "correct", "share", "value") if r in cells]
        if any(_is_missing(text) for text in answer):
            missed += count
            continue
        named = {name: labels(name, cells[f"factor {name}"]) for name in mapping.factors}
        who = labels("participant", cells.get("participant", file.path.stem))
        row = {"participant_id": who, **named, "count": count}
        row |= _measured(cells, line.where, labels=labels, decimal_comma=file.decimal_comma)
        if count:
            rows.append({**row, "file": str(file.path), "where": line.where})
    return pd.DataFrame(rows), missed


def _measured(
    cells: dict[str, str], where: str, *, labels: _Labels, decimal_comma: bool
) -> dict[str, object]:
    """What a line says of the answer."""
    row: dict[str, object] = {}
    if "presented" in cells:
        for role in ("presented", "answered"):
            row[role] = labels("class", cells[role])
        row["correct"] = float(row["presented"] == row["answered"])
    if "correct" in cells:
        row["correct"] = _number(cells["correct"], where, decimal_comma=decimal_comma)
        if row["correct"] not in (0.0, 1.0):
            raise InputError(
                f"expected 0 or 1 as correct in {where}, got {shown(cells['correct'])}; "
                "name a column of shares as share=."
            )
    if "share" in cells:
        share = _number(cells["share"], where, decimal_comma=decimal_comma)
        row["correct"] = share
        if not 0 <= share <= 1:
            raise InputError(
                f"expected a share from 0 to 1 in {where}, got {shown(cells['share'])}; "
                "divide per cent by 100."
            )
    if "value" in cells:
        row["value"] = _number(cells["value"], where, decimal_comma=decimal_comma)
    return row


def _number(text: str, where: str, *, decimal_comma: bool) -> float:
    plain = text.replace(",", ".") if decimal_comma else text
    try:
        value = float(plain)
    except ValueError:
        value = float("nan")
    if not abs(value) < float("inf"):
        raise InputError(f"expected a number in {where}, got {shown(text)}; correct that cell.")
    return value


def _count(text: str, where: str, *, decimal_comma: bool) -> int:
    count = _number(text, where, decimal_comma=decimal_comma)
    if count < 0 or count != int(count):
        raise InputError(
            f"expected a whole count from 0 in {where}, got {shown(text)}; "
            "give the number of answers."
        )
    return int(count)


def _matrix(
    file: _File, factors: tuple[str, ...], *, labels: _Labels, classes: tuple[str, ...]
) -> tuple[pd.DataFrame, tuple[str, ...]]:
    """The answers of one participant in one condition, rows presented and columns answered."""
    who, *levels = _name_parts(file.path, factors)
    answered = tuple(labels("class", name) for name in file.header.cells[1:] if name)
    presented = tuple(labels("class", line.cells[0]) for line in file.lines)
    _check_matrix(file, presented=presented, answered=answered, before=classes)
    fixed = {"participant_id": labels("participant", who)}
    fixed |= {f: labels(f, level) for f, level in zip(factors, levels, strict=True)}
    rows = [
        fixed
        | {"count": _count(cell or "0", line.where, decimal_comma=file.decimal_comma)}
        | {"presented": row, "answered": column, "correct": float(row == column)}
        | {"file": str(file.path), "where": line.where}
        for line, row in zip(file.lines, presented, strict=True)
        for column, cell in zip(answered, line.cells[1:], strict=False)
    ]
    table = pd.DataFrame(rows)
    return table[table["count"] > 0], classes or answered


def _name_parts(path: Path, factors: tuple[str, ...]) -> list[str]:
    """Participant and levels of the factors from a name like P01_full_day1."""
    parts = path.stem.rsplit("_", len(factors)) if factors else [path.stem]
    if len(parts) != 1 + len(factors) or not all(parts):
        wanted = "_".join(("PARTICIPANT", *factors))
        raise InputError(
            f"expected the file of a matrix to be called {wanted}, got {path}; rename it."
        )
    return parts


def _check_matrix(
    file: _File, *, presented: Sequence[str], answered: Sequence[str], before: Sequence[str]
) -> None:
    if sorted(presented) != sorted(answered) or len(set(answered)) != len(answered):
        raise InputError(
            f"expected the same classes, each once, in the first row and column of {file.path}, "
            f"got {shown(', '.join(answered))} and {shown(', '.join(presented))}; make the matrix "
            "square."
        )
    _check_classes(answered, file.header.where)
    if before and sorted(answered) != sorted(before):
        raise InputError(
            f"expected the classes of the files before ({shown(', '.join(before))}) in "
            f"{file.header.where}, got {shown(', '.join(answered))}; analyse them on their own."
        )


def _check_classes(classes: Sequence[str], where: str) -> None:
    if not FEWEST_CLASSES <= len(classes) <= MOST_CLASSES:
        raise InputError(
            f"expected {FEWEST_CLASSES} to {MOST_CLASSES} classes in {where}, got {len(classes)}; "
            "check the columns named in the map."
        )


def _check_twice(rows: pd.DataFrame, mapping: TableMap) -> None:
    """Refuse a participant's cell in two files, or twice in a table that sums trials up."""
    cell = ["participant_id", *mapping.factors]
    elsewhere = rows.groupby(cell, sort=False)["file"].transform("first") != rows["file"]
    again = elsewhere.to_numpy()
    if not mapping.is_matrix and (mapping.count or mapping.share):
        what = [name for name in ("presented", "answered") if name in rows]
        again = again | rows.duplicated([*cell, *(what or ["correct"] * bool(mapping.correct))])
    for row in rows[again].head(1).to_dict("records"):
        raise InputError(
            f"expected each participant and condition once, got {row['participant_id']} again in "
            f"{row['where']}; remove it, or name the column that distinguishes them as a factor."
        )
