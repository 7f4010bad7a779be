"""Signs of layers worth trying: which patterns a coherent sum can have.

docs/method/equalizer.md#signs
"""

from __future__ import annotations

import numpy as np

from tactileq.modeling.arrays import Floats


def sign_patterns(frequencies_hz: Floats) -> Floats:
    """Signs worth trying (docs/method/equalizer.md#signs): all equal, and the two that alternate.

    Parameters
    ----------
    frequencies_hz : (m,) ndarray
        Any order.

    Returns
    -------
    (k, m) ndarray of ±1
        k = 3, or 1 for m < 2: the sign of a layer alone only rescales its gain.
    """
    m = frequencies_hz.size
    if m < 2:
        return np.ones((1, m))
    alternating = np.empty(m)
    alternating[np.argsort(frequencies_hz, kind="stable")] = (-1.0) ** np.arange(m)
    return np.stack((np.ones(m), alternating, -alternating))


def neighbouring_patterns(frequencies_hz: Floats) -> Floats:
    """`sign_patterns`, and each of them with one relation between neighbours turned, (k, m).

    Turned means that all layers above a gap change their signs.
    """
    patterns = sign_patterns(frequencies_hz)
    turns = [np.where(frequencies_hz >= above, -1.0, 1.0) for above in np.sort(frequencies_hz)[1:]]
    return np.unique([*patterns, *(turn * p for turn in turns for p in patterns)], axis=0)
