"""Gain in a band, and over placements of the pen."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import t

from tactileq.modeling import InputError
from tactileq.modeling.rendering.limits import Limits
from tactileq.rig.desk.calibration.level import band_gain, level_of
from tactileq.rig.desk.calibration.signals import noise_signal, usual_rms_g
from tests.refusals import refused

RATE_HZ = 8000.0
BAND_HZ = (100.0, 500.0)
DRIVE = noise_signal(2.0, rate_hz=RATE_HZ, rms_g=0.5, band_hz=(10, 2500), seed=1)
NOISE = np.random.default_rng(2).standard_normal(DRIVE.size)


def test_a_gain_is_found_whatever_the_sensor_adds() -> None:
    for noise_g in (0.0, 0.05, 0.2):
        measured = 0.7 * DRIVE + noise_g * NOISE
        found = band_gain(DRIVE, measured, rate_hz=RATE_HZ, band_hz=BAND_HZ)
        assert abs(20 * np.log10(found.gain / 0.7)) < 0.1
    assert 0.8 < found.coherence < 0.98


def test_the_levels_are_those_of_the_band() -> None:
    found = band_gain(DRIVE, 2 * DRIVE, rate_hz=RATE_HZ, band_hz=BAND_HZ)
    in_band = 0.5 * np.sqrt(400 / 2490)
    np.testing.assert_allclose(found.drive_rms, in_band, rtol=0.05)
    np.testing.assert_allclose(found.acceleration_rms, 2 * found.drive_rms, rtol=1e-6)


def test_a_gain_that_varies_counts_by_power() -> None:
    low = noise_signal(2.0, rate_hz=RATE_HZ, rms_g=0.5, band_hz=(100, 300), seed=1)
    high = noise_signal(2.0, rate_hz=RATE_HZ, rms_g=0.5, band_hz=(300, 500), seed=2)
    found = band_gain(low + high, low + 3 * high, rate_hz=RATE_HZ, band_hz=(105, 495))
    np.testing.assert_allclose(found.gain, np.sqrt(5), rtol=0.05)


@pytest.mark.parametrize(
    ("measured", "expected", "got"),
    [
        (0.7 * DRIVE + 2 * NOISE, ["coherence", 0.8, "100 to 500 Hz"], 0.05),
        (np.clip(5 * DRIVE, -1, 1), ["1%", "clipped"], "68.2%"),
        (np.zeros(DRIVE.size), "accelerometer", ["constant", 0]),
        (DRIVE[:100], ["length", "0.45 s"], [2, "0.013 s"]),
    ],
)
def test_a_poor_record_is_refused(measured: np.ndarray, expected: object, got: object) -> None:
    with refused(InputError, expected=expected, got=got):
        band_gain(DRIVE, measured, rate_hz=RATE_HZ, band_hz=BAND_HZ)


@pytest.mark.parametrize("band_hz", [(0.0, 500.0), (500.0, 100.0), (100.0, 5000.0)])
def test_a_band_that_is_none_is_refused(band_hz: tuple[float, float]) -> None:
    with refused(
        InputError, expected=["band", "0…4000 Hz"], got=f"{band_hz[0]:g} to {band_hz[1]:g} Hz"
    ):
        band_gain(DRIVE, DRIVE, rate_hz=RATE_HZ, band_hz=band_hz)


def test_placements_give_a_geometric_mean_with_its_interval() -> None:
    level = level_of([1.0, 2.0, 4.0])
    np.testing.assert_allclose(level.gain, 2.0)
    np.testing.assert_allclose(level.spread_db, 20 * np.log10(2))
    half = t.ppf(0.975, 2) * np.log(2) / np.sqrt(3)
    np.testing.assert_allclose([level.low, level.high], 2 * np.exp([-half, half]))


def test_the_interval_holds_the_truth_as_often_as_it_says() -> None:
    rng = np.random.default_rng(6)
    levels = [level_of(np.exp(0.2 * rng.standard_normal(5)).tolist()) for _ in range(1000)]
    held = np.mean([level.low <= 1 <= level.high for level in levels])
    assert 0.93 < held < 0.97


def test_two_placements_are_too_few() -> None:
    with refused(InputError, expected="3 placements", got=2):
        level_of([1.0, 1.1])


def test_noise_has_its_level_its_band_and_soft_ends() -> None:
    middle = DRIVE[800:-800]
    np.testing.assert_allclose(middle.std(), 0.5, rtol=0.03)
    assert np.abs(DRIVE).max() <= 2.5
    assert abs(DRIVE[0]) < 0.01
    assert abs(DRIVE[-1]) < 0.01
    power = np.abs(np.fft.rfft(DRIVE)) ** 2
    frequency = np.fft.rfftfreq(DRIVE.size, 1 / RATE_HZ)
    assert power[(frequency > 2600) | (frequency < 5)].sum() < 1e-3 * power.sum()


def test_the_usual_level_is_half_of_what_the_limits_allow() -> None:
    assert usual_rms_g(Limits(peak=3.0, rms=1.0)) == 0.3
    assert usual_rms_g(Limits(peak=20.0, rms=1.0)) == 0.5
