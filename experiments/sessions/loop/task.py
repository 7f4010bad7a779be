"""What a task is: everything that distinguishes it from another one, as one object."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from tactileq.experiments.sessions.loop.people import Respondent
from tactileq.experiments.sessions.loop.surfaces import Surfaces
from tactileq.experiments.study.design import Occasion, Order, Trial
from tactileq.experiments.study.models import ModelSets
from tactileq.modeling import InputError
from tactileq.modeling.errors import shown
from tactileq.modeling.files.answer_tables import ANSWER_TABLES, AnswerColumn
from tactileq.modeling.reprs import one_line
from tactileq.rig.shared.interface import Presentable, TextureRig, ToneBurst


@dataclass(frozen=True, kw_only=True)
class Task:
    """One task of an experiment.

    What the participant reads stands under the task's name in the console's texts: before the
    phases "training" and "main", and at "closing".

    Parameters
    ----------
    name : str
        One of `ANSWER_TABLES`, where the columns of its answers are declared.
    description : str
        What the participant does, for the sidecar of the answers.
    trial : type
        Of one trial; a dataclass.
    trials : callable
        From the occasion, and textures and models in a balanced random order, to what
        distinguishes the trials: texture, model and the task's own fields.
    virtual : callable
        From the models and a trial to the virtual surfaces, one per button.
    begin : callable
        Presents the first surface of a trial.
    ask : callable
        From the respondent, a trial and its surfaces to the columns that are the task's own.
    adapt : callable, optional
        From a planned trial, the answers so far in this session (training and those that are not
        valid among them) and the rig to the trial as it is presented; None where everything is
        planned.
    mounts : bool
        Whether a real surface is mounted for each trial.
    feel_all : bool
        Whether every virtual surface must be felt before an answer, whatever the study says.
    """

    name: str
    description: str
    trial: type[Trial]
    trials: Callable[[Occasion, Order], list[dict[str, Any]]]
    virtual: Callable[[ModelSets, Any], Sequence[Presentable | ToneBurst]]
    begin: Callable[[Any, Surfaces], None]
    ask: Callable[[Respondent, Any, Surfaces], Mapping[str, object]]
    adapt: Callable[[Any, Sequence[Mapping[str, object]], TextureRig], Any] | None = None
    mounts: bool = True
    feel_all: bool = False

    __repr__ = one_line

    def trial_of(self, values: Mapping[str, Any]) -> Trial:
        """A trial as it was before a manifest stored it: what is a list in JSON was a tuple.

        Raises
        ------
        InputError
            If these are not the values of a trial of the task.
        """
        stored: dict[str, Any] = {
            name: tuple(value) if isinstance(value, list) else value
            for name, value in values.items()
        }
        try:
            return self.trial(**stored)
        except TypeError:
            raise InputError(
                f"expected a trial of the task {self.name} in the manifest, got {shown(stored)}; "
                "restore the file from a copy."
            ) from None

    @property
    def columns(self) -> tuple[AnswerColumn, ...]:
        """The columns of its answers, in order."""
        return ANSWER_TABLES[self.name].columns
