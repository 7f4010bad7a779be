"""A population of simulated participants: its limits, and its rules in closed form."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from experiments.observers.psychometrics import (
    HIGHEST_MEAN,
    LOWEST_MEAN,
    Psychometrics,
    Trait,
    choice_shares,
    mean_ratings,
    with_effect,
)
from modeling import InputError
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


@given(st.floats(0.0, 100.0), st.floats(-100.0, 100.0), st.floats(-90.0, 90.0))
def test_mean_ratings_stay_on_the_scale_and_as_far_apart_as_planted(
    felt: float, bias: float, effect: float
) -> None:
    reference, other = mean_ratings(felt, bias=bias, effect=effect)
    assert other - reference == pytest.approx(effect, abs=1e-9)
    lowest, highest = min(reference, other), max(reference, other)
    assert lowest >= LOWEST_MEAN - 1e-9
    assert highest <= HIGHEST_MEAN + 1e-9
    alone = {felt + bias, felt + bias + effect}
    if min(alone) >= LOWEST_MEAN and max(alone) <= HIGHEST_MEAN:
        assert reference == pytest.approx(felt + bias, abs=1e-9)


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


def test_the_default_population_may_be_planted_with_what_studies_look_for() -> None:
    strongest = Psychometrics(planted={"MDF": {"choice": -30.0, "frequency_similarity": 30.0}})
    assert strongest.effect("MDF", "choice") == -30.0
