"""The answers of one session, checked: what cannot have been given is refused.

docs/data.md
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from tactileq.analysis.answers.gathering import Gathered
from tactileq.modeling import InputError
from tactileq.modeling.errors import shown
from tactileq.modeling.files.answer_tables import (
    ANSWER_TABLES,
    AnswerColumn,
)
from tactileq.modeling.files.columns import Column, names
from tactileq.modeling.files.documents import read_json_object
from tactileq.modeling.files.tables import read_table

_RESTS_ON = ("StudySHA256", "ModelsSHA256")
# In what a session may differ if its manifest records the reason, and under which word.
MAY_DIFFER = {
    "StudySHA256": "study",
    "ModelsSHA256": "models",
    "TextsSHA256": "texts",
    "Pilot": "pilot",
}
_ADVICE = "correct it, or delete the file, which tactileq study status makes again from the log"


def json_object(path: Path) -> Mapping[str, object]:
    return read_json_object(path, advice="restore the file")


def valid_trials(table: pd.DataFrame, what: str, *, warnings: list[str]) -> pd.DataFrame:
    """The answers to trials in which the rig presented what was planned; warns of the others."""
    failed = table["valid"] == 0
    if failed.any():
        again = int((failed & table["trial"].isin(table["repeats"])).sum())
        warnings.append(
            f"{what}: {int(failed.sum())} of {len(table)} answers left out, since the rig failed "
            f"in their trials ({again} repeated)."
        )
    return table[~failed].reset_index(drop=True)


def checked_sidecar(
    path: Path, origin: Mapping[str, object], what: str, *, warnings: list[str]
) -> Mapping[str, object]:
    """The sidecar of a session, refused where it says otherwise than the data set what it is of."""
    if not path.is_file() and any(key in origin for key in _RESTS_ON):
        raise InputError(
            f"expected the sidecar {path}, which names the study and the models of the session, "
            "found none; restore the file."
        )
    sidecar = json_object(path) if path.is_file() else {}
    allowed = _overridden(sidecar, what, warnings=warnings)
    warnings += _damaged(sidecar, what)
    for key, value in origin.items():
        if sidecar.get(key, value) == value or MAY_DIFFER.get(key) in allowed:
            continue
        is_hash = key.endswith("SHA256")
        found = "another" if is_hash else json.dumps(sidecar[key])
        wanted = f"one {key}" if is_hash else f"{key} {json.dumps(value)}"
        raise InputError(
            f"expected {wanted} in {path}, as dataset_description.json says, "
            f"never a mixture, but found {found}; correct the file or leave "
            "its session out."
        )
    return sidecar


def _overridden(sidecar: Mapping[str, object], what: str, *, warnings: list[str]) -> frozenset[str]:
    """The rules that a session overrode, each with its reason."""
    stated = sidecar.get("Overrides", [])
    records = [r for r in stated if isinstance(r, Mapping)] if isinstance(stated, list) else []
    for record in records:
        warnings.append(
            f"{what} was continued against a rule ({record.get('what')}): {record.get('reason')}."
        )
    return frozenset(str(record.get("what")) for record in records)


def _damaged(sidecar: Mapping[str, object], what: str) -> list[str]:
    """A sentence for what of a session's traces is damaged, and in none of its tables."""
    stated = sidecar.get("Damaged")
    tables = stated.values() if isinstance(stated, Mapping) else ()
    return [
        f"{what}: damaged and left out: {row}."
        for rows in tables
        for row in (rows if isinstance(rows, list) else [])
    ]


def check_session(table: pd.DataFrame, task: str, *, path: Path, simulated: bool) -> None:
    """Refuse what each cell may be, but all of them together cannot."""
    columns = {column.name: column for column in ANSWER_TABLES[task].columns}
    check_simulated(table, simulated, path=path)
    twice = table.duplicated("trial")
    _refuse(twice, table["trial"], expected="every trial once", path=path)
    _check_choices(table, columns, path=path)


def check_known(table: pd.DataFrame, gathered: Gathered, *, path: Path) -> None:
    """Refuse textures and sets of models that the study does not have, where it is known."""
    if not gathered.sets:
        return
    sets, textures = gathered.sets, sorted(gathered.textures)
    of_textures = ("texture", *(known.other_texture for known in ANSWER_TABLES.values()))
    named = [(column, textures, "textures") for column in dict.fromkeys(of_textures) if column]
    for column, known, what in (("model", sets, "sets of models"), *named):
        if column in table:
            other = ~table[column].isin(list(known)) & table[column].notna()
            expected = f"{' or '.join(known)}, the study's {what}, in column {column}"
            _refuse(other, table[column], expected=expected, path=path)


def _check_choices(table: pd.DataFrame, columns: Mapping[str, AnswerColumn], *, path: Path) -> None:
    """Where there is a right answer: whether `correct` agrees with it and it was on a button."""
    if not {"answer", "correct"} <= columns.keys():
        return
    answered = table[table["answer"].notna()]
    if "layout" in columns and columns["answer"].limits is None:
        layouts = [str(layout).split("|") for layout in answered["layout"]]
        absent = [
            answer not in layout for answer, layout in zip(answered["answer"], layouts, strict=True)
        ]
        _refuse(
            pd.Series(absent, index=answered.index, dtype=bool),
            answered["answer"],
            expected="an answer that stands in its trial's layout",
            path=path,
        )
    right = columns["answer"].right
    _refuse(
        (answered["answer"] == answered[right]).astype(float) != answered["correct"],
        answered["correct"],
        expected=f"correct = 1 exactly where answer and {right} agree",
        path=path,
    )


def check_simulated(table: pd.DataFrame, simulated: bool, *, path: Path) -> None:
    expected = "true" if simulated else "false"
    _refuse(
        table["simulated"] != expected,
        table["simulated"],
        expected=f"simulated = {expected}, as dataset_description.json says, never a mixture,",
        path=path,
    )


def _refuse(wrong: pd.Series, column: pd.Series, *, expected: str, path: Path) -> None:
    if wrong.any():
        row = int(np.flatnonzero(wrong.to_numpy())[0])
        value = column.loc[wrong[wrong].index[0]]
        found = "n/a" if pd.isna(value) else value
        raise InputError(
            f"expected {expected} in {path}, but answer {row + 1} has {shown(found)}; correct the "
            "file or leave it out."
        )


def read_answers_table(path: Path, columns: Sequence[Column]) -> pd.DataFrame:
    """A table of BIDS: numbers as floats, NaN where there is no value."""
    rows = read_table(path, columns, bids=True, advice=_ADVICE)
    header = dict.fromkeys([*names(columns), *(rows[0] if rows else ())])
    table = pd.DataFrame(rows, columns=list(header), dtype=object)
    numbers = dict.fromkeys((c.name for c in columns if c.limits is not None), float)
    return table.astype(numbers).fillna(np.nan)
