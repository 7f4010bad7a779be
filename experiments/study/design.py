"""The order of the trials: who does what, when (docs/method/protocols.md#order, PAPER VII)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal, Protocol, TypeVar

import numpy as np

from experiments.study.study import TASKS, Study
from modeling.checks import check_whole
from modeling.seeds import generator

Phase = Literal["training", "main"]
ModelKind = Literal["full", "simplified"]
Item = TypeVar("Item")

MODELS: tuple[ModelKind, ...] = ("full", "simplified")


def fisher_yates(items: Sequence[Item], rng: np.random.Generator) -> list[Item]:
    """A uniformly random order of `items` by the Fisher–Yates shuffle (paper VII-B).

    Parameters
    ----------
    items : sequence of length n
    rng : numpy.random.Generator
        Asked n − 1 times for an integer.

    Returns
    -------
    list
        A new list; each of the n! orders has the same probability.
    """
    shuffled = list(items)
    for last in range(len(shuffled) - 1, 0, -1):
        # 'last' itself must be among the choices: without it only cyclic orders could come out.
        other = int(rng.integers(0, last + 1))
        shuffled[last], shuffled[other] = shuffled[other], shuffled[last]
    return shuffled


@dataclass(frozen=True, kw_only=True)
class Trial:
    """What every trial has; each task adds its own.

    Parameters
    ----------
    trial : int
        Running number in the session, from 1, training included.
    phase : {"training", "main"}
    texture : str
        The real surface.
    model : {"full", "simplified"}
        Behind the virtual surfaces.
    tray : str
        Where the real sample lies.
    """

    trial: int
    phase: Phase
    texture: str
    model: ModelKind
    tray: str


Order = Sequence[tuple[str, ModelKind]]


class OrderedTask(Protocol):
    """What of a task decides the order of its trials."""

    @property
    def name(self) -> str: ...

    @property
    def repeated(self) -> bool:
        """Whether each texture and model comes as often as the study's `repeats` says."""
        ...

    @property
    def trials(self) -> Callable[[Order, Study, np.random.Generator], list[dict[str, Any]]]:
        """What differs from trial to trial, for textures and models in their random order."""
        ...

    @property
    def trial(self) -> type[Trial]: ...


@dataclass(frozen=True, kw_only=True)
class SessionPlan:
    """The whole order of one session, made before its first trial."""

    study: Study
    task: str
    subject: int
    session: int
    trials: tuple[Trial, ...]

    def to_dict(self) -> dict[str, Any]:
        """The plan as plain values, for the order file."""
        return asdict(self) | {"study": self.study.to_dict()}


def draw_session(study: Study, task: OrderedTask, *, subject: int, session: int) -> SessionPlan:
    """The order of one session: training trials, then the main ones.

    docs/method/protocols.md#order

    The same study, task, subject and session always give the same order.

    Parameters
    ----------
    study : Study
    task : OrderedTask
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
    rng = _generator(study, task.name, subject, session=session)
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


def models_of_session(
    study: Study, *, task: str, subject: int, session: int
) -> tuple[ModelKind, ...]:
    """The models that a session presents: both when interleaved, one when by day.

    By day, subjects 1 and 2, 3 and 4, … are pairs in which a fair coin decides who begins with
    the full model: an exactly counterbalanced order that cannot be guessed from the number.
    """
    if study.plan(task).schedule == "interleaved":
        return MODELS
    pair = (subject + 1) // 2
    coin = int(_generator(study, task, pair, session=0).integers(0, 2))
    return (MODELS[(subject + session + coin) % 2],)


def _generator(study: Study, task: str, subject: int, *, session: int) -> np.random.Generator:
    """Random numbers of one session (session 0: of one counterbalancing pair)."""
    return generator(study.seed, TASKS.index(task), subject, session)
