"""What was decided on one layer, whatever decided it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tactileq.modeling.arrays import Bools, Floats
from tactileq.modeling.errors import counted
from tactileq.modeling.perception.thresholds import Threshold


class Decision(NamedTuple):
    """On one layer, in the C conditions of the grid.

    Parameters
    ----------
    distances_db : (C,) ndarray
        Of what decides to the threshold; NaN where it is not known.
    assumed : (C,) ndarray of bool
        Where the threshold's last level was held as a lower bound.
    """

    kept: bool
    reason: str
    distances_db: Floats
    assumed: Bools
    flip_probability: float


def no_threshold_known(distances_db: Floats, threshold: Threshold) -> str:
    """The reason of a layer whose distance is NaN in some conditions."""
    outside = int(np.isnan(distances_db).sum())
    known = "{:g} to {:g} Hz".format(*threshold.valid_range_hz)
    where = f"{outside} of {counted(distances_db.size, 'condition')}"
    return f"no threshold known in {where} ({threshold.name} covers {known})"
