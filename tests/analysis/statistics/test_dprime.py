"""d′ against closed forms, published values and simulated observers."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.stats import norm

from tactileq.analysis.statistics.dprime import (
    d_primes,
    m_afc_d_prime,
    oddity_d_prime,
    same_different_d_prime,
    same_different_differencing_d_prime,
    yes_no_d_prime,
)
from tactileq.modeling import InputError
from tactileq.modeling.participants.choices import m_afc_share, oddity_share
from tests.refusals import refused


@pytest.mark.parametrize("share", [0.5, 0.6, 0.76, 0.9, 0.99, 0.3])
def test_two_alternatives_have_a_closed_form(share):
    assert_allclose(m_afc_d_prime(share, alternatives=2), math.sqrt(2) * norm.ppf(share), atol=1e-9)


@pytest.mark.parametrize(
    ("share", "alternatives", "published"),
    [
        # Hacker and Ratcliff (1979), table 1: two decimals.
        (0.80, 3, 1.65),
        (0.50, 4, 0.84),
        (0.80, 4, 1.89),
        # METHOD: d′(0.5, 7).
        (0.50, 7, 1.26),
    ],
)
def test_published_values(share, alternatives, published):
    assert_allclose(m_afc_d_prime(share, alternatives=alternatives), published, atol=0.005)


@given(st.floats(-3, 5), st.integers(2, 16))
def test_d_prime_comes_back_from_the_share(d_prime, alternatives):
    share = m_afc_share(d_prime, alternatives=alternatives)
    assert_allclose(m_afc_d_prime(share, alternatives=alternatives), d_prime, atol=1e-5)


@given(st.floats(0.3, 6))
def test_so_it_does_in_the_oddity_task(d_prime):
    assert_allclose(oddity_d_prime(oddity_share(d_prime)), d_prime, atol=1e-5)


def test_chance_and_the_ends():
    assert_allclose(m_afc_share(0.0, alternatives=7), 1 / 7, atol=1e-9)
    assert_allclose(oddity_share(0.0), 1 / 3, atol=1e-9)
    assert oddity_d_prime(0.2) == 0.0  # below chance carries no sign
    assert m_afc_d_prime(0.1, alternatives=7) < 0
    assert m_afc_d_prime(1.0, alternatives=7) == oddity_d_prime(1.0) == math.inf
    assert m_afc_d_prime(0.0, alternatives=7) == -math.inf


def test_simulated_observers_are_right_as_often():
    rng = np.random.default_rng(3)
    seen = rng.normal(size=(200_000, 3))
    seen[:, 0] += 2.0
    largest = (seen.argmax(axis=1) == 0).mean()
    pairs = np.abs(seen[:, [1, 0, 0]] - seen[:, [2, 2, 1]])
    farthest = (pairs.argmin(axis=1) == 0).mean()  # the closest two leave the odd one out
    error = 4 * 0.5 / math.sqrt(len(seen))
    assert_allclose(largest, m_afc_share(2.0, alternatives=3), atol=error)
    assert_allclose(farthest, oddity_share(2.0), atol=error)


@pytest.mark.parametrize("share", [-0.1, 1.1, math.nan])
def test_no_share_is_refused(share):
    with refused(InputError, expected=[0, 1], got=share):
        m_afc_d_prime(share, alternatives=3)
    with refused(InputError, expected=[0, 1], got=share):
        oddity_d_prime(share)


def test_one_alternative_is_refused():
    with refused(InputError, expected="two", got=1):
        m_afc_share(1.0, alternatives=1)


@pytest.mark.parametrize(
    ("share", "published"),
    # Triangular method, two decimals (Frijters, Kooistra and Vereijken 1980).
    [(0.40, 0.88), (0.50, 1.47), (0.60, 1.98), (0.70, 2.50), (0.80, 3.13), (0.90, 4.03)],
)
def test_published_values_of_the_oddity_task(share, published):
    assert_allclose(oddity_d_prime(share), published, atol=0.005)


# Prins and Kingdom's Palamedes documents these of Macmillan and Creelman's formulas.
INDEPENDENT = [(0.6, 0.1, 2.2835), (0.8, 0.1, 2.8342), (0.9, 0.6, 1.7808)]
DIFFERENCING = [(0.6, 0.1, 2.6837), (0.7, 0.1, 3.0675), (0.8, 0.5, 2.0629)]


@pytest.mark.parametrize(("hits", "false_alarms", "published"), INDEPENDENT)
def test_published_values_of_same_or_different(hits, false_alarms, published):
    assert_allclose(same_different_d_prime(hits, false_alarms), published, atol=5e-5)


@pytest.mark.parametrize(("hits", "false_alarms", "published"), DIFFERENCING)
def test_published_values_of_differencing(hits, false_alarms, published):
    assert_allclose(same_different_differencing_d_prime(hits, false_alarms), published, atol=5e-5)


SAME_DIFFERENT = (same_different_d_prime, same_different_differencing_d_prime)


@given(st.floats(0.01, 0.98), st.floats(0.01, 0.98), st.sampled_from(SAME_DIFFERENT))
def test_same_or_different_rises_with_hits_and_falls_with_false_alarms(one, another, d_prime):
    false_alarms, hits = sorted([one, another])
    assert d_prime(false_alarms, hits) == 0.0
    assert d_prime(hits, hits) == 0.0
    found = d_prime(hits, false_alarms)
    assert d_prime(hits + 0.01, false_alarms) > found >= 0
    assert d_prime(hits, false_alarms - 0.005) > found or found == 0


def test_the_ends_of_same_or_different():
    for d_prime in SAME_DIFFERENT:
        assert d_prime(1.0, 0.3) == d_prime(0.3, 0.0) == d_prime(1.0, 0.0) == math.inf
        assert d_prime(1.0, 1.0) == d_prime(0.0, 0.0) == d_prime(0.0, 1.0) == 0.0
        for hits, false_alarms in ((1.1, 0.2), (0.5, -0.1), (math.nan, 0.2), (0.2, math.nan)):
            [wrong] = [share for share in (hits, false_alarms) if not 0 <= share <= 1]
            with refused(InputError, expected=[0, 1], got=wrong):
                d_prime(hits, false_alarms)


def test_simulated_observers_say_different_as_often():
    rng = np.random.default_rng(6)
    same, apart = rng.normal(size=(2, 400_000, 2))
    apart[:, 1] += 2.0
    # Differencing with a criterion of 1.5; one by one, on different sides of the middle.
    hits, false_alarms = (float((np.abs(np.diff(x)) > 1.5).mean()) for x in (apart, same))
    assert_allclose(same_different_differencing_d_prime(hits, false_alarms), 2.0, atol=0.02)
    sides = [
        (x > 1).sum(axis=1) == 1 for x in (apart, same + 2 * rng.integers(2, size=(400_000, 1)))
    ]
    hits, false_alarms = (float(side.mean()) for side in sides)
    assert_allclose(same_different_d_prime(hits, false_alarms), 2.0, atol=0.02)


@given(st.floats(-0.2, 1.2), st.floats(0, 0.4), st.floats(0, 1))
def test_the_interval_holds_what_its_shares_hold(low, width, place):
    d_low, d_high = d_primes(low, low + width, of=oddity_d_prime)
    inside = min(max(low + place * width, 0.0), 1.0)
    assert 0 <= d_low <= oddity_d_prime(inside) + 1e-9
    assert oddity_d_prime(inside) <= d_high + 1e-9


def test_no_interval_stays_none():
    assert all(math.isnan(d) for d in d_primes(math.nan, math.nan, of=oddity_d_prime))
    assert d_primes(-0.3, 1.4, of=oddity_d_prime) == (0.0, math.inf)


def test_yes_and_no_have_the_difference_of_normal_quantiles():
    # One participant with H = Φ(0.5) and F = Φ(−0.5), one all right, one without noise trials.
    many = 10**7
    hits = round(many * norm.cdf(0.5))
    found = yes_no_d_prime(
        [hits, 10, 3], [many, 10, 5], false_alarms=[many - hits, 0, 0], noise=[many, 10, 0]
    )
    # Hautus (1995): half a count and one trial more.
    assert_allclose(found, [1.0, 2 * norm.ppf(10.5 / 11), math.nan], atol=1e-6)
