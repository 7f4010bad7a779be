"""One file for each task; what their plans cost."""

from __future__ import annotations

from importlib import import_module

from tactileq.experiments.sessions.loop.order import draw_session
from tactileq.experiments.sessions.loop.task import Task
from tactileq.experiments.study.design import SessionPlan
from tactileq.experiments.study.study import Study
from tactileq.modeling import InputError
from tactileq.modeling.errors import shown
from tactileq.modeling.files.answer_tables import ANSWER_TABLES


def task_named(name: str) -> Task:
    """The task that `ANSWER_TABLES` declares under this name; InputError for another name."""
    if name not in ANSWER_TABLES:
        raise InputError(
            f"expected the task {' or '.join(ANSWER_TABLES)}, got {shown(name)}; choose one."
        )
    found: Task = import_module(f"tactileq.experiments.tasks.{name}").TASK
    return found


def plan_session(
    study: Study, *, task: str, subject: int, session: int, slot: int | None = None
) -> SessionPlan:
    """The order of one session of a task, as `draw_session` draws it.

    Parameters
    ----------
    subject, session : int
        From 1.
    slot : int, optional
        The place in the plan, 1 … participants; the subject's own number without it.

    Raises
    ------
    InputError
        If the study has no such task, subject, session or slot.
    """
    place = subject if slot is None else slot
    return draw_session(study, task_named(task), subject=subject, session=session, slot=place)
