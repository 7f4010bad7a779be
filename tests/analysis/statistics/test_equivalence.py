"""Equivalence: published numbers, two libraries, and what both tests say together."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy import stats
from statsmodels.stats.weightstats import ttost_paired

from tactileq.analysis.statistics.equivalence import (
    DIFFERENT,
    EQUIVALENT,
    INCONCLUSIVE,
    WITHIN_BOUNDS,
    bayes_factor_null,
    equivalence_test,
    one_sided_tests,
    verdict,
)
from tactileq.modeling import InputError
from tests.refusals import refused

# Student (1908), extra hours of sleep, as R's data set `sleep`.
DRUG_1 = np.array([0.7, -1.6, -0.2, -1.2, -0.1, 3.4, 3.7, 0.8, 0.0, 2.0])
DRUG_2 = np.array([1.9, 0.8, 1.1, 0.1, -0.1, 4.4, 5.5, 1.6, 4.6, 3.4])
NUMBERS = st.lists(st.floats(-50, 50), min_size=3, max_size=12)


def rng() -> np.random.Generator:
    return np.random.default_rng(3)


def test_the_example_of_toster():
    # The vignette of the R package TOSTER: t_TOST(extra ~ group, paired = TRUE, eqb = .5) gives
    # t(9) = −2.777, p = .989 for the bound that decides.
    found = equivalence_test(DRUG_1 - DRUG_2, (-0.5, 0.5), rng=rng())
    assert_allclose([found.t_low, found.p], [-2.777, 0.989], atol=5e-4)
    p, low, high = ttost_paired(DRUG_1, DRUG_2, -0.5, 0.5)
    assert_allclose(found.p, p, rtol=1e-12)
    assert_allclose([found.t_low, found.p_low, found.t_high, found.p_high], [*low[:2], *high[:2]])


@given(NUMBERS, st.floats(0.1, 20), st.floats(0.1, 20))
def test_the_interval_lies_within_the_bounds_exactly_where_tost_is_significant(values, low, high):
    differences = np.round(values, 6)
    assume(np.ptp(differences) > 1e-3)
    found = equivalence_test(differences, (-low, high), rng=rng())
    reference = stats.ttest_rel(differences, np.zeros(len(differences))).confidence_interval(0.9)
    assert_allclose([found.ci_low, found.ci_high], [reference.low, reference.high])
    assume(min(abs(found.ci_low + low), abs(found.ci_high - high)) > 1e-9)
    assert (found.p < 0.05) == (-low < found.ci_low and found.ci_high < high)
    p, *_ = ttost_paired(differences, np.zeros(len(differences)), -low, high)
    assert_allclose(found.p, p, rtol=1e-9, atol=1e-15)


def test_many_studies_at_once_are_the_single_ones():
    studies = np.random.default_rng(1).normal(1, 3, (5, 12))
    together = np.array(one_sided_tests(studies, (-2.0, 2.5)))
    for number, study in enumerate(studies):
        found = equivalence_test(study, (-2.0, 2.5), rng=rng())
        single = [found.t_low, found.p_low, found.t_high, found.p_high]
        assert_allclose(together[:, number], single)


def test_who_does_not_vary_is_tested_by_flipping_signs():
    # Ten people without any difference: every one is 2 above the lower and 2 below the upper bound.
    found = equivalence_test(np.zeros(10), (-2.0, 2.0), rng=rng())
    assert_allclose([found.p_low, found.p_high, found.p], 1 / 2**10)
    assert np.isnan([found.t_low, found.ci_low, found.ci_high]).all()
    assert equivalence_test(np.full(10, 3.0), (-2.0, 2.0), rng=rng()).p == 1
    assert np.isnan(equivalence_test(np.array([]), (-2.0, 2.0), rng=rng()).p)


def test_bounds_in_the_wrong_order_are_refused():
    with refused(InputError, expected="bound", got=[0.5, -0.5]):
        equivalence_test(DRUG_1, (0.5, -0.5), rng=rng())


@pytest.mark.parametrize(
    ("p_difference", "p_equivalence", "expected"),
    [
        (0.2, 0.01, EQUIVALENT),
        (0.01, 0.2, DIFFERENT),
        (0.01, 0.01, WITHIN_BOUNDS),
        (0.2, 0.2, INCONCLUSIVE),
        (0.05, 0.05, INCONCLUSIVE),  # at the level is not below it
        (0.01, np.nan, DIFFERENT),  # without bounds
        (0.2, np.nan, INCONCLUSIVE),
        (np.nan, 0.01, ""),
        (np.nan, np.nan, ""),
    ],
)
def test_what_two_tests_say(p_difference, p_equivalence, expected):
    assert verdict(p_difference, p_equivalence) == expected


def test_the_bayes_factor_and_its_ceiling():
    # Rouder et al. (2009): t = 0 is the most that speaks for the null; METHOD: 4.3 at n = 20.
    assert_allclose(bayes_factor_null(0.0, 20), 4.304, atol=5e-4)
    assert bayes_factor_null(2.0, 20) < 1 < bayes_factor_null(0.5, 20)
    # R's BayesFactor manual prints BF10 = 17.26 for the sleep data (t = 4.0621, n = 10).
    assert_allclose(1 / bayes_factor_null(4.0621277, 10), 17.259, atol=5e-3)
    assert np.isnan(bayes_factor_null(np.nan, 10))


@given(st.floats(-8, 8), st.integers(2, 60))
def test_no_data_speak_for_the_null_more_than_no_difference(t, n):
    assert bayes_factor_null(t, n) <= bayes_factor_null(0.0, n) * (1 + 1e-9)
