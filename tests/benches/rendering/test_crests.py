"""Crest factors: of known signals, and of the largest of n Gaussian samples."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import erfinv

from tactileq.benches.rendering.crests import RATE_HZ, crest_db, crest_difference_db, through_band
from tactileq.modeling.equalizer.bands import band_rms

STREAMS = 20
WIDTHS_HZ = (10.0, 30.0, 100.0, 300.0)


def expected_gaussian_db(count: int) -> float:
    """Mean crest of `count` independent samples: the quantiles of their largest, evenly drawn."""
    quantiles = (np.arange(2000) + 0.5) / 2000
    largest = np.sqrt(2) * erfinv(quantiles ** (1 / count))
    return float(np.mean(20 * np.log10(largest)))


def test_crests_of_known_signals() -> None:
    phase = 2 * np.pi * np.arange(1000) / 1000
    signals = np.stack([np.sin(phase), np.sign(np.sin(phase + 1e-3)), np.eye(1000)[0]])
    assert crest_db(signals) == pytest.approx([3.0103, 0, 30], abs=1e-3)


@pytest.mark.parametrize("width_hz", WIDTHS_HZ)
def test_band_has_its_variance(width_hz: float) -> None:
    """docs/method/equalizer.md#band-variance; an impulse in a period that it dies away in."""
    impulse = np.zeros(5000)
    impulse[0] = 1.0
    energy = np.sum(through_band(impulse, width_hz=width_hz) ** 2)
    assert energy == pytest.approx(band_rms(1.0, width_hz, rate_hz=RATE_HZ) ** 2, rel=1e-6)


@pytest.mark.parametrize("duration_s", [1.0, 10.0])
def test_crest_of_the_noise_branch(duration_s: float) -> None:
    """4.8 dB whatever the duration; of Gaussian noise that of the largest of so many samples."""
    below_db = crest_difference_db(np.nan, duration_s=duration_s, streams=STREAMS, seed=1)
    expected = expected_gaussian_db(round(duration_s * RATE_HZ))
    assert expected == pytest.approx({1.0: 11.7, 10.0: 12.8}[duration_s], abs=0.05)
    uniform = 20 * np.log10(np.sqrt(3))
    assert below_db == pytest.approx(expected - uniform, abs=4 * 0.65 / np.sqrt(STREAMS))


def test_the_wider_a_layer_the_lower_its_crest_from_uniform_noise() -> None:
    """Equal where it is narrow, 1 dB or so lower at 300 Hz; the standard error is 0.2 dB."""
    below = {
        width_hz: crest_difference_db(width_hz, duration_s=1.0, streams=STREAMS, seed=1)
        for width_hz in WIDTHS_HZ
    }
    assert abs(below[10.0]) < 0.8
    assert abs(below[30.0]) < 0.8
    assert -0.4 < below[100.0] < 1.2
    assert 0.5 < below[300.0] < 2.0
