"""How choices come about: shares by d′ against closed and published ones."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import integrate, stats

from tactileq.modeling import InputError
from tactileq.modeling.participants.choices import (
    ODDITY_CHANCE,
    m_afc_share,
    oddity_share,
)
from tests.refusals import refused


@given(st.integers(2, 100))
def test_without_sensitivity_every_alternative_is_as_likely(alternatives: int) -> None:
    assert float(m_afc_share(0.0, alternatives=alternatives)) == pytest.approx(1 / alternatives)


def test_without_sensitivity_the_odd_one_is_found_in_a_third() -> None:
    assert float(oddity_share(0.0)) == pytest.approx(1 / 3, abs=1e-13)
    assert pytest.approx(1 / 3) == ODDITY_CHANCE


@given(st.floats(-8.0, 8.0))
def test_two_alternatives_have_a_closed_form(d_prime: float) -> None:
    share = float(m_afc_share(d_prime, alternatives=2))
    assert share == pytest.approx(stats.norm.cdf(d_prime / np.sqrt(2)), abs=1e-13)


@pytest.mark.parametrize(
    ("share", "d_prime"), [(0.1, 0.0), (0.3, 0.8680), (0.5, 1.4748), (0.7, 2.0872), (0.9, 2.9829)]
)
def test_published_shares_of_ten_alternatives(share: float, d_prime: float) -> None:
    """Prins and Kingdom's Palamedes documents these of `PAL_SDT_MAFC_PCtoDP`."""
    assert float(m_afc_share(d_prime, alternatives=10)) == pytest.approx(share, abs=3e-5)


@pytest.mark.parametrize(
    ("alternatives", "largest"), [(2, 0.56419), (3, 0.84628), (7, 1.35218), (10, 1.53875)]
)
def test_shares_rise_from_chance_as_published_order_statistics_say(
    alternatives: int, largest: float
) -> None:
    """The slope at d′ = 0 is 1/m of the mean of the largest of m normal values.

    Teichroew 1956 (Annals of Mathematical Statistics 27:410), five decimals.
    """
    step = 1e-4
    low, high = m_afc_share(np.array([-step, step]), alternatives=alternatives)
    assert alternatives * (high - low) / (2 * step) == pytest.approx(largest, abs=1e-5)


@pytest.mark.parametrize(("d_prime", "share"), [(1.0, 0.418), (2.0, 0.605)])
def test_published_shares_of_the_triangle_test(d_prime: float, share: float) -> None:
    """Ennis 1993 (Journal of Sensory Studies 8:353), table of the triangular method."""
    assert float(oddity_share(d_prime)) == pytest.approx(share, abs=5e-4)


def bradley(d_prime: float) -> float:
    """Share of right answers in a triangle test (Bradley 1963, Biometrics 19:385)."""

    def density(u: float) -> float:
        shift = d_prime * np.sqrt(2 / 3)
        tails = stats.norm.cdf([-u * np.sqrt(3) + shift, -u * np.sqrt(3) - shift])
        return float(2 * tails.sum() * stats.norm.pdf(u))

    return float(integrate.quad(density, 0, 12, limit=200)[0])


@pytest.mark.parametrize("d_prime", [0.0, 0.3, 1.0, 2.5, 6.0])
def test_odd_ones_are_found_as_in_bradleys_integral(d_prime: float) -> None:
    assert float(oddity_share(d_prime)) == pytest.approx(bradley(d_prime), abs=1e-8)


@given(st.floats(-20.0, 20.0), st.floats(0.0, 5.0), st.integers(2, 1000))
def test_shares_are_shares_and_rise_with_sensitivity(low: float, more: float, m: int) -> None:
    two = np.array([low, low + more])
    for shares in (m_afc_share(two, alternatives=m), oddity_share(np.abs(np.sort(np.abs(two))))):
        assert shares.shape == (2,)
        assert ((shares >= 0) & (shares <= 1)).all()
        assert shares[1] >= shares[0] - 1e-12


def test_shares_have_the_shape_of_d_prime() -> None:
    d_prime = np.linspace(0.0, 3.0, 12).reshape(3, 2, 2)
    for of in (oddity_share, lambda d: m_afc_share(d, alternatives=7)):
        shares = of(d_prime)
        assert shares.shape == d_prime.shape
        assert float(of(float(d_prime[1, 0, 1]))) == pytest.approx(shares[1, 0, 1], abs=1e-15)


@pytest.mark.parametrize("alternatives", [1, 0, 2.0, True])
def test_fewer_than_two_alternatives_are_refused(alternatives: int) -> None:
    with refused(InputError, expected="two", got=alternatives):
        m_afc_share(1.0, alternatives=alternatives)
