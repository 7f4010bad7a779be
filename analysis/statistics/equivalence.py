"""Equivalence tests: two one-sided tests against bounds, and the combined verdict."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import stats

from tactileq.analysis.statistics.paired import (
    sign_flips_p,
    t_tests,
    why_undefined,
    without_rounding_noise,
)
from tactileq.modeling import InputError
from tactileq.modeling.arrays import Floats

ALPHA = 0.05
EQUIVALENT = "equivalent"
DIFFERENT = "different"
WITHIN_BOUNDS = "different but within bounds"
INCONCLUSIVE = "inconclusive"
# Said by the model of the participants alone (docs/method/participants.md#verdict).
EQUAL_ON_AVERAGE = "equal on average"  # of single textures, whose people are not counted
AVERAGE_FELT = "equal on average, felt by some"
ALL_BUT = "equal for all but a few"
FELT = "felt by some"
Bounds = tuple[float, float]


@dataclass(frozen=True)
class EquivalenceTest:
    """Two one-sided tests (TOST) of a mean difference against bounds (Schuirmann 1987).

    `p_low` is that of the claim that the difference is above the lower bound, `p_high` that it is
    below the upper one, `p` the larger of the two. `ci_*` is the 90 % confidence interval, which
    lies within the bounds exactly where p < .05. Where participants do not vary, t and the interval
    are NaN, and p is that of sign flips about the bounds.
    """

    ci_low: float
    ci_high: float
    t_low: float
    p_low: float
    t_high: float
    p_high: float

    @property
    def p(self) -> float:
        """The larger of the two one-sided p values; NaN without participants."""
        return float(np.maximum(self.p_low, self.p_high))


def equivalence_test(
    differences: Floats, bounds: Bounds, *, rng: np.random.Generator
) -> EquivalenceTest:
    """Whether a mean difference lies within bounds.

    docs/method/statistics.md#equivalence

    Parameters
    ----------
    differences : (n,) ndarray
        Other − reference, finite, one per participant.
    bounds : (float, float)
        In the unit of the differences, the lower below the upper one.
    rng : Generator
        Draws sign flips where more than 13 participants do not vary.

    Raises
    ------
    InputError
        For bounds in the wrong order.
    """
    low, high = bounds
    if not low < high:
        raise InputError(
            f"expected a lower bound below the upper one, got {low:g} and {high:g}; exchange them."
        )
    differences = without_rounding_noise(np.asarray(differences, dtype=float))
    if why_undefined(differences):
        return EquivalenceTest(
            *(float("nan"),) * 3,
            sign_flips_p(differences - low, rng=rng, alternative="greater"),
            float("nan"),
            sign_flips_p(differences - high, rng=rng, alternative="less"),
        )
    (t_low,), (p_low,), (t_high,), (p_high,) = one_sided_tests(differences[None, :], bounds)
    *_, (ci_low,), (ci_high,) = t_tests(differences[None, :], confidence=1 - 2 * ALPHA)
    return EquivalenceTest(*map(float, (ci_low, ci_high, t_low, p_low, t_high, p_high)))


def one_sided_tests(differences: Floats, bounds: Bounds) -> tuple[Floats, Floats, Floats, Floats]:
    """t and p against the lower, then against the upper bound, (k,) each, of (k, n) differences."""
    above = stats.ttest_1samp(differences, bounds[0], axis=1, alternative="greater")
    below = stats.ttest_1samp(differences, bounds[1], axis=1, alternative="less")
    t_low, p_low, t_high, p_high = np.array(
        [above.statistic, above.pvalue, below.statistic, below.pvalue]
    )
    return t_low, p_low, t_high, p_high


def verdict(p_difference: float, p_equivalence: float, *, alpha: float = ALPHA) -> str:
    """The combined verdict of a test of a difference and one of equivalence.

    Empty where the former could not be made; the latter is NaN where there are no bounds.
    docs/method/statistics.md#verdicts
    """
    if np.isnan(p_difference):
        return ""
    differs, equals = p_difference < alpha, p_equivalence < alpha
    if differs:
        return WITHIN_BOUNDS if equals else DIFFERENT
    return EQUIVALENT if equals else INCONCLUSIVE


def bayes_factor_null(t: float, n: int) -> float:
    """How much more likely the data are without a difference than with one (JZS, r = 0.707).

    NaN where t is. docs/method/statistics.md#bayes-factor

    Parameters
    ----------
    t : float
        Paired t value.
    n : int
        Participants, ≥ 2.
    """
    from pingouin import bayesfactor_ttest  # late: it takes a second to import

    if not np.isfinite(t):
        return float("nan")
    return 1.0 / float(bayesfactor_ttest(t, n, paired=True))
