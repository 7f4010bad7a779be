"""Simulated sessions in memory, for planning: the very same tasks and loop, nothing on disk."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import partial

from tactileq.experiments.observers.experimenter import SimulatedExperimenter
from tactileq.experiments.observers.percepts import Perception
from tactileq.experiments.observers.psychometrics import Psychometrics
from tactileq.experiments.observers.simulated import (
    SimulatedParticipant,
    occasion_of,
    require_plantable,
)
from tactileq.experiments.sessions.loop.order import draw_session
from tactileq.experiments.sessions.loop.trial_loop import People, run_trials
from tactileq.experiments.sessions.store.interface import MemoryStore
from tactileq.experiments.study.models import ModelSets
from tactileq.experiments.study.study import Study
from tactileq.experiments.tasks import task_named
from tactileq.modeling.checks import check_whole
from tactileq.modeling.models.loading import AnyModel
from tactileq.rig.desk.twin import SimulatedRig
from tactileq.rig.shared.interface import (
    HandRows,
    PresentationRecord,
    RigReading,
    Stimulus,
    ToneBurst,
)

Row = dict[str, object]
Occasion = tuple[str, int, int]  # task, subject, session
_NO_ROWS = HandRows.joined([])
_AT_REST = RigReading(0.0, 0.0, 0.0, False, simulated=True)


class _UnfeltRig(SimulatedRig):
    """A twin whose hand does not move, and which keeps no record of what it presents."""

    def present_model(self, model: AnyModel) -> float:
        return 0.0

    def present_signal(self, signal: ToneBurst | Stimulus) -> float:
        return 0.0

    def present_real(self, texture: str) -> float:
        return 0.0

    def silence(self) -> None:
        pass

    def read(self) -> RigReading:
        return _AT_REST

    def take_history(self) -> HandRows:
        return _NO_ROWS

    def take_presentations(self) -> tuple[PresentationRecord, ...]:
        return ()


class _KeptAnswers(MemoryStore):
    """Keeps only answers."""

    def log(self, event: str, **fields: object) -> None:
        pass


def simulate_sessions(
    study: Study,
    *,
    models: ModelSets,
    perception: Perception,
    psychometrics: Psychometrics,
    seed: int,
    subjects: Iterable[int] | None = None,
    tasks: Sequence[str] | None = None,
    workers: int = 1,
) -> dict[str, list[Row]]:
    """Run sessions of simulated participants at a rig that nobody feels; nothing is written.

    Answers are those that `simulate_study` stores for the same seed.

    Parameters
    ----------
    perception : Perception
        Of this study and these models.
    seed : int
        ≥ 0; of the participants and their answers.
    subjects : iterable of int, optional
        From 1; all of each task without it. Participants beyond those planned take slots again.
    tasks : sequence of str, optional
        All of the study without it.
    workers : int
        Processes, ≥ 1; no answer depends on their number.

    Returns
    -------
    dict
        By task the rows of answers in the order of subjects and sessions, as the table of answers
        has them, with participant and session (int) before.

    Raises
    ------
    InputError
        For a subject, task, seed or planted effect that cannot be.
    """
    check_whole("seed", seed, low=0, high=2**63)
    check_whole("workers", workers, low=1, high=1024)
    require_plantable(perception, psychometrics)
    wanted = None if subjects is None else tuple(subjects)
    agenda = [
        (task, subject, session)
        for task in (study.tasks if tasks is None else tasks)
        for subject in wanted or range(1, study.plan_of(task).participants + 1)
        for session in range(1, study.sessions(task) + 1)
    ]
    run = partial(
        _rows_of,
        study=study,
        models=models,
        perception=perception,
        psychometrics=psychometrics,
        seed=seed,
    )
    answers: dict[str, list[Row]] = {task: [] for task, _, _ in agenda}
    for (task, _, _), rows in zip(agenda, _in_parts(run, agenda, workers), strict=True):
        answers[task] += rows
    return answers


def _in_parts(
    run: Callable[[Sequence[Occasion]], list[list[Row]]], agenda: Sequence[Occasion], workers: int
) -> list[list[Row]]:
    """The rows of each session, a part of the agenda for each process."""
    if workers == 1:
        return run(agenda)
    from joblib import Parallel, delayed

    size = max(1, -(-len(agenda) // workers))
    parts = [agenda[start : start + size] for start in range(0, len(agenda), size)]
    done = Parallel(n_jobs=workers)(delayed(run)(part) for part in parts)
    return [rows for part in done for rows in part]


def _rows_of(
    agenda: Sequence[Occasion],
    *,
    study: Study,
    models: ModelSets,
    perception: Perception,
    psychometrics: Psychometrics,
    seed: int,
) -> list[list[Row]]:
    """The rows of these sessions, one after the other."""
    rig = _UnfeltRig()
    answers = []
    for task, subject, session in agenda:
        kind = task_named(task)
        slot = (subject - 1) % study.plan_of(task).participants + 1
        participant = SimulatedParticipant(
            perception,
            psychometrics,
            seed=seed,
            subject=subject,
            occasion=occasion_of(task, session),
        )
        store = _KeptAnswers()
        run_trials(
            draw_session(study, kind, subject=subject, session=session, slot=slot),
            kind,
            models=models,
            rig=rig,
            people=People(respondent=participant, experimenter=SimulatedExperimenter()),
            store=store,
        )
        who = {"participant": subject, "session": session}
        answers.append([{**who, **row} for row in store.rows])
    return answers
