"""The absolute evaluation (docs/method/protocols.md#absolute-task, PAPER VII-B1).

The participant knows that the virtual surface stands for the real one, feels both as often as
wanted, and rates on two scales from 0 to 100 how alike they are.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from tactileq.experiments.sessions.loop.people import Respondent
from tactileq.experiments.sessions.loop.surfaces import Surfaces
from tactileq.experiments.sessions.loop.task import Task
from tactileq.experiments.study.design import Occasion, Order, Trial, dealt, fisher_yates
from tactileq.experiments.study.models import ModelSets
from tactileq.rig.shared.interface import Presentable

# --- Parameters -----------------------------------------------------------------------------

DESCRIPTION = (
    "A real and a virtual surface, presented as a corresponding pair, are compared "
    "freely and their similarity "
    "is rated on two visual analogue scales without a preset marker."
)

Surface = Literal["real", "virtual"]
SURFACES: tuple[Surface, ...] = ("real", "virtual")


@dataclass(frozen=True, kw_only=True)
class AbsoluteTrial(Trial):
    """One trial: a real surface beside one virtual surface.

    Parameters
    ----------
    trial, phase, texture, model, tray
        As in `Trial`.
    virtual_texture : str
        What the virtual surface models: `texture`, except in an anchor.
    first_surface : {"real", "virtual"}
        What is presented when the trial begins.
    """

    virtual_texture: str
    first_surface: Surface


# --- The trials -----------------------------------------------------------------------------


def _trials(occasion: Occasion, order: Order) -> list[dict[str, Any]]:
    """Real and virtual first equally often, as is dealt; anchors at random places among the rest.

    docs/method/protocols.md#order
    """
    first = _first_surfaces(occasion)
    came: Counter[tuple[str, str]] = Counter()
    drafts = []
    for pair in order:
        turn = (first[pair] + came[pair]) % 2
        came[pair] += 1
        drafts.append(_draft(*pair, virtual=pair[0], first=SURFACES[turn]))
    return _with_anchors(occasion, drafts) if occasion.phase == "main" else drafts


def _first_surfaces(occasion: Occasion) -> dict[tuple[str, str], int]:
    """Which surface is first where a texture comes with a model for the first time.

    Of two neighbouring slots one begins with the real surface where the other does not; within a
    slot half of all begin with it, and half within each model.
    """
    study = occasion.study
    models, textures = study.models_of(occasion.task), study.textures
    rng, place = occasion.block(2, "first surface")
    turn = int(rng.integers(0, 2))
    first = {}
    for model in models:
        turns = [(turn + index) % 2 for index in range(len(textures))]
        turn += len(textures)
        for texture, dealt_turn in zip(textures, fisher_yates(turns, rng), strict=True):
            first[texture, model] = (dealt_turn + place) % 2
    return first


def _with_anchors(occasion: Occasion, drafts: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Each anchor once at a random place, beside the reference model of another texture."""
    study, rng = occasion.study, occasion.rng
    anchors = study.plan_of(occasion.task).anchors
    reference = study.models_of(occasion.task)[0]
    surfaces = dealt(SURFACES, len(anchors), rng)
    for (real, virtual), first in zip(sorted(anchors.items()), surfaces, strict=True):
        place = int(rng.integers(0, len(drafts) + 1))
        drafts.insert(place, _draft(real, reference, virtual=virtual, first=first))
    return drafts


def _draft(texture: str, model: str, *, virtual: str, first: Surface) -> dict[str, Any]:
    return {
        "texture": texture,
        "model": model,
        "virtual_texture": virtual,
        "first_surface": first,
    }


def _virtual(models: ModelSets, trial: AbsoluteTrial) -> list[Presentable]:
    return [models.of(trial.virtual_texture, trial.model)]


def _begin(trial: AbsoluteTrial, surfaces: Surfaces) -> None:
    if trial.first_surface == "real":
        surfaces.present_real()
    else:
        surfaces.present_virtual()


def _ask(respondent: Respondent, trial: AbsoluteTrial, surfaces: Surfaces) -> Mapping[str, object]:
    rating = respondent.rate(trial, surfaces)
    return {
        "virtual_texture": trial.virtual_texture,
        "first_surface": trial.first_surface,
        "magnitude_similarity": rating.magnitude_similarity,
        "frequency_similarity": rating.frequency_similarity,
        "toggles": surfaces.switches,
        "response_time_s": rating.response_time_s,
    }


TASK = Task(
    name="absolute",
    description=DESCRIPTION,
    trial=AbsoluteTrial,
    trials=_trials,
    virtual=_virtual,
    begin=_begin,
    ask=_ask,
)
