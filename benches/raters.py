"""What the atlas and the validation of statistics simulate alike, and how both count hits.

Ends of a scale, answers at random, intervals that cover the truth, and the power of the t-test.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from tactileq.analysis.statistics.paired import CONFIDENCE
from tactileq.analysis.statistics.rates import bootstrap_intervals
from tactileq.modeling.arrays import Bools, Floats
from tactileq.modeling.files.answer_tables import ENDS

LOWEST, HIGHEST = ENDS
MISS_RATE = 1 - CONFIDENCE  # of intervals, and the level of tests


def mean_at_the_end(share: float, *, sd: float) -> float:
    """Mean of normal ratings of this standard deviation, of which a share lies above the end.

    Parameters
    ----------
    share : float
        Between 0 and 1.
    sd : float
        In points, > 0.
    """
    return float(HIGHEST + sd * stats.norm.ppf(share))


def ended(ratings: Floats) -> Floats:
    """Latent ratings of any shape as the scale shows them: none beyond an end."""
    return np.clip(ratings, LOWEST, HIGHEST)


def at_random(rng: np.random.Generator, shape: tuple[int, ...]) -> Floats:
    """Ratings of whoever does not attend: anywhere on the scale."""
    return rng.uniform(LOWEST, HIGHEST, shape)


def covered(low: ArrayLike, truth: float, high: ArrayLike) -> Bools:
    """Which intervals contain the truth, ends included; none that is NaN."""
    return np.asarray((np.asarray(low) <= truth) & (truth <= np.asarray(high)))


def bootstrap_covers(rates: Floats, truth: float, rng: np.random.Generator) -> Bools:
    """Which bootstrap intervals of the mean contain it; none where participants do not vary.

    Parameters
    ----------
    rates : (k, n) ndarray
        Of k studies with n participants.
    rng : Generator
        Draws the resamples.
    """
    hits = np.zeros(len(rates), dtype=np.bool_)
    varied = np.ptp(rates, axis=1) > 0
    if varied.any():
        low, high = bootstrap_intervals(rates[varied], rng)
        hits[varied] = covered(low, truth, high)
    return hits


def paired_power(d_z: float, count: float) -> float:
    """Power of the two-sided paired t-test of normal differences, by the noncentral t.

    docs/method/validation.md#nominal-values

    Parameters
    ----------
    d_z : float
        Mean of the differences over their standard deviation.
    count : float
        Participants, > 1; whole numbers are meant, others lie between.
    """
    shift = d_z * np.sqrt(count)
    limit = stats.t.isf(MISS_RATE / 2, count - 1)
    tails = stats.nct.sf(limit, count - 1, shift) + stats.nct.cdf(-limit, count - 1, shift)
    return float(tails)
