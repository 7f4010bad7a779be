"""Frequency weighting and daily exposure of hand-transmitted vibration (ISO 5349-1)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import freqz_sos

from tactileq.modeling.arrays import Floats
from tactileq.modeling.vibrators.exposure import (
    STANDARD_GRAVITY_M_S2,
    daily_exposure_m_s2,
    hand_arm_sections,
)
from tactileq.stimuli.planted.vibrators import planted_vibrator

# ISO 5349-1:2001, table A.2: W_h in third octaves.
TABLE_A2 = {
    6.3: 0.727, 8: 0.873, 10: 0.951, 12.5: 0.958, 16: 0.896, 20: 0.782, 25: 0.647, 31.5: 0.519,
    40: 0.411, 50: 0.324, 63: 0.256, 80: 0.202, 100: 0.160, 125: 0.127, 160: 0.101, 200: 0.0799,
    250: 0.0634, 315: 0.0503, 400: 0.0398, 500: 0.0314, 630: 0.0245, 800: 0.0186, 1000: 0.0135,
    1250: 0.00894,
}  # fmt: skip


def response(frequency_hz: Floats, sections: Floats, rate_hz: float) -> Floats:
    """Height of sections in series."""
    ones = np.ones((len(sections), 1))
    sos = np.hstack([sections[:, :3], ones, sections[:, 3:]])
    return np.abs(freqz_sos(sos, worN=frequency_hz, fs=rate_hz)[1])


@pytest.mark.parametrize(
    ("rate_hz", "up_to_hz", "within_db"),
    [(48000, 1300, 0.05), (44100, 1300, 0.05), (5000, 700, 0.5)],
)
def test_the_weighting_is_that_of_the_standard(
    rate_hz: float, up_to_hz: float, within_db: float
) -> None:
    nominal = np.array(list(TABLE_A2))
    exact = 10 ** (np.round(10 * np.log10(nominal)) / 10)  # what the nominal ones stand for
    used = nominal < up_to_hz
    found = response(exact[used], hand_arm_sections(rate_hz), rate_hz)
    off_db = 20 * np.log10(found / np.array(list(TABLE_A2.values()))[used])
    assert np.abs(off_db).max() < within_db


def test_the_resonance_of_a_vibrator_is_put_back() -> None:
    vibrator = replace(planted_vibrator(), frequency_hz=120.0, bandwidth_hz=30.0, height=4.0)
    frequency = np.array([10.0, 120.0, 1000.0])
    with_it = response(frequency, hand_arm_sections(48000, vibrator=vibrator), 48000)
    without = response(frequency, hand_arm_sections(48000), 48000)
    assert with_it / without == pytest.approx([1, 4, 1], rel=0.02)


def test_eight_hours_at_one_metre_per_second_squared_are_an_exposure_of_one() -> None:
    in_g = 1 / STANDARD_GRAVITY_M_S2
    assert daily_exposure_m_s2(in_g**2 * 8 * 3600) == pytest.approx(1)
    # ISO 5349-1, annex: half an hour counts a quarter of the acceleration.
    assert daily_exposure_m_s2(in_g**2 * 1800) == pytest.approx(0.25)
    assert daily_exposure_m_s2(0.0) == 0
