"""What a whole scene costs: distinct tables of all textures, and one state for a hand."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from tactileq.modeling.models.loading import Layered
from tactileq.modeling.models.regressed_model import RegressedModel
from tactileq.modeling.rendering.plan import RenderPlan

Rendered = tuple[Layered, RenderPlan]


def in_one_precision(rendered: Iterable[Rendered]) -> list[Rendered]:
    """Models and plans of one program, which has one kind of numbers: single if all may have it."""
    pairs = list(rendered)
    single = all(plan.single for _, plan in pairs)
    return [(model, replace(plan, single=single)) for model, plan in pairs]


def scene_bytes(rendered: Iterable[Rendered]) -> int:
    """Bytes of a scene: arrays that are equal bit for bit are stored once, and so is the state."""
    arrays: dict[tuple[str, bytes], int] = {}
    states = [0]
    for model, plan in in_one_precision(rendered):
        for value in plan.texture(model).values():
            if np.ndim(value):
                array = np.asarray(value)
                arrays[array.dtype.str, array.tobytes()] = array.nbytes
        states.append(plan.cost(model).state_bytes)
    return sum(arrays.values()) + max(states)


def stored_numbers(model: Layered) -> int:
    """Of a grid S·F·(1 + 3m), of regressions the coefficients that are not 0."""
    if isinstance(model, RegressedModel):
        return model.n_parameters
    return model.noise_gains.size * model.n_parameters
