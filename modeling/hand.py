"""The hand: speed and force over samples."""

from __future__ import annotations

from typing import NamedTuple

from tactileq.modeling.arrays import Floats


class Hand(NamedTuple):
    """A hand at each of n samples.

    Parameters
    ----------
    speed_mm_s : (n,) ndarray
        Tangential speed; its sign is the direction. NaN where it was not read.
    force_n : (n,) ndarray
        Normal force; 0 and below is lift-off; NaN where it was not read.
    """

    speed_mm_s: Floats
    force_n: Floats
