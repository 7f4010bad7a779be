"""Types of arrays that every room speaks of."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
Integers = NDArray[np.intp]


def no_marks() -> Bools:
    """An array of no marks, which stands for as many as there may be, none of them set."""
    return np.zeros(0, dtype=bool)
