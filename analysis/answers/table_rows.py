"""Rows of tables of any experiment: which of them are trials, and what was answered in each.

docs/method/tables.md#what-is-read
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt
import pandas as pd

from tactileq.analysis.answers.matrices import MOST_COUNTED, is_named_sum
from tactileq.analysis.answers.table_map import MEASURE_ROLES, OF_FILES, TableMap
from tactileq.modeling import InputError
from tactileq.modeling.arrays import Floats
from tactileq.modeling.errors import shown
from tactileq.modeling.files.others.labels import Labels, is_no_name, same_label, without_zeros
from tactileq.modeling.files.others.numbers import NO_NUMBER, PLAIN_STYLE
from tactileq.modeling.files.others.table import OtherTable, same_name

RIGHT = {"true": 1.0, "false": 0.0}
NO_ANSWER = frozenset({"na", "null", "."})  # what may be an answer of this name, or none

Mask = npt.NDArray[np.bool_]


@dataclass
class Noted:
    """What of all tables was left out or counted on the way."""

    labels: Labels = field(default_factory=Labels)
    missed: int = 0
    left_out: dict[str, list[str]] = field(default_factory=dict)
    codes: dict[str, Counter[str]] = field(default_factory=dict)
    decided: dict[str, list[str]] = field(default_factory=dict)
    files: dict[str, dict[str, None]] = field(default_factory=dict)  # of each participant, in order

    def leave_out(self, what: str, places: Sequence[str]) -> None:
        """Count lines that are no trials, by why."""
        if places:
            self.left_out.setdefault(what, []).extend(places)

    def decide(self, what: str, place: str) -> None:
        """Note what was decided, and where."""
        self.decided.setdefault(what, []).append(place)


def code_of(text: str) -> str:
    """What equal codes have in common: 1.0 is 1, TRUE is true."""
    return without_zeros(same_label(text))


def trials(table: OtherTable, mapping: TableMap, noted: Noted) -> pd.DataFrame:
    """The answered trials of a table with one row per trial, count or share.

    Returns
    -------
    DataFrame
        participant_id, the factors that are columns, presented and answered where known, correct or
        value, count, from_file and line.

    Raises
    ------
    InputError
        Naming the line that does not hold what the map says.
    """
    return _Rows(table, mapping, noted).read()


class _Rows:
    """The rows of a table that --where lets through, and its columns by role."""

    def __init__(self, table: OtherTable, mapping: TableMap, noted: Noted) -> None:
        self.mapping, self.noted = mapping, noted
        self.table = self._chosen(table)
        self.factors = [
            name
            for name in mapping.factors
            if name not in OF_FILES or same_name(name) in map(same_name, table.names)
        ]

    def _chosen(self, table: OtherTable) -> OtherTable:
        """The table with the rows that --where lets through."""
        chosen = np.ones(len(table.lines), dtype=bool)
        for column, values in self.mapping.where.items():
            wanted = set(map(code_of, values))
            cells = table.cells(column, may_be_cut=True)
            fits = np.array([code_of(cell) in wanted for cell in cells], dtype=bool)
            if not fits.any():
                there = ", ".join(list(dict.fromkeys(cells))[:5])
                raise InputError(
                    f"expected rows with {' or '.join(values)} in column {shown(column)} of "
                    f"{table.path}, got {there}; correct --where."
                )
            chosen &= fits
        left_out = [line.number for line, own in zip(table.lines, chosen, strict=True) if not own]
        places = [f"{table.path.name}, line {number}" for number in left_out]
        self.noted.leave_out("have another value than --where names", places)
        lines = [line for line, own in zip(table.lines, chosen, strict=True) if own]
        return replace(table, lines=lines)

    def read(self) -> pd.DataFrame:
        """The trials with an answer."""
        names = self._names
        answer, no_answer = self._answer()
        levels = [role for role in names if role not in ("participant", "answered")]
        no_level = self._missing(levels)
        no_name = self._missing(["participant"] if "participant" in names else [])
        no_trial = no_answer & (no_level | no_name)
        self._refuse_first(~no_answer & (no_level | no_name), levels)
        self._refuse_sums(~no_trial)
        count = self._count(~no_trial)
        self.noted.missed += int(count[no_answer & ~no_trial].sum())
        places = [self._where(i) for i in np.flatnonzero(no_trial).tolist()]
        self.noted.leave_out(f"have no answer{' and no level' * bool(levels)}", places)
        who = names.pop("participant", [self._own_name] * len(self.table.lines))
        for name, left_out in zip(who, no_trial, strict=True):
            if not left_out:
                self.noted.files.setdefault(name, {})[str(self.table.path)] = None
        kept = ~no_answer & (count > 0)
        columns = {"participant_id": who, **names, **answer}
        rows = pd.DataFrame(
            {role: np.array(cells, dtype=object)[kept] for role, cells in columns.items()}
        )
        rows = rows.astype(dict.fromkeys(answer, float))
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
        return self.noted.labels("participant", parts[0])

    def _where(self, place: int, *, whole: bool = False) -> str:
        line = self.table.lines[place]
        return self.table.where(line) if whole else f"{self.table.path.name}, line {line.number}"

    @cached_property
    def _names(self) -> dict[str, list[str]]:
        """Cells of the columns that hold names, by role or factor."""
        of, mapping = self.noted.labels.of, self.mapping
        names: dict[str, list[str]] = {}
        if mapping.participant:
            names["participant"] = of(self.table, [mapping.participant], "participant")[0]
        names |= {name: of(self.table, [name], name)[0] for name in self.factors}
        classes = {r: c for r, c in mapping.columns.items() if r in ("presented", "answered")}
        both = of(self.table, list(classes.values()), "class") if classes else []
        return names | dict(zip(classes, both, strict=True))

    def _missing(self, roles: Iterable[str]) -> Mask:
        none = np.zeros(len(self.table.lines), dtype=bool)
        for role in roles:
            none |= np.array([is_no_name(cell) for cell in self._names[role]], dtype=bool)
        return none

    def _answer(self) -> tuple[dict[str, Floats], Mask]:
        """The measure of each row, and which rows have none."""
        role = next((role for role in MEASURE_ROLES if getattr(self.mapping, role)), "")
        if not role:
            cells = self._names["answered"]
            self._refuse_doubtful(cells)
            none = [is_no_name(cell) or cell.casefold() in NO_ANSWER for cell in cells]
            return {}, np.array(none, dtype=bool)
        values = self._right() if role == "correct" else self._numbers(role)
        if role == "share":
            self._refuse_where((values < 0) | (values > 1), role, "a share from 0 to 1")
        return {"value" if role == "value" else "correct": values}, np.isnan(values)

    def _refuse_doubtful(self, cells: Sequence[str]) -> None:
        """Refuse an answer that may be a name or mean that there is none."""
        presented = self._names.get("presented", [""] * len(cells))
        for place, cell in enumerate(cells):
            no_trial = bool(self.mapping.presented) and is_no_name(presented[place])
            if cell.casefold() in NO_ANSWER and not no_trial:
                raise InputError(
                    f"expected an answer in {self._where(place, whole=True)}, got {shown(cell)}, "
                    "which is an answer of this name or a trial without one; leave the cell empty, "
                    "choose another name, or choose the rows that are trials with --where."
                )

    def _numbers(self, role: str) -> Floats:
        measured = [r for r in ("share", "value", "count") if r in self.mapping.columns]
        columns = [self.mapping.columns[r] for r in measured]
        style = self.table.numbers(columns, whole=measured == ["count"])
        return self.table.floats(self.mapping.columns[role], style)

    def _right(self) -> Floats:
        """1 for right, 0 for wrong, NaN where there is no answer."""
        cells = self.table.cells(self.mapping.correct)
        right = code_of(self.mapping.right)
        codes = self.noted.codes.setdefault(str(self.table.path), Counter())
        out = np.full(len(self.table.lines), np.nan)
        for place, cell in enumerate(cells):
            code = code_of(cell)
            if code in NO_NUMBER and (not right or code != right):
                continue
            if right:
                out[place] = float(code == right)
                codes[code] += 1
            elif PLAIN_STYLE.pattern.fullmatch(cell) and float(cell) in (0.0, 1.0):
                out[place] = float(cell)
            elif code in RIGHT:
                out[place] = RIGHT[code]
            else:
                raise InputError(
                    f"expected 0 or 1, or true or false, as correct in "
                    f"{self._where(place, whole=True)}, got {shown(cell)}; name the code "
                    "that is right with --right, or a column of shares as share=."
                )
        return out

    def _count(self, rows: Mask) -> Floats:
        """How many trials each row stands for; 0 for those that are none."""
        if not self.mapping.count:
            return rows.astype(float)
        count = self._numbers("count")
        with np.errstate(invalid="ignore"):
            wrong = ~((count >= 0) & (count == np.floor(count)) & (count <= MOST_COUNTED))
        self._refuse_where(rows & wrong, "count", "a whole count from 0")
        return np.where(rows, count, 0)

    def _refuse_where(self, wrong: Mask, role: str, wanted: str) -> None:
        for place in np.flatnonzero(wrong)[:1].tolist():
            cell = self.table.cells(self.mapping.columns[role])[place]
            advice = "divide per cent by 100" if role == "share" else "give the number of answers"
            raise InputError(
                f"expected {wanted} in {self._where(place, whole=True)}, got "
                f"{shown(cell) if cell else 'none'}; {advice}."
            )

    def _refuse_sums(self, rows: Mask) -> None:
        """Refuse rows that by their names sum others up: they would count once more."""
        for role, cells in self._names.items():
            times = Counter(cells)
            usual = max(times.values(), default=0) / 2
            for place in np.flatnonzero(rows).tolist():
                name, is_level = cells[place], role in self.factors
                # A level of as many trials as others sums nothing up.
                is_condition = is_level and self._is_of_trials and times[name] >= usual
                if is_named_sum(name, is_level=is_level) and not is_condition:
                    raise InputError(
                        f"expected a row of one {'level' if is_level else role} in "
                        f"{self._where(place, whole=True)}, got {shown(name)}, which is a name, or "
                        "sums other rows up; rename it, or remove the row."
                    )

    @property
    def _is_of_trials(self) -> bool:
        """Whether a row is a trial, and no summary of some."""
        return not (self.mapping.count or self.mapping.share)

    def _refuse_first(self, wrong: Mask, levels: Sequence[str]) -> None:
        for place in np.flatnonzero(wrong)[:1].tolist():
            roles = (*levels, "participant")
            role = next(r for r in roles if r in self._names and is_no_name(self._names[r][place]))
            raise InputError(
                f"expected a value of {self.mapping.columns.get(role, role)} beside the answer in "
                f"{self._where(place, whole=True)}, got {self._names[role][place] or 'none'} "
                "(which counts as none); fill it in, or choose the rows that are trials with "
                "--where."
            )
