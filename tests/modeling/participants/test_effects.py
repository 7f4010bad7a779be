"""Effects that differ between people: shares, weights and draws against closed forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy import stats

from tactileq.modeling.participants.effects import (
    COMPONENTS,
    EffectMixture,
    EffectPriors,
    drawn_effects,
    drawn_mixture,
    drawn_places,
    drawn_weights,
)

MIXTURE = EffectMixture(
    weights=np.array([[0.5, 0.3, 0.2], [1.0, 0.0, 0.0]]),
    means=np.array([[-4.0, 0.0, 9.0], [2.0, 50.0, -50.0]]),
    spread=np.array([1.5, 3.0]),
)


def test_the_share_outside_is_that_of_normal_distributions() -> None:
    low, high = -3.0, 5.0
    of = stats.norm(MIXTURE.means, MIXTURE.spread[:, None])
    expected = (MIXTURE.weights * (of.cdf(low) + of.sf(high))).sum(axis=1)
    np.testing.assert_allclose(MIXTURE.share_outside((low, high)), expected, rtol=1e-12)


def test_the_mean_is_that_of_the_components() -> None:
    np.testing.assert_allclose(MIXTURE.mean(), [-2.0 + 1.8, 2.0])


FINITE = {"allow_nan": False, "allow_infinity": False}


@given(
    arrays(np.float64, (3, COMPONENTS), elements=st.floats(-200.0, 200.0, **FINITE)),
    arrays(np.float64, 3, elements=st.floats(0.01, 100.0, **FINITE)),
    st.floats(-100.0, 0.0),
    st.floats(0.0, 100.0),
    st.integers(0, 1000),
)
def test_shares_outside_are_shares_and_fall_with_wider_bounds(
    means: np.ndarray, spread: np.ndarray, low: float, high: float, seed: int
) -> None:
    weights = drawn_weights(np.full((3, COMPONENTS), 0.5), np.random.default_rng(seed))
    mixture = EffectMixture(weights=weights, means=means, spread=spread)
    share = mixture.share_outside((low, high))
    assert ((share >= 0) & (share <= 1)).all()
    assert (mixture.share_outside((low - 1.0, high + 1.0)) <= share + 1e-12).all()
    assert (mixture.mean() <= means.max(axis=1) + 1e-9).all()
    assert (mixture.mean() >= means.min(axis=1) - 1e-9).all()


@given(st.floats(1e-3, 50.0), st.integers(0, 10_000))
def test_weights_sum_to_one_however_small_the_parameter(parameter: float, seed: int) -> None:
    weights = drawn_weights(np.full((20, COMPONENTS), parameter), np.random.default_rng(seed))
    np.testing.assert_allclose(weights.sum(axis=1), 1.0)
    assert (weights >= 0).all()


def test_weights_have_the_moments_of_the_dirichlet_distribution() -> None:
    parameters = np.array([2.0, 1.0, 0.5])
    weights = drawn_weights(np.tile(parameters, (50_000, 1)), np.random.default_rng(1))
    of = stats.dirichlet(parameters)
    error = np.sqrt(of.var() / len(weights))
    assert (np.abs(weights.mean(axis=0) - of.mean()) < 4 * error).all()
    np.testing.assert_allclose(weights.var(axis=0), of.var(), rtol=0.03)


def test_places_are_drawn_by_their_weights_whatever_the_sum() -> None:
    weights = np.array([2.0, 0.0, 5.0, 3.0])
    places = drawn_places(np.tile(weights, (20_000, 1)), np.random.default_rng(2))
    counts = np.bincount(places, minlength=4)
    assert counts[1] == 0
    expected = 20_000 * weights[weights > 0] / 10
    assert stats.chisquare(counts[weights > 0], expected).pvalue > 1e-3


def test_drawn_effects_have_the_moments_of_their_mixture() -> None:
    effects = drawn_effects(MIXTURE, 100_000, rng=np.random.default_rng(3))
    assert effects.shape == (2, 100_000)
    square = (MIXTURE.weights * (MIXTURE.means**2)).sum(axis=1) + MIXTURE.spread**2
    variance = square - MIXTURE.mean() ** 2
    error = np.sqrt(variance / effects.shape[1])
    assert (np.abs(effects.mean(axis=1) - MIXTURE.mean()) < 4 * error).all()
    np.testing.assert_allclose(effects.var(axis=1), variance, rtol=0.03)
    outside = ((effects < -3.0) | (effects > 5.0)).mean(axis=1)
    np.testing.assert_allclose(outside, MIXTURE.share_outside((-3.0, 5.0)), atol=4 * 0.5 / 316)


def test_drawn_mixtures_follow_their_priors() -> None:
    priors = EffectPriors(mean_sd=10.0, spread=2.0, weight=0.02)
    mixture = drawn_mixture(priors, 5000, rng=np.random.default_rng(4))
    assert mixture.means.shape == mixture.weights.shape == (5000, COMPONENTS)
    assert stats.kstest(mixture.means.ravel(), stats.norm(0.0, 10.0).cdf).pvalue > 1e-3
    assert stats.kstest(mixture.spread, stats.halfnorm(scale=2.0).cdf).pvalue > 1e-3
    np.testing.assert_allclose(mixture.weights.sum(axis=1), 1.0)
    # So small a weight gives nearly everybody the same component.
    assert np.median(mixture.weights.max(axis=1)) > 0.999


@pytest.mark.parametrize("draw", [drawn_mixture])
def test_a_seed_fixes_what_is_drawn(draw: Any) -> None:
    priors = EffectPriors(mean_sd=1.0, spread=1.0, weight=1.0)
    first, again = (draw(priors, 3, rng=np.random.default_rng(7)) for _ in range(2))
    np.testing.assert_array_equal(first.means, again.means)
    np.testing.assert_array_equal(first.weights, again.weights)
