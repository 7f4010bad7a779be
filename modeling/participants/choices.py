"""How a participant comes to a choice: the one definition for simulation, planning and verdicts.

docs/method/participants.md#choices
"""

from __future__ import annotations

import numpy as np
from scipy.special import ndtr

from tactileq.modeling.arrays import Floats
from tactileq.modeling.checks import is_whole
from tactileq.modeling.errors import InputError, shown

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(200)
_FURTHEST = 10.0  # normal values beyond it do not count
ODDITY_CHANCE = 1 / 3  # of finding the odd one of three by guessing


def m_afc_share(d_prime: Floats | float, *, alternatives: int) -> Floats:
    """Share of right answers of an unbiased observer in m-alternative forced choice.

    The largest of m independent normal values is chosen; that of the right answer has the mean d′
    (Green and Swets 1966; Hacker and Ratcliff 1979).

    Parameters
    ----------
    d_prime : float or ndarray
        Any shape.
    alternatives : int
        m ≥ 2.

    Raises
    ------
    InputError
        For fewer than two alternatives.
    """
    if not is_whole(alternatives) or alternatives < 2:
        raise InputError(
            f"expected two alternatives or more, got {shown(alternatives)}; give the number of "
            "buttons."
        )
    x, weights = _FURTHEST * _NODES, _FURTHEST * _WEIGHTS * _density(_FURTHEST * _NODES)
    # Values about the right answer's, so that the nodes lie where the density is.
    shares = ndtr(x + np.asarray(d_prime)[..., None]) ** (alternatives - 1) @ weights
    return _shares(shares)


def oddity_share(d_prime: Floats | float) -> Floats:
    """Share of right answers of an observer who finds the odd one of three.

    The one farthest from the other two is chosen (triangular method: Frijters, Kooistra and
    Vereijken 1980).

    Parameters
    ----------
    d_prime : float or ndarray
        Of the odd one from the other two, ≥ 0; any shape.
    """
    x = _FURTHEST * (_NODES + 1) / 2
    weights = _FURTHEST * _WEIGHTS * _density(x)
    apart = np.sqrt(2 / 3) * np.asarray(d_prime)[..., None]
    right = ndtr(apart - np.sqrt(3) * x) + ndtr(-apart - np.sqrt(3) * x)
    return _shares(right @ weights)


def _shares(found: Floats) -> Floats:
    return np.clip(found, 0.0, 1.0)  # which rounding could pass


def _density(x: Floats) -> Floats:
    found: Floats = np.exp(-0.5 * x * x) / np.sqrt(2 * np.pi)
    return found
