"""Line spectral frequencies: a published example, closed forms, round trips, stable blends."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactileq.modeling import InputError
from tactileq.modeling.models.line_spectral import (
    check_line_spectral,
    line_spectral_frequencies,
    prediction_coefficients,
    reflection_coefficients,
)
from tests.refusals import refused

reflections = st.lists(st.floats(-0.9, 0.9), min_size=1, max_size=24)


def step_up(reflection: list[float]) -> np.ndarray:
    """Coefficients of the stable filter with these reflection coefficients (Levinson)."""
    a = np.ones(1)
    for k in reflection:
        longer = np.append(a, 0.0)
        a = longer + k * longer[::-1]
    return a[1:]


def rising(draw: np.ndarray) -> np.ndarray:
    """Frequencies with gaps in proportion to `draw` > 0."""
    return np.pi * np.cumsum(draw)[:-1] / np.sum(draw)


def test_published_example() -> None:
    """MATLAB's reference pages of poly2lsf and lsf2poly (Signal Processing Toolbox)."""
    coefficients = [0.6149, 0.9899, 0.0000, 0.0031, -0.0082]
    frequencies = [0.7842, 1.5605, 1.8776, 1.8984, 2.3593]
    assert line_spectral_frequencies(coefficients) == pytest.approx(frequencies, abs=5.1e-5)
    assert prediction_coefficients(frequencies) == pytest.approx(
        [0.6148, 0.9899, 0.0001, 0.0031, -0.0081], abs=5.1e-5
    )


@pytest.mark.parametrize("p", [1, 2, 5, 6, 20, 39, 40])
def test_white_spectrum_has_evenly_spaced_frequencies(p: int) -> None:
    expected = np.pi * np.arange(1, p + 1) / (p + 1)
    assert line_spectral_frequencies(np.zeros(p)) == pytest.approx(expected, abs=1e-13)
    assert prediction_coefficients(expected) == pytest.approx(np.zeros(p), abs=1e-13)


@given(st.floats(-0.999, 0.999))
def test_first_order_in_closed_form(a: float) -> None:
    """P = 1 + 2a... : (1 + a)(1 + z⁻¹)... has its only free root at cos ω = −a."""
    assert line_spectral_frequencies([a])[0] == pytest.approx(np.arccos(-a), abs=1e-12)


@given(st.floats(0.05, 0.999), st.floats(0.01, np.pi - 0.01))
def test_second_order_in_closed_form(radius: float, angle: float) -> None:
    """Quadratic P/(1+z⁻¹) and Q/(1−z⁻¹): cos ω = (1 − a₁ − a₂)/2 and −(1 + a₁ − a₂)/2."""
    a1, a2 = -2 * radius * np.cos(angle), radius**2
    expected = np.arccos([(1 - a1 - a2) / 2, -(1 + a1 - a2) / 2])
    assert line_spectral_frequencies([a1, a2]) == pytest.approx(expected, abs=1e-9)


@given(reflections)
def test_coefficients_to_frequencies_and_back(reflection: list[float]) -> None:
    coefficients = step_up(reflection)
    frequencies = line_spectral_frequencies(coefficients)
    assert frequencies.shape == coefficients.shape
    check_line_spectral(frequencies, "the filter")
    back = prediction_coefficients(frequencies)
    assert back == pytest.approx(coefficients, abs=1e-9 * max(1, np.abs(coefficients).max()))


@given(st.lists(st.floats(0.2, 5.0), min_size=2, max_size=41))
def test_frequencies_to_coefficients_and_back(gaps: list[float]) -> None:
    frequencies = rising(np.array(gaps))
    coefficients = prediction_coefficients(frequencies)
    assert line_spectral_frequencies(coefficients) == pytest.approx(frequencies, abs=1e-7)


@given(
    st.lists(st.floats(0.5, 2.0), min_size=16, max_size=16),
    st.lists(st.floats(0.5, 2.0), min_size=16, max_size=16),
    st.floats(0, 1),
)
def test_any_blend_of_stable_filters_is_stable(
    one: list[float], other: list[float], share: float
) -> None:
    blend = (1 - share) * rising(np.array(one)) + share * rising(np.array(other))
    assert np.abs(reflection_coefficients(prediction_coefficients(blend))).max() < 1


@given(reflections)
def test_reflection_coefficients_undo_the_step_up(reflection: list[float]) -> None:
    assert reflection_coefficients(step_up(reflection)) == pytest.approx(reflection, abs=1e-6)


def test_many_filters_at_once() -> None:
    frequencies = np.sort(np.random.default_rng(0).uniform(0.1, 3.0, (3, 4, 7)), axis=-1)
    coefficients = prediction_coefficients(frequencies)
    assert coefficients.shape == (3, 4, 7)
    assert coefficients[1, 2] == pytest.approx(prediction_coefficients(frequencies[1, 2]))
    assert reflection_coefficients(coefficients)[2, 0] == pytest.approx(
        reflection_coefficients(coefficients[2, 0])
    )


def test_pole_on_the_expected_side_of_the_unit_circle() -> None:
    inside, outside = [-1.2, 0.72], [-2.4, 1.69]  # radii 0.85 and 1.3
    assert (np.abs(reflection_coefficients(inside)) < 1).all()
    assert not (np.abs(reflection_coefficients(outside)) < 1).all()
    with refused(InputError, expected="filter", names="unstable"):
        line_spectral_frequencies(outside)


@pytest.mark.parametrize("bad", [[], [np.nan], [np.inf, 0.1], [[0.1]]])
def test_unusable_coefficients_are_refused(bad: list[float]) -> None:
    with refused(InputError, expected="coefficients", got=f"{bad}"):
        line_spectral_frequencies(bad)


@pytest.mark.parametrize(
    "bad", [[0.0, 1.0], [1.0, np.pi], [1.0, 1.0], [2.0, 1.0], [1.0, np.nan], [-0.1, 1.0]]
)
def test_frequencies_that_do_not_rise_within_0_and_pi_are_refused(bad: list[float]) -> None:
    with refused(InputError, expected=[0, "π", "the model"]):
        check_line_spectral(np.array([[0.5, 1.0], bad]), "the model")
