"""Sensitivity d′ from shares of right answers, each task by its own decision model.

docs/method/statistics.md#d-prime
"""

from __future__ import annotations

from collections.abc import Callable
from math import inf, sqrt

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import ndtr

from modeling import InputError

HIGHEST = 20.0  # where all shares are 1 to the last digit
Model = Callable[[float], float]


def m_afc_share(d_prime: float, *, alternatives: int) -> float:
    """Share of right answers of an unbiased observer in m-alternative forced choice.

    The largest of m independent normal values is chosen; that of the right answer has the mean d′
    (Green and Swets 1966; Hacker and Ratcliff 1979).

    Parameters
    ----------
    d_prime : float
    alternatives : int
        m ≥ 2.
    """
    if alternatives < 2:
        raise InputError(
            f"expected two alternatives or more, got {alternatives}; give the number of buttons."
        )
    return _mean_over_normal(lambda x: float(ndtr(x + d_prime)) ** (alternatives - 1))


def oddity_share(d_prime: float) -> float:
    """Share of right answers of an observer who finds the odd one of three.

    The one farthest from the other two is chosen (triangular method: Frijters, Kooistra and
    Vereijken 1980).

    Parameters
    ----------
    d_prime : float
        Of the odd one from the other two, ≥ 0.
    """
    apart = d_prime * sqrt(2 / 3)

    def right(x: float) -> float:
        return float(ndtr(apart - x * sqrt(3)) + ndtr(-apart - x * sqrt(3)))

    found, _ = quad(lambda x: 2 * right(x) * _density(x), 0, inf)
    return float(found)


def m_afc_d_prime(share: float, *, alternatives: int) -> float:
    """d′ at which `m_afc_share` is this share; below 0 below chance, infinite for 0 and 1."""
    if share in (0.0, 1.0):
        return inf if share else -inf
    return _inverse(lambda d: m_afc_share(d, alternatives=alternatives), share, lowest=-HIGHEST)


def oddity_d_prime(share: float) -> float:
    """d′ at which `oddity_share` is this share; 0 at and below chance (1/3), infinite for 1.

    Less than chance carries no sign here: who confuses the odd one with others feels no less.
    """
    if 0 <= share <= 1 / 3:
        return 0.0
    return inf if share == 1 else _inverse(oddity_share, share, lowest=0.0)


def _inverse(model: Model, share: float, *, lowest: float) -> float:
    if not 0 <= share <= 1:
        raise InputError(f"expected a share of right answers from 0 to 1, got {share}; correct it.")
    if share >= model(HIGHEST):
        return inf
    return float(brentq(lambda d: model(d) - share, lowest, HIGHEST, xtol=1e-12))


def _mean_over_normal(of: Model) -> float:
    found, _ = quad(lambda x: of(x) * _density(x), -10, 10, points=[0], limit=200, epsabs=1e-12)
    return float(found)


def _density(x: float) -> float:
    return float(np.exp(-x * x / 2) / sqrt(2 * np.pi))
