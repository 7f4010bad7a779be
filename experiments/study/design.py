"""The order of the trials: who does what, when (docs/method/protocols.md#order, PAPER VII)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal, TypeVar

import numpy as np

from experiments.study.study import TASKS, Study
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
    coin = int(session_generator(study, task, pair, session=0).integers(0, 2))
    return (MODELS[(subject + session + coin) % 2],)


def session_generator(
    study: Study, task: str, subject: int, *, session: int
) -> np.random.Generator:
    """Random numbers of one session (session 0: of one counterbalancing pair)."""
    return generator(study.seed, TASKS.index(task), subject, session)
