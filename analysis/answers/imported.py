"""Answers in tables of any experiment: trials, counts, shares or matrices, read into one form.

docs/method/tables.md#what-is-read
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import pandas as pd

from tactileq.analysis.answers.matrices import (
    AnswerMatrix,
    answer_matrix,
    check_classes,
    expected_copies,
)
from tactileq.analysis.answers.table_map import OF_FILES, TableMap
from tactileq.analysis.answers.table_rows import RIGHT, Noted, code_of, trials
from tactileq.modeling import InputError
from tactileq.modeling.errors import counted, shown
from tactileq.modeling.files.others.named_table import read_other_table
from tactileq.modeling.files.others.table import OtherTable, first_few, left_out_sentence

FEWEST_COPIES = 0.05  # expected number of equal files by chance, from which on they may be


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
    _check_sessions(mapping)
    for place, times in Counter(Path(path).resolve() for path in files).items():
        if times > 1:
            raise InputError(f"expected each file once, got {place} again; leave one out.")
    found = _Found(mapping)
    for path in files:
        table = read_other_table(Path(path), "a table of answers", wanted=mapping.wanted)
        found.add(replace(table, decimal=mapping.decimal))
    rows = pd.concat(found.rows, ignore_index=True) if found.rows else pd.DataFrame()
    if rows.empty:
        raise InputError("expected answers in the tables, got none; give files with trials.")
    rows = _by_files(rows, mapping, found)
    _check_twice(rows, mapping)
    found.check(rows)
    presented, classes = found.classes(rows)
    notes = found.notes(rows, presented)
    response = ""
    said: tuple[str, ...] = ()
    if mapping.answered and not mapping.presented:
        rows, response, said = _share_of_response(rows, mapping)
    answers = rows.drop(columns=["from_file", "line"])
    return ImportedAnswers(
        answers,
        mapping.factors,
        "value" if mapping.value else "correct",
        classes,
        found.missed,
        presented,
        (*notes, *said),
        response,
    )


class _Found(Noted):
    """What the tables read so far hold, and what of them was left out."""

    def __init__(self, mapping: TableMap) -> None:
        super().__init__()
        self.mapping = mapping
        self.rows: list[pd.DataFrame] = []
        self.tables: list[OtherTable] = []
        self.matrices: list[AnswerMatrix] = []
        self.equal: list[str] = []

    def add(self, table: OtherTable) -> None:
        """Read one more table."""
        self.tables.append(table)
        for what, numbers in table.left_out.items():
            self.leave_out(what, [f"{table.path.name}, line {number}" for number in numbers])
        for what in table.decided:
            self.decide(what, table.path.name)
        if self.mapping.is_matrix:
            matrix = answer_matrix(table, labels=self.labels)
            self.matrices.append(matrix)
            for what in matrix.notes:
                self.decide(what, table.path.name)
            self.rows.append(self._of_matrix(table, matrix))
        else:
            self.rows.append(trials(table, self.mapping, self))

    def _of_matrix(self, table: OtherTable, matrix: AnswerMatrix) -> pd.DataFrame:
        """The answers of one participant in one condition."""
        factors = self.mapping.factors
        who, *levels = _name_parts(table.path, factors)
        rows = matrix.rows().assign(
            participant_id=self.labels("participant", who),
            **{f: self.labels(f, level) for f, level in zip(factors, levels, strict=True)},
            from_file=str(table.path),
        )
        if not matrix.counts.any():
            self.decide("the matrix holds no answers", table.path.name)
        return rows[rows["count"] > 0]

    def check(self, rows: pd.DataFrame) -> None:
        """Refuse what only all tables together show."""
        self.labels.check_numbers()
        if self.matrices:
            self._check_matrices()
        if self.mapping.right and self.mapping.correct:
            self._check_codes()
        self._check_copies(rows)

    def _check_matrices(self) -> None:
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

    def _check_codes(self) -> None:
        """Refuse a code of right answers that a file does not know, or beside which none is."""
        right = code_of(self.mapping.right)
        every = set().union(*self.codes.values())
        if every & set(RIGHT) and every & {"0", "1"}:
            raise InputError(
                f"expected one way of writing right and wrong in column "
                f"{shown(self.mapping.correct)}, got {shown(', '.join(sorted(every)))}; write them "
                "alike, or leave --right out."
            )
        beside = set().union(*(codes for codes in self.codes.values() if right in codes))
        for path, codes in self.codes.items():
            if codes and not set(codes) <= beside:
                raise InputError(
                    f"expected the code {shown(self.mapping.right)} of --right in {path}, got "
                    f"{shown(', '.join(sorted(codes)))}; name a code that is there, or correct the "
                    "cells."
                )
        if beside == {right} and self.missed:
            raise InputError(
                f"expected codes of wrong answers beside {shown(self.mapping.right)} in column "
                f"{shown(self.mapping.correct)}, got only that one and "
                f"{counted(self.missed, 'blank cell')}, which may be wrong answers or none; write "
                "wrong ones out."
            )

    def _check_copies(self, rows: pd.DataFrame) -> None:
        """Refuse two files that hold the same, unless that may well be by chance.

        Where all their cells are the same, those of columns that are not taken count, too.
        """
        whole = {str(t.path): [tuple(line.cells) for line in t.lines] for t in self.tables}
        groups = rows.groupby("from_file", sort=False).groups
        measure = next(name for name in ("value", "correct", "answered") if name in rows)
        alike = {path for path, own in groups.items() if rows.loc[own, measure].nunique() < 2}
        others = {"participant_id", "from_file", "line", *OF_FILES}
        answers = rows.drop(columns=[name for name in rows if name in others])
        held: dict[str, list[object]] = {
            str(path): list(map(tuple, answers.loc[own].to_numpy())) for path, own in groups.items()
        }
        if self.matrices:
            held = {
                path: [*matrix.counts.flat]
                for path, matrix in zip(whole, self.matrices, strict=True)
            }
        first: dict[tuple[object, ...], str] = {}
        for path, own in held.items():
            before = first.setdefault(tuple(own), path)
            if before == path:
                continue
            self.equal.append(f"{Path(before).name} and {Path(path).name}")
            if path in alike:
                continue
            every = whole if whole[path] == whole[before] else held
            places = [every[other] for other in held]
            if expected_copies(places, list(held).index(path)) < FEWEST_COPIES:
                raise InputError(
                    f"expected different answers in each file, got the same in {before} and "
                    f"{path}; leave one out, since a copy would count as another participant."
                )

    def classes(self, rows: pd.DataFrame) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """The classes that were presented, and all with what else was answered."""
        if self.matrices:
            first = self.matrices[0]
            others = (name for name in first.answered if name not in first.presented)
            return first.presented, (*first.presented, *others)
        if not self.mapping.presented:
            return (), ()
        presented = tuple(sorted(set(rows["presented"]), key=in_order))
        never = sorted(set(rows["answered"]) - set(presented), key=in_order)
        names = sorted({table.path.name for table in self.tables})
        check_classes((*presented, *never), ", ".join(names[:3]))
        return presented, (*presented, *never)

    def notes(self, rows: pd.DataFrame, presented: Sequence[str]) -> tuple[str, ...]:
        """A sentence for each kind of lines left out, and for what was decided."""
        sentences = [left_out_sentence(what, places) for what, places in self.left_out.items()]
        if self.missed:
            sentences.append(f"Left out without an answer: {counted(self.missed, 'trial')}.")
        codes = sum(self.codes.values(), Counter[str]())
        if self.mapping.right and codes:
            every = ", ".join(f"{code} ({n})" for code, n in sorted(codes.items()))
            sentences.append(f"Codes of the answers: {every}; right: {self.mapping.right}.")
        sentences.extend(self.labels.notes)
        for what, places in self.decided.items():
            sentences.append(f"{what[0].upper()}{what[1:]} ({first_few(places)}).")
        sentences.extend(_twice_over(self.tables))
        if self.equal:
            pairs = counted(len(self.equal), "pair")
            sentences.append(
                f"{pairs} of files that hold the same ({first_few(self.equal)}); make sure that "
                "none is a copy."
            )
        for word in sorted(set(rows.get("answered", ())) - set(presented)) if presented else ():
            times = int(rows.loc[rows["answered"] == word, "count"].sum())
            sentences.append(
                f"{shown(word)} was answered {counted(times, 'time')} and never presented; it "
                "counts as a wrong answer."
            )
        return tuple(sentences)


def _check_sessions(mapping: TableMap) -> None:
    """Refuse sessions by file without a column of participants: each file would be somebody."""
    if "session" in mapping.factors and not (mapping.participant or mapping.is_matrix):
        raise InputError(
            "expected a column of participants in the map for factor=session, got none; name it as "
            "participant, or give factor=file where files are called PARTICIPANT_LEVEL."
        )


def _twice_over(tables: Sequence[OtherTable]) -> list[str]:
    """A sentence for each file that holds all its rows several times."""
    found = []
    for table in tables:
        cells = [line.cells for line in table.lines]
        for times in (2, 3):
            size = len(cells) // times
            blocks = [cells[n * size : (n + 1) * size] for n in range(times)]
            in_turn = [cells[n::times] for n in range(times)]
            is_whole = size > 1 and size * times == len(cells) and len(set(map(tuple, cells))) > 1
            if is_whole and (
                all(one == blocks[0] for one in blocks)
                or (all(one == in_turn[0] for one in in_turn) and _differ(in_turn[0]))
            ):
                found.append(
                    f"{table.path.name}: all rows are there {times} times, cell by cell (lines "
                    f"{table.lines[0].number} to {table.lines[-1].number}); if the file was joined "
                    "with itself, remove the copies."
                )
                break
    return found


def _differ(rows: Sequence[Sequence[str]]) -> bool:
    """Whether no row is there twice, as where trials are numbered."""
    return len(set(map(tuple, rows))) == len(rows)


def in_order(level: object) -> tuple[bool, float, str]:
    """Key that sorts levels: numbers by size, before names by letter."""
    text = str(level)
    try:
        return False, float(text), ""
    except ValueError:
        return True, 0.0, text.casefold()


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
        for who, files in found.files.items():
            if factor == "session" and len(files) > 1:
                names = ", ".join(Path(file).name for file in files)
                found.decide("sessions are counted in the order of the files", f"{who}: {names}")
        by_file = {
            (who, file): str(number) if factor == "session" else _without_name(who, file)
            for who, files in found.files.items()
            for number, file in enumerate(files, 1)
        }
        cells = zip(rows["participant_id"], rows["from_file"], strict=True)
        rows[factor] = [found.labels(factor, by_file[cell]) for cell in cells]
    return rows


def _without_name(participant: str, file: str) -> str:
    """What the name of a file says beside the participant."""
    stem = Path(file).stem
    rest = re.sub(
        rf"(?<![A-Za-z0-9]){re.escape(participant)}(?![A-Za-z0-9])",
        "",
        stem,
        count=1,
        flags=re.IGNORECASE,
    )
    return rest.strip("_- .") or stem


def _share_of_response(
    rows: pd.DataFrame, mapping: TableMap
) -> tuple[pd.DataFrame, str, tuple[str, ...]]:
    """The rows with 1 where the answer is the one whose share is asked for; it; a note."""
    answers = sorted(set(rows["answered"]), key=in_order)
    same = [name for name in answers if code_of(name) == code_of(mapping.right)]
    if not same and (mapping.right or len(answers) != 2):
        got = f"{shown(mapping.right)} and " if mapping.right else ""
        raise InputError(
            f"expected one of the answers {shown(', '.join(answers))} as --right, whose share is "
            f"asked for, got {got}{counted(len(answers), 'answer')}; name one."
        )
    response = same[0] if same else answers[1]
    note = f"No answer is right: the share of {shown(response)} is shown; --right names another."
    correct = (rows["answered"] == response).astype(float)
    return (
        rows.drop(columns="answered").assign(correct=correct),
        response,
        () if same else (note,),
    )


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
