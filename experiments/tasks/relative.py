"""The relative evaluation (docs/method/protocols.md#relative-task, PAPER VII-B2).

The participant feels a real surface and, behind one button each, the virtual surfaces of all
textures, switches freely, and says once which virtual surface is the real one.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from tactileq.experiments.sessions.loop.people import Respondent
from tactileq.experiments.sessions.loop.surfaces import Surfaces
from tactileq.experiments.sessions.loop.task import Task
from tactileq.experiments.study.design import Occasion, Order, Trial, fisher_yates
from tactileq.experiments.study.models import ModelSets
from tactileq.rig.shared.interface import Presentable

# --- Parameters -----------------------------------------------------------------------------

DESCRIPTION = (
    "Forced choice: which of the virtual surfaces, one per button and in a new layout each time, "
    "corresponds to the real surface that can be felt beside them?"
)


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


def _trials(occasion: Occasion, order: Order) -> list[dict[str, Any]]:
    """A new layout of the buttons for each trial, each button right equally often.

    Whenever all textures have come with a model once, each of the buttons was right once
    (docs/method/protocols.md#order).
    """
    buttons: dict[tuple[str, int], dict[str, int]] = {}
    came: Counter[tuple[str, str]] = Counter()
    drafts = []
    for texture, model in order:
        turn = (model, came[texture, model])
        came[texture, model] += 1
        if turn not in buttons:
            buttons[turn] = _right_buttons(occasion)
        layout = _layout(occasion, texture, buttons[turn][texture])
        drafts.append({"texture": texture, "model": model, "layout": layout})
    return drafts


def _right_buttons(occasion: Occasion) -> dict[str, int]:
    textures = occasion.study.textures
    return dict(zip(textures, fisher_yates(range(len(textures)), occasion.rng), strict=True))


def _layout(occasion: Occasion, texture: str, button: int) -> tuple[str, ...]:
    """The texture behind its button, the others in random order behind theirs."""
    others = [other for other in occasion.study.textures if other != texture]
    layout = fisher_yates(others, occasion.rng)
    layout.insert(button, texture)
    return tuple(layout)


def _virtual(models: ModelSets, trial: RelativeTrial) -> list[Presentable]:
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
    trial=RelativeTrial,
    trials=_trials,
    virtual=_virtual,
    begin=_begin,
    ask=_ask,
)
