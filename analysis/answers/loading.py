"""Read what the experiments wrote: one folder of tab-separated files, checked before use."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pandas as pd

from analysis.answers.order import (
    check_order,
    check_stored,
    planned_trials,
    told_of_unordered,
    with_repeats,
)
from analysis.labels import MODELS
from modeling import InputError
from modeling.errors import shown
from modeling.files.answer_tables import ANSWER_TABLES
from modeling.files.documents import read_json_object
from modeling.files.hashes import sha256_of_values
from modeling.files.reading import read_bytes
from modeling.files.tables import check_named_once

_SIMULATED = ("Simulated", "SimulatedParticipant", "SimulatedRig")
_RESTS_ON = ("StudySHA256", "ModelsSHA256")


@dataclass(frozen=True)
class PlannedTask:
    """How many participants are to do a task, in how many sessions altogether."""

    participants: int
    sessions: int


@dataclass(frozen=True, eq=False)
class Responses:
    """Every answer of one study, checked.

    Parameters
    ----------
    answers : mapping of task to DataFrame
        Main trials of each task that `modeling.files.answer_tables` declares, one row each:
        participant_id, session, and the task's columns (numbers NaN where not answered).
    simulated_participants : bool
        True where no person took part.
    simulated_rig : bool
        True where no real rig was used, so that nobody felt a real surface.
    training : mapping of task to DataFrame
        The training trials, same columns; no statistic uses them.
    name : str
        The study's name.
    models : mapping of texture to mapping of kind to SHA-256
        The full and the simplified model that were presented; empty where the data do not say.
    study_sha256 : str
        Of the study that was run; empty where the data do not say.
    planned : mapping of task to PlannedTask
        How many are to take part, where the data set's description tells.
    warnings : tuple of str
        What was dropped on reading and why, and which sessions ended early, one sentence each.
    """

    answers: Mapping[str, pd.DataFrame]
    simulated_participants: bool
    simulated_rig: bool
    training: Mapping[str, pd.DataFrame] = field(default_factory=dict)
    name: str = ""
    models: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    study_sha256: str = ""
    planned: Mapping[str, PlannedTask] = field(default_factory=dict)
    warnings: tuple[str, ...] = field(default=())

    @property
    def identical(self) -> frozenset[str]:
        """Textures whose full and simplified model are the same: nothing to compare."""
        return frozenset(
            texture for texture, kinds in self.models.items() if len(set(kinds.values())) == 1
        )

    @property
    def absolute(self) -> pd.DataFrame:
        """Main trials of the absolute evaluation."""
        return self.answers["absolute"]

    @property
    def relative(self) -> pd.DataFrame:
        """Main trials of the seven-alternative forced choice."""
        return self.answers["relative"]

    @property
    def textures(self) -> tuple[str, ...]:
        """Textures that were asked about, in the order of the answers."""
        asked = (texture for table in self.answers.values() for texture in table["texture"])
        return tuple(dict.fromkeys(asked))

    def done(self, task: str) -> PlannedTask:
        """How many participants and sessions have answered main trials of a task so far."""
        answers = self.answers[task]
        sessions = answers.reindex(columns=["participant_id", "session"]).drop_duplicates()
        return PlannedTask(answers["participant_id"].nunique(), len(sessions))

    @property
    def unfinished(self) -> tuple[str, ...]:
        """Tasks that were begun, with fewer participants or sessions than planned."""
        short = []
        for task, planned in self.planned.items():
            done = self.done(task)
            fewer = done.participants < planned.participants or done.sessions < planned.sessions
            if done.participants and fewer:
                short.append(task)
        return tuple(short)

    @property
    def simulated(self) -> bool:
        """True where participants or rig were simulated."""
        return self.simulated_participants or self.simulated_rig


def load_responses(data_folder: str | Path) -> Responses:
    """Load and check all answers of a study.

    Parameters
    ----------
    data_folder : str or Path
        Folder holding dataset_description.json, participants.tsv and
        sub-*/ses-*/beh/sub-*_ses-*_task-TASK_beh.tsv; beside each its sidecar, and
        below sourcedata/ the order of its trials, where they are there. Answers must follow that
        order, trial by trial.

    Returns
    -------
    Responses
        A last line cut short by a killed process is dropped and named in `warnings`; so is a
        session with fewer answers than planned trials, one without a stored order, and how many
        answers to invalid trials were left out.

    Raises
    ------
    InputError
        Where the folder is none, a file is malformed, a value is out of range, answers are not
        those to the trials that were planned, or answers are mixed that differ in whether
        participants or rig were simulated, in their study or in their models.
    """
    folder = Path(data_folder)
    description = _description(folder)
    models = _models(description, folder)
    simulated = {key: bool(description.get(key)) for key in _SIMULATED}
    origin = {**simulated, **{key: description[key] for key in _RESTS_ON if key in description}}
    warnings: list[str] = []
    participants = simulated["SimulatedParticipant"]
    _check_participants(folder / "participants.tsv", participants, warnings=warnings)
    tables = {
        task: _load_task(folder, task, origin=origin, warnings=warnings) for task in ANSWER_TABLES
    }
    if all(table is None for table in tables.values()):
        raise InputError(
            f"expected answers such as sub-01/ses-01/beh/sub-01_ses-01_task-absolute_beh.tsv in "
            f"{folder}, found none; run a session first or name the study's data folder."
        )
    parts = {task: _split(table, task) for task, table in tables.items()}
    return Responses(
        answers={task: main for task, (main, _) in parts.items()},
        simulated_participants=participants,
        simulated_rig=simulated["SimulatedRig"],
        training={task: training for task, (_, training) in parts.items()},
        name=str(description.get("Name", "")),
        models=models,
        study_sha256=str(description.get("StudySHA256", "")),
        planned=_planned(description, folder / "dataset_description.json"),
        warnings=tuple(warnings),
    )


def _description(folder: Path) -> Mapping[str, object]:
    path = folder / "dataset_description.json"
    if not folder.is_dir():
        raise InputError(
            f"expected a data folder, but {folder} is not one; name the folder that holds "
            f"dataset_description.json."
        )
    if not path.is_file():
        raise InputError(
            f"expected {path}, which is not there; name the folder of a study, the one that "
            f"holds dataset_description.json."
        )
    description = _json_object(path)
    if not isinstance(description.get("Simulated"), bool):
        raise InputError(
            f'expected "Simulated": true or false in {path}; add it, so that no one takes '
            f"simulated answers for a person's."
        )
    parts = [description.get(key, False) for key in _SIMULATED[1:]]
    if any(parts) != description["Simulated"] or not all(isinstance(p, bool) for p in parts):
        raise InputError(
            f'expected "SimulatedParticipant" and "SimulatedRig" in {path}, one of them true '
            f'exactly where "Simulated" is, got {parts[0]} and {parts[1]}; say what was simulated.'
        )
    design, stated = description.get("StudyDesign"), description.get("StudySHA256")
    if isinstance(design, dict) and stated not in (None, sha256_of_values(design)):
        raise InputError(
            f"expected the StudyDesign in {path} to have the StudySHA256 that stands beside it, "
            "got another design; restore the file."
        )
    return description


def _planned(description: Mapping[str, object], path: Path) -> dict[str, PlannedTask]:
    """Participants and sessions of each task in the study's design; none where it is not told."""
    design = description.get("StudyDesign")
    plans = design if isinstance(design, dict) else {}
    planned = {}
    for task in (task for task in ANSWER_TABLES if task in plans):
        plan = plans[task]
        participants = plan.get("participants") if isinstance(plan, dict) else None
        if not isinstance(participants, int) or isinstance(participants, bool) or participants < 1:
            raise InputError(
                f"expected a whole number of at least 1 for the participants of {task} under "
                f"StudyDesign in {path}, got {participants!r}; restore the file."
            )
        a_day_for_each_model = plan.get("schedule") == "by-day"
        planned[task] = PlannedTask(participants, participants * (1 + a_day_for_each_model))
    return planned


def _json_object(path: Path) -> Mapping[str, object]:
    return read_json_object(path, advice="restore the file")


def _check_participants(path: Path, simulated: bool, *, warnings: list[str]) -> None:
    if not path.is_file():
        raise InputError(f"expected {path}, which is not there; restore the list of participants.")
    table = _read_lines(path, warnings)
    _require_columns(table, ("participant_id", "simulated"), path=path)
    _check_simulated(table, simulated, path=path)


def _models(description: Mapping[str, object], folder: Path) -> dict[str, dict[str, str]]:
    """SHA-256 of the models that were presented, by texture and kind; empty where not stated."""
    stated = description.get("ModelsSHA256", {})
    textures = stated.values() if isinstance(stated, Mapping) else [None]
    if not all(isinstance(kinds, Mapping) and set(kinds) == set(MODELS) for kinds in textures):
        raise InputError(
            'expected "ModelsSHA256" with a full and a simplified model of each texture in '
            f"{folder / 'dataset_description.json'}, got something else; restore the file."
        )
    assert isinstance(stated, Mapping)
    return {str(t): {str(k): str(v) for k, v in kinds.items()} for t, kinds in stated.items()}


def _load_task(
    folder: Path, task: str, *, origin: Mapping[str, object], warnings: list[str]
) -> pd.DataFrame | None:
    """All sessions of one task beneath each other, or None where there is none."""
    sessions, unordered = [], []
    for path in sorted(folder.glob(f"sub-*/ses-*/beh/*_task-{task}_beh.tsv")):
        participant, session = path.parts[-4], path.parts[-3]
        if path.name != f"{participant}_{session}_task-{task}_beh.tsv":
            raise InputError(
                f"expected the name {participant}_{session}_task-{task}_beh.tsv, but found {path}; "
                f"move the file back to its own participant's folder."
            )
        sidecar = _checked_sidecar(path.with_suffix(".json"), origin)
        table = _read_lines(path, warnings)
        order = folder / "sourcedata" / participant / session
        order /= path.name.removesuffix("beh.tsv") + "order.json"
        what = f"{participant} {task} {session}"
        planned = None
        if order.is_file():
            stored = _json_object(order)
            check_stored(stored, order, sidecar=sidecar, study=origin.get("StudySHA256"))
            planned = planned_trials(stored, (participant, session, task), path=order)
        else:
            unordered.append(what)
        if not table.columns.empty:
            _check_session(table, task, path=path, simulated=bool(origin["Simulated"]))
            planned = None if planned is None else with_repeats(table, planned)
        if planned is not None and len(table) < len(planned):
            ended = f"answered {len(table)} of {len(planned)} trials (ended early)."
            warnings.append(f"{what} {ended}")
        if table.columns.empty:
            continue
        check_order(table, planned, path=path)
        table = _valid(table, what, warnings=warnings)
        table.insert(0, "participant_id", participant)
        table.insert(1, "session", session)
        sessions.append(table)
    warnings += [*told_of_unordered(unordered), *_unanswered(folder, task)]
    return pd.concat(sessions, ignore_index=True) if sessions else None


def _valid(table: pd.DataFrame, what: str, *, warnings: list[str]) -> pd.DataFrame:
    """The answers to trials in which the rig presented what was planned; tells of the others."""
    failed = table["valid"] == 0
    if failed.any():
        again = int((failed & table["trial"].isin(table["repeats"])).sum())
        warnings.append(
            f"{what}: {int(failed.sum())} of {len(table)} answers left out, since the rig failed "
            f"in their trials ({again} repeated)."
        )
    return table[~failed].reset_index(drop=True)


def _checked_sidecar(path: Path, origin: Mapping[str, object]) -> Mapping[str, object]:
    """The sidecar of a session, refused where it says otherwise than the data set what it is of."""
    if not path.is_file() and any(key in origin for key in _RESTS_ON):
        raise InputError(
            f"expected the sidecar {path}, which names the study and the models of the session, "
            "found none; restore the file."
        )
    sidecar = _json_object(path) if path.is_file() else {}
    for key, value in origin.items():
        if sidecar.get(key, value) != value:
            found = json.dumps(sidecar[key]) if key in _SIMULATED else "another"
            wanted = f"{key} {json.dumps(value)}" if key in _SIMULATED else f"one {key}"
            raise InputError(
                f"expected {wanted} in {path}, as dataset_description.json says, "
                f"never a mixture, but found {found}; correct the file or leave "
                "its session out."
            )
    return sidecar


def _unanswered(folder: Path, task: str) -> list[str]:
    """A sentence for each session whose order is stored but whose answers are not there."""
    told = []
    for order in sorted(folder.glob(f"sourcedata/sub-*/ses-*/*_task-{task}_order.json")):
        stem = order.name.removesuffix("order.json")
        participant, session = order.parts[-3:-1]
        if not (folder / participant / session / "beh" / f"{stem}beh.tsv").is_file():
            told.append(f"{participant} {task} {session} has a stored order, but no answers.")
    return told


def _check_session(table: pd.DataFrame, task: str, *, path: Path, simulated: bool) -> None:
    """Refuse what cannot be an answer; turn the columns of numbers into numbers."""
    columns = ANSWER_TABLES[task]
    for column in columns:
        if column.before is not None and column.name not in table:
            table[column.name] = np.nan if column.before == "n/a" else column.before
    _require_columns(table, tuple(column.name for column in columns), path=path)
    for column in columns:
        found = table[column.name]
        if column.required:
            expected = f"a value in column {column.name}"
            _refuse(found.isna(), found, expected=expected, path=path)
        if column.limits is not None:
            table[column.name] = _number_column(found, column.limits, path=path)
        elif column.levels:
            known = found.isin(list(column.levels)) | found.isna()
            expected = f"{' or '.join(column.levels)} in column {column.name}"
            _refuse(~known, found, expected=expected, path=path)
    _check_simulated(table, simulated, path=path)
    neither = ~table["valid"].isin([0.0, 1.0])
    _refuse(neither, table["valid"], expected="1 or 0 in column valid", path=path)
    twice = table.duplicated(["phase", "trial"])
    _refuse(twice, table["trial"], expected="every trial once", path=path)
    if {"layout", "answer", "correct"} <= set(table):
        _check_choices(table, path)


def _number_column(column: pd.Series, limits: tuple[float, float], *, path: Path) -> pd.Series:
    low, high = limits
    values = pd.to_numeric(column, errors="coerce").astype(float)
    wrong = column.notna() & ~(np.isfinite(values) & (values >= low) & (values <= high))
    wanted = f"from {low:g} to {high:g}" if np.isfinite(high) else f"of at least {low:g}"
    _refuse(wrong, column, expected=f"a number {wanted} in column {column.name}", path=path)
    return values


def _check_choices(table: pd.DataFrame, path: Path) -> None:
    answered = table[table["answer"].notna()]
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
    right = (answered["answer"] == answered["texture"]).astype(float)
    _refuse(
        right != answered["correct"],
        answered["correct"],
        expected="correct = 1 exactly where answer and texture agree",
        path=path,
    )


def _check_simulated(table: pd.DataFrame, simulated: bool, *, path: Path) -> None:
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


def _require_columns(table: pd.DataFrame, columns: tuple[str, ...], *, path: Path) -> None:
    missing = [column for column in dict.fromkeys(columns) if column not in table]
    if missing:
        raise InputError(
            f"expected the column{'s' * (len(missing) > 1)} {', '.join(missing)} in {path}, "
            f"but the first line does not name {'them' if len(missing) > 1 else 'it'}; restore "
            f"the first line."
        )


def _read_lines(path: Path, warnings: list[str]) -> pd.DataFrame:
    """All complete lines as text; n/a becomes missing. No columns where even the first is cut."""
    complete, _, rest = read_bytes(path, "a table").rpartition(b"\n")
    try:
        lines = [line.rstrip("\r") for line in complete.decode("utf-8-sig").split("\n")]
    except UnicodeDecodeError:
        raise InputError(
            f"expected UTF-8 text in {path}, got other bytes; restore the file."
        ) from None
    if not complete:
        warnings.append(
            f"{path.name}: the first line was cut short (a killed session?); no answers."
        )
        return pd.DataFrame()
    header = lines[0].split("\t")
    check_named_once(header, path)
    rows = [line.split("\t") for line in lines[1:]]
    if rest:
        tail = rest.decode("utf-8", errors="replace")
        if _is_whole(tail, header):
            rows.append(tail.split("\t"))
        else:
            warnings.append(
                f"{path.name}: the last line was cut short (a killed session?) and is left out."
            )
    for number, row in enumerate(rows, start=2):
        if len(row) != len(header):
            raise InputError(
                f"expected {len(header)} values in line {number} of {path}, but found {len(row)}; "
                f"correct the line."
            )
    return pd.DataFrame(rows, columns=header, dtype=object).replace("n/a", np.nan)


def _is_whole(tail: str, header: list[str]) -> bool:
    """Only a last value known in full (true or false) proves that nothing is missing."""
    values = tail.split("\t")
    return len(values) == len(header) and values[-1] in ("true", "false")


def _split(table: pd.DataFrame | None, task: str) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Main and training trials; without answers, tables without rows."""
    if table is None:
        kinds = {c.name: object if c.limits is None else float for c in ANSWER_TABLES[task]}
        kinds = {"participant_id": object, "session": object} | kinds
        table = pd.DataFrame({name: pd.Series(dtype=kind) for name, kind in kinds.items()})
    main = table["phase"] == "main"
    return table[main].reset_index(drop=True), table[~main].reset_index(drop=True)
