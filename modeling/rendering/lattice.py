"""All-pole models in real time: their representation in `lattice.h`.

docs/method/rendering.md#ar-models
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from tactileq.modeling.errors import InputError
from tactileq.modeling.models.ar_model import ARModel
from tactileq.modeling.models.parameter_table import wide_enough
from tactileq.modeling.rendering.plan import RenderPlan

MOST_ORDER = 100  # fits go up to 40; the coefficients of one update take time with its square


class LatticeFields(NamedTuple):
    """Members of `tq_texture` and of `tq_lattice`, by name."""

    texture: dict[str, Any]
    lattice: dict[str, Any]


def lattice_fields(model: ARModel, plan: RenderPlan) -> LatticeFields:
    """What an all-pole model is in `lattice.h`, played as this plan says.

    Parameters
    ----------
    model : ARModel
        Of an order up to 100.
    plan : RenderPlan
        For the model's rate.

    Raises
    ------
    InputError
        For a higher order.
    """
    if model.order > MOST_ORDER:
        raise InputError(
            f"expected an AR model of order {MOST_ORDER} at most for real time, got order "
            f"{model.order} of {model.texture}; fit a lower one."
        )
    values = np.concatenate(
        [model.rendered_gains[..., None], model.line_spectral_frequencies], axis=-1
    )
    speeds, values = wide_enough(model.speeds_mm_s, values, along=0)
    forces, values = wide_enough(model.forces_n, values, along=1)
    texture = {
        "speeds": speeds.size,
        "forces": forces.size,
        "speed_mm_s": speeds,
        "force_n": forces,
        "values": values[..., 0].ravel(),
    }
    texture |= plan.timing(np.array([model.rendered_gains.max()])) | plan.restraints()
    lattice = {
        "order": model.order,
        "frequencies": values[..., 1:].ravel(),
    }
    return LatticeFields(texture, lattice)
