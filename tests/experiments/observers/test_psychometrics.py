"""A population of simulated participants: its limits, and its rules in closed form."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy import stats

from tactileq.experiments.observers.psychometrics import (
    EFFECTS,
    Psychometrics,
    SimulatedPerson,
    Trait,
    choice_shares,
    with_effect,
)
from tactileq.modeling import InputError
from tactileq.modeling.participants.ratings import RatingPriors
from tactileq.modeling.seeds import generator
from tests.refusals import refused

TRAITS = (
    *("threshold_db", "sensitivity", "magnitude_bias", "frequency_bias"),
    *("lapse_rate", "learning", "care"),
)
SHARES = arrays(np.float64, st.integers(2, 12), elements=st.floats(0.0, 1.0)).filter(np.sum)


def test_people_are_as_the_population_says() -> None:
    population = Psychometrics()
    rng = np.random.default_rng(1)
    people = [asdict(population.draw(rng)) for _ in range(4000)]
    for name in TRAITS:
        trait = getattr(population, name)
        values = np.array([person[name] for person in people])
        assert abs(values.mean() - trait.mean) < 4 * trait.sd / np.sqrt(len(people))
        assert values.std() == pytest.approx(trait.sd, rel=0.05)
        low, high = trait.ends
        assert low <= values.min() < values.max() <= high
    liked = np.array([person["preferences"] for person in people])
    assert liked.shape == (4000, 12)
    assert liked.std() == pytest.approx(population.preference_sd, rel=0.02)
    traits = np.array([[person[name] for name in TRAITS] for person in people])
    others = np.corrcoef(traits.T)[~np.eye(len(TRAITS), dtype=bool)]
    assert np.abs(others).max() < 5 / np.sqrt(len(people))


def test_traits_end_at_three_standard_deviations() -> None:
    class Extreme:
        def standard_normal(self, count: int) -> np.ndarray:
            return np.resize([-9.0, 9.0], count)

    person = Psychometrics(sensitivity=Trait(1.0, 0.3)).draw(Extreme())  # type: ignore[arg-type]
    assert person.threshold_db == pytest.approx(-7.5)
    assert person.sensitivity == pytest.approx(1.9)


def drawn(count: int, **of: Any) -> list[SimulatedPerson]:
    population = Psychometrics(**of)
    return [population.draw(generator(3, subject)) for subject in range(count)]


def test_some_people_are_careless_and_differ_in_level_and_noise() -> None:
    people = drawn(2000, careless=0.2)
    careless = [person for person in people if person.careless]
    assert stats.binomtest(len(careless), len(people), 0.2).pvalue > 1e-3
    assert all(person.blind_rate == 1.0 for person in careless)
    assert all(p.blind_rate == p.lapse_rate for p in people if not p.careless)
    priors = RatingPriors()
    levels = [person.level for person in people]
    assert stats.kstest(levels, stats.norm(*priors.level).cdf).pvalue > 1e-3
    variances = [person.level_sd**2 for person in people]
    expected = stats.invgamma(1.0, scale=priors.careless_scale)
    assert stats.kstest(variances, expected.cdf).pvalue > 1e-3
    assert not any(person.careless for person in drawn(50))
    assert all(person.careless for person in drawn(50, careless=1.0))


def test_effects_differ_between_people_as_much_as_they_were_told_to() -> None:
    people = drawn(4000, effect_sd=5.0)
    deviations = np.array([person.deviations for person in people])
    assert deviations.shape == (4000, len(EFFECTS))
    assert (np.abs(deviations.mean(axis=0)) < 4 * 5.0 / np.sqrt(4000)).all()
    # The SD of normal numbers that are cut off at 3 SD is 0.996; its standard error 1.1 %.
    np.testing.assert_allclose(deviations.std(axis=0), 5.0, rtol=0.04)
    assert np.abs(deviations).max() <= 15.0
    apart = np.corrcoef(deviations.T)[~np.eye(len(EFFECTS), dtype=bool)]
    assert np.abs(apart).max() < 5 / np.sqrt(4000)


def test_traits_do_not_depend_on_carelessness_or_on_how_effects_differ() -> None:
    new = ("careless", "level", "level_sd", "deviations")
    plain, other = drawn(20), drawn(20, careless=0.4, effect_sd=4.0)
    for before, after in zip(plain, other, strict=True):
        kept = {name: value for name, value in asdict(before).items() if name not in new}
        assert kept == {name: value for name, value in asdict(after).items() if name not in new}
        assert before.deviations == (0.0, 0.0, 0.0)
    # Nor who is careless on how effects differ; nor anything else that is drawn afterwards.
    alone = drawn(20, careless=0.4)
    assert [p.careless for p in alone] == [p.careless for p in other]
    assert [p.level_sd for p in alone] == [p.level_sd for p in other]
    after_draw = []
    for of in ({}, {"careless": 0.4, "effect_sd": 4.0}):
        rng = generator(3, 1)
        Psychometrics(**of).draw(rng)  # type: ignore[arg-type]
        after_draw.append(rng.random())
    assert after_draw[0] == after_draw[1]


def test_a_rating_falls_by_e_with_each_scale() -> None:
    exact = Psychometrics(scale_db=10.0, best_rating=90.0)
    assert exact.felt_rating(0.0) == 90.0
    assert exact.felt_rating(10.0) == pytest.approx(90.0 / np.e)


@given(st.floats(0.0, 60.0))
def test_a_distance_of_points_lowers_a_rating_by_as_many(points: float) -> None:
    population = Psychometrics()
    away = population.as_distance_db(-points)
    assert population.felt_rating(away) == pytest.approx(population.best_rating - points)


def test_practice_takes_the_noise_of_beginners_away() -> None:
    population = Psychometrics(learning=Trait(0.5), learning_trials=4.0)
    person = population.draw(np.random.default_rng(1))
    assert population.unpractised(person, 1) == pytest.approx(1.5)
    assert population.unpractised(person, 5) == pytest.approx(1 + 0.5 / np.e)
    assert population.unpractised(person, 1000) == pytest.approx(1.0)


def test_choice_shares_by_hand() -> None:
    shares = choice_shares([-0.5, -0.5 - np.log(2)], 0.1, [0.0, 0.0])
    np.testing.assert_allclose(shares, 0.9 * np.array([2 / 3, 1 / 3]) + 0.05)
    liked = choice_shares([0.0, 0.0], 0.3, [np.log(3), 0.0])
    np.testing.assert_allclose(liked, [0.75, 0.25])


@given(
    arrays(np.float64, st.integers(2, 12), elements=st.floats(-1000.0, 0.0)), st.floats(0.0, 1.0)
)
def test_choice_shares_follow_luce(evidence: np.ndarray, lapse_rate: float) -> None:
    shares = np.array(choice_shares(evidence.tolist(), lapse_rate, [0.0] * evidence.size))
    assert shares.sum() == pytest.approx(1.0)
    assert shares.min() >= lapse_rate / evidence.size - 1e-12
    better = evidence[:, None] > evidence[None, :]
    assert (shares[:, None] >= shares[None, :] - 1e-12)[better].all()


def test_shares_that_rounding_could_swallow_keep_their_sum() -> None:
    for tiny in (2.220446049250313e-16, 5e-324):
        for effect in (1.0, 0.5):
            shares = [0.375 / (0.375 + tiny), tiny / (0.375 + tiny)]
            for changed in with_effect(shares, 0, effect=effect):
                assert sum(changed) == pytest.approx(1.0)


@given(SHARES, st.floats(-1.0, 1.0), st.data())
def test_shares_of_two_models_are_as_far_apart_as_planted(
    weights: np.ndarray, effect: float, data: Any
) -> None:
    shares = (weights / weights.sum()).tolist()
    right = data.draw(st.integers(0, len(shares) - 1))
    reference, other = with_effect(shares, right, effect=effect)
    assert other[right] - reference[right] == pytest.approx(effect, abs=1e-9)
    for changed in (reference, other):
        assert sum(changed) == pytest.approx(1.0)
        assert min(changed) >= -1e-9
    if 0 <= shares[right] + effect <= 1:
        np.testing.assert_allclose(reference, shares, atol=1e-12)


def test_the_other_buttons_keep_their_proportions() -> None:
    _, other = with_effect([0.5, 0.3, 0.2], 0, effect=-0.25)
    np.testing.assert_allclose(other, [0.25, 0.45, 0.3])


@pytest.mark.parametrize(
    "wrong",
    [
        {"threshold_db": 3.0},
        {"sensitivity": Trait(1.0, 0.4)},
        {"sensitivity": Trait(0.0)},
        {"magnitude_bias": Trait(float("nan"))},
        {"frequency_bias": Trait(0.0, -1.0)},
        {"lapse_rate": Trait(0.03, 0.02)},
        {"learning": Trait(0.5, float("inf"))},
        {"care": Trait("much")},
        {"best_rating": 99.0},
        {"scale_db": 0.0},
        {"noise_sd": -1.0},
        {"temperature_db": float("nan")},
        {"preference_sd": True},
        {"learning_trials": 0},
        {"careless": 1.1},
        {"careless": float("nan")},
        {"effect_sd": -1.0},
        {"effect_sd": 26.0},
        {"planted": 5.0},
        {"planted": {"MDF": -12.0}},
        {"planted": {"MDF": {"magnitude": -12.0}}},
        {"planted": {"MDF": {"choice": "many"}}},
        {"planted": {"MDF": {"magnitude_similarity": float("nan")}}},
        {"planted": {"MDF": {"magnitude_similarity": 80.0}}},
    ],
)
def test_impossible_populations_are_refused_in_one_sentence(wrong: dict[str, Any]) -> None:
    with refused(InputError, names=next(iter(wrong))) as caught:
        Psychometrics(**wrong)
    assert "\n" not in str(caught.value)


def test_what_is_planted_is_kept_as_it_was() -> None:
    effects = {"MDF": {"magnitude_similarity": -12.0}}
    population = Psychometrics(planted=effects)
    effects["MDF"]["magnitude_similarity"] = 5.0
    assert population.effect("MDF", "magnitude_similarity") == -12.0
    assert population.effect("MDF", "choice") is None
    assert population.effect("PVC", "choice") is None


def test_nobody_may_differ_by_more_than_a_scale_can_show() -> None:
    strong = {"MDF": {"magnitude_similarity": 50.0}}  # 80 for whoever is the most sensitive
    assert Psychometrics(planted=strong, effect_sd=3.0).effect_sd == 3.0
    with refused(InputError, names=["magnitude_similarity", "MDF"], got=50.0):
        Psychometrics(planted=strong, effect_sd=4.0)


def test_the_default_population_may_be_planted_with_what_studies_look_for() -> None:
    strongest = Psychometrics(planted={"MDF": {"choice": -30.0, "frequency_similarity": 30.0}})
    assert strongest.effect("MDF", "choice") == -30.0
