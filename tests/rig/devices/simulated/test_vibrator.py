"""The simulated vibrator: its response, noise, clipping and delay are what was planted."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tactileq.modeling import InputError, identify_vibrator
from tactileq.rig.devices.simulated.vibrator import SimulatedAccelerometer, SimulatedTransducers
from tests.refusals import refused

RATE_HZ = 8000.0


def quiet(**values: float) -> SimulatedTransducers:
    return SimulatedTransducers(noise_g=0.0, **values)  # type: ignore[arg-type]


def test_an_impulse_has_the_stated_response() -> None:
    vibrator = quiet(sensor_fullscale_g=100.0)
    impulse = np.zeros(8000)
    impulse[0] = 1.0
    measured = 100.0 * SimulatedAccelerometer(vibrator, rate_hz=RATE_HZ).give(impulse)
    frequency = np.fft.rfftfreq(impulse.size, 1 / RATE_HZ)
    response = vibrator.response(frequency, rate_hz=RATE_HZ)
    np.testing.assert_allclose(np.fft.rfft(measured), response, atol=1e-9)
    peak = np.abs(response[frequency == vibrator.frequency_hz])
    np.testing.assert_allclose(peak, vibrator.g_per_fullscale * vibrator.height)


@pytest.mark.parametrize("block", [1, 7, 128])
def test_blocks_of_any_size_give_one_signal(block: int) -> None:
    vibrator = SimulatedTransducers(delay_s=0.01, hum_g=0.02)
    played = np.random.default_rng(1).standard_normal(1000) * 0.1
    whole = SimulatedAccelerometer(vibrator, rate_hz=RATE_HZ).give(played)
    split = SimulatedAccelerometer(vibrator, rate_hz=RATE_HZ)
    parts = [split.give(played[at : at + block]) for at in range(0, played.size, block)]
    np.testing.assert_array_equal(np.concatenate(parts), whole)


def test_delay_clipping_and_noise_are_as_planted() -> None:
    played = np.ones(2000)
    delayed = SimulatedAccelerometer(quiet(delay_s=0.05), rate_hz=RATE_HZ).give(played)
    assert np.flatnonzero(delayed)[0] == 400
    clipped = SimulatedAccelerometer(quiet(sensor_fullscale_g=1.0), rate_hz=RATE_HZ).give(played)
    assert clipped.max() == 1.0
    noise = SimulatedAccelerometer(SimulatedTransducers(noise_g=0.2), rate_hz=RATE_HZ)
    rest = 10.0 * noise.give(np.zeros(40_000))
    np.testing.assert_allclose(rest.std(), 0.2, rtol=0.02)


def test_it_is_identified_as_what_it_is() -> None:
    vibrator = SimulatedTransducers(frequency_hz=150.0, bandwidth_hz=40.0, height=3.0)
    drive = 0.1 * np.random.default_rng(2).standard_normal(10 * 8000)
    measured = SimulatedAccelerometer(vibrator, rate_hz=RATE_HZ).give(drive)
    found = identify_vibrator(drive, 10.0 * measured, rate_hz=RATE_HZ, simulated=True)
    np.testing.assert_allclose(found.frequency_hz, 150.0, rtol=0.01)
    np.testing.assert_allclose(found.bandwidth_hz, 40.0, rtol=0.05)
    np.testing.assert_allclose(found.height, 3.0, rtol=0.03)
    np.testing.assert_allclose(found.flat_gain, 5.0, rtol=0.02)


def test_a_file_says_what_it_is(tmp_path: Path) -> None:
    file = tmp_path / "vibrator.toml"
    file.write_text("frequency_hz = 90.0\nhum_g = 0.01\n")
    assert SimulatedTransducers.load(file) == SimulatedTransducers(frequency_hz=90.0, hum_g=0.01)
    file.write_text("frequency = 90.0\n")
    with pytest.raises(InputError, match="expected only frequency_hz, .*, got frequency"):
        SimulatedTransducers.load(file)


@pytest.mark.parametrize(
    ("values", "expected", "got"),
    [
        ({"height": 1.0}, "R > 1", "R = 1"),
        ({"height": [2.0]}, ["height", 1, 1000], "[2.0]"),
        ({"frequency_hz": float("nan")}, ["frequency_hz", 1, 100000], "nan"),
        ({"noise_g": -1.0}, ["noise_g", 0, 100], -1.0),
        ({"delay_s": 2.0}, ["delay_s", 0, 1], 2.0),
        ({"hum_hz": "50"}, ["hum_hz", 1, 1000], "'50'"),
        ({"seed": 0.5}, ["seed", 0], 0.5),
    ],
)
def test_values_out_of_range_are_refused(
    values: dict[str, Any], expected: object, got: object
) -> None:
    with refused(InputError, expected=expected, got=got):
        SimulatedTransducers(**values)


def test_a_resonance_beyond_the_rate_is_refused() -> None:
    with refused(InputError, expected=["frequency", "1…3920 Hz", "8000 Hz"], got=5000):
        SimulatedAccelerometer(SimulatedTransducers(frequency_hz=5000.0), rate_hz=8000.0)
