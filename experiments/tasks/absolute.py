"""The absolute evaluation (docs/method/protocols.md#absolute-task, PAPER VII-B1).

The participant knows that the virtual surface stands for the real one, feels both as often as
wanted, and rates on two scales from 0 to 100 how alike they are.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial, update_wrapper
from typing import Any, Literal

import numpy as np

from experiments.sessions.surfaces import Respondent, Surfaces
from experiments.sessions.task import Task
from experiments.sessions.trial_loop import run_session
from experiments.study.design import Order, Trial, fisher_yates
from experiments.study.models import ModelSets
from experiments.study.study import Study
from modeling.models.loading import Layered

# --- Parameters -----------------------------------------------------------------------------

DESCRIPTION = (
    "A real and a virtual surface, said to correspond, are compared at will and their similarity "
    "is rated on two visual analogue scales without a preset marker."
)
TEXTS = {
    "training": (
        "Training",
        "You will compare a real surface with its virtual copy. Switch between the two as often "
        "as you like, then rate how alike they are on both scales. "
        "These first ratings are for practice.",
    ),
    "main": (
        "The ratings begin",
        "Switch between the real surface and its virtual copy as often as you like, "
        "then rate how alike they are on both scales.",
    ),
    "closing": ("Thank you", "This part is complete."),
}

Surface = Literal["real", "virtual"]


@dataclass(frozen=True, kw_only=True)
class AbsoluteTrial(Trial):
    """One trial: a real surface beside one virtual surface.

    Parameters
    ----------
    trial, phase, texture, model, tray
        As in `Trial`.
    first_surface : {"real", "virtual"}
        What is presented when the trial begins.
    """

    first_surface: Surface


# --- The trials -----------------------------------------------------------------------------


def _trials(order: Order, study: Study, rng: np.random.Generator) -> list[dict[str, Any]]:
    """Real first and virtual first equally often (one apart if odd), in random order."""
    surfaces: tuple[Surface, ...] = ("real", "virtual")
    pair = fisher_yates(surfaces, rng)
    first = fisher_yates([pair[index % 2] for index in range(len(order))], rng)
    return [
        {"texture": texture, "model": model, "first_surface": surface}
        for (texture, model), surface in zip(order, first, strict=True)
    ]


def _virtual(models: ModelSets, trial: AbsoluteTrial) -> list[Layered]:
    return [models.of(trial.texture, trial.model)]


def _begin(trial: AbsoluteTrial, surfaces: Surfaces) -> None:
    if trial.first_surface == "real":
        surfaces.present_real()
    else:
        surfaces.present_virtual()


def _ask(respondent: Respondent, trial: AbsoluteTrial, surfaces: Surfaces) -> Mapping[str, object]:
    rating = respondent.rate(trial, surfaces)
    return {
        "first_surface": trial.first_surface,
        "magnitude_similarity": rating.magnitude_similarity,
        "frequency_similarity": rating.frequency_similarity,
        "toggles": surfaces.switches,
        "response_time_s": rating.response_time_s,
    }


TASK = Task(
    name="absolute",
    description=DESCRIPTION,
    texts=TEXTS,
    trial=AbsoluteTrial,
    repeated=False,
    trials=_trials,
    virtual=_virtual,
    begin=_begin,
    ask=_ask,
)
run_absolute = partial(run_session, TASK)
update_wrapper(run_absolute, run_session, assigned=("__doc__",), updated=())
