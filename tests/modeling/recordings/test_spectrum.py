"""From recordings to spectra: levels, resampling, high-pass, smoothing, floor."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactileq.modeling import InputError, Recording, Spectrum, spectrum
from tactileq.modeling.recordings.spectrum import (
    high_pass_response,
    mean_spectrum,
    prepare,
    smooth,
    spectrum_of_samples,
    subtract_floor,
)
from tests.refusals import refused

RecordingMaker = Callable[..., Recording]


def flat(level: float, *, samples: int = 5000, rate_hz: float = 5000.0) -> Spectrum:
    frequency = np.fft.rfftfreq(samples, 1 / rate_hz)
    return Spectrum(frequency, np.full(frequency.shape, level), rate_hz, samples)


@pytest.mark.parametrize(("n", "rate_hz"), [(1000, 1000.0), (5000, 5000.0), (20001, 5000.0)])
def test_white_noise_has_the_magnitude_of_its_rms(n: int, rate_hz: float) -> None:
    """The mean |FFT| of unit noise is √(πN)/2, whatever N and the rate.

    docs/method/recordings.md#magnitude
    """
    rng = np.random.default_rng(0)
    means = [
        spectrum_of_samples(0.25 * rng.standard_normal(n), rate_hz).magnitude[5:-1].mean()
        for _ in range(20)
    ]
    assert np.mean(means) == pytest.approx(0.25, rel=4 * 0.523 / np.sqrt(20 * n / 2))


def test_resampling_keeps_the_density_of_noise(make_recording: RecordingMaker) -> None:
    """White noise of RMS r at 22 704 Hz is r·√(5000/22704) per unit noise at 5 kHz, to 2.4 kHz."""
    rng = np.random.default_rng(2)
    spectra = [
        spectrum(make_recording(rng.standard_normal(22704), rate_hz=22704.0)).magnitude
        for _ in range(40)
    ]
    bands = np.mean(spectra, axis=0)[100:2400].reshape(23, 100).mean(axis=1)
    expected = np.sqrt(5000 / 22704)
    # 40 records × 100 bins: standard error 0.8 %.
    assert bands == pytest.approx(expected, rel=0.04)
    assert bands.mean() == pytest.approx(expected, rel=0.01)
    assert bands[-1] / bands[:10].mean() == pytest.approx(1, abs=0.035)


@pytest.mark.parametrize("frequency_hz", [50.0, 440.0, 1000.0, 2399.0])
def test_resampling_keeps_a_sines_amplitude(
    make_recording: RecordingMaker, frequency_hz: float
) -> None:
    sine = 0.3 * np.sin(2 * np.pi * frequency_hz * np.arange(22704) / 22704)
    found = spectrum(make_recording(sine, rate_hz=22704.0))
    assert (found.n_samples, found.rate_hz, found.duration_s) == (5000, 5000.0, 1.0)
    peak = int(np.argmax(found.magnitude))
    assert found.frequency_hz[peak] == frequency_hz
    # A bin-centred sine has |X| = A·N/2; the 10 Hz high-pass settles within the record.
    amplitude = found.magnitude[peak] * np.sqrt(np.pi * 5000) / 2 * 2 / 5000
    assert amplitude == pytest.approx(0.3, rel=0.02)


@pytest.mark.parametrize("frequency_hz", [60.0, 440.3, 1000.5])
def test_a_pure_tone_is_fitted_as_a_band_of_its_power(
    make_recording: RecordingMaker, frequency_hz: float
) -> None:
    """Of a signal of power P the squared magnitudes sum to 2nP/π (Parseval)."""
    n = 10000
    sine = 0.3 * np.sin(2 * np.pi * frequency_hz * np.arange(n) / 5000)
    noise = 0.01 * np.random.default_rng(4).standard_normal(n)
    found = spectrum(make_recording(sine + noise))
    assert len(found.notes) == 1
    power = np.sum(found.without_leakage**2) * np.pi / (2 * n)
    assert power == pytest.approx(0.3**2 / 2 + 0.01**2, rel=0.01)


def test_high_pass_is_3_db_down_at_10_hz(make_recording: RecordingMaker) -> None:
    """Two opposite impulses: no mean, known spectrum 1 − e^(−iω·250) with 2 at 10 Hz."""
    impulses = np.zeros(10000)
    impulses[[0, 250]] = 1.0, -1.0
    filtered = prepare(make_recording(impulses))
    frequency = np.fft.rfftfreq(10000, 1 / 5000)
    before = np.abs(1 - np.exp(-2j * np.pi * frequency * 250 / 5000))
    gain = np.abs(np.fft.rfft(filtered)) / np.maximum(before, 1e-9)

    def at(f: float) -> float:
        return float(gain[int(f * 2)])

    assert 20 * np.log10(at(10)) == pytest.approx(-3.0103, abs=0.01)
    # Fourth order: 24 dB an octave below, flat above (|H|² = 1/(1 + (10/f)⁸)).
    for f in (2.5, 5.0, 30.0, 90.0, 990.0):
        assert at(f) == pytest.approx(1 / np.sqrt(1 + (10 / f) ** 8), rel=2e-3)


@pytest.mark.parametrize("rate_hz", [1000.0, 5000.0])
def test_response_of_the_high_pass_is_butterworths(rate_hz: float) -> None:
    """|H|² = 1/(1 + (tan(π·10/fs)/tan(πf/fs))⁸): order 4 through the bilinear transform."""
    frequency = np.linspace(0.5, 0.49 * rate_hz, 200)
    warped = np.tan(10 * np.pi / rate_hz) / np.tan(np.pi * frequency / rate_hz)
    found = high_pass_response(frequency, rate_hz=rate_hz)
    assert found == pytest.approx(1 / np.sqrt(1 + warped**8), rel=1e-6)
    assert high_pass_response(np.array([0.0]), rate_hz=rate_hz) == pytest.approx(0, abs=1e-9)


def test_mean_and_drift_are_removed(make_recording: RecordingMaker) -> None:
    noise = 0.01 * np.random.default_rng(0).standard_normal(5000)
    plain = spectrum(make_recording(noise))
    shifted = spectrum(make_recording(noise + 1.0))
    assert shifted.magnitude == pytest.approx(plain.magnitude, abs=1e-9)


@pytest.mark.parametrize("duration_s", [0.5, 1.0, 3.0])
def test_smoothing_is_gaussian_with_sigma_in_hz(duration_s: float) -> None:
    n = round(5000 * duration_s)
    line = flat(0.0, samples=n)
    centre = int(1000 * duration_s)
    line.magnitude[centre] = 1.0
    smoothed = line.smoothed(30.0)
    assert smoothed.sum() == pytest.approx(1.0, rel=1e-6)
    step = 5000 / n
    bell = np.exp(-0.5 * ((line.frequency_hz - 1000) / 30) ** 2) * step / (30 * np.sqrt(2 * np.pi))
    assert smoothed == pytest.approx(bell, abs=bell.max() * 2e-3)
    spread = np.sqrt((smoothed * (line.frequency_hz - 1000) ** 2).sum())
    assert spread == pytest.approx(30.0, rel=0.01)


@settings(deadline=None)
@given(st.lists(st.floats(0, 10), min_size=80, max_size=120), st.floats(1, 20))
def test_smoothing_preserves_the_area_up_to_the_edges(values: list[float], sigma_hz: float) -> None:
    magnitude = np.array(values)
    smoothed = smooth(magnitude, sigma_hz, step_hz=1.0)
    assert smoothed.sum() == pytest.approx(magnitude.sum(), rel=1e-9, abs=1e-12)
    assert smoothed.max() <= magnitude.max() + 1e-12


def test_slow_data_keep_their_own_rate(make_recording: RecordingMaker) -> None:
    noise = np.random.default_rng(3).standard_normal(3000)
    found = spectrum(make_recording(noise, rate_hz=1000.0))
    assert (found.rate_hz, found.n_samples, found.frequency_hz[-1]) == (1000.0, 3000, 500.0)
    assert found.magnitude[60:].mean() == pytest.approx(1.0, rel=0.05)


def test_records_too_short_or_too_slow_are_refused(make_recording: RecordingMaker) -> None:
    noise = np.random.default_rng(0).standard_normal(100)
    with refused(
        InputError, names=["planted", "100 mm/s", "22704 Hz"], expected=[64, "5000 Hz"], got=22
    ):
        spectrum(make_recording(noise, rate_hz=22704.0))
    with refused(InputError, names=["planted", "1 N"], expected="20 Hz", got="15 Hz"):
        spectrum(make_recording(noise, rate_hz=15.0))


def test_floor_is_subtracted_in_power() -> None:
    left = subtract_floor(flat(0.5), flat(0.3))
    assert left.magnitude == pytest.approx(0.4)  # 3-4-5
    assert not subtract_floor(flat(0.3), flat(0.5)).magnitude.any()
    assert subtract_floor(flat(0.5), flat(0.3, samples=2500)).magnitude == pytest.approx(0.4)


def test_floor_subtraction_recovers_the_level_under_noise(make_recording: RecordingMaker) -> None:
    rng = np.random.default_rng(5)
    vibration, sensor, other = rng.standard_normal((3, 50000))
    noisy = spectrum_of_samples(0.4 * vibration + 0.3 * sensor, 5000.0)
    left = subtract_floor(noisy, spectrum_of_samples(0.3 * other, 5000.0))
    assert left.magnitude.mean() == pytest.approx(0.4, rel=0.02)


def test_repeats_are_averaged() -> None:
    average = mean_spectrum([flat(1.0), flat(3.0)])
    assert average.magnitude == pytest.approx(2.0)
    weighted = mean_spectrum([flat(1.0, samples=2500), flat(4.0, samples=5000)])
    assert weighted.magnitude == pytest.approx(3.0)
    assert weighted.n_samples == 5000
    only = flat(1.0)
    assert mean_spectrum([only]) is only
