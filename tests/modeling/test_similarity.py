"""Measures of likeness against closed forms and planted ratios (docs/method/similarity.md)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from tactileq.modeling import (
    PEQ,
    ARFilter,
    ARModel,
    InputError,
    Recording,
    TextureModel,
    similarity,
    spectrum,
)
from tactileq.modeling.recordings.spectrum import Spectrum
from tests.refusals import refused

ModelMaker = Callable[..., TextureModel]
RecordingMaker = Callable[..., Recording]
FREQUENCY_HZ = np.arange(2501.0)
LAYERS = [(150.0, 30.0, 0.5), (600.0, 60.0, -0.5), (1300.0, 100.0, 0.5)]
magnitudes = hnp.arrays(float, 20, elements=st.floats(0, 1e6, allow_subnormal=False))


def scattered(peq: similarity.SpectralFilter, rng: np.random.Generator) -> Spectrum:
    """A fresh draw of a filter's output: Rayleigh-distributed bins around its response."""
    draw = peq.response(FREQUENCY_HZ) * rng.rayleigh(np.sqrt(2 / np.pi), FREQUENCY_HZ.size)
    return Spectrum(FREQUENCY_HZ, draw, 5000.0, 5000)


# --- GFC


@settings(deadline=None)
@given(magnitudes, magnitudes, st.floats(1e-6, 1e6))
def test_gfc_is_symmetric_bounded_and_blind_to_scale(
    a: np.ndarray, b: np.ndarray, scale: float
) -> None:
    assume(a.max() > 1e-3 and b.max() > 1e-3)
    value = similarity.gfc(a, b)
    assert 0 <= value <= 1
    assert similarity.gfc(b, a) == pytest.approx(value, abs=1e-12)
    assert similarity.gfc(scale * a, b) == pytest.approx(value, abs=1e-9)
    assert similarity.gfc(a, scale * a) == pytest.approx(1, abs=1e-12)
    expected = (a / a.max()) @ (b / b.max()) / np.linalg.norm(a / a.max())
    assert value == pytest.approx(expected / np.linalg.norm(b / b.max()), abs=1e-9)


def test_gfc_of_known_pairs() -> None:
    assert similarity.gfc([1, 0, 2, 0], [0, 3, 0, 1]) == 0
    assert similarity.gfc([1, 1], [1, 0]) == pytest.approx(np.sqrt(0.5))
    assert similarity.gfc([1e-200, 2e-200], [1e200, 2e200]) == pytest.approx(1)


def test_unsmoothed_noise_is_capped() -> None:
    """π/4 between two draws of one spectrum, √π/2 between response and draw."""
    rng = np.random.default_rng(0)
    n = 200_000
    one, other = rng.rayleigh(size=(2, n))
    assert similarity.gfc(one, other) == pytest.approx(np.pi / 4, abs=0.005)
    assert similarity.gfc(np.ones(n), one) == pytest.approx(np.sqrt(np.pi) / 2, abs=0.005)


@pytest.mark.parametrize(
    ("a", "b", "got"),
    [
        ([], [], "(0,)"),
        ([1, 2], [1, 2, 3], ["(2,)", "(3,)"]),
        ([1, np.nan], [1, 2], "NaN"),
        ([1, 2], [1, np.inf], "inf"),
        ([0, 0], [1, 2], 0),
        ([[1]], [[1]], "(1, 1)"),
    ],
)
def test_unusable_pairs_are_refused(a: list[float], b: list[float], got: object) -> None:
    for measure in (similarity.gfc, similarity.log_spectral_distance_db):
        with refused(InputError, expected="spectra", got=got):
            measure(a, b)


# --- distances


@settings(deadline=None)
@given(hnp.arrays(float, 20, elements=st.floats(1e-6, 1e6)), st.floats(1e-4, 1e4))
def test_log_spectral_distance_of_a_constant_ratio(a: np.ndarray, ratio: float) -> None:
    expected = abs(20 * np.log10(ratio))
    assert similarity.log_spectral_distance_db(a, ratio * a) == pytest.approx(expected, abs=1e-9)
    assert similarity.log_spectral_distance_db(ratio * a, a) == pytest.approx(expected, abs=1e-9)


def test_log_spectral_distance_is_a_root_mean_square() -> None:
    distance = similarity.log_spectral_distance_db([10.0, 1.0, 1.0, 1.0], [1.0, 1.0, 1.0, 1.0])
    assert distance == pytest.approx(20 / np.sqrt(4))


def test_log_spectral_distance_refuses_zeros() -> None:
    with refused(InputError, expected=["magnitudes", 0], got=0):
        similarity.log_spectral_distance_db([1.0, 0.0], [1.0, 1.0])


def test_band_energies_of_planted_ratios() -> None:
    """Each band of docs/method/similarity.md#band-energies gets its error."""
    edges = [10, 20, 35, 60, 90, 130, 180, 250, 350, 480, 800, 1300, 2500]
    frequency = np.arange(10.0, 2451.0)
    rng = np.random.default_rng(1)
    planted_db = rng.uniform(-9, 9, 12)
    b = rng.uniform(0.5, 2, frequency.size)
    a = b * 10 ** (planted_db[np.searchsorted(edges, frequency, side="right") - 1] / 20)
    found_edges, errors = similarity.band_energy_error_db(frequency, a, b)
    assert found_edges.tolist() == edges
    assert errors == pytest.approx(planted_db, abs=1e-9)


def test_bands_beyond_the_data_are_left_out() -> None:
    frequency = np.arange(10.0, 400.0)
    one = np.ones(frequency.size)
    edges, errors = similarity.band_energy_error_db(frequency, 2 * one, one)
    assert edges.tolist() == [10, 20, 35, 60, 90, 130, 180, 250, 350, 480]
    assert errors == pytest.approx(np.full(9, 6.0206), abs=1e-3)


# --- the report


def test_truth_scores_above_the_floor_and_as_expected(make_model: ModelMaker) -> None:
    peq = make_model(0.05, LAYERS).peq(200.0, 2.0)
    rng = np.random.default_rng(2)
    reports = [similarity.report(scattered(peq, rng), peq, rng=rng) for _ in range(12)]
    for r in reports:
        assert r.floor_gfc30 < r.gfc30 <= 1
        assert r.floor_gfc5 < r.gfc5 <= 1
        # The expected value is a mean over draws: the truth may pass it by their scatter.
        assert r.gfc30 < r.expected_gfc30 + 0.01
        assert r.gfc5 < r.expected_gfc5 + 0.03
        assert r.gfc30_deficit == pytest.approx(1 - r.gfc30 / r.expected_gfc30)
    assert np.mean([r.gfc30 for r in reports]) > 0.99
    assert np.mean([r.gfc30 - r.floor_gfc30 for r in reports]) > 0.05
    assert abs(np.mean([r.gfc30_deficit for r in reports])) < 0.004
    # In expectation the truth has the right energy, in all and in every band.
    assert np.mean([r.rms_error_db for r in reports]) == pytest.approx(0, abs=0.15)
    bands = np.mean([r.band_energy_error_db for r in reports], axis=0)
    assert np.abs(bands[2:]).max() < 0.8


@pytest.mark.parametrize("ratio", [0.5, 2.0])
def test_a_wrong_level_is_reported_as_such(make_model: ModelMaker, ratio: float) -> None:
    peq = make_model(0.05, LAYERS).peq(200.0, 2.0)
    other = PEQ(
        noise_gain=ratio * peq.noise_gain,
        frequencies_hz=peq.frequencies_hz,
        bandwidths_hz=peq.bandwidths_hz,
        gains=ratio * peq.gains,
        rate_hz=5000.0,
    )
    measured = scattered(peq, np.random.default_rng(3))
    right, wrong = similarity.report(measured, peq), similarity.report(measured, other)
    shift = 20 * np.log10(ratio)
    assert wrong.gfc30 == pytest.approx(right.gfc30, abs=1e-12)
    assert wrong.rms_error_db - right.rms_error_db == pytest.approx(shift)
    assert wrong.band_energy_error_db - right.band_energy_error_db == pytest.approx(shift)
    assert wrong.log_spectral_distance_db == pytest.approx(abs(shift), abs=0.6)
    assert right.log_spectral_distance_db < 1


def test_white_noise_model_scores_its_own_floor(make_model: ModelMaker) -> None:
    measured = scattered(make_model(0.05, LAYERS).peq(200.0, 2.0), np.random.default_rng(4))
    r = similarity.report(measured, make_model(0.3, []).peq(200.0, 2.0))
    assert (r.gfc30, r.gfc5) == pytest.approx((r.floor_gfc30, r.floor_gfc5))


def test_only_the_band_from_10_hz_to_098_nyquist_counts(make_model: ModelMaker) -> None:
    peq = make_model(0.05, [(1200.0, 100.0, 0.5)]).peq(200.0, 2.0)
    measured = scattered(peq, np.random.default_rng(5))
    outside = (FREQUENCY_HZ < 10) | (FREQUENCY_HZ > 0.98 * 2500)
    changed = measured.magnitude.copy()
    changed[outside] = 0.0
    loud = Spectrum(FREQUENCY_HZ, changed, 5000.0, 5000)
    here, there = similarity.report(measured, peq), similarity.report(loud, peq)
    assert here.rms_error_db == there.rms_error_db
    assert np.array_equal(here.band_energy_error_db, there.band_energy_error_db)


def test_report_takes_the_recordings_condition(
    make_model: ModelMaker, make_recording: RecordingMaker
) -> None:
    model = make_model(0.05, LAYERS)
    recording = make_recording(
        np.random.default_rng(0).standard_normal(5000), speed_mm_s=50.0, force_n=0.5
    )
    assert similarity.report(recording, model).rms_error_db == pytest.approx(
        similarity.report(spectrum(recording), model.peq(50.0, 0.5)).rms_error_db
    )


def test_report_repeats(make_model: ModelMaker) -> None:
    peq = make_model(0.05, LAYERS).peq(200.0, 2.0)
    measured = scattered(peq, np.random.default_rng(6))
    first, second = similarity.report(measured, peq), similarity.report(measured, peq)
    assert first.expected_gfc30 == second.expected_gfc30
    other = similarity.report(measured, peq, rng=np.random.default_rng(9))
    assert first.expected_gfc30 != other.expected_gfc30
    assert first.gfc30 == other.gfc30


def test_spectrum_without_condition_needs_a_peq(make_model: ModelMaker) -> None:
    model = make_model(0.05, LAYERS)
    measured = scattered(model.peq(200.0, 2.0), np.random.default_rng(0))
    with refused(InputError, expected=["recording", "PEQ"], got=["spectrum", "model.peq"]):
        similarity.report(measured, model)


def test_rates_that_do_not_match_are_refused(
    make_model: ModelMaker, make_recording: RecordingMaker
) -> None:
    with refused(InputError, expected="5000 Hz", got="1000 Hz"):
        similarity.report(make_recording(rate_hz=1000.0), make_model(0.05, LAYERS))


def test_ar_filter_is_held_to_the_same_measures(make_recording: RecordingMaker) -> None:
    truth = ARFilter(coefficients=[-1.2, 0.72], gain=0.1, rate_hz=5000.0)
    rng = np.random.default_rng(7)
    reports = [similarity.report(scattered(truth, rng), truth, rng=rng) for _ in range(8)]
    assert np.mean([r.gfc30 for r in reports]) > 0.99
    assert abs(np.mean([r.gfc30_deficit for r in reports])) < 0.004
    assert np.mean([r.rms_error_db for r in reports]) == pytest.approx(0, abs=0.15)
    half = ARFilter(coefficients=truth.coefficients, gain=0.05, rate_hz=5000.0)
    measured = scattered(truth, rng)
    shift = similarity.report(measured, half).rms_error_db
    shift -= similarity.report(measured, truth).rms_error_db
    assert shift == pytest.approx(-20 * np.log10(2))


def test_ar_model_is_taken_at_the_recordings_condition(make_recording: RecordingMaker) -> None:
    frequencies = np.array([[[0.5, 1.5]] * 2, [[1.0, 2.5]] * 2])
    model = ARModel(
        texture="planted",
        rate_hz=5000.0,
        speeds_mm_s=[100.0, 300.0],
        forces_n=[1.0, 3.0],
        line_spectral_frequencies=frequencies,
        gains=[[0.1, 0.2], [0.3, 0.4]],
        level_sd_db=np.zeros((2, 2)),
    )
    recording = make_recording(
        np.random.default_rng(0).standard_normal(5000), speed_mm_s=250.0, force_n=1.2
    )
    there = similarity.report(recording, model)
    assert there.rms_error_db == pytest.approx(
        similarity.report(spectrum(recording), model.filter(250.0, 1.2)).rms_error_db
    )
    with refused(InputError, expected=["recording", "PEQ"], got=["spectrum", "filter"]):
        similarity.report(spectrum(recording), model)


def test_anything_with_a_rate_and_a_response_is_reported_on(make_model: ModelMaker) -> None:
    peq = make_model(0.05, LAYERS).peq(200.0, 2.0)

    class Table:
        rate_hz = 5000.0

        def response(self, frequency_hz: np.ndarray) -> np.ndarray:
            return np.interp(frequency_hz, FREQUENCY_HZ, peq.response(FREQUENCY_HZ))

    measured = scattered(peq, np.random.default_rng(8))
    assert similarity.report(measured, Table()).gfc30 == similarity.report(measured, peq).gfc30
