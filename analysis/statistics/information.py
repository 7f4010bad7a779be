"""Transferred information: how many bits the answers tell about what was presented."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from modeling import InputError
from modeling.arrays import Floats

RESAMPLES = 1999


@dataclass(frozen=True)
class TransferredInformation:
    """Information of a pooled confusion matrix, in bits.

    `bits` is corrected for its bias, `uncorrected` is not; `ci_*` is the 95 % interval of `bits`,
    NaN where all participants answered alike.
    """

    participants: int
    trials: int
    uncorrected: float
    bits: float
    ci_low: float
    ci_high: float


def transferred_information(
    counts: ArrayLike, *, rng: np.random.Generator
) -> TransferredInformation:
    """Transferred information of participants' pooled answers, with a bootstrap over them.

    docs/method/confusions.md#transferred-information

    Parameters
    ----------
    counts : (n, k, k) array_like of int
        A matrix per participant, n ≥ 2: rows presented, columns answered, ≥ 0.
    rng : Generator
        Draws participants.

    Raises
    ------
    InputError
        For one participant, other shapes, or a participant without answers.
    """
    matrices = np.asarray(counts, dtype=float)
    if matrices.ndim != 3 or len(matrices) < 2 or matrices.shape[1] != matrices.shape[2]:
        raise InputError(
            "expected square matrices of at least two participants, got an array of shape "
            f"{matrices.shape}; few trials of one person read as information at pure chance, so "
            "pool several people."
        )
    if not (np.isfinite(matrices).all() and (matrices >= 0).all()):
        raise InputError("expected counts of at least 0, got others; count answers.")
    if not (matrices.sum(axis=(1, 2)) > 0).all():
        raise InputError(
            "expected answers of every participant, got a matrix without any; leave it out."
        )
    pooled = matrices.sum(axis=0)
    low, high = _interval(matrices, rng=rng)
    return TransferredInformation(
        participants=len(matrices),
        trials=int(pooled.sum()),
        uncorrected=information_bits(pooled),
        bits=corrected_bits(pooled),
        ci_low=low,
        ci_high=high,
    )


def information_bits(pooled: Floats) -> float:
    """Mutual information of rows and columns as counted, in bits (Miller and Nicely 1955)."""
    presented, answered = pooled.sum(axis=1), pooled.sum(axis=0)
    return _entropy(presented) + _entropy(answered) - _entropy(pooled.ravel())


def corrected_bits(pooled: Floats) -> float:
    """The same with Miller and Madow's correction of each entropy.

    Never above the entropy of what was presented.
    """
    presented, answered = pooled.sum(axis=1), pooled.sum(axis=0)
    seen = np.count_nonzero(presented) + np.count_nonzero(answered) - np.count_nonzero(pooled)
    correction = (seen - 1) / (2 * pooled.sum() * np.log(2))
    return float(min(information_bits(pooled) + correction, _entropy(presented)))


def _entropy(counts: Floats) -> float:
    return float(stats.entropy(counts, base=2))


def _interval(matrices: Floats, *, rng: np.random.Generator) -> tuple[float, float]:
    if (matrices == matrices[0]).all():
        return float("nan"), float("nan")
    # BCa, since a resample repeats people and so reads too many bits.
    result = stats.bootstrap(
        (np.arange(len(matrices)),),
        lambda people: corrected_bits(matrices[people].sum(axis=0)),
        vectorized=False,
        n_resamples=RESAMPLES,
        rng=rng,
    )
    interval = result.confidence_interval
    return float(interval.low), float(interval.high)
