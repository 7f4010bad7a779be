"""Levels of moving filters against closed forms and the frozen filters' responses."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactileq.benches.rendering.coefficients import PoleZeroFilter, SecondOrderBands
from tactileq.benches.rendering.levels import (
    System,
    level_at_rest,
    levels_in_motion,
    louder_by,
    systems_of_layers,
)
from tactileq.modeling import PEQ
from tactileq.modeling.models.parameter_table import Parameters

RATE_HZ = 5000.0
FREQUENCY_HZ = np.linspace(0, RATE_HZ / 2, 50001)


def one_pole(pole: float) -> System:
    """y[n] = pole·y[n−1] + w[n]."""
    return System(np.array([[pole]]), np.array([1.0]), np.array([pole]), 1.0)


@given(st.floats(-0.99, 0.99))
def test_a_single_pole_rises_as_a_geometric_series(pole: float) -> None:
    """The variance is Σ pole²ᵏ."""
    found = levels_in_motion([one_pole(pole)], samples=20)
    expected = np.sqrt(np.cumsum(pole ** (2 * np.arange(20))))
    assert found == pytest.approx(expected)
    assert level_at_rest(one_pole(pole)) == pytest.approx(1 / np.sqrt(1 - pole**2))


def test_a_silent_filter_is_louder_by_nothing() -> None:
    silent = System(np.array([[0.5]]), np.array([0.0]), np.array([0.0]), 0.0)
    assert louder_by(0.1, silent) == 1.0
    assert louder_by(4.0, System(*silent[:3], 2.0)) == pytest.approx(2.0)


def test_what_the_filter_before_has_left_dies_with_the_new_pole() -> None:
    """From pole a to b: variance v ← b²·v + 1, from 1/(1 − a²) on."""
    found = levels_in_motion([one_pole(0.9), one_pole(0.5)], samples=400) ** 2
    variance = [1 / (1 - 0.81)]
    for _ in range(5):
        variance.append(0.25 * variance[-1] + 1)
    assert found[399:405] == pytest.approx(variance)


PEQ_OF_TWO = PEQ(
    noise_gain=0.3,
    frequencies_hz=[120.0, 900.0],
    bandwidths_hz=[20.0, 250.0],
    gains=[1.5, -0.7],
    rate_hz=RATE_HZ,
)


def rms_of(response: np.ndarray) -> float:
    return float(np.sqrt(np.mean(response[:-1] ** 2 + response[1:] ** 2) / 2))


def held(samples: int) -> Parameters:
    rows = (PEQ_OF_TWO.frequencies_hz, PEQ_OF_TWO.bandwidths_hz, PEQ_OF_TWO.gains)
    every = (np.tile(row, (samples, 1)) for row in rows)
    return Parameters(np.full(samples, PEQ_OF_TWO.noise_gain), *every)


def bands() -> SecondOrderBands:
    k = np.tan(np.pi * PEQ_OF_TWO.bandwidths_hz / RATE_HZ)
    return SecondOrderBands(
        noise_gain=PEQ_OF_TWO.noise_gain,
        first=-2 * np.cos(2 * np.pi * PEQ_OF_TWO.frequencies_hz / RATE_HZ) / (1 + k),
        second=(1 - k) / (1 + k),
        gains=PEQ_OF_TWO.gains * k / (1 + k),
        rate_hz=RATE_HZ,
    )


def test_every_form_of_the_equalizer_has_its_level() -> None:
    expected = rms_of(PEQ_OF_TWO.response(FREQUENCY_HZ))
    for system in (systems_of_layers(held(1), rate_hz=RATE_HZ)[0], bands().system):
        assert level_at_rest(system) == pytest.approx(expected, rel=1e-6)
        assert levels_in_motion([system], samples=3000)[-1] == pytest.approx(expected, rel=1e-6)
    assert rms_of(bands().response(FREQUENCY_HZ)) == pytest.approx(expected, rel=1e-9)


def test_poles_and_zeros_have_the_level_of_their_response() -> None:
    one = PoleZeroFilter(
        poles=np.array([-1.6, 0.8]), zeros=np.array([0.5, -0.2, 0.1]), gain=0.3, rate_hz=RATE_HZ
    )
    expected = rms_of(one.response(FREQUENCY_HZ))
    assert level_at_rest(one.system) == pytest.approx(expected, rel=1e-6)
    assert level_at_rest(one.times(2.0).system) == pytest.approx(2 * expected, rel=1e-6)


@given(st.floats(30.0, 2000.0), st.floats(30.0, 2000.0))
def test_the_kernel_keeps_its_level_when_a_frequency_jumps(low: float, high: float) -> None:
    """Unit covariance: turning a state does not change it. A band of 20 Hz without noise branch."""
    course = Parameters(
        np.zeros(1600),
        np.repeat([low, high], 800)[:, None],
        np.full((1600, 1), 20.0),
        np.ones((1600, 1)),
    )
    kernel = levels_in_motion(systems_of_layers(course, rate_hz=RATE_HZ), samples=1)
    assert kernel[799:] == pytest.approx(kernel[799], rel=0.02)
