"""The relative evaluation (docs/method/protocols.md#relative-task, PAPER VII-B2).

The participant feels a real surface and, behind one button each, the virtual surfaces of all
textures, switches freely, and says once which virtual surface is the real one.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial, update_wrapper
from typing import Any

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
    "Forced choice: which of the virtual surfaces, one per button and in a new layout each time, "
    "is the real surface that can be felt beside them?"
)
TEXTS = {
    "training": (
        "Training",
        "One real surface is in place. Each numbered button presents a virtual surface; one of "
        "them is its copy. Switch as often as you like, then confirm the one that you think it "
        "is. These first choices are for practice.",
    ),
    "main": (
        "The choices begin",
        "Find the virtual surface that is the copy of the real one. Switch as often as you like; "
        "if you are not sure, take the most similar one.",
    ),
    "closing": ("Thank you", "This part is complete."),
}


@dataclass(frozen=True, kw_only=True)
class RelativeTrial(Trial):
    """One trial: a real surface, and one button per virtual surface.

    Parameters
    ----------
    trial, phase, texture, model, tray
        As in `Trial`; `texture` is the right answer.
    layout : tuple of str
        Texture behind each button, from button 1 on.
    """

    layout: tuple[str, ...]


# --- The trials -----------------------------------------------------------------------------


def _trials(order: Order, study: Study, rng: np.random.Generator) -> list[dict[str, Any]]:
    """A new layout of the buttons for each trial."""
    return [
        {"texture": texture, "model": model, "layout": tuple(fisher_yates(study.textures, rng))}
        for texture, model in order
    ]


def _virtual(models: ModelSets, trial: RelativeTrial) -> list[Layered]:
    return [models.of(texture, trial.model) for texture in trial.layout]


def _begin(trial: RelativeTrial, surfaces: Surfaces) -> None:
    surfaces.present_real()


def _ask(respondent: Respondent, trial: RelativeTrial, surfaces: Surfaces) -> Mapping[str, object]:
    choice = respondent.choose(trial, surfaces)
    answer = trial.layout[choice.button]
    return {
        "layout": "|".join(trial.layout),
        "answer": answer,
        "correct": int(answer == trial.texture),
        "presses": surfaces.presses,
        "response_time_s": choice.response_time_s,
    }


TASK = Task(
    name="relative",
    description=DESCRIPTION,
    texts=TEXTS,
    trial=RelativeTrial,
    repeated=True,
    trials=_trials,
    virtual=_virtual,
    begin=_begin,
    ask=_ask,
)
run_relative = partial(run_session, TASK)
update_wrapper(run_relative, run_session, assigned=("__doc__",), updated=())
