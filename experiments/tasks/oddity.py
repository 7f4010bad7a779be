"""Full against simplified, compared directly (docs/own-protocol.md).

Three buttons present virtual surfaces of one texture: two render one model, the third the other.
Which is the odd one out? Nobody has to name a texture or to find a number for a likeness, so this
shows most directly whether anybody feels the difference.
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
    "Of three virtual surfaces of one texture, one per button, two render the same model and one "
    "another; which is the odd one out? Chance is 1/3."
)
BUTTONS = 3


@dataclass(frozen=True, kw_only=True)
class OddityTrial(Trial):
    """One trial: three virtual surfaces of one texture, or in a catch trial of two; no real one.

    Parameters
    ----------
    trial, phase, texture, model, tray
        As in `Trial`; `texture` is that of the two that are alike, `model` that of the odd one.
    layout : tuple of str
        Model behind each button, from button 1 on.
    odd_position : int
        The right answer, from 1.
    odd_texture : str
        What the odd one models: `texture`, except in a catch trial. Empty in a session without
        catch trials, which stores nothing of it.
    """

    layout: tuple[str, ...]
    odd_position: int
    odd_texture: str = ""

    @property
    def is_catch(self) -> bool:
        """Whether the odd one models another texture."""
        return self.odd_texture not in ("", self.texture)

    def to_dict(self) -> dict[str, Any]:
        """The trial as plain values, as a session stores it."""
        values = super().to_dict()
        if not self.odd_texture:
            del values["odd_texture"]
        return values


# --- The trials -----------------------------------------------------------------------------


def _trials(occasion: Occasion, order: Order) -> list[dict[str, Any]]:
    """Where the odd one is, is balanced for each texture and odd model, and over the study."""
    positions = _positions(occasion, order)
    drafts = []
    for texture, odd in order:
        position = positions[texture, odd].pop()
        (same,) = set(occasion.models) - {odd}
        layout = [same] * BUTTONS
        layout[position - 1] = odd
        drafts.append(
            {"texture": texture, "model": odd, "layout": tuple(layout), "odd_position": position}
        )
    if occasion.study.plan_of(occasion.task).catch_trials:
        return _with_catch_trials(occasion, drafts)
    return drafts


def _positions(occasion: Occasion, order: Order) -> dict[tuple[str, str], list[int]]:
    """The buttons of the odd one for each texture and odd model, in the order of their trials.

    Over three neighbouring slots each pair has it behind each button equally often; within a
    session each button is right equally often (± 1), over all pairs and within each (± 1).
    """
    counts = Counter(order)
    pairs = sorted(counts)
    rng, place = occasion.block(BUTTONS, f"odd position, {occasion.phase}")
    positions, begun = {}, 0
    for pair in fisher_yates(pairs, rng):
        # Each pair continues where the one before stopped, so that all buttons come in turn.
        turns = [(begun + n + place) % BUTTONS + 1 for n in range(counts[pair])]
        begun += counts[pair]
        positions[pair] = fisher_yates(turns, occasion.rng)
    return positions


def _with_catch_trials(occasion: Occasion, drafts: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Catch trials at random places among the main trials, which stay in their order."""
    drafts = [{**draft, "odd_texture": draft["texture"]} for draft in drafts]
    if occasion.phase == "main":
        for catch in _catch_trials(occasion):
            drafts.insert(int(occasion.rng.integers(0, len(drafts) + 1)), catch)
    return drafts


def _catch_trials(occasion: Occasion) -> list[dict[str, Any]]:
    """The catch trials of a session in random order, all surfaces with the reference model.

    Pairs, which surface of a pair is odd, and buttons come equally often (± 1), each of the last
    two also within a pair; over three neighbouring slots each button comes equally often.
    """
    plan = occasion.study.plan_of(occasion.task)
    rng, place = occasion.block(BUTTONS, "catch trials")
    pairs = fisher_yates(sorted(plan.catch.items()), rng)
    turn = int(occasion.rng.integers(0, 2))
    drafts = []
    for number, which in enumerate(sorted(n % len(pairs) for n in range(plan.catch_trials or 0))):
        odd = (number + turn) % 2
        drafts.append(
            {
                "texture": pairs[which][1 - odd],
                "model": occasion.models[0],
                "layout": (occasion.models[0],) * BUTTONS,
                "odd_position": (number + place) % BUTTONS + 1,
                "odd_texture": pairs[which][odd],
            }
        )
    return fisher_yates(drafts, occasion.rng)


def _virtual(models: ModelSets, trial: OddityTrial) -> list[Presentable]:
    textures = [trial.texture] * BUTTONS
    textures[trial.odd_position - 1] = trial.odd_texture or trial.texture
    return [models.of(*shown) for shown in zip(textures, trial.layout, strict=True)]


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
        **({"odd_texture": trial.odd_texture} if trial.odd_texture else {}),
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
