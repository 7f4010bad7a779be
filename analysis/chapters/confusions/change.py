"""Whether two models are confused differently: labels swapped within participants."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from tactileq.modeling import InputError

RESAMPLES = 9999  # all swaps where there are fewer, that is up to 13 participants


def confusion_change_p(
    reference: ArrayLike, other: ArrayLike, *, rng: np.random.Generator
) -> float:
    """p of the difference of two models' confusion matrices.

    docs/method/confusions.md#models-swapped-within-participants

    Parameters
    ----------
    reference, other : (n, k, k) array_like of int
        Each participant's counts with each model: rows presented, columns answered, ≥ 0.
    rng : Generator
        Draws swaps of more than 13 participants.

    Raises
    ------
    InputError
        For no participant, different shapes or negative counts.
    """
    one, two = np.asarray(reference, dtype=float), np.asarray(other, dtype=float)
    if (
        one.shape != two.shape
        or one.ndim != 3
        or not one.size
        or not (np.minimum(one, two) >= 0).all()
    ):
        raise InputError(
            "expected counts of the same participants and classes with both models, got arrays of "
            f"shapes {one.shape} and {two.shape}; leave out people who lack one of the models."
        )
    if len(one) == 1:
        return 1.0  # the swap of one participant has the same sum of squares
    totals = np.stack([one.sum(axis=2), two.sum(axis=2)])
    both = (totals.min(axis=0) > 0)[..., None]
    divisor = np.maximum(totals, 1)[..., None]
    change = np.where(both, two / divisor[1] - one / divisor[0], 0.0).reshape(len(one), -1)
    # A swap of the models turns a participant's whole change round.
    result = stats.permutation_test(
        (np.ones(len(one)), -np.ones(len(one))),
        lambda signs, _: np.round(np.square(signs @ change).sum(), 9),
        permutation_type="samples",
        vectorized=False,
        n_resamples=RESAMPLES,
        alternative="greater",
        rng=rng,
    )
    return float(result.pvalue)
