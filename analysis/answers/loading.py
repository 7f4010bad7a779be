"""Read the output of the experiments: one folder of tab-separated files, checked before use."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from pathlib import Path

import pandas as pd

from tactileq.analysis.answers.gathering import Gathered
from tactileq.analysis.answers.order import (
    Planned,
    check_manifest,
    check_order,
    open_sessions_warning,
    planned_trials,
    unordered_warnings,
)
from tactileq.analysis.answers.plan import AnalysisPlan, plan_from
from tactileq.analysis.answers.responses import PlannedTask, Responses, stands_apart
from tactileq.analysis.answers.tables import (
    MAY_DIFFER,
    check_known,
    check_session,
    check_simulated,
    checked_sidecar,
    json_object,
    read_answers_table,
    valid_trials,
)
from tactileq.analysis.labels import MODELS
from tactileq.modeling import InputError
from tactileq.modeling.errors import shown
from tactileq.modeling.files.answer_tables import (
    ANSWER_TABLES,
    PARTICIPANT_COLUMNS,
    PARTICIPANT_ID,
)
from tactileq.modeling.files.columns import shortened_hash
from tactileq.modeling.files.hashes import sha256_of_values
from tactileq.modeling.files.places import matching

_SIMULATED = ("Simulated", "SimulatedParticipant", "SimulatedRig")


def load_responses(data_folder: str | Path, *, leaving_out: Collection[str] = ()) -> Responses:
    """Load and check all answers of a study.

    Parameters
    ----------
    data_folder : str or Path
        Folder holding dataset_description.json, participants.tsv and
        sub-*/ses-*/beh/sub-*_ses-*_task-TASK_beh.tsv; beside each its sidecar, and
        below sourcedata/ the session's manifest, where they are there. Answers must follow the
        order of its trials.
    leaving_out : collection of str
        Participants whom `leave_out` is to leave out: what of theirs cannot be read is no reason
        to refuse the others.

    Returns
    -------
    Responses
        Its `warnings` name sessions with fewer answers than planned trials, those without a
        manifest, rules that were overridden, pilots, and how many answers to invalid trials were
        left out.

    Raises
    ------
    InputError
        Where the folder is none, a file is malformed, a value is out of range, answers are not
        those to the trials that were planned, models are not the study's, or
        answers are mixed that differ in whether participants or rig were simulated; or in their
        study, their models or whether they are a pilot, and no session says why.
    """
    folder = Path(data_folder)
    description = _description(folder)
    models = _models(description, folder)
    simulated = {key: bool(description.get(key)) for key in _SIMULATED}
    origin = {**simulated, **{key: description[key] for key in MAY_DIFFER if key in description}}
    gathered = Gathered(models, frozenset(leaving_out))
    participants = simulated["SimulatedParticipant"]
    dropped = _dropped_out(folder / "participants.tsv", simulated=participants)
    tables = {
        task: _load_task(folder, task, origin=origin, gathered=gathered) for task in ANSWER_TABLES
    }
    if all(table is None for table in tables.values()):
        raise InputError(
            f"expected answers such as sub-01/ses-01/beh/sub-01_ses-01_task-absolute_beh.tsv in "
            f"{folder}, found none; run a session first or name the study's data folder."
        )
    parts = {task: _split(table, task) for task, table in tables.items()}
    return Responses(
        answers={task: main for task, (main, *_) in parts.items()},
        simulated_participants=participants,
        simulated_rig=simulated["SimulatedRig"],
        training={task: training for task, (_, training, _) in parts.items()},
        anchors={task: anchors for task, (*_, anchors) in parts.items() if anchors is not None},
        name=str(description.get("Name", "")),
        models=models,
        left_out={task: pd.DataFrame(unread) for task, unread in gathered.unread.items()},
        equal=gathered.equal,
        plan=_plan(description, gathered.plans, path=folder / "dataset_description.json"),
        study_sha256=str(description.get("StudySHA256", "")),
        planned=_planned(
            description, folder / "dataset_description.json", trials=gathered.main_trials
        ),
        under_way={task: frozenset(who) - dropped for task, who in gathered.under_way.items()},
        dropped_out=dropped,
        warnings=tuple(gathered.warnings),
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
    description = json_object(path)
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
    if isinstance(design, dict) and stated not in (None, found := sha256_of_values(design)):
        raise InputError(
            f"expected the StudyDesign in {path} to have the StudySHA256 stored with it, "
            f"{shortened_hash(str(stated))}, got {shortened_hash(found)}; restore the file."
        )
    return description


def _plan(description: Mapping[str, object], hashes: Iterable[str], *, path: Path) -> AnalysisPlan:
    """The claims of the study as it was first run; none where the data do not state the study."""
    design = description.get("StudyDesign")
    stated = design.get("plan", {}) if isinstance(design, dict) else {}
    return plan_from(stated, sha256=tuple(hashes), path=path)


def _planned(
    description: Mapping[str, object], path: Path, *, trials: Mapping[str, Collection[int]]
) -> dict[str, PlannedTask]:
    """Participants and sessions of each task in the study's design; none where it is not stated.

    `trials` are the numbers of main trials of sessions that were begun; where they have one number,
    all others have it, too.
    """
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
        models = plan.get("models", MODELS)
        days = len(models) if plan.get("schedule") == "by-day" else 1
        numbers = trials.get(task, ())
        planned[task] = PlannedTask(
            participants,
            participants * days,
            tuple(models),
            int(plan.get("repeats", 1)),
            participants * days * max(numbers) if len(numbers) == 1 else 0,
        )
    return planned


def _dropped_out(path: Path, *, simulated: bool) -> frozenset[str]:
    """Participants who dropped out, from the list of participants, which is checked."""
    if not path.is_file():
        raise InputError(f"expected {path}, which is not there; restore the list of participants.")
    table = read_answers_table(path, (PARTICIPANT_ID, *PARTICIPANT_COLUMNS))
    check_simulated(table, simulated, path=path)
    return frozenset(table["participant_id"][table["status"] == "dropped"])


def _models(description: Mapping[str, object], folder: Path) -> dict[str, dict[str, str]]:
    """SHA-256 of the models that were presented, by texture and kind; empty where not stated."""
    stated = description.get("ModelsSHA256", {})
    textures = stated.values() if isinstance(stated, Mapping) else [None]
    place = folder / "dataset_description.json"
    if not all(isinstance(kinds, Mapping) for kinds in textures):
        raise InputError(
            f'expected "ModelsSHA256" with the models of each texture in {place}, got something '
            "else; restore the file."
        )
    names = {tuple(kinds) for kinds in textures if isinstance(kinds, Mapping)}
    if len({frozenset(some) for some in names}) > 1 or any(len(some) < 2 for some in names):
        raise InputError(
            f"expected models of the same sets, two at least, for every texture in {place}, got "
            f"{shown('; '.join(', '.join(some) for some in sorted(names)))}; restore the file."
        )
    assert isinstance(stated, Mapping)
    return {str(t): {str(k): str(v) for k, v in kinds.items()} for t, kinds in stated.items()}


def _load_task(
    folder: Path,
    task: str,
    *,
    origin: Mapping[str, object],
    gathered: Gathered,
) -> pd.DataFrame | None:
    """All sessions of one task beneath each other, or None where there is none."""
    sessions, warnings = [], gathered.warnings
    unordered: list[str] = []
    for path in matching(folder, f"sub-*/ses-*/beh/*_task-{task}_beh.tsv"):
        participant, session = path.parts[-4], path.parts[-3]
        left_out, told_before = participant in gathered.leaving_out, len(warnings)
        table = None
        try:
            table = _load_session(path, task, origin=origin, gathered=gathered, unordered=unordered)
            sessions.append(table)
        except InputError:
            if not left_out:
                raise
            del warnings[told_before:]
        is_pilot = (task, participant, session) in gathered.pilots
        if left_out and not is_pilot and (table is None or "main" not in set(table["phase"])):
            gathered.add_unread(task, participant, session=session)
    warnings += [*unordered_warnings(unordered), *_unanswered(folder, task, gathered=gathered)]
    return pd.concat(sessions, ignore_index=True) if sessions else None


def _load_session(
    path: Path,
    task: str,
    *,
    origin: Mapping[str, object],
    gathered: Gathered,
    unordered: list[str],
) -> pd.DataFrame:
    """The answers of one session; `unordered` takes its name where it has no manifest."""
    participant, session, warnings = path.parts[-4], path.parts[-3], gathered.warnings
    if path.name != f"{participant}_{session}_task-{task}_beh.tsv":
        raise InputError(
            f"expected the name {participant}_{session}_task-{task}_beh.tsv, but found {path}; "
            f"move the file back to its own participant's folder."
        )
    what = f"{participant} {task} {session}"
    sidecar = checked_sidecar(path.with_suffix(".json"), origin, what, warnings=warnings)
    table = read_answers_table(path, ANSWER_TABLES[task].columns)
    check_session(table, task, path=path, simulated=bool(origin["Simulated"]))
    check_known(table, gathered, path=path)
    gathered.check_once(table, what, path=path)
    planned = _planned_of(path, (participant, session, task), sidecar=sidecar)
    owed = None if planned is None else open_sessions_warning(table, planned)
    if planned is None:
        unordered.append(what)
    else:
        gathered.add_order(task, planned)
    if owed:
        warnings.append(f"{what} {owed}")
    check_order(table, planned, path=path)
    gathered.add(sidecar)
    table = valid_trials(table, what, warnings=warnings)
    if (pilot := table["pilot"] == "true").any():
        answers = "its answers are not data of the study"
        if not origin.get("Pilot", False):
            table = table[~pilot].reset_index(drop=True)
            gathered.pilots.add((task, participant, session))
            answers += " and are left out"
        warnings.append(f"{what} was a pilot; {answers}.")
    # Without the order, as in published data, only the sidecar says so.
    is_whole = not owed if planned else sidecar.get("Status", "complete") == "complete"
    if len(table) and not is_whole:
        gathered.under_way.setdefault(task, set()).add(participant)
    table.insert(0, "participant_id", participant)
    table.insert(1, "session", session)
    return table


def _planned_of(
    path: Path, session: tuple[str, str, str], *, sidecar: Mapping[str, object]
) -> list[Planned] | None:
    """The trials of a session's manifest, None where there is none."""
    participant, number, _ = session
    manifest = path.parents[3] / "sourcedata" / participant / number
    manifest /= path.name.removesuffix("beh.tsv") + "manifest.json"
    if not manifest.is_file():
        return None
    stored = json_object(manifest)
    check_manifest(stored, manifest, sidecar=sidecar)
    return planned_trials(stored, session, path=manifest)


def _unanswered(folder: Path, task: str, *, gathered: Gathered) -> list[str]:
    """A sentence for each session that was begun but whose answers are not there."""
    sentences = []
    for manifest in matching(folder, f"sourcedata/sub-*/ses-*/*_task-{task}_manifest.json"):
        stem = manifest.name.removesuffix("manifest.json")
        participant, session = manifest.parts[-3:-1]
        if (folder / participant / session / "beh" / f"{stem}beh.tsv").is_file():
            continue
        if participant in gathered.leaving_out:
            gathered.add_unread(task, participant, session=session)
        else:
            sentences.append(
                f"{participant} {task} {session} was begun, but has no table of answers; it is "
                "running, or tactileq study status makes one."
            )
    return sentences


def _split(
    table: pd.DataFrame | None, task: str
) -> tuple[pd.DataFrame, pd.DataFrame, pd.DataFrame | None]:
    """Main trials, training, and anchors or catch trials (None of a task that can have none).

    Tables without rows where there are no sessions.
    """
    if table is None:
        columns = ANSWER_TABLES[task].columns
        kinds = {c.name: object if c.limits is None else float for c in columns}
        kinds = {"participant_id": object, "session": object} | kinds
        table = pd.DataFrame({name: pd.Series(dtype=kind) for name, kind in kinds.items()})
    main = table["phase"] == "main"
    training = table[~main].reset_index(drop=True)
    apart = stands_apart(table, task)
    own, other = (table[main & rows].reset_index(drop=True) for rows in (~apart, apart))
    return own, training, other if ANSWER_TABLES[task].other_texture else None
