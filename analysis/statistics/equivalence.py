"""Equivalence tests: two one-sided tests against bounds, and the combined verdict."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import stats

from tactileq.analysis.statistics.crossover import MeanDifferences, mean_differences
from tactileq.analysis.statistics.paired import (
    sign_flips_p,
    t_tests,
    why_undefined,
    without_rounding_noise,
)
from tactileq.modeling import InputError
from tactileq.modeling.arrays import Floats

ALPHA = 0.05
WIDTH = 0.707  # of the Cauchy prior of d_z
EQUIVALENT = "equivalent"
DIFFERENT = "different"
WITHIN_BOUNDS = "different but within bounds"
INCONCLUSIVE = "inconclusive"
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
    differences: Floats,
    bounds: Bounds,
    *,
    rng: np.random.Generator,
    contrasts: Floats | None = None,
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
    contrasts : (n, c) ndarray, optional
        Days that differences are adjusted for (`crossover.day_contrasts`).

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
    rounded = without_rounding_noise(np.asarray(differences, dtype=float))
    found = mean_differences(rounded[None, :], contrasts)
    if why_undefined(found):
        adjusted = found.told[0]
        return EquivalenceTest(
            *(float("nan"),) * 3,
            sign_flips_p(adjusted - low, rng=rng, alternative="greater"),
            float("nan"),
            sign_flips_p(adjusted - high, rng=rng, alternative="less"),
        )
    (t_low,), (p_low,), (t_high,), (p_high,) = one_sided_tests(found, bounds)
    *_, (ci_low,), (ci_high,) = t_tests(found, confidence=1 - 2 * ALPHA)
    return EquivalenceTest(*map(float, (ci_low, ci_high, t_low, p_low, t_high, p_high)))


def one_sided_tests(
    differences: Floats | MeanDifferences, bounds: Bounds
) -> tuple[Floats, Floats, Floats, Floats]:
    """t and p against the lower, then against the upper bound, (k,) each, of (k, n) differences."""
    found = mean_differences(differences)
    with np.errstate(divide="ignore", invalid="ignore"):  # where nobody varies
        t_low, t_high = ((found.mean - bound) / found.error for bound in bounds)
    return t_low, stats.t.sf(t_low, found.df), t_high, stats.t.cdf(t_high, found.df)


def verdict(p_difference: float, p_equivalence: float, *, alpha: float = ALPHA) -> str:
    """The combined verdict of a test of a difference and one of equivalence.

    Empty where the former could not be made; the latter is NaN where there are no bounds.
    docs/method/statistics.md#verdicts
    """
    if np.isnan(p_difference):
        return ""
    return combined(differs=p_difference < alpha, equals=p_equivalence < alpha)


def combined(*, differs: bool, equals: bool) -> str:
    """The word for what two tests, or two intervals, found."""
    if differs:
        return WITHIN_BOUNDS if equals else DIFFERENT
    return EQUIVALENT if equals else INCONCLUSIVE


def bayes_factor_null(t: float, n: int, *, groups: tuple[int, int] | None = None) -> float:
    """How much more likely the data are without a difference than with one (JZS, r = 0.707).

    NaN where t is. docs/method/statistics.md#bayes-factor

    Parameters
    ----------
    t : float
        Paired t value.
    n : int
        Participants, ≥ 2.
    groups : (int, int), optional
        How many of them began with either model, where models were on two days: t is then that of
        two samples, of the differences of those and of minus the differences of these, whose
        effect size, and so the prior's width, is twice d_z.
    """
    from pingouin import bayesfactor_ttest  # late: it takes a second to import

    if not np.isfinite(t):
        return float("nan")
    if groups is not None:
        return 1.0 / float(bayesfactor_ttest(t, *groups, r=2 * WIDTH))
    return 1.0 / float(bayesfactor_ttest(t, n, paired=True, r=WIDTH))
