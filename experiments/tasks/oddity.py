"""Full against simplified, compared directly (docs/own-protocol.md).

Three buttons present virtual surfaces of one texture: two render one model, the third the other.
Which is the odd one out? Nobody has to name a texture or to find a number for a likeness, so this
most sharply tells whether anybody feels the difference.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from experiments.sessions.surfaces import Respondent, Surfaces
from experiments.sessions.task import Task
from experiments.study.design import Occasion, Order, Trial, dealt
from experiments.study.models import ModelSets
from rig.interface import Presentable

# --- Parameters -----------------------------------------------------------------------------

DESCRIPTION = (
    "Of three virtual surfaces of one texture, one per button, two render the same model and one "
    "another; which is the odd one out? Chance is 1/3."
)
BUTTONS = 3


@dataclass(frozen=True, kw_only=True)
class OddityTrial(Trial):
    """One trial: three virtual surfaces of one texture, no real one.

    Parameters
    ----------
    trial, phase, texture, model, tray
        As in `Trial`; `model` is the odd one.
    layout : tuple of str
        Model behind each button, from button 1 on.
    odd_position : int
        The right answer, from 1.
    """

    layout: tuple[str, ...]
    odd_position: int


# --- The trials -----------------------------------------------------------------------------


def _trials(occasion: Occasion, order: Order) -> list[dict[str, Any]]:
    """For each texture and odd model, the odd one is behind each button equally often (± 1)."""
    positions = {
        pair: dealt(range(1, BUTTONS + 1), count, occasion.rng)
        for pair, count in Counter(order).items()
    }
    drafts = []
    for texture, odd in order:
        position = positions[texture, odd].pop()
        (same,) = set(occasion.models) - {odd}
        layout = [same] * BUTTONS
        layout[position - 1] = odd
        drafts.append(
            {"texture": texture, "model": odd, "layout": tuple(layout), "odd_position": position}
        )
    return drafts


def _virtual(models: ModelSets, trial: OddityTrial) -> list[Presentable]:
    return [models.of(trial.texture, name) for name in trial.layout]


def _begin(trial: OddityTrial, surfaces: Surfaces) -> None:
    surfaces.present_virtual(0)


def _ask(respondent: Respondent, trial: OddityTrial, surfaces: Surfaces) -> Mapping[str, object]:
    choice = respondent.choose(trial, surfaces)
    answer = choice.button + 1
    return {
        "layout": "|".join(trial.layout),
        "odd_position": trial.odd_position,
        "answer": answer,
        "correct": int(answer == trial.odd_position),
        "presses": surfaces.presses,
        "response_time_s": choice.response_time_s,
    }


TASK = Task(
    name="oddity",
    description=DESCRIPTION,
    trial=OddityTrial,
    trials=_trials,
    virtual=_virtual,
    begin=_begin,
    ask=_ask,
    mounts=False,
    feel_all=True,
)
