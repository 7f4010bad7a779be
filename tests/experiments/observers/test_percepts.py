"""What surfaces feel like: levels above threshold and distances, in closed form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from tactileq.experiments.observers.percepts import (
    BAND_EDGES_HZ,
    STROKES,
    Distance,
    Perception,
    distance,
    sensation_levels,
)
from tactileq.experiments.study.models import ModelSets
from tactileq.experiments.study.study import Study
from tactileq.modeling import InputError, TextureModel, Threshold
from tactileq.modeling.models.ar_model import ARModel
from tests.experiments.observers.planted_models import flat_threshold, texture_model
from tests.refusals import refused
from tests.rig.planted import planted_stimulus

PERCEPTS = arrays(np.float64, (3, 9), elements=st.floats(0.0, 80.0))


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


def test_a_stimulus_is_felt_by_its_spectrum_alike_in_every_stroke() -> None:
    rate_hz, amplitude_g, noise_g, limit_g = 5000.0, 0.05, 0.02, 0.001
    time_s = np.arange(round(60 * rate_hz)) / rate_hz
    tone = amplitude_g * np.sin(2 * np.pi * 215.3 * time_s)
    levels = sensation_levels(planted_stimulus(tone, rate_hz=rate_hz), flat_threshold(limit_g))
    np.testing.assert_allclose(levels[:, 6], 20 * np.log10(amplitude_g / limit_g), atol=0.01)
    noise = noise_g * np.random.default_rng(1).standard_normal(time_s.size)
    levels = sensation_levels(planted_stimulus(noise, rate_hz=rate_hz), flat_threshold(limit_g))
    power = noise_g**2 * (2 / rate_hz) * np.diff(BAND_EDGES_HZ)
    expected = 20 * np.log10(np.sqrt(2 * power) / limit_g)
    # The narrowest band, 10 Hz, for a minute: a standard deviation of 1/√600, or 0.18 dB.
    np.testing.assert_allclose(levels, np.tile(expected, (len(STROKES), 1)), atol=0.6)
    assert (levels == levels[0]).all()


def test_silence_and_a_very_short_stimulus_are_felt_as_nothing() -> None:
    for samples in (np.zeros(2500), np.zeros(2)):
        stimulus = planted_stimulus(samples, rate_hz=5000.0)
        assert (sensation_levels(stimulus, flat_threshold(0.001)) == 0.0).all()


def test_an_autoregressive_model_of_white_noise_is_felt_as_one_in_layers() -> None:
    order = 4
    evenly = np.pi * np.arange(1, order + 1) / (order + 1)  # 1/A = 1: no pole but at 0
    rival = ARModel(
        texture="made up",
        rate_hz=5000.0,
        speeds_mm_s=[50.0, 350.0],
        forces_n=[0.5, 3.5],
        line_spectral_frequencies=np.tile(evenly, (2, 2, 1)),
        gains=np.full((2, 2), 0.2),
        level_sd_db=np.zeros((2, 2)),
    )
    limit = flat_threshold(0.01)
    np.testing.assert_allclose(
        sensation_levels(rival, limit), sensation_levels(texture_model(0.2), limit), atol=1e-6
    )


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
    with refused(InputError, expected="g", got=[model.texture, "'arbitrary'"]):
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


def test_a_study_holds_the_distances_of_its_surfaces(
    study: Study, truths: dict[str, TextureModel], models: ModelSets, threshold: Threshold
) -> None:
    perception = Perception(study, real=truths, models=models, threshold=threshold)
    percepts = {
        (name, texture): sensation_levels(models.of(texture, name), threshold)
        for name in models.names
        for texture in study.textures
    }
    for name in models.names:
        for texture in study.textures:
            for other in study.textures:
                expected = distance(percepts["full", texture], percepts[name, other])
                found = perception.distance(texture, name, other)
                assert found.magnitude_db == pytest.approx(expected.magnitude_db, abs=1e-9)
                assert found.frequency_db == pytest.approx(expected.frequency_db, abs=1e-9)
    between = perception.felt().between[:, 0, 1, 2]
    expected = distance(percepts["full", "PVC"], percepts["simplified", "PVC"])
    np.testing.assert_allclose(between, [expected.magnitude_db, expected.frequency_db])


@pytest.mark.parametrize("shift_db", [-10.0, 6.0, 35.0])
def test_a_shifted_threshold_is_felt_as_another_one(
    study: Study,
    truths: dict[str, TextureModel],
    models: ModelSets,
    threshold: Threshold,
    shift_db: float,
) -> None:
    ours = Perception(study, real=truths, models=models, threshold=threshold)
    higher = replace(threshold, acceleration_g=threshold.acceleration_g * 10 ** (shift_db / 20))
    theirs = Perception(study, real=truths, models=models, threshold=higher)
    np.testing.assert_allclose(ours.felt(shift_db).from_real, theirs.felt().from_real, atol=1e-9)
    np.testing.assert_allclose(ours.felt(shift_db).between, theirs.felt().between, atol=1e-9)


def test_nothing_differs_to_somebody_who_feels_nothing(
    study: Study, truths: dict[str, TextureModel], models: ModelSets, threshold: Threshold
) -> None:
    numb = Perception(study, real=truths, models=models, threshold=threshold).felt(200.0)
    assert not numb.from_real.any()
    assert not numb.between.any()


def test_a_real_surface_without_truth_is_refused(
    study: Study, models: ModelSets, threshold: Threshold
) -> None:
    truth = {"PVC": models.of("PVC", "full")}
    with refused(InputError, got=["canvas", "MDF"]):
        Perception(study, real=truth, models=models, threshold=threshold)
