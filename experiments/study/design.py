"""The order of the trials: who does what, when (METHOD 11, paper section VII)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal, TypeVar

import numpy as np

from experiments.study.study import TASKS, Study, Task
from modeling.checks import check_whole
from modeling.seeds import generator

Phase = Literal["training", "main"]
ModelKind = Literal["full", "simplified"]
Surface = Literal["real", "virtual"]
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
class AbsoluteTrial:
    """One trial of the absolute task: a real surface beside one virtual surface.

    Parameters
    ----------
    trial : int
        Running number in the session, from 1, training included.
    phase : {"training", "main"}
    texture : str
    model : {"full", "simplified"}
    tray : str
        Where the real sample lies.
    first_surface : {"real", "virtual"}
        What is presented when the trial begins.
    """

    trial: int
    phase: Phase
    texture: str
    model: ModelKind
    tray: str
    first_surface: Surface


@dataclass(frozen=True, kw_only=True)
class RelativeTrial:
    """One trial of the relative task: a real surface, and one button per virtual surface.

    Parameters
    ----------
    trial, phase, texture, model, tray
        As in `AbsoluteTrial`; `texture` is the right answer.
    layout : tuple of str
        Texture behind each button, from button 1 on.
    """

    trial: int
    phase: Phase
    texture: str
    model: ModelKind
    tray: str
    layout: tuple[str, ...]


Trial = AbsoluteTrial | RelativeTrial


@dataclass(frozen=True, kw_only=True)
class SessionPlan:
    """The whole order of one session, made before its first trial."""

    study: Study
    task: Task
    subject: int
    session: int
    trials: tuple[Trial, ...]

    def to_dict(self) -> dict[str, Any]:
        """The plan as plain values, for the order file."""
        return asdict(self)


def plan_session(study: Study, *, task: Task, subject: int, session: int) -> SessionPlan:
    """The order of one session: training trials, then the main ones (METHOD 11).

    The same study, task, subject and session always give the same order.

    Parameters
    ----------
    study : Study
    task : {"absolute", "relative"}
    subject : int
        1 … participants of the task.
    session : int
        1 … sessions of the task (2 by day, 1 interleaved).

    Raises
    ------
    InputError
        If the study has no such task, subject or session.
    """
    plan = study.plan(task)
    check_whole("subject", subject, low=1, high=plan.participants)
    check_whole("session", session, low=1, high=plan.sessions)
    rng = _generator(study, task, subject, session=session)
    models = models_of_session(study, task=task, subject=subject, session=session)
    training = _shuffled_trials(study, task, models, rng=rng)[: study.training_trials]
    drafts: list[tuple[Phase, dict[str, Any]]] = [("training", draft) for draft in training]
    drafts += [("main", draft) for draft in _shuffled_trials(study, task, models, rng=rng)]
    kind = AbsoluteTrial if task == "absolute" else RelativeTrial
    trials = tuple(
        kind(trial=number, phase=phase, tray=study.trays[draft["texture"]], **draft)
        for number, (phase, draft) in enumerate(drafts, start=1)
    )
    return SessionPlan(study=study, task=task, subject=subject, session=session, trials=trials)


def models_of_session(
    study: Study, *, task: Task, subject: int, session: int
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


def _main_trials(
    study: Study, task: Task, models: Sequence[ModelKind]
) -> list[tuple[str, ModelKind]]:
    """Texture and model of each main trial, in the study's own order (nothing shuffled)."""
    pairs = [(texture, model) for model in models for texture in study.textures]
    return pairs * (study.repeats if task == "relative" else 1)


def _shuffled_trials(
    study: Study, task: Task, models: Sequence[ModelKind], *, rng: np.random.Generator
) -> list[dict[str, Any]]:
    """What differs from trial to trial, in random order."""
    order = fisher_yates(_main_trials(study, task, models), rng)
    if task == "absolute":
        first = _balanced_first_surfaces(len(order), rng)
        return [
            {"texture": texture, "model": model, "first_surface": surface}
            for (texture, model), surface in zip(order, first, strict=True)
        ]
    return [
        {"texture": texture, "model": model, "layout": tuple(fisher_yates(study.textures, rng))}
        for texture, model in order
    ]


def _balanced_first_surfaces(count: int, rng: np.random.Generator) -> list[Surface]:
    """Real first and virtual first equally often (one apart if odd), in random order."""
    surfaces: tuple[Surface, ...] = ("real", "virtual")
    pair = fisher_yates(surfaces, rng)
    return fisher_yates([pair[index % 2] for index in range(count)], rng)


def _generator(study: Study, task: Task, subject: int, *, session: int) -> np.random.Generator:
    """Random numbers of one session (session 0: of one counterbalancing pair)."""
    return generator(study.seed, TASKS.index(task), subject, session)
