"""Sensitivity d′ from shares of right answers, each task by its own decision model.

docs/method/statistics.md#d-prime, docs/method/speed-accuracy.md#same-or-different
"""

from __future__ import annotations

from collections.abc import Callable
from math import inf, sqrt

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq
from scipy.special import ndtr, ndtri

from tactileq.modeling import InputError
from tactileq.modeling.arrays import Floats
from tactileq.modeling.participants.choices import m_afc_share, oddity_share

HIGHEST = 20.0  # where all shares are 1 to the last digit
Model = Callable[[float], float]


def m_afc_d_prime(share: float, *, alternatives: int) -> float:
    """d′ at which `m_afc_share` is this share; below 0 below chance, infinite for 0 and 1."""
    if share in (0.0, 1.0):
        return inf if share else -inf
    return _inverse(
        lambda d: float(m_afc_share(d, alternatives=alternatives)), share, lowest=-HIGHEST
    )


def yes_no_d_prime(
    hits: ArrayLike, signals: ArrayLike, *, false_alarms: ArrayLike, noise: ArrayLike
) -> Floats:
    """d′ = z(H) − z(F) of one interval, two classes and two answers, corrected loglinearly.

    Half an answer is added to hits and to false alarms, and one trial to either class, so that it
    is finite (Hautus 1995).

    Parameters
    ----------
    hits, false_alarms : array_like
        Numbers of answers "signal" to either class.
    signals, noise : array_like
        Numbers of trials of either class; NaN where there is none.
    """
    s, n = np.asarray(signals, dtype=float), np.asarray(noise, dtype=float)
    z_hits = ndtri((np.asarray(hits) + 0.5) / (s + 1))
    z_false_alarms = ndtri((np.asarray(false_alarms) + 0.5) / (n + 1))
    return np.where((s > 0) & (n > 0), z_hits - z_false_alarms, np.nan)


def oddity_d_prime(share: float) -> float:
    """d′ at which `oddity_share` is this share; 0 at and below chance (1/3), infinite for 1.

    Shares below chance count as chance: sensitivity cannot be less than none.
    """
    if 0 <= share <= 1 / 3:
        return 0.0
    return inf if share == 1 else _inverse(lambda d: float(oddity_share(d)), share, lowest=0.0)


def same_different_d_prime(hits: float, false_alarms: float) -> float:
    """d′ of observers who judge the two surfaces of a trial one by one: independent observations.

    Infinite for hits of 1 or false alarms of 0 (Macmillan and Creelman 2005, ch. 9).
    docs/method/speed-accuracy.md#same-or-different

    Parameters
    ----------
    hits, false_alarms : float
        Share of "different" where the surfaces differ, and where they are the same, 0 … 1; 0 where
        the former is not the larger.
    """
    if not _more_hits(hits, false_alarms):
        return 0.0
    # Neighbouring numbers may change places when rounded.
    unbiased = ndtr(max(0.0, ndtri(hits) - ndtri(false_alarms)) / 2)
    return float(2 * ndtri((1 + np.sqrt(2 * unbiased - 1)) / 2))


def same_different_differencing_d_prime(hits: float, false_alarms: float) -> float:
    """d′ of observers who answer by the difference between the two percepts: differencing.

    Parameters and limits as in `same_different_d_prime`.
    docs/method/speed-accuracy.md#same-or-different
    """
    if not _more_hits(hits, false_alarms):
        return 0.0
    if hits == 1 or false_alarms == 0:
        return inf
    criterion = -sqrt(2) * ndtri(false_alarms / 2)

    def model(d_prime: float) -> float:
        above, below = d_prime - criterion, -d_prime - criterion
        return float(ndtr(above / sqrt(2)) + ndtr(below / sqrt(2)))

    return _inverse(model, hits, lowest=0.0)


def d_primes(*shares: float, of: Callable[[float], float]) -> tuple[float, ...]:
    """d′ of a mean share of right answers, of the limits of its interval, or of a bound.

    docs/method/speed-accuracy.md#interval-of-d-prime

    Parameters
    ----------
    shares : float
        Cut to 0 … 1; NaN stays NaN.
    of : callable
        From a share to d′, rising.
    """
    return tuple(
        share if np.isnan(share) else of(float(np.clip(share, 0.0, 1.0))) for share in shares
    )


def _more_hits(hits: float, false_alarms: float) -> bool:
    for share in (hits, false_alarms):
        _check_share(share)
    return hits > false_alarms


def _check_share(share: float) -> None:
    if not 0 <= share <= 1:
        raise InputError(f"expected a share of answers from 0 to 1, got {share}; correct it.")


def _inverse(model: Model, share: float, *, lowest: float) -> float:
    _check_share(share)
    if share >= model(HIGHEST):
        return inf
    return float(brentq(lambda d: model(d) - share, lowest, HIGHEST, xtol=1e-12))
