"""The accelerometer at rest: level, spectrum and hum as planted."""

from __future__ import annotations

import numpy as np
import pytest

from tactileq.modeling import InputError
from tactileq.rig.desk.calibration.floor import no_contact_floor
from tactileq.rig.devices.simulated.vibrator import SimulatedAccelerometer, SimulatedTransducers
from tests.refusals import refused

RATE_HZ = 8000.0


def at_rest(duration_s: float = 5.0, **values: float) -> np.ndarray:
    vibrator = SimulatedTransducers(**values)  # type: ignore[arg-type]
    accelerometer = SimulatedAccelerometer(vibrator, rate_hz=RATE_HZ)
    return 10.0 * accelerometer.give(np.zeros(round(duration_s * RATE_HZ)))


def test_white_noise_has_its_level_and_a_flat_spectrum() -> None:
    floor = no_contact_floor(at_rest(noise_g=0.02) + 0.3, rate_hz=RATE_HZ)
    density = 0.02**2 / (RATE_HZ / 2)
    np.testing.assert_allclose(floor.rms_g, np.sqrt(990 * density), rtol=0.03)
    widths = floor.band_hz * (2 ** (1 / 6) - 2 ** (-1 / 6))
    np.testing.assert_allclose(floor.band_rms_g, np.sqrt(density * widths), rtol=0.3)
    np.testing.assert_allclose(floor.band_rms_g[-4:], np.sqrt(density * widths[-4:]), rtol=0.06)
    assert floor.mains_hz is None
    assert floor.hum_rms_g == 0


@pytest.mark.parametrize("mains_hz", [50.0, 60.0])
def test_hum_of_the_mains_is_noticed(mains_hz: float) -> None:
    floor = no_contact_floor(at_rest(hum_g=0.01, hum_hz=mains_hz), rate_hz=RATE_HZ)
    assert floor.mains_hz == mains_hz
    np.testing.assert_allclose(floor.hum.frequency_hz, [mains_hz], atol=0.05)
    np.testing.assert_allclose(floor.hum_rms_g, 0.01 / np.sqrt(2), rtol=0.05)


@pytest.mark.parametrize(
    ("samples", "expected", "got"),
    [
        (np.zeros(40_000), "accelerometer", ["constant", 0]),
        (at_rest(1.0), ["accelerometer", "2 s"], "1 s"),
        (np.clip(at_rest(noise_g=20.0), -10, 10), ["1%", "clipped"], "62.1%"),
    ],
)
def test_what_is_no_floor_is_refused(samples: np.ndarray, expected: object, got: object) -> None:
    with refused(InputError, expected=expected, got=got):
        no_contact_floor(samples, rate_hz=RATE_HZ)
