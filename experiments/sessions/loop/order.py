"""The order of one session, drawn before its first trial."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from tactileq.experiments.sessions.loop.task import Task
from tactileq.experiments.study.design import (
    Occasion,
    Phase,
    SessionPlan,
    first_models,
    fisher_yates,
    with_first_models,
)
from tactileq.experiments.study.study import Study
from tactileq.modeling.files.answer_tables import ANSWER_TABLES


def draw_session(study: Study, task: Task, *, subject: int, session: int, slot: int) -> SessionPlan:
    """The order of one session: training trials, then the main ones.

    docs/method/protocols.md#order

    The same study, task, subject, session and slot always give the same order.

    Parameters
    ----------
    subject : int
        1 … 9999; the shuffles follow from it.
    session : int
        1 … sessions of the task (by day one for each model, 1 interleaved).
    slot : int
        1 … participants of the task; what is balanced over participants follows from it.

    Raises
    ------
    InputError
        If the study has no such task, subject, session or slot.
    """
    occasion = Occasion.of(study, task=task.name, subject=subject, session=session, slot=slot)
    drafts: list[tuple[Phase, dict[str, Any]]]
    drafts = [("training", draft) for draft in _training(occasion, task)]
    drafts += [("main", draft) for draft in task.trials(occasion, _order(occasion))]
    trials = tuple(
        task.trial(trial=number, phase=phase, tray=study.trays.get(draft["texture"], ""), **draft)
        for number, (phase, draft) in enumerate(drafts, start=1)
    )
    return SessionPlan(
        study=study, task=task.name, subject=subject, session=session, slot=slot, trials=trials
    )


def _training(occasion: Occasion, task: Task) -> list[dict[str, Any]]:
    """As many trials for practice as there may be, drawn as the main ones are."""
    most = occasion.study.plan_of(task.name).most_training_trials
    practice = replace(occasion, phase="training")
    drafts: list[dict[str, Any]] = []
    while len(drafts) < most:
        drafts += task.trials(practice, _order(practice))
    return drafts[:most]


def _order(occasion: Occasion) -> list[tuple[str, str]]:
    """Textures and models in random order, each model first for as many textures as planned."""
    plan = occasion.study.plan_of(occasion.task)
    repeats = plan.repeats
    if ANSWER_TABLES[occasion.task].both_models:  # so that a trial is a repeat of each
        repeats //= len(plan.models)
    pairs = [(texture, model) for model in occasion.models for texture in occasion.study.textures]
    order = fisher_yates(pairs * repeats, occasion.rng)
    if len(occasion.models) == 1:
        return order
    return with_first_models(order, first_models(occasion))
