"""How far a study is: who was here, what was answered, what comes next; no names of conditions.

docs/method/protocols.md#status
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import date, datetime
from pathlib import Path
from typing import Any, Literal

from tactileq.experiments.sessions.kept.files import require_data_folder
from tactileq.experiments.sessions.kept.roster import Roster
from tactileq.experiments.sessions.kept.state import Status
from tactileq.experiments.sessions.kept.stored_sessions import Damaged, StoredSession, held_sessions
from tactileq.experiments.study.study import Study
from tactileq.modeling import InputError
from tactileq.modeling.files.answer_tables import ANSWER_TABLES


@dataclass(frozen=True, kw_only=True)
class SessionProgress:
    """How far one session is.

    Parameters
    ----------
    status : {"running", "complete", "aborted", "crashed", "damaged"}
        Damaged where its manifest or log cannot be read, so that nothing else is known.
    answered, planned : int
        Of the main trials; repeats are not counted.
    """

    task: str
    session: int
    status: Status | Literal["damaged"]
    answered: int
    planned: int


@dataclass(frozen=True, kw_only=True)
class PersonProgress:
    """How far one person is.

    Parameters
    ----------
    code : str
        Pseudonym; empty of somebody who withdrew.
    left : {"", "dropped", "withdrawn"}
    sessions : tuple of SessionProgress
        In the order of the study's tasks.
    due : str
        The next session, in words; empty where none is.
    """

    subject: int
    slot: int
    code: str
    left: str
    sessions: tuple[SessionProgress, ...]
    due: str = ""


@dataclass(frozen=True, kw_only=True)
class TaskProgress:
    """How many sessions of a task are complete, of those that are planned."""

    task: str
    complete: int
    planned: int


@dataclass(frozen=True, kw_only=True)
class StudyProgress:
    """How far a study is.

    Parameters
    ----------
    damaged : tuple of str
        What cannot be read of the roster.
    declined : int
        How many people did not consent.
    """

    people: tuple[PersonProgress, ...]
    tasks: tuple[TaskProgress, ...]
    damaged: tuple[str, ...] = ()
    declined: int = 0


def study_progress(
    data_folder: str | Path, study: Study | None = None, *, today: date | None = None
) -> StudyProgress:
    """How far a study is.

    Parameters
    ----------
    data_folder : path
        Root of the data set.
    study : Study, optional
        Without it that of the first session.
    today : date, optional
        Local; that of now without it.

    Raises
    ------
    InputError
        If there is no such folder, or there is no session that can be read and no study is given.
    """
    root = Path(data_folder)
    require_data_folder(root)
    held, damaged = held_sessions(root)
    if study is None and not held:
        raise InputError(
            f"expected sessions below {root / 'sourcedata'}, got none"
            f"{' that can be read' if damaged else ''}; name the study's file with --study."
        )
    design = study.to_dict() if study is not None else held[0].manifest.study
    wanted = {
        task: (design[task]["participants"], _sessions(design[task]))
        for task in ANSWER_TABLES
        if isinstance(design.get(task), Mapping)
    }
    roster = Roster(root).listed()
    sessions: list[StoredSession | Damaged] = [*held, *damaged]
    people = tuple(
        _person(entry, [s for s in sessions if s.files.subject == number], wanted, today=today)
        for number, entry in roster.entries.items()
    )
    return StudyProgress(
        people=people,
        tasks=_tasks(people, wanted),
        damaged=(roster.damaged,) if roster.damaged else (),
        declined=roster.declined,
    )


def _sessions(plan: Mapping[str, Any]) -> int:
    """Sessions of a task for one person, as `Study.sessions`."""
    return len(plan["models"]) if plan["schedule"] == "by-day" else 1


def _person(
    entry: Mapping[str, Any],
    sessions: Sequence[StoredSession | Damaged],
    wanted: Mapping[str, tuple[int, int]],
    *,
    today: date | None,
) -> PersonProgress:
    order = {task: place for place, task in enumerate(ANSWER_TABLES)}
    found = sorted(
        sessions, key=lambda one: (order.get(one.files.task, len(order)), one.files.session)
    )
    person = PersonProgress(
        subject=entry["subject"],
        slot=entry["slot"],
        code=entry["code"],
        left=entry["left"],
        sessions=tuple(map(_session, found)),
    )
    active = {
        (one.files.task, one.files.session): one.state.last_utc
        for one in found
        if isinstance(one, StoredSession)
    }
    return person if person.left else replace(person, due=_due(person, active, wanted, today=today))


def _session(one: StoredSession | Damaged) -> SessionProgress:
    task, session = one.files.task, one.files.session
    if isinstance(one, Damaged):
        return SessionProgress(task=task, session=session, status="damaged", answered=0, planned=0)
    main = {trial["trial"] for trial in one.manifest.trials if trial["phase"] == "main"}
    answered = main & {row["trial"] for row in one.state.rows}
    return SessionProgress(
        task=task,
        session=session,
        status=one.state.status,
        answered=len(answered),
        planned=len(main),
    )


def _due(
    person: PersonProgress,
    active: Mapping[tuple[str, int], str],
    wanted: Mapping[str, tuple[int, int]],
    *,
    today: date | None,
) -> str:
    """The next session, in words; `active` has when each was active last."""
    stands: dict[tuple[str, int], str] = {(s.task, s.session): s.status for s in person.sessions}
    planned = [
        [(task, session) for session in range(1, sessions + 1)]
        for task, (participants, sessions) in wanted.items()
        if person.slot <= participants
    ]
    in_order = _in_order(planned, stands, active)
    if not in_order:
        return ""
    task, session = in_order[0]
    name = f"{task} {session}" if wanted[task][1] > 1 else task
    day_before = _is(active.get((task, session - 1), ""), today)
    return name + _words(stands.get((task, session)), day_before=day_before)


def _in_order(
    planned: Sequence[Sequence[tuple[str, int]]],
    stands: Mapping[tuple[str, int], str],
    active: Mapping[tuple[str, int], str],
) -> list[tuple[str, int]]:
    """Planned sessions (task by task) that are not complete, the one that is due next first.

    What was begun comes before what was not. The one that runs now is first; then those that were
    interrupted, the one that was active last before others, since after a short gap training is not
    repeated; then those that are damaged, which somebody has to restore. Of those never begun, the
    ones of a task that was begun come before the other ones, else as in the study.
    """
    every = [one for of_task in planned for one in of_task]
    interrupted = [one for one in every if stands.get(one) in ("aborted", "crashed")]
    begun_tasks_first = sorted(planned, key=lambda of_task: stands.keys().isdisjoint(of_task))
    return [
        *(one for one in every if stands.get(one) == "running"),
        *sorted(interrupted, key=lambda one: active.get(one, ""), reverse=True),
        *(one for one in every if stands.get(one) == "damaged"),
        *(one for of_task in begun_tasks_first for one in of_task if one not in stands),
    ]


def _words(status: str | None, *, day_before: bool) -> str:
    """What is to be known of the session that is due; None of one that was never begun."""
    if status is None:
        return ", not before tomorrow" if day_before else ""
    return ", with --resume" if status in ("aborted", "crashed") else f" is {status}"


def _is(utc: str, today: date | None) -> bool:
    if not utc:
        return False
    moment = datetime.fromisoformat(utc).astimezone()
    return moment.date() >= (today or datetime.now().astimezone().date())


def _tasks(
    people: Sequence[PersonProgress], wanted: Mapping[str, tuple[int, int]]
) -> tuple[TaskProgress, ...]:
    """Sessions of those whose slot was given to somebody else do not count."""
    counted = [one for person in people if not person.left for one in person.sessions]
    return tuple(
        TaskProgress(
            task=task,
            complete=sum(one.task == task and one.status == "complete" for one in counted),
            planned=participants * sessions,
        )
        for task, (participants, sessions) in wanted.items()
    )
