"""Sinusoids against ones that were put in, and against noise that holds none."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactileq.modeling.recordings.sinusoids import (
    common_hum,
    find_sinusoids,
    mains_harmonics,
    sinusoids_near,
)

RATE_HZ = 5000.0


def noise(n: int, seed: int) -> np.ndarray:
    """Noise that falls by 6 dB per octave above 100 Hz, RMS about 1."""
    rng = np.random.default_rng(seed)
    spectrum = np.fft.rfft(rng.standard_normal(n))
    frequency = np.fft.rfftfreq(n, 1 / RATE_HZ)
    shaped = np.fft.irfft(spectrum / np.maximum(frequency / 100, 1.0), n)
    return np.asarray(shaped / shaped.std())


def tone(n: int, frequency_hz: float, amplitude: float, phase: float = 0.7) -> np.ndarray:
    return np.asarray(amplitude * np.cos(2 * np.pi * frequency_hz * np.arange(n) / RATE_HZ + phase))


@settings(deadline=None, max_examples=40)
@given(
    st.floats(30, 2000),
    st.floats(2.5, 5.0),
    st.floats(-np.pi, np.pi),
    st.integers(0, 1000),
)
def test_a_tone_in_noise_is_found(
    frequency: float, amplitude: float, phase: float, seed: int
) -> None:
    """Its frequency to a fifth of a line, its amplitude to what the noise beside it allows."""
    x = noise(5000, seed) + tone(5000, frequency, amplitude, phase)
    found = find_sinusoids(x, RATE_HZ, lowest_hz=10.0)
    near = np.abs(found.frequency_hz - frequency) < 0.2
    assert near.sum() == 1
    # Beside 100 Hz, where this noise is strongest, one line has an RMS of about 0.1.
    assert found.amplitude[near][0] == pytest.approx(amplitude, abs=0.25 + 0.03 * amplitude)
    rest = x - found.samples(5000, RATE_HZ)
    assert np.std(rest) < 1.1 * np.std(x - tone(5000, frequency, amplitude, phase))


def test_a_weaker_tone_is_missed_in_a_few_records() -> None:
    """15 times the RMS of a line of the noise, at its lowest frequency: p is about 1e-6."""
    found = 0
    for seed in range(60):
        x = noise(5000, seed) + tone(5000, 30.0, 1.5)
        at = find_sinusoids(x, RATE_HZ, lowest_hz=10.0).frequency_hz
        found += int((np.abs(at - 30.0) < 0.2).sum() == 1)
    assert found >= 50


def test_without_noise_it_is_exact() -> None:
    x = tone(5000, 441.3, 2.0) + 1e-9 * noise(5000, 0)
    found = find_sinusoids(x, RATE_HZ, lowest_hz=10.0)
    loudest = int(np.argmax(found.amplitude))
    assert found.frequency_hz[loudest] == pytest.approx(441.3, abs=0.02)
    assert found.amplitude[loudest] == pytest.approx(2.0, rel=0.01)


def test_noise_holds_none() -> None:
    """200 records of a second: with p below 1e-6 for each candidate, not one should be found."""
    found = [
        find_sinusoids(noise(5000, seed), RATE_HZ, lowest_hz=10.0).frequency_hz.size
        for seed in range(200)
    ]
    assert sum(found) == 0


@pytest.mark.parametrize("width_hz", [3.0, 10.0, 40.0])
def test_a_narrow_band_of_noise_is_no_tone(width_hz: float) -> None:
    """Over two lines wide, its phase wanders within the record."""
    rng = np.random.default_rng(1)
    frequency = np.fft.rfftfreq(20_000, 1 / RATE_HZ)
    band = 1 / (1 + 1j * (frequency - 300) / (width_hz / 2))
    found = 0
    for seed in range(40):
        longer = np.fft.irfft(np.fft.rfft(rng.standard_normal(20_000)) * band)
        x = longer[:5000] / longer.std() + 0.05 * noise(5000, seed)
        found += find_sinusoids(x, RATE_HZ, lowest_hz=10.0).frequency_hz.size
    assert found <= 1


def test_what_is_below_the_lowest_is_not_looked_for() -> None:
    x = noise(5000, 3) + tone(5000, 20.0, 3.0)
    assert find_sinusoids(x, RATE_HZ, lowest_hz=30.0).frequency_hz.size == 0


def test_silence_holds_none() -> None:
    assert find_sinusoids(np.zeros(5000), RATE_HZ, lowest_hz=10.0).frequency_hz.size == 0
    assert mains_harmonics(np.zeros(5000), RATE_HZ, 50.0).frequency_hz.size == 0


# --- hum


def humming(seed: int, *, mains_hz: float, off: float = 0.0) -> np.ndarray:
    """Hum a little off its nominal frequency, its third harmonic, and noise."""
    lines = (tone(5000, k * mains_hz * (1 + off), a, k * seed) for k, a in ((1, 2.0), (3, 0.8)))
    return noise(5000, seed) + sum(lines)


@pytest.mark.parametrize("mains_hz", [50.0, 60.0])
@pytest.mark.parametrize("off", [-1e-3, 0.0, 1e-3])
def test_hum_of_every_record_is_found_and_named(mains_hz: float, off: float) -> None:
    records = [humming(seed, mains_hz=mains_hz, off=off) for seed in range(12)]
    lines = common_hum(records, RATE_HZ, speeds_mm_s=4 * [50.0, 100.0, 200.0])
    holding = sum(len(found) == 2 for found in lines)
    assert holding >= 10
    for found in lines:
        numbers = np.rint(np.array(found) / mains_hz)
        assert set(numbers) <= {1, 3}
        assert np.array(found) == pytest.approx(numbers * mains_hz * (1 + off), abs=0.3)


def test_textures_without_hum_keep_everything() -> None:
    for seed in range(20):
        records = [noise(5000, 100 * seed + n) for n in range(10)]
        assert common_hum(records, RATE_HZ, speeds_mm_s=range(10)) == [()] * 10


def test_a_grating_that_passes_the_mains_frequency_is_no_hum() -> None:
    """Its line moves with speed: at 50 Hz in one record of seven only."""
    records = [noise(5000, n) + tone(5000, 25.0 * (n + 1), 1.5) for n in range(7)]
    assert not any(common_hum(records, RATE_HZ, speeds_mm_s=range(7)))


@pytest.mark.parametrize("speeds", [[100.0], [100.0, 200.0]])
def test_a_grating_at_a_harmonic_of_the_mains_is_no_hum(speeds: list[float]) -> None:
    """A millimetre long, three records at each speed: 100 Hz, and 200 Hz."""
    each = [speed for speed in speeds for _ in range(3)]
    records = [noise(5000, n) + tone(5000, speed, 1.5) for n, speed in enumerate(each)]
    assert not any(common_hum(records, RATE_HZ, speeds_mm_s=each))


def test_at_one_speed_a_record_without_contact_tells_hum() -> None:
    records = [humming(seed, mains_hz=50.0) for seed in range(4)]
    assert not any(common_hum(records, RATE_HZ, speeds_mm_s=[100.0] * 4))
    lines = common_hum(records, RATE_HZ, speeds_mm_s=[100.0] * 3 + [0.0])
    assert all(min(found) == pytest.approx(50.0, abs=0.2) for found in lines)


def test_harmonics_of_both_mains_belong_to_the_one_with_more() -> None:
    """300 Hz is six times 50 Hz, too."""
    records = [
        noise(5000, seed) + sum(tone(5000, f, 2.0, seed) for f in (60.0, 180.0, 300.0))
        for seed in range(6)
    ]
    for found in common_hum(records, RATE_HZ, speeds_mm_s=range(6)):
        assert min(found) == pytest.approx(60.0, abs=0.2)
        assert set(np.rint(np.array(found) / 60)) <= {1, 3, 5}


def test_hum_that_is_taken_out_leaves_the_noise() -> None:
    clean = noise(5000, 5)
    x = clean + tone(5000, 50.03, 5.0)
    taken = sinusoids_near(x, RATE_HZ, np.array([50.0])).samples(5000, RATE_HZ)
    line = slice(45, 56)
    before, left, noise_alone = (
        np.sum(np.abs(np.fft.rfft(s)[line]) ** 2) for s in (x, x - taken, clean)
    )
    assert before > 50 * noise_alone
    assert left < 1.2 * noise_alone
    away = np.r_[10:40, 60:500]
    off = np.abs(np.fft.rfft(x - taken - clean)[away]).max()
    assert off < 0.1 * np.abs(np.fft.rfft(clean)[away]).mean()
