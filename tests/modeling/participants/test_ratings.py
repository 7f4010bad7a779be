"""How ratings come about: ends of the scale, lapses, careless people, and drawn studies."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy import stats

from tactileq.modeling.participants.ratings import (
    AT_END,
    HIGHEST,
    LOWEST,
    WITHIN,
    DrawnRatings,
    RatingPriors,
    careless_sds,
    censored,
    centred,
    drawn_ratings,
    lapsed_ratings,
)

# A study without anything that differs, but for what a test adds.
PLAIN = RatingPriors(
    mean_sd=0.0,
    people_sd=0.0,
    interaction_sd=0.0,
    level=(50.0, 0.0),
    person_sd=0.0,
    cell_sd=0.0,
    anchor_sd=0.0,
    texture_sd=0.0,
    texture_effect_sd=0.0,
    anchor=(-25.0, 0.0),
    trend_sd=0.0,
    rating_sd=0.0,
    lapses=(1.0, 1e9),
    careless=(1.0, 1e9),
)


def drawn(
    priors: RatingPriors, *, studies: int = 200, people: int = 10, repeats: int = 2, seed: int = 1
) -> DrawnRatings:
    trends = np.zeros((2, studies, people, 3, 2, repeats))
    trends[0, ..., 1:] = 0.5
    return drawn_ratings(priors, trends=trends, anchors=2, rng=np.random.default_rng(seed))


@given(arrays(np.float64, st.integers(1, 20), elements=st.floats(allow_nan=False)))
def test_no_rating_lies_beyond_the_ends_and_those_between_are_kept(latent: np.ndarray) -> None:
    ratings = censored(latent)
    assert ((ratings >= LOWEST) & (ratings <= HIGHEST)).all()
    inside = (latent >= LOWEST) & (latent <= HIGHEST)
    np.testing.assert_array_equal(ratings[inside], latent[inside])
    assert (ratings[latent > HIGHEST] == HIGHEST).all()
    assert (ratings[latent < LOWEST] == LOWEST).all()


@pytest.mark.parametrize(("mean", "sd"), [(50.0, 20.0), (95.0, 10.0), (110.0, 5.0)])
def test_the_ends_hold_the_normal_tails(mean: float, sd: float) -> None:
    ratings = censored(np.random.default_rng(1).normal(mean, sd, 20_000))
    for end, tail in (
        (LOWEST, stats.norm.cdf(LOWEST, mean, sd)),
        (HIGHEST, stats.norm.sf(HIGHEST, mean, sd)),
    ):
        assert stats.binomtest(int((ratings == end).sum()), len(ratings), tail).pvalue > 1e-3


def test_lapsed_ratings_are_uniform_with_a_chance_of_two_percent_at_each_end() -> None:
    total = 2 * AT_END + WITHIN * (HIGHEST - LOWEST)
    assert total == pytest.approx(1.0)
    ratings = lapsed_ratings(np.random.default_rng(2), (100, 200))
    assert ratings.shape == (100, 200)
    for end in (LOWEST, HIGHEST):
        assert stats.binomtest(int((ratings == end).sum()), ratings.size, AT_END).pvalue > 1e-3
    between = ratings[(ratings > LOWEST) & (ratings < HIGHEST)]
    assert stats.kstest(between, stats.uniform(LOWEST, HIGHEST - LOWEST).cdf).pvalue > 1e-3


def test_careless_people_have_an_sd_of_their_own() -> None:
    priors = RatingPriors(careless_scale=30.0)
    variances = careless_sds(priors, (5000,), rng=np.random.default_rng(3)) ** 2
    assert stats.kstest(variances, stats.invgamma(1.0, scale=30.0).cdf).pvalue > 1e-3


def test_doubled_priors_have_twice_the_sds_and_the_same_means() -> None:
    one = RatingPriors()
    two = one.doubled()
    sds = [name for name in vars(one) if name.endswith("_sd")]
    assert len(sds) == 10
    for name in sds:
        assert getattr(two, name) == 2 * getattr(one, name)
    for name in ("level", "anchor"):
        assert getattr(two, name) == (getattr(one, name)[0], 2 * getattr(one, name)[1])
    for name in ("lapses", "careless"):
        share = [stats.beta(*getattr(priors, name)).mean() for priors in (one, two)]
        odds = [mean / (1 - mean) for mean in share]
        assert odds[1] == pytest.approx(2 * odds[0])
    kept = ("rating_df", "careless_scale")
    assert all(getattr(two, name) == getattr(one, name) for name in kept)


@given(arrays(np.float64, (2, 5), elements=st.floats(-1e6, 1e6)))
def test_centred_values_have_no_mean(values: np.ndarray) -> None:
    np.testing.assert_allclose(centred(values).mean(axis=-1), 0.0, atol=1e-6)


def test_a_study_in_which_nothing_differs_is_one_of_equal_ratings() -> None:
    found = drawn(PLAIN, studies=3)
    np.testing.assert_allclose(found.studies.values, 50.0)
    np.testing.assert_allclose(found.studies.anchors, 25.0)
    assert not found.careless.any()


def apart(found: DrawnRatings) -> np.ndarray:
    """(B, n, T) other − reference."""
    means = found.studies.values.mean(axis=-1)
    return means[..., 1] - means[..., 0]


def test_an_effect_is_the_difference_between_the_two_models() -> None:
    """Far from the ends, without noise: of each person, and the same on all textures."""
    found = drawn(replace(PLAIN, mean_sd=5.0, people_sd=2.0), people=500, studies=300)
    differences = apart(found)
    np.testing.assert_allclose(differences, np.repeat(found.effects[..., None], 3, axis=2))
    assert stats.kstest(found.mean, stats.norm(0.0, 5.0).cdf).pvalue > 1e-3
    assert stats.kstest(found.people_sd, stats.halfnorm(scale=2.0).cdf).pvalue > 1e-3
    scaled = (found.effects - found.mean[:, None]) / found.people_sd[:, None]
    assert stats.kstest(scaled.ravel(), "norm").pvalue > 1e-3


def test_deviations_on_single_textures_are_those_of_people_and_of_all() -> None:
    alike = drawn(replace(PLAIN, texture_effect_sd=5.0))
    np.testing.assert_allclose(apart(alike), np.repeat(alike.texture_effects[:, None], 10, axis=1))
    np.testing.assert_allclose(alike.texture_effects.sum(axis=1), 0.0, atol=1e-9)
    # Without a mean over three textures two thirds of the variance remain.
    of_textures = stats.norm(0.0, 5.0 * np.sqrt(2 / 3))
    assert stats.kstest(alike.texture_effects[:, 0], of_textures.cdf).pvalue > 1e-3
    own = drawn(replace(PLAIN, interaction_sd=4.0), studies=300)
    assert stats.kstest(own.interaction_sd, stats.halfnorm(scale=4.0).cdf).pvalue > 1e-3
    scaled = apart(own) / own.interaction_sd[:, None, None]
    assert stats.kstest(scaled.ravel(), "norm").pvalue > 1e-3


def test_of_single_ratings_there_are_no_deviations_to_be_known() -> None:
    found = drawn(replace(PLAIN, interaction_sd=4.0), repeats=1)
    assert not found.interaction_sd.any()
    np.testing.assert_allclose(apart(found), 0.0, atol=1e-12)


def test_trends_are_added_by_their_place() -> None:
    found = drawn(replace(PLAIN, trend_sd=5.0), studies=400)
    later = found.studies.values[..., 1] - found.studies.values[..., 0]
    slopes = 2 * later[:, 0, 0, 0]
    np.testing.assert_allclose(later, np.broadcast_to(slopes[:, None, None, None] / 2, later.shape))
    assert stats.kstest(slopes, stats.norm(0.0, 5.0).cdf).pvalue > 1e-3


def test_nothing_that_is_presented_matters_to_the_careless() -> None:
    felt = replace(PLAIN, mean_sd=20.0, people_sd=5.0, interaction_sd=5.0, texture_effect_sd=9.0)
    priors = replace(felt, texture_sd=10.0, careless=(1e9, 1.0), careless_scale=1e-12)
    found = drawn(priors, studies=5)
    assert found.careless.all()
    np.testing.assert_allclose(found.studies.values, 50.0, atol=1e-2)
    np.testing.assert_allclose(found.studies.anchors, 50.0, atol=1e-2)


def test_shares_of_careless_people_and_of_lapsed_trials_follow_their_priors() -> None:
    found = drawn(RatingPriors(), studies=4000, people=5)
    mean = stats.beta(*RatingPriors().careless).mean()
    by_study = found.careless.mean(axis=1)
    assert abs(by_study.mean() - mean) < 4 * by_study.std() / np.sqrt(4000)
    assert stats.kstest(found.lapses, stats.beta(*RatingPriors().lapses).cdf).pvalue > 1e-3
    expected = stats.gamma(2.0, scale=RatingPriors().rating_sd ** 2 / 2)
    assert stats.kstest(found.rating_sd**2, expected.cdf).pvalue > 1e-3
    assert np.isfinite(found.studies.values).all()
    assert found.studies.values.min() >= LOWEST
    assert found.studies.values.max() <= HIGHEST
