"""Sensation level against closed forms: sinusoids at threshold, sums of powers, unknown parts."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactileq.modeling import InputError, Threshold
from tactileq.modeling.perception.sensation_level import sensation_level
from tests.refusals import refused

FLAT = Threshold("flat", [10.0, 400.0], [0.01, 0.01], "planted", "none")
RATE_HZ = 5000.0
TIME_S = np.arange(5000) / RATE_HZ


def sine(frequency_hz: float, peak_g: float) -> np.ndarray:
    return peak_g * np.sin(2 * np.pi * frequency_hz * TIME_S)


@pytest.mark.parametrize("name", ["codec", "pen-hold"])
@pytest.mark.parametrize("frequency_hz", [20.0, 100.0, 250.0])
def test_a_sinusoid_at_threshold_has_0_db(name: str, frequency_hz: float) -> None:
    threshold = Threshold.shipped(name)
    at_threshold = sine(frequency_hz, float(threshold.at(frequency_hz)))
    found = sensation_level(at_threshold, RATE_HZ, threshold=threshold)
    assert found.level_db == pytest.approx(0.0, abs=1e-9)
    assert found.share_without_threshold == pytest.approx(0.0, abs=1e-12)


@given(gain_db=st.floats(-60, 60))
def test_gain_adds_in_db(gain_db: float) -> None:
    louder = sensation_level(sine(100, 0.01 * 10 ** (gain_db / 20)), RATE_HZ, threshold=FLAT)
    assert louder.level_db == pytest.approx(gain_db, abs=1e-9)


def test_powers_add() -> None:
    """Three sinusoids 1 dB below threshold are 3.8 dB above it.

    docs/method/perception.md#simplification
    """
    three = sum(sine(f, 0.01 * 10 ** (-1 / 20)) for f in (40.0, 120.0, 350.0))
    found = sensation_level(np.asarray(three), RATE_HZ, threshold=FLAT)
    assert found.level_db == pytest.approx(10 * np.log10(3) - 1, abs=1e-9)


def test_what_lies_outside_the_table_is_left_out_and_told() -> None:
    within, beyond = sine(100, 0.02), sine(1000, 0.06)
    found = sensation_level(within + beyond, RATE_HZ, threshold=FLAT)
    assert found.level_db == pytest.approx(20 * np.log10(2), abs=1e-9)
    assert found.share_without_threshold == pytest.approx(0.9, abs=1e-12)


def test_odd_lengths_count_every_line_once() -> None:
    """White noise under a flat threshold up to Nyquist: Parseval."""
    everywhere = Threshold("flat", [1e-6, 2500.0], [0.01, 0.01], "planted", "none")
    for n in (999, 1000):
        noise = np.random.default_rng(n).normal(0, 0.1, n)
        noise -= noise.mean()
        found = sensation_level(noise, RATE_HZ, threshold=everywhere)
        expected = 20 * np.log10(np.sqrt(2 * np.mean(noise**2)) / 0.01)
        assert found.level_db == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("vibration", [np.zeros(500), sine(1000, 0.1)[:1]])
def test_nothing_to_weigh_is_refused(vibration: np.ndarray) -> None:
    with refused(InputError, expected=["10 and 400 Hz", "flat"], got="none"):
        sensation_level(vibration, RATE_HZ, threshold=FLAT)
