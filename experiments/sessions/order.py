"""The order of one session, drawn before its first trial."""

from __future__ import annotations

from typing import Any

from experiments.sessions.task import Task
from experiments.study.design import (
    Phase,
    SessionPlan,
    fisher_yates,
    models_of_session,
    session_generator,
)
from experiments.study.study import Study
from modeling.checks import check_whole


def draw_session(study: Study, task: Task, *, subject: int, session: int) -> SessionPlan:
    """The order of one session: training trials, then the main ones.

    docs/method/protocols.md#order

    The same study, task, subject and session always give the same order.

    Parameters
    ----------
    study : Study
    task : Task
    subject : int
        1 … participants of the task.
    session : int
        1 … sessions of the task (2 by day, 1 interleaved).

    Raises
    ------
    InputError
        If the study has no such task, subject or session.
    """
    plan = study.plan(task.name)
    check_whole("subject", subject, low=1, high=plan.participants)
    check_whole("session", session, low=1, high=plan.sessions)
    rng = session_generator(study, task.name, subject, session=session)
    models = models_of_session(study, task=task.name, subject=subject, session=session)
    pairs = [(texture, model) for model in models for texture in study.textures]
    pairs *= study.repeats if task.repeated else 1
    training = task.trials(fisher_yates(pairs, rng), study, rng)[: study.training_trials]
    drafts: list[tuple[Phase, dict[str, Any]]] = [("training", draft) for draft in training]
    drafts += [("main", draft) for draft in task.trials(fisher_yates(pairs, rng), study, rng)]
    trials = tuple(
        task.trial(trial=number, phase=phase, tray=study.trays[draft["texture"]], **draft)
        for number, (phase, draft) in enumerate(drafts, start=1)
    )
    return SessionPlan(study=study, task=task.name, subject=subject, session=session, trials=trials)
