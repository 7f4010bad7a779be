"""What a task is: everything that distinguishes it from another one, as one object."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from experiments.sessions.surfaces import Respondent, Surfaces
from experiments.study.design import Occasion, Order, Trial
from experiments.study.models import ModelSets
from modeling.files.answer_tables import ANSWER_TABLES, AnswerColumn
from modeling.models.loading import AnyModel


@dataclass(frozen=True, kw_only=True)
class Task:
    """One task of an experiment.

    Parameters
    ----------
    name : str
        One of `ANSWER_TABLES`, where the columns of its answers are declared.
    description : str
        What the participant does, for the sidecar of the answers.
    texts : mapping of key to (title, text)
        What the participant reads: before the phases "training" and "main", and at "closing".
    trial : type
        Of one trial; a dataclass.
    trials : callable
        From an occasion and textures and models in random, balanced order to what distinguishes
        the trials: texture, model and the task's own fields.
    virtual : callable
        From the models and a trial to the virtual surfaces, one per button.
    begin : callable
        Presents the first surface of a trial.
    ask : callable
        From the respondent, a trial and its surfaces to the columns that are the task's own.
    """

    name: str
    description: str
    texts: Mapping[str, tuple[str, str]]
    trial: type[Trial]
    trials: Callable[[Occasion, Order], list[dict[str, Any]]]
    virtual: Callable[[ModelSets, Any], Sequence[AnyModel]]
    begin: Callable[[Any, Surfaces], None]
    ask: Callable[[Respondent, Any, Surfaces], Mapping[str, object]]
    mounts: bool = True
    feel_all: bool = False

    @property
    def columns(self) -> tuple[AnswerColumn, ...]:
        """The columns of its answers, in order."""
        return ANSWER_TABLES[self.name]
