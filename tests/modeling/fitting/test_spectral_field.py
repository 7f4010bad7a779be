"""The field of spectra: its equations in dense form, planted fields, what must not matter."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest

from tactileq.modeling import InputError, Recording, RecordingSet, Spectrum, fit_ar
from tactileq.modeling.arrays import Floats
from tactileq.modeling.estimation.likelihood import LOWEST_FITTED_HZ
from tactileq.modeling.fitting.conditions import recording_spectra
from tactileq.modeling.fitting.spectral_field import (
    PRIOR_CONDITIONS,
    SpectralField,
    _eigen,
    _learnt,
    _likelihood,
    _weights,
    fit_field_to_spectra,
    fit_spectral_field,
)
from tactileq.modeling.models.grid import Condition
from tactileq.modeling.similarity import SpectralFilter
from tactileq.stimuli.planted.drawn import FORCES_N, SPEEDS_MM_S, draw_surface
from tests.refusals import refused

RATE_HZ = 1000.0
FREQUENCY_HZ = np.arange(15.0, 481.0)
NEPER_DB = 20 / np.log(10)


def definite(size: int, rng: np.random.Generator) -> Floats:
    root = rng.standard_normal((size, size))
    return np.asarray(root @ root.T / size)


def drawn_records(seed: int, speeds: Sequence[float], forces: Sequence[float]) -> RecordingSet:
    return draw_surface(seed).record(speeds, forces, duration_s=0.5, seed=seed)


def white(conditions: Sequence[Condition], *, rms: float = 0.2, n: int = 1000) -> list[Recording]:
    rng = np.random.default_rng(3)
    return [Recording(rms * rng.standard_normal(n), RATE_HZ, v, f, "oak") for v, f in conditions]


def spectrum_of(log_power: Floats, frequency_hz: Floats, rng: np.random.Generator) -> Spectrum:
    """A periodogram with this expected power: of a mean magnitude r the mean square is (4/π)r²."""
    power = np.exp(log_power) * rng.exponential(size=frequency_hz.size)
    return Spectrum(
        frequency_hz, np.sqrt(4 / np.pi * power), RATE_HZ, round(RATE_HZ / frequency_hz[1])
    )


# --- the equations


def test_likelihood_and_prediction_are_those_of_the_dense_covariance() -> None:
    rng = np.random.default_rng(1)
    space, bands = definite(5, rng), definite(4, rng)
    response = rng.standard_normal((5, 4))
    dense = np.kron(space, bands) + np.eye(20)
    y = response.ravel()
    expected = -0.5 * (y @ np.linalg.solve(dense, y) + np.linalg.slogdet(dense)[1])
    found = _eigen(space), _eigen(bands)
    assert _likelihood(*found, response) == pytest.approx(expected)
    mean = (np.kron(space, bands) @ np.linalg.solve(dense, y)).reshape(5, 4)
    assert space @ _weights(*found, response) == pytest.approx(mean)
    assert found[0].product(np.eye(5)) == pytest.approx(space)


def test_each_step_raises_the_posterior_density_of_the_covariance() -> None:
    """Expectation–maximisation never lowers it."""
    rng = np.random.default_rng(2)
    space, prior = _eigen(definite(30, rng)), definite(6, rng)
    response = 2 * rng.standard_normal((30, 6))
    bands, before = _eigen(prior), -np.inf
    for _ in range(6):
        dense = bands.product(np.eye(6))
        inverse = np.trace(np.linalg.solve(dense, prior)) + np.linalg.slogdet(dense)[1]
        density = _likelihood(space, bands, response) - PRIOR_CONDITIONS / 2 * inverse
        assert density > before
        bands, before = _learnt(space, bands, response, prior=prior), density


# --- planted fields


def test_a_planted_field_is_predicted_as_by_its_own_covariance() -> None:
    """Separable, Gaussian, other than what is assumed at first: errors and their deviations.

    With the true covariance and bands of the same noise nothing could be nearer.
    """
    rng = np.random.default_rng(4)
    frequency = np.fft.rfftfreq(1000, 1 / RATE_HZ)
    x = np.log(np.maximum(frequency, 1.0))
    curves = np.array([np.cos(2 * x), np.sin(2 * x), np.tanh(3 * (x - 5))]) * 0.7
    conditions = [
        (float(v), float(f)) for v in np.geomspace(50, 350, 7) for f in np.geomspace(0.5, 3.5, 7)
    ]
    places = np.log(np.array(conditions))
    apart = np.abs(places[:, None] - places).sum(axis=2)
    covariance = np.exp(-apart / 1.5)
    scores = np.linalg.cholesky(covariance) @ rng.standard_normal((49, 3))
    truth = scores @ curves - 6
    known = np.arange(49) % 4 != 1
    measured = [
        (record, spectrum_of(log_power, frequency, rng))
        for record, log_power in zip(white(conditions), truth, strict=True)
    ]
    field = fit_field_to_spectra(
        [pair for pair, there in zip(measured, known, strict=True) if there]
    )
    found = [field.filter(*conditions[n]) for n in np.flatnonzero(~known)]
    true = np.array(
        [np.interp(field.frequency_hz, frequency, truth[n]) for n in np.flatnonzero(~known)]
    )
    off_db = NEPER_DB * np.array([np.log(one.magnitude) for one in found]) - NEPER_DB / 2 * true
    sd_db = np.array([field.sd_db(*conditions[n]) for n in np.flatnonzero(~known)])
    assert 0.6 < np.mean((off_db / sd_db) ** 2) < 1.5
    best = covariance[~known][:, known] @ np.linalg.solve(
        covariance[np.ix_(known, known)], scores[known]
    )
    least_db = (
        NEPER_DB / 2 * (best @ curves + -6 - truth[~known])[:, (frequency > LOWEST_FITTED_HZ)]
    )
    assert np.sqrt(np.mean(off_db**2)) < 1.2 * np.sqrt(np.mean(least_db**2))


def test_white_noise_is_flat_at_its_level() -> None:
    """Of N lines in K records the mean log magnitude has a deviation of about ½/√(NK)."""
    records = white([(v, f) for v in (100.0, 200.0) for f in (1.0, 2.0)])
    field = fit_spectral_field(records)
    found = np.array(
        [np.log(field.filter(r.speed_mm_s, r.force_n).magnitude / 0.2) for r in records]
    )
    lines = 475
    assert abs(found.mean()) < 4 * 0.5 / np.sqrt(lines * len(records))
    # Single bands have four lines and more: half of that would be half of ½/√4.
    assert np.sqrt(np.mean((found - found.mean()) ** 2)) < 0.5 * 0.5 / np.sqrt(4)
    reference = fit_ar(records, order=1).filter(100.0, 1.0)
    assert field.rate_hz == reference.rate_hz == RATE_HZ
    level = np.log(field.filter(100.0, 1.0).response(FREQUENCY_HZ)).mean()
    assert level == pytest.approx(np.log(reference.response(FREQUENCY_HZ)).mean(), abs=0.1)


def test_a_steep_spectrum_is_followed_to_its_end() -> None:
    """It falls by 80 dB over the band: also below 50 dB under its maximum."""
    frequency = np.fft.rfftfreq(2000, 1 / RATE_HZ)
    log_power = -80 / 10 * np.log(10) * frequency / 500
    rng = np.random.default_rng(6)
    records = white([(v, f) for v in (100.0, 200.0) for f in (1.0, 2.0)])
    field = fit_field_to_spectra([(r, spectrum_of(log_power, frequency, rng)) for r in records])
    off = np.log(field.filter(150.0, 1.5).response(frequency[40:950])) - log_power[40:950] / 2
    assert NEPER_DB * np.abs(off).max() < 2.5


@pytest.mark.parametrize("seed", [9500, 9501, 9502])
def test_hidden_conditions_are_nearer_than_the_nearest_record(seed: int) -> None:
    surface = draw_surface(seed)
    hidden = [(100.0, 1.0), (200.0, 2.0), (250.0, 1.5)]
    records = [r for r in surface.record(seed=seed) if r.condition not in hidden]
    measured = recording_spectra(RecordingSet(records))
    field = fit_field_to_spectra(measured)
    logs = np.log([r.condition for r, _ in measured])

    def nearest(v: float, f: float) -> Floats:
        near = measured[int(np.argmin(np.linalg.norm(logs - np.log([v, f]), axis=1)))][1]
        return np.interp(FREQUENCY_HZ, near.frequency_hz, near.smoothed())

    def distance(response: Callable[[float, float], Floats]) -> float:
        off = [
            np.log(response(v, f) / surface.magnitude(FREQUENCY_HZ, speed_mm_s=v, force_n=f))
            for v, f in hidden
        ]
        return float(np.sqrt(np.mean(np.square(off))))

    assert distance(lambda v, f: field.filter(v, f).response(FREQUENCY_HZ)) < distance(nearest)


# --- what must not matter, and what must


def field_at(field: SpectralField) -> Floats:
    return np.array([field.filter(v, f).response(FREQUENCY_HZ) for v, f in ((70.0, 0.7), (300, 3))])


@pytest.mark.parametrize("factor", [10.0, 1e-4])
def test_ten_times_the_samples_are_ten_times_the_response(factor: float) -> None:
    records = drawn_records(9510, SPEEDS_MM_S[::3], FORCES_N[::3])
    louder = [replace(r, samples=factor * r.samples) for r in records]
    expected = factor * field_at(fit_spectral_field(records))
    assert field_at(fit_spectral_field(louder)) == pytest.approx(expected, rel=1e-6)


def test_the_order_of_records_does_not_matter() -> None:
    records = drawn_records(9511, SPEEDS_MM_S[::3], FORCES_N[::3]).recordings
    order = np.random.default_rng(5).permutation(len(records))
    shuffled = fit_spectral_field([records[n] for n in order])
    assert field_at(shuffled) == pytest.approx(field_at(fit_spectral_field(records)), rel=1e-6)


def test_one_condition_is_the_spectrum_itself() -> None:
    """Half a record's scatter at most: over four lines a level has a deviation of 2.2 dB."""
    surface = draw_surface(9512)
    field = fit_spectral_field(surface.record([150.0], [1.5], seed=7))
    found = field.filter(150.0, 1.5)
    assert isinstance(found, SpectralFilter)
    assert field.n_parameters == found.magnitude.size
    true = surface.magnitude(FREQUENCY_HZ, speed_mm_s=150.0, force_n=1.5)
    off_db = NEPER_DB * np.log(found.response(FREQUENCY_HZ) / true)
    assert np.sqrt(np.mean(off_db**2)) < 1.1
    assert found.response([0.0, 499.0]) == pytest.approx(found.magnitude[[0, -1]])


def test_the_deviation_grows_away_from_the_records() -> None:
    field = fit_spectral_field(drawn_records(9513, SPEEDS_MM_S[:4], FORCES_N[:4]))
    near, far, farther = (field.sd_db(v, 1.0).mean() for v in (150.0, 300.0, 600.0))
    assert 0 < near < far < farther


def test_lines_of_no_weight_are_bridged() -> None:
    """Hum lines and what the floor took: of white noise with a gap in which nothing is left."""
    measured = recording_spectra(RecordingSet(white([(v, 1.0) for v in (100.0, 150.0, 200.0)])))
    gapped = []
    for record, found in measured:
        left = ~(
            (found.frequency_hz > 90) & (found.frequency_hz < 110) | (found.frequency_hz > 400)
        )
        gapped.append((record, replace(found, share=left * 1.0, magnitude=found.magnitude * left)))
    assert all(found.tapered_magnitude is not None for _, found in gapped)
    response = fit_field_to_spectra(gapped).filter(150.0, 1.0).response(FREQUENCY_HZ)
    assert NEPER_DB * np.abs(np.log(response / 0.2)).max() < 3


def test_what_is_quieter_than_the_floor_is_modelled_all_the_same() -> None:
    """Of each line's power the floor has left a tenth: no band is worth a whole line."""
    measured = recording_spectra(RecordingSet(white([(v, 1.0) for v in (100.0, 150.0, 200.0)])))
    quiet = [
        (r, replace(s, share=0.1, tapered_magnitude=s.without_leakage * np.sqrt(0.1)))
        for r, s in measured
    ]
    response = fit_field_to_spectra(quiet).filter(150.0, 1.0).response(FREQUENCY_HZ)
    assert NEPER_DB * np.log(response / 0.2).mean() == pytest.approx(-10, abs=0.5)


@pytest.mark.parametrize(("rate_hz", "count"), [(100.0, 64), (40.0, 64), (5000.0, 64)])
def test_records_of_few_lines(rate_hz: float, count: int) -> None:
    rng = np.random.default_rng(8)
    records = [
        Recording(rng.standard_normal(count), rate_hz, v, 1.0, "oak") for v in (100.0, 200.0)
    ]
    found = fit_spectral_field(records).filter(140.0, 1.0)
    response = found.response(np.linspace(0, rate_hz / 2, 9))
    assert ((response > 0.3) & (response < 3)).all()


def test_silent_records_are_left_out_and_silence_is_refused() -> None:
    measured = recording_spectra(drawn_records(9514, SPEEDS_MM_S[:3], FORCES_N[:2]))
    nothing = np.zeros_like(measured[0][1].magnitude)
    silent = [
        (record, replace(found, magnitude=nothing, tapered_magnitude=nothing))
        for record, found in measured
    ]
    found = fit_field_to_spectra([*measured[1:], silent[0]])
    assert field_at(found) == pytest.approx(field_at(fit_field_to_spectra(measured[1:])))
    with refused(InputError, expected="vibration", got=["silence", 2]):
        fit_field_to_spectra(silent[:2])
    records = [record for record, _ in measured]
    with refused(InputError, expected="unit", got="arbitrary"):
        fit_spectral_field([records[0], replace(records[1], unit="arbitrary")])


def test_records_of_other_lengths_fit_beside_each_other() -> None:
    """The scatter of the longer ones is less; all are white and of one level."""
    records = [*white([(100.0, 1.0), (200.0, 1.0)], n=600), *white([(150.0, 1.5)], n=4000)]
    response = fit_spectral_field(records).filter(150.0, 1.2).response(FREQUENCY_HZ)
    assert NEPER_DB * np.abs(np.log(response / 0.2)).max() < 2.5
