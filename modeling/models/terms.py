"""The predictors of parameters (eq. 3 and 4)."""

from __future__ import annotations

from typing import Literal

from tactileq.modeling.errors import InputError, shown

DrivenBy = Literal["conditions", "centroid"]
CENTROID = "centroid"
SPEED, FORCE, SPEED_FORCE = "speed", "force", "speed_force"
TERMS = (SPEED, FORCE, SPEED_FORCE)
DRIVING_TERMS = {"conditions": TERMS, "centroid": (CENTROID,)}


def check_driver(driven_by: str) -> None:
    """Refuse predictors that cannot drive a model."""
    names = tuple(DRIVING_TERMS)  # a file may hold a list, which no dictionary can look up
    if driven_by not in names:
        raise InputError(
            f"expected a model driven by {' or '.join(names)}, got {shown(driven_by)}; choose one."
        )
