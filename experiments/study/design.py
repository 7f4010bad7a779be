"""The order of the trials and conditions (docs/method/protocols.md#order, PAPER VII).

Balancing over participants is based on the *slot*, a place 1 … participants in the plan of
a task, which the replacement of a dropout takes over; all shuffles follow from the subject.

Several things are balanced over slots: which model comes on which day, which comes first of a
texture. Each is balanced over a block of neighbouring slots by random
numbers that these slots share (`block_of`: seed, task, number of the block, purpose), and dealt
among them by Fisher–Yates. So balances cannot disturb each other, since their purposes draw
independently; a study that ends early is balanced in every complete block; the number of a slot
reveals nothing; and who replaces a dropout inherits what is balanced, while what is only shuffled
is new. The purpose is part of the seed: renaming one, or another order of `TASKS`, changes the
order of every study under way.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal, TypeVar

import numpy as np

from tactileq.experiments.study.study import TASKS, Study
from tactileq.modeling.checks import check_whole
from tactileq.modeling.reprs import one_line
from tactileq.modeling.seeds import generator, number_of

Phase = Literal["training", "main"]
Item = TypeVar("Item")
HIGHEST_SUBJECT = 9999


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


def dealt(items: Sequence[Item], count: int, rng: np.random.Generator) -> list[Item]:
    """`count` items in random order, each equally often; which comes once more is random, too.

    Parameters
    ----------
    items : sequence of length n
    count : int
        ≥ 0.
    rng : numpy.random.Generator
    """
    order = fisher_yates(items, rng)
    return fisher_yates([order[index % len(order)] for index in range(count)], rng)


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
    model : str
        The set of models behind the virtual surfaces.
    tray : str
        Where the real sample lies.
    """

    trial: int
    phase: Phase
    texture: str
    model: str
    tray: str

    def to_dict(self) -> dict[str, Any]:
        """The trial as plain values, as a session stores it."""
        return asdict(self)


Order = Sequence[tuple[str, str]]


@dataclass(frozen=True, kw_only=True)
class Occasion:
    """One session of one participant: what its trials are drawn from.

    Parameters
    ----------
    subject : int
        1 … 9999; with the seed, the task and the session all shuffles follow from it.
    slot : int
        1 … participants; what is balanced over participants follows from it.
    session : int
        From 1.
    models : tuple of str
        Those that the session presents.
    rng : numpy.random.Generator
        Of the session's shuffles.
    phase : {"training", "main"}
        What the trials are drawn for.
    """

    study: Study
    task: str
    subject: int
    slot: int
    session: int
    models: tuple[str, ...]
    rng: np.random.Generator
    phase: Phase = "main"

    @staticmethod
    def of(study: Study, *, task: str, subject: int, session: int, slot: int) -> Occasion:
        """The occasion of one session.

        Raises
        ------
        InputError
            If the study has no such task, subject, session or slot.
        """
        check_whole("subject", subject, low=1, high=HIGHEST_SUBJECT)
        check_whole("slot", slot, low=1, high=study.plan_of(task).participants)
        check_whole("session", session, low=1, high=study.sessions(task))
        return Occasion(
            study=study,
            task=task,
            subject=subject,
            slot=slot,
            session=session,
            models=models_of_session(study, task=task, slot=slot, session=session),
            rng=generator(study.seed, TASKS.index(task), subject, session),
        )

    def block(self, size: int, purpose: str) -> tuple[np.random.Generator, int]:
        """Random numbers that `size` neighbouring slots share, and this slot's place among them.

        Parameters
        ----------
        size : int
            Slots 1 … size are the first block, and so on.
        purpose : str
            What it is for; each purpose has random numbers of its own.

        Returns
        -------
        numpy.random.Generator
            In the same state for every slot of the block.
        int
            0 … size − 1, dealt by Fisher–Yates: another one for each slot of the block.
        """
        return block_of(self.study, self.task, slot=self.slot, size=size, purpose=purpose)


def block_of(
    study: Study, task: str, *, slot: int, size: int, purpose: str
) -> tuple[np.random.Generator, int]:
    """`Occasion.block` of a slot before there is an occasion."""
    number, place = divmod(slot - 1, size)
    rng = generator(study.seed, TASKS.index(task), number, 0, number_of(purpose))
    return rng, fisher_yates(range(size), rng)[place]


def models_of_session(study: Study, *, task: str, slot: int, session: int) -> tuple[str, ...]:
    """The models that a session presents: all of the task when interleaved, one when by day.

    By day, as many neighbouring slots as there are models do them in the rows of a cyclic Latin
    square of a random order, dealt at random: exactly as many begin with each model, and a number
    does not reveal which.
    """
    models = study.models_of(task)
    if study.plan_of(task).schedule == "interleaved":
        return models
    rng, row = block_of(study, task, slot=slot, size=len(models), purpose="days")
    order = fisher_yates(models, rng)
    return (order[(row + session - 1) % len(order)],)


def first_models(occasion: Occasion) -> dict[str, str]:
    """The model that comes first of each texture in an interleaved session.

    Over as many neighbouring slots as there are models each comes first once, and within a session
    each is first for equally many textures, or for one more.
    """
    models, textures = occasion.models, occasion.study.textures
    rng, place = occasion.block(len(models), "first model")
    order = fisher_yates(models, rng)
    starts = dealt(range(len(order)), len(textures), rng)
    return {
        texture: order[(start + place) % len(order)]
        for texture, start in zip(textures, starts, strict=True)
    }


def with_first_models(order: Order, first: Mapping[str, str]) -> list[tuple[str, str]]:
    """The order with two models of a texture exchanged wherever another one came first.

    Exchanging names of a uniformly random order leaves it uniform among those that begin so.
    """
    came: dict[str, str] = {}
    for texture, model in order:
        came.setdefault(texture, model)
    names = {
        texture: {model: first[texture], first[texture]: model} for texture, model in came.items()
    }
    return [(texture, names[texture].get(model, model)) for texture, model in order]


@dataclass(frozen=True, kw_only=True)
class SessionPlan:
    """The whole order of one session, made before its first trial."""

    study: Study
    task: str
    subject: int
    session: int
    slot: int
    trials: tuple[Trial, ...]

    __repr__ = one_line

    def to_dict(self) -> dict[str, Any]:
        """The plan as plain values."""
        return {
            "study": self.study.to_dict(),
            "task": self.task,
            "subject": self.subject,
            "session": self.session,
            "slot": self.slot,
            "trials": [trial.to_dict() for trial in self.trials],
        }
