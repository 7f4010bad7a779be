"""How choices come about: shares by d′ against closed and published ones, and drawn studies."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import integrate, stats

from tactileq.modeling import InputError
from tactileq.modeling.participants.choices import (
    ODDITY,
    ChoicePriors,
    DecisionModel,
    DrawnChoices,
    StudyPeople,
    drawn_choices,
    forced_choice,
    m_afc_share,
    mean_effect,
    oddity_share,
)
from tactileq.modeling.participants.effects import EffectPriors
from tests.refusals import refused

MODELS = [ODDITY, *(forced_choice(alternatives) for alternatives in (2, 3, 7, 12))]


# --- Shares by d′ -----------------------------------------------------------------------------


@given(st.integers(2, 100))
def test_without_sensitivity_every_alternative_is_as_likely(alternatives: int) -> None:
    assert float(m_afc_share(0.0, alternatives=alternatives)) == pytest.approx(1 / alternatives)


def test_without_sensitivity_the_odd_one_is_found_in_a_third() -> None:
    assert float(oddity_share(0.0)) == pytest.approx(1 / 3, abs=1e-13)


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


@pytest.mark.parametrize("model", MODELS)
def test_shares_by_the_table_are_the_exact_ones(model: DecisionModel) -> None:
    d_prime = np.random.default_rng(1).uniform(-5.0, 10.0, (50, 200))
    exact = model.exact(np.maximum(d_prime, 0.0) if model.both_models else d_prime)
    np.testing.assert_allclose(model.share(d_prime), exact, atol=1e-5)
    assert model.table[500] == pytest.approx(model.chance)  # at 0
    given_d_prime = d_prime.copy()
    model.share(d_prime)
    np.testing.assert_array_equal(d_prime, given_d_prime)


@given(st.floats(-1e6, 1e6))
def test_shares_far_beyond_the_table_are_those_at_its_ends(d_prime: float) -> None:
    for model in MODELS:
        (share,) = model.share(np.array([d_prime]))
        assert model.table[0] <= share <= model.table[-1] <= 1


# --- Priors -----------------------------------------------------------------------------------


@pytest.mark.parametrize("model", [ODDITY, forced_choice(7)])
def test_doubled_priors_have_twice_the_sds_and_the_same_means(model: DecisionModel) -> None:
    one = ChoicePriors.of(model)
    two = one.doubled()
    for name in ("person", "texture", "texture_effect", "trend"):
        assert getattr(two, f"{name}_sd") == 2 * getattr(one, f"{name}_sd")
    assert two.effects == replace(
        one.effects, mean_sd=2 * one.effects.mean_sd, spread=2 * one.effects.spread
    )
    assert two.ability == (one.ability[0], 2 * one.ability[1])
    assert two.catch == one.catch
    for name in ("lapses", "careless"):
        share = [stats.beta(*getattr(priors, name)).mean() for priors in (one, two)]
        odds = [mean / (1 - mean) for mean in share]
        assert odds[1] == pytest.approx(2 * odds[0])


# --- People of studies, and drawn studies --------------------------------------------------------


def people(*, slopes: tuple[float, ...] = ()) -> StudyPeople:
    return StudyPeople(
        ability=np.array([[1.0, 2.0]]),
        effect=np.array([[-0.4, 0.6]]),
        textures=np.array([[0.0, 0.5, -0.5]]),
        texture_effects=np.array([[0.0, 0.1, -0.1]]),
        slopes=np.array(slopes).reshape(-1, 1),
    )


def test_sensitivity_by_hand() -> None:
    d_prime = people().d_prime(2)
    assert d_prime.shape == (1, 2, 3, 2)
    np.testing.assert_allclose(d_prime[0, 1, 1], [2.5 - 0.35, 2.5 + 0.35])
    np.testing.assert_allclose(
        d_prime[..., 1] - d_prime[..., 0], people().effect[..., None] + [[0.0, 0.1, -0.1]]
    )
    alone = people().d_prime(1)
    np.testing.assert_allclose(alone[0, 1, 1, 0], 2.0 + 0.5 + 0.6 + 0.1)
    trends = np.zeros((1, 1, 2, 3, 2))
    trends[0, 0, 0, 0, 0] = 0.5
    moved = people(slopes=(0.8,)).d_prime(2, trends) - d_prime
    assert moved[0, 0, 0, 0] == pytest.approx(0.4)
    assert np.count_nonzero(moved) == 1


def test_effects_of_shares_are_differences_or_what_lies_above_chance() -> None:
    np.testing.assert_allclose(mean_effect(np.array([[0.6, 0.5]]), 1 / 7), [-0.1])
    np.testing.assert_allclose(mean_effect(np.array([[0.5]]), 1 / 3), [1 / 6])


def drawn(model: DecisionModel, priors: ChoicePriors, *, studies: int = 300) -> DrawnChoices:
    each = (studies, 12, 3, 1 if model.both_models else 2)
    return drawn_choices(
        model,
        priors,
        asked=np.full(each, 10.0),
        catch_asked=np.full(each[:2], 20.0),
        trends=np.zeros((0, *each)),
        rng=np.random.default_rng(5),
    )


@pytest.mark.parametrize("model", [ODDITY, forced_choice(7)])
def test_drawn_answers_are_right_as_often_as_the_model_says(model: DecisionModel) -> None:
    priors = replace(ChoicePriors.of(model), lapses=(2.0, 8.0), careless=(2.0, 8.0))
    found = drawn(model, priors)
    models = 1 if model.both_models else 2
    rate = np.where(found.careless, 1.0, found.lapses[:, None])[..., None, None]
    expected = 10 * (rate * model.chance + (1 - rate) * model.share(found.people.d_prime(models)))
    z = (found.studies.right - expected) / np.sqrt(expected * (1 - expected / 10) + 1e-12)
    assert abs(z.mean()) < 4 / np.sqrt(z.size)
    assert z.std() == pytest.approx(1.0, abs=0.05)
    assert ((found.studies.right >= 0) & (found.studies.right <= 10)).all()


@pytest.mark.parametrize("model", [ODDITY, forced_choice(7)])
def test_the_careless_guess_at_catch_trials_too(model: DecisionModel) -> None:
    priors = replace(ChoicePriors.of(model), lapses=(1.0, 1e9), careless=(5.0, 5.0))
    found = drawn(model, priors)
    caught = found.studies.catch_right
    guessed = caught[found.careless]
    right = int(guessed.sum()), 20 * guessed.size
    assert stats.binomtest(*right, model.chance).pvalue > 1e-3
    attentive = caught[~found.careless].sum(), 20 * (~found.careless).sum()
    mean = stats.beta(*priors.catch).mean()
    assert attentive[0] / attentive[1] == pytest.approx(mean, abs=0.01)
    assert found.careless.mean() == pytest.approx(0.5, abs=0.04)


def test_drawn_studies_follow_their_priors() -> None:
    priors = ChoicePriors.of(forced_choice(7))
    found = drawn(forced_choice(7), priors, studies=4000)
    assert stats.kstest(found.level, stats.norm(*priors.ability).cdf).pvalue > 1e-3
    assert stats.kstest(found.lapses, stats.beta(*priors.lapses).cdf).pvalue > 1e-3
    expected = stats.invgamma(2.0, scale=priors.person_sd**2)
    assert stats.kstest(found.person_sd**2, expected.cdf).pvalue > 1e-3
    within = (found.people.ability - found.level[:, None]) / found.person_sd[:, None]
    assert stats.kstest(within.ravel(), "norm").pvalue > 1e-3
    textures = found.people.textures.ravel()
    assert stats.kstest(textures, stats.norm(0.0, priors.texture_sd).cdf).pvalue > 1e-3


def test_where_trials_hold_both_models_nobody_has_an_ability_of_their_own() -> None:
    none = EffectPriors(mean_sd=0.0, spread=0.0, weight=1.0)
    found = drawn(ODDITY, replace(ChoicePriors.of(ODDITY), effects=none, texture_sd=0.0))
    assert not found.level.any()
    assert not found.people.d_prime(1).any()
    assert not found.people.texture_effects.any()
