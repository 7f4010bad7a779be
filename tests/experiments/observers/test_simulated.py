"""Simulated participants against the closed form of what they were told to be."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy import integrate, stats

from experiments.observers.simulated import (
    BAND_EDGES_HZ,
    STROKES,
    Distance,
    Perception,
    Psychometrics,
    SimulatedParticipant,
    distance,
    sensation_levels,
)
from experiments.sessions.surfaces import Surfaces
from experiments.study.models import ModelSets
from experiments.study.study import Study
from experiments.tasks import plan_session
from modeling import InputError, TextureModel, Threshold

PERCEPTS = arrays(np.float64, (3, 9), elements=st.floats(0.0, 80.0))


def flat_threshold(level_g: float, low_hz: float = 1.0, high_hz: float = 2000.0) -> Threshold:
    return Threshold("flat", np.array([low_hz, high_hz]), np.full(2, level_g), "made up", "none")


def texture_model(
    noise_gain: float, layers: tuple[tuple[float, float, float], ...] = ()
) -> TextureModel:
    """The same noise gain and layers (f, B, G) at every condition."""
    grid = np.array(layers).reshape(1, 1, len(layers), 3).repeat(2, 0).repeat(2, 1)
    return TextureModel(
        texture="made up",
        rate_hz=5000.0,
        speeds_mm_s=np.array([50.0, 350.0]),
        forces_n=np.array([0.5, 3.5]),
        noise_gains=np.full((2, 2), noise_gain),
        frequencies_hz=grid[..., 0],
        bandwidths_hz=grid[..., 1],
        gains=grid[..., 2],
        level_sd_db=np.zeros(grid.shape[:3]),
        estimator="planted",
    )


def test_white_noise_is_felt_by_the_power_in_each_band() -> None:
    gain, limit_g = 0.2, 0.01
    levels = sensation_levels(texture_model(gain), flat_threshold(limit_g))
    power = gain**2 * (2 / 5000.0) * np.diff(BAND_EDGES_HZ)
    expected = 20 * np.log10(np.sqrt(2 * power) / limit_g)
    np.testing.assert_allclose(levels, np.tile(expected, (len(STROKES), 1)), atol=1e-9)


def test_a_narrow_layer_is_felt_as_the_sinusoid_of_equal_power() -> None:
    """`energy` (docs/method/perception.md#criteria): √2·G·√(k/(1+k)) with k = tan(πB/rate)."""
    gain, bandwidth_hz, limit_g = 0.5, 2.0, 0.001
    k = np.tan(np.pi * bandwidth_hz / 5000.0)
    amplitude_g = np.sqrt(2) * gain * np.sqrt(k / (1 + k))
    model = texture_model(0.0, ((215.0, bandwidth_hz, gain),))
    level = sensation_levels(model, flat_threshold(limit_g))[:, 6]  # 180 … 250 Hz
    np.testing.assert_allclose(level, 20 * np.log10(amplitude_g / limit_g), atol=0.1)


def test_what_is_below_threshold_changes_nothing() -> None:
    loud = ((70.0, 10.0, 0.5),)
    felt = sensation_levels(texture_model(1e-4, loud), flat_threshold(0.02))
    fainter = sensation_levels(texture_model(1e-6, loud), flat_threshold(0.02))
    faint_layer = texture_model(1e-4, (*loud, (300.0, 20.0, 0.02)))
    with_layer = sensation_levels(faint_layer, flat_threshold(0.02))
    assert np.count_nonzero(felt) == 3
    np.testing.assert_allclose(fainter, felt, atol=0.01)
    np.testing.assert_allclose(with_layer, felt, atol=0.01)
    np.testing.assert_array_equal(with_layer == 0, felt == 0)


def test_nothing_is_felt_where_no_threshold_is_known() -> None:
    levels = sensation_levels(texture_model(0.5), flat_threshold(0.001, 60.0, 180.0))
    np.testing.assert_array_equal(levels > 0, np.tile([0, 0, 0, 1, 1, 1, 0, 0, 0], (3, 1)))


def test_models_in_arbitrary_units_are_refused() -> None:
    model = replace(texture_model(0.5), unit="arbitrary")
    with pytest.raises(InputError, match="expected a model in g"):
        sensation_levels(model, flat_threshold(0.001))


@given(PERCEPTS, PERCEPTS)
def test_distance_is_symmetric_and_splits_as_pythagoras_says(
    first: np.ndarray, second: np.ndarray
) -> None:
    there, back = distance(first, second), distance(second, first)
    np.testing.assert_allclose(
        [there.magnitude_db, there.frequency_db], [back.magnitude_db, back.frequency_db]
    )
    rms = np.sqrt(((first - second) ** 2).mean())
    np.testing.assert_allclose(there.total_db, rms, rtol=1e-9, atol=1e-9)
    assert distance(first, first) == Distance(0.0, 0.0)


@given(PERCEPTS, st.floats(-20.0, 20.0))
def test_a_change_of_level_alone_is_a_distance_in_magnitude_alone(
    percept: np.ndarray, gain_db: float
) -> None:
    apart = distance(percept, percept + gain_db)
    np.testing.assert_allclose(apart.magnitude_db, abs(gain_db), atol=1e-9)
    np.testing.assert_allclose(apart.frequency_db, 0.0, atol=1e-9)


def cut_off_mean(mean: float, sd: float) -> float:
    """Mean of a normal variable cut off at 0 and 100, by quadrature."""
    density = stats.norm(mean, sd).pdf
    inside, _ = integrate.quad(lambda x: x * density(x), 0.0, 100.0)
    return inside + 100.0 * float(stats.norm.sf(100.0, mean, sd))


def test_the_true_rating_falls_by_e_with_each_scale() -> None:
    exact = Psychometrics(bias_sd=0.0, noise_sd=0.0, scale_db=10.0)
    np.testing.assert_allclose(exact.true_rating([0.0, 10.0]), [100.0, 100.0 / np.e])


@given(
    arrays(np.float64, st.integers(2, 12), elements=st.floats(0.0, 1000.0)),
    st.floats(0.05, 50.0),
    st.floats(0.0, 1.0),
)
def test_choice_probabilities_follow_luce(
    distances: np.ndarray, temperature_db: float, lapse_rate: float
) -> None:
    rule = Psychometrics(temperature_db=temperature_db, lapse_rate=lapse_rate)
    probabilities = rule.choice_probabilities(distances)
    np.testing.assert_allclose(probabilities.sum(), 1.0)
    assert probabilities.min() >= lapse_rate / distances.size - 1e-12
    nearer = distances[:, None] < distances[None, :]
    assert (probabilities[:, None] >= probabilities[None, :] - 1e-12)[nearer].all()


def test_choice_probabilities_by_hand() -> None:
    rule = Psychometrics(temperature_db=2.0, lapse_rate=0.1)
    expected = 0.9 * np.array([2 / 3, 1 / 3]) + 0.05
    np.testing.assert_allclose(rule.choice_probabilities([1.0, 1.0 + 2 * np.log(2)]), expected)


@pytest.mark.parametrize(
    "wrong",
    [{"scale_db": 0.0}, {"bias_sd": -1.0}, {"temperature_db": float("nan")}, {"lapse_rate": 1.1}],
)
def test_impossible_psychometrics_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(InputError, match=f"expected a {next(iter(wrong))}"):
        Psychometrics(**wrong)


@pytest.fixture
def perception(
    study: Study, truths: dict[str, TextureModel], models: ModelSets, threshold: Threshold
) -> Perception:
    # A virtual surface that is 6 dB too strong, so that ratings are not all at the ceiling.
    louder = {
        name: replace(model, gains=2 * model.gains, noise_gains=2 * model.noise_gains)
        for name, model in truths.items()
    }
    sets = ModelSets(sets={"full": louder, "simplified": models.sets["simplified"]})
    return Perception(study, real=truths, models=sets, threshold=threshold)


def test_many_ratings_agree_with_the_planted_truth(
    study: Study, perception: Perception, models: ModelSets, rig: Any
) -> None:
    truth = Psychometrics(scale_db=8.0, bias_sd=12.0, noise_sd=16.0)
    trials = plan_session(study, task="absolute", subject=1, session=1).trials
    trial = next(t for t in trials if (t.texture, t.model) == ("MDF", "full"))
    surfaces = Surfaces(rig, texture="MDF", models=[models.sets["full"]["MDF"]])
    surfaces.present_real()
    ratings = []
    for subject in range(1, 2001):
        person = SimulatedParticipant(perception, truth, seed=5, subject=subject, occasion=(1,))
        given_ = person.rate(trial, surfaces)
        ratings.append((given_.magnitude_similarity, given_.frequency_similarity))
    apart = perception.distance("MDF", "full", "MDF")
    means = truth.true_rating([apart.magnitude_db, apart.frequency_db])
    expected = [cut_off_mean(mean, np.hypot(12.0, 16.0)) for mean in means]
    error = np.std(ratings, axis=0) / np.sqrt(len(ratings))
    assert (np.abs(np.mean(ratings, axis=0) - expected) < 4 * error).all()
    assert 1.0 < expected[0] < 90.0
    assert np.min(ratings) >= 0.0
    assert np.max(ratings) <= 100.0


def test_many_choices_agree_with_the_planted_truth(
    study: Study, perception: Perception, models: ModelSets, rig: Any
) -> None:
    truth = Psychometrics(temperature_db=4.0, lapse_rate=0.1)
    trial = plan_session(study, task="relative", subject=1, session=1).trials[0]
    layout = [models.of(texture, trial.model) for texture in trial.layout]
    person = SimulatedParticipant(perception, truth, seed=6, subject=1, occasion=(1,))
    surfaces = Surfaces(rig, texture=trial.texture, models=layout)
    counts = np.zeros(3)
    for _ in range(3000):
        counts[person.choose(trial, surfaces).button] += 1
    apart = [perception.distance(trial.texture, trial.model, t).total_db for t in trial.layout]
    expected = 3000 * truth.choice_probabilities(apart)
    assert stats.chisquare(counts, expected).pvalue > 0.001


def test_a_subject_keeps_the_bias_and_not_the_noise(
    study: Study, perception: Perception, models: ModelSets, rig: Any
) -> None:
    trial = plan_session(study, task="absolute", subject=1, session=1).trials[0]
    surfaces = Surfaces(rig, texture=trial.texture, models=[models.sets["full"][trial.texture]])

    def magnitude(noise_sd: float, **who: int) -> float:
        truth = Psychometrics(bias_sd=3.0, noise_sd=noise_sd, scale_db=30.0)
        person = SimulatedParticipant(perception, truth, seed=7, **who)
        return person.rate(trial, surfaces).magnitude_similarity

    steady = magnitude(0.0, subject=1, occasion=(1,))
    assert steady == magnitude(0.0, subject=1, occasion=(2,))
    assert steady != magnitude(0.0, subject=2, occasion=(1,))
    assert magnitude(1.0, subject=1, occasion=(1,)) == magnitude(1.0, subject=1, occasion=(1,))
    assert magnitude(1.0, subject=1, occasion=(1,)) != magnitude(1.0, subject=1, occasion=(2,))


def test_a_real_surface_without_truth_is_refused(
    study: Study, models: ModelSets, threshold: Threshold
) -> None:
    with pytest.raises(InputError, match="got none for canvas, MDF"):
        Perception(
            study, real={"PVC": models.sets["full"]["PVC"]}, models=models, threshold=threshold
        )
