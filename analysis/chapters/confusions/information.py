"""Transferred information: how many bits the answers carry about what was presented."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from tactileq.modeling import InputError
from tactileq.modeling.arrays import Floats

CONFIDENCE = 0.95


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


def transferred_information(counts: ArrayLike) -> TransferredInformation:
    """Transferred information of participants' pooled answers, with a jackknife over them.

    docs/method/confusions.md#transferred-information

    Parameters
    ----------
    counts : (n, k, k) array_like of int
        A matrix per participant, n ≥ 2: rows presented, columns answered, ≥ 0.

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
    check_counts(matrices)
    if not (matrices.sum(axis=(1, 2)) > 0).all():
        raise InputError(
            "expected answers of every participant, got a matrix without any; leave it out."
        )
    pooled = matrices.sum(axis=0)
    low, high = _interval(matrices, pooled)
    return TransferredInformation(
        participants=len(matrices),
        trials=int(pooled.sum()),
        uncorrected=float(information_bits(pooled)),
        bits=float(corrected_bits(pooled)),
        ci_low=low,
        ci_high=high,
    )


def information_bits(pooled: Floats) -> Floats:
    """Mutual information of rows and columns as counted, in bits (Miller and Nicely 1955).

    Parameters
    ----------
    pooled : (…, k, k) ndarray
        Counts or probabilities, not all 0.

    Returns
    -------
    (…,) ndarray
    """
    rows, columns = _entropy(pooled.sum(axis=-1)), _entropy(pooled.sum(axis=-2))
    return rows + columns - _entropy(pooled.reshape(*pooled.shape[:-2], -1))


def corrected_bits(pooled: Floats) -> Floats:
    """The same of counts with Miller and Madow's correction of each entropy.

    Never above the entropy of what was presented.
    """
    presented, answered = pooled.sum(axis=-1), pooled.sum(axis=-2)
    seen = np.count_nonzero(presented, axis=-1) + np.count_nonzero(answered, axis=-1)
    seen = seen - np.count_nonzero(pooled, axis=(-2, -1))
    correction = (seen - 1) / (2 * pooled.sum(axis=(-2, -1)) * np.log(2))
    bits: Floats = np.minimum(information_bits(pooled) + correction, _entropy(presented))
    return bits


def _entropy(counts: Floats) -> Floats:
    return np.asarray(stats.entropy(counts, base=2, axis=-1))


def _interval(matrices: Floats, pooled: Floats) -> tuple[float, float]:
    """Jackknife over participants; a bootstrap repeats people, and reads too many bits."""
    n = len(matrices)
    without_one = corrected_bits(pooled - matrices)
    if np.ptp(without_one) == 0 or not np.isfinite(without_one).all():
        return float("nan"), float("nan")
    error = float(without_one.std() * np.sqrt(n - 1))
    reach = float(stats.t.ppf((1 + CONFIDENCE) / 2, n - 1)) * error
    bits = float(corrected_bits(pooled))
    return bits - reach, bits + reach


def check_counts(counts: Floats) -> None:
    """Refuse counts (of any shape) that are negative, NaN or inf.

    Raises
    ------
    InputError
        It names the first of them.
    """
    wrong = counts[~(np.isfinite(counts) & (counts >= 0))]
    if wrong.size:
        raise InputError(f"expected counts of at least 0, got {wrong[0]:g}; count answers.")
