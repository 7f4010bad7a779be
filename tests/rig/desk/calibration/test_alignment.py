"""A played noise is found in a recording: delay and drift as planted."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from tactileq.modeling import InputError
from tactileq.modeling.arrays import Floats
from tactileq.rig.desk.calibration.alignment import aligned
from tactileq.rig.desk.calibration.signals import noise_signal
from tactileq.rig.devices.simulated.vibrator import SimulatedAccelerometer, SimulatedTransducers
from tests.refusals import refused

RATE_HZ = 12_000.0


def noise(duration_s: float = 3.0) -> Floats:
    return noise_signal(duration_s, rate_hz=RATE_HZ, rms_g=0.5, band_hz=(10, 2500), seed=3)


def recorded(played: Floats, *, delay: float, drift: float = 0.0, noise: float = 0.05) -> Floats:
    """What a sensor records whose clock is faster by `drift`; the delay is in samples."""
    positions = (np.arange(played.size + 3000) - delay) / (1 + drift)
    heard = CubicSpline(np.arange(played.size), played, extrapolate=False)(positions)
    return np.nan_to_num(heard) + noise * np.random.default_rng(4).standard_normal(positions.size)


@pytest.mark.parametrize(("delay", "drift"), [(0.0, 0.0), (700.25, 0.0), (1234.0, 1e-4)])
def test_delay_and_drift_are_found(delay: float, drift: float) -> None:
    played = noise()
    pair = aligned(
        played, recorded(played, delay=delay, drift=drift), played_rate_hz=RATE_HZ, rate_hz=RATE_HZ
    )
    assert abs(pair.delay_s * RATE_HZ - delay) < 0.1
    assert abs(pair.drift - drift) < 3e-6
    apart = pair.recorded - pair.played
    np.testing.assert_allclose(apart.std(), 0.05, rtol=0.05)  # nothing but the sensor's noise


def test_drift_left_in_would_cost_coherence() -> None:
    played = noise()
    record = recorded(played, delay=500, drift=2e-4)
    pair = aligned(played, record, played_rate_hz=RATE_HZ, rate_hz=RATE_HZ)
    shifted = record[500 : 500 + played.size]
    assert np.corrcoef(pair.played, pair.recorded)[0, 1] > 0.99
    assert np.corrcoef(played, shifted)[0, 1] < 0.8


def test_a_card_of_another_rate_is_followed() -> None:
    played = noise()
    faster = noise_signal(3.0, rate_hz=2 * RATE_HZ, rms_g=0.5, band_hz=(10, 2500), seed=3)
    pair = aligned(
        faster, recorded(faster[::2], delay=600), played_rate_hz=2 * RATE_HZ, rate_hz=RATE_HZ
    )
    assert abs(pair.delay_s - 0.05) < 1e-4
    assert pair.played.size == pair.recorded.size <= played.size


def test_a_resonance_moves_it_by_less_than_half_a_millisecond() -> None:
    played = noise()
    accelerometer = SimulatedAccelerometer(SimulatedTransducers(delay_s=0.02), rate_hz=RATE_HZ)
    record = accelerometer.give(np.append(played, np.zeros(3000)))
    pair = aligned(played, record, played_rate_hz=RATE_HZ, rate_hz=RATE_HZ)
    assert abs(pair.delay_s - 0.02) < 5e-4


def test_a_recording_without_it_is_refused() -> None:
    rest = np.random.default_rng(5).standard_normal(40_000)
    with refused(InputError, expected="accelerometer", got="[accelerometer]"):
        aligned(noise(), rest, played_rate_hz=RATE_HZ, rate_hz=RATE_HZ)
    with refused(InputError, expected="accelerometer", got="[accelerometer]"):
        aligned(noise(), np.zeros(40_000), played_rate_hz=RATE_HZ, rate_hz=RATE_HZ)


def test_a_recording_too_short_is_refused() -> None:
    with refused(InputError, expected="0.2 s", got=["0.417 s", "3 s"]):
        aligned(noise(), noise()[:5000], played_rate_hz=RATE_HZ, rate_hz=RATE_HZ)


def test_another_rate_than_stated_is_refused() -> None:
    played = noise()
    record = recorded(played, delay=500, drift=4e-3)
    with refused(InputError, names="accelerometer"):
        aligned(played, record, played_rate_hz=RATE_HZ, rate_hz=RATE_HZ)
