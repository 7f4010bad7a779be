"""The hand: speed and force over samples, as everything that renders reads them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from modeling.arrays import Floats
from modeling.errors import InputError


class Hand(NamedTuple):
    """A hand at each of n samples.

    Parameters
    ----------
    speed_mm_s : (n,) ndarray
        Tangential speed; its sign is the direction. NaN counts as lift-off.
    force_n : (n,) ndarray
        Normal force; 0 and below is lift-off, as is NaN.
    """

    speed_mm_s: Floats
    force_n: Floats

    @staticmethod
    def of(speed_mm_s: ArrayLike, force_n: ArrayLike, *, samples: int | None = None) -> Hand:
        """A hand from two arrays of one length, or from two scalars that hold for `samples`.

        Raises
        ------
        InputError
            For anything else.
        """
        speed = np.asarray(speed_mm_s, dtype=np.float64, order="C")
        force = np.asarray(force_n, dtype=np.float64, order="C")
        if speed.ndim == force.ndim == 0 and samples is not None and samples >= 0:
            return Hand(np.full(samples, float(speed)), np.full(samples, float(force)))
        if speed.ndim != 1 or speed.shape != force.shape or samples is not None:
            raise InputError(
                "expected speed and force as two arrays of one length, or two scalars with "
                f"samples=, got shapes {speed.shape} and {force.shape} with samples={samples}; "
                "match them."
            )
        return Hand(speed, force)
