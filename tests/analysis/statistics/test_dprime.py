"""d′ against closed forms, published values and simulated observers."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.stats import norm

from analysis.statistics.dprime import (
    m_afc_d_prime,
    m_afc_share,
    oddity_d_prime,
    oddity_share,
)
from modeling import InputError


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
    with pytest.raises(InputError, match="from 0 to 1"):
        m_afc_d_prime(share, alternatives=3)
    with pytest.raises(InputError, match="from 0 to 1"):
        oddity_d_prime(share)


def test_one_alternative_is_refused():
    with pytest.raises(InputError, match="two alternatives"):
        m_afc_share(1.0, alternatives=1)
