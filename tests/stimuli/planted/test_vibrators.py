"""The simulated vibrator against the closed form of a mass on a spring and a damper."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactileq.modeling import InputError
from tactileq.stimuli.planted.vibrators import SimulatedVibrator
from tests.refusals import refused


def test_it_rolls_off_as_method_9_says() -> None:
    response = np.abs(SimulatedVibrator(80.0, 5.0, 5000.0).response([10.0, 80.0, 2400.0]))
    assert 20 * np.log10(response) == pytest.approx([-36.0, 20 * np.log10(5), 0.0], abs=0.2)


@given(frequency_hz=st.floats(5.0, 100.0), quality=st.floats(0.5, 50.0))
def test_it_is_the_analogue_one_far_below_the_nyquist_frequency(frequency_hz, quality) -> None:
    at = np.append(np.geomspace(1.0, 300.0, 50), frequency_hz)
    s = 1j * at / frequency_hz
    analogue = s**2 / (s**2 + s / quality + 1)
    response = SimulatedVibrator(frequency_hz, quality, 48000.0).response(at)
    # Warping moves frequencies by (πf/fs)²/3 at most.
    assert np.abs(response / analogue - 1).max() < 2e-3 * quality
    assert response[-1] == pytest.approx(1j * quality, rel=1e-6)


def test_a_sensor_reports_the_response_and_its_own_noise() -> None:
    vibrator = SimulatedVibrator(80.0, 5.0, 5000.0)
    click = np.zeros(50000)
    click[0] = 1.0
    moved = vibrator.accelerate(click, rng=np.random.default_rng(0))
    frequency = np.fft.rfftfreq(click.size, 1 / 5000)
    assert np.fft.rfft(moved) == pytest.approx(vibrator.response(frequency), abs=1e-9)
    noisy = vibrator.accelerate(click, sensor_noise=0.3, rng=np.random.default_rng(0))
    again = vibrator.accelerate(click, sensor_noise=0.3, rng=np.random.default_rng(0))
    assert (noisy == again).all()
    assert (noisy - moved).std() == pytest.approx(0.3, rel=0.02)
    assert vibrator.simulated


@pytest.mark.parametrize(
    ("values", "expected", "got"),
    [
        ((2500.0, 5.0, 5000.0), ["resonance", "1…2450 Hz"], 2500),
        ((float("nan"), 5.0, 5000.0), ["resonance", "1…2450 Hz"], "nan"),
        ((80.0, 0.0, 5000.0), ["quality", 0], 0),
        ((80.0, 5.0, -1.0), ["rate", 1, "10000000 Hz"], -1.0),
    ],
)
def test_impossible_vibrators_are_refused(values, expected, got) -> None:
    with refused(InputError, expected=expected, got=got):
        SimulatedVibrator(*values)
