"""The parametric equalizer against docs/method/equalizer.md, written out here a second time."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import solve_discrete_lyapunov
from scipy.optimize import brentq

from tactileq.modeling import PEQ, InputError
from tactileq.modeling.equalizer.bands import band_coefficients, clamp_bands, rational_tan
from tests.refusals import refused

RATE_HZ = 5000.0
frequencies = st.floats(1.0, 0.49 * RATE_HZ)
bandwidths = st.floats(0.1, 0.45 * RATE_HZ)
CORNERS = [
    (f, b) for f in (1.0, 37.0, 800.0, 0.49 * RATE_HZ) for b in (0.1, 4.0, 50.0, 0.45 * RATE_HZ)
]


def one_band(frequency_hz: float, bandwidth_hz: float, *, gain: float = 1.0) -> PEQ:
    return PEQ(
        noise_gain=0.0,
        frequencies_hz=[frequency_hz],
        bandwidths_hz=[bandwidth_hz],
        gains=[gain],
        rate_hz=RATE_HZ,
    )


def state_space(frequency_hz: float, bandwidth_hz: float) -> tuple[np.ndarray, ...]:
    """(A, b, c, d) of one band, from docs/method/equalizer.md#recursion and numpy's tangent."""
    g = np.tan(np.pi * frequency_hz / RATE_HZ)
    K = 2 * np.tan(np.pi * bandwidth_hz / RATE_HZ) / np.sin(2 * np.pi * frequency_hz / RATE_HZ)
    a1 = 1 / (1 + g * (g + K))
    a2 = g * a1
    a3 = g * a2
    drive = np.sqrt(K / g)
    v1 = np.array([a1, -a2, a2 * drive])  # coefficients of s1, s2, w
    v2 = np.array([a2, 1 - a3, a3 * drive])
    s1, s2 = 2 * v1 - [1, 0, 0], 2 * v2 - [0, 1, 0]
    step = np.array([s1, s2])
    tap = np.sqrt(K * g)
    return step[:, :2], step[:, 2:], tap * v1[:2], np.array(tap * v1[2])


def states_of_code(frequency_hz: float, bandwidth_hz: float) -> tuple[np.ndarray, np.ndarray]:
    """(A, b) that the code's coefficients give."""
    c = band_coefficients(frequency_hz, bandwidth_hz, rate_hz=RATE_HZ)
    return np.array([[1 + c.p, -c.q], [c.q, 1 + c.r]]), np.array([[c.b1], [c.b2]])


def test_rational_tan_is_the_tangent_to_2e_14() -> None:
    angle = np.concatenate((np.geomspace(1e-8, 0.1, 3000), np.linspace(0.1, 0.49 * np.pi, 50000)))
    truth = np.tan(angle.astype(np.longdouble))
    assert float(np.max(np.abs(rational_tan(angle) / truth - 1))) <= 2e-14
    assert rational_tan(0.0) == 0.0


@given(st.floats(1, 0.49 * RATE_HZ), st.floats(0.1, 0.45 * RATE_HZ))
def test_coefficients_are_those_of_the_closed_forms(frequency: float, bandwidth: float) -> None:
    """In extended precision; of numbers that may be close to 0, the absolute error."""
    theta = np.longdouble(np.pi) * np.longdouble(frequency) / RATE_HZ
    k = np.tan(np.longdouble(np.pi) * np.longdouble(bandwidth) / RATE_HZ)
    c = band_coefficients(frequency, bandwidth, rate_hz=RATE_HZ)
    assert abs(c.p / (-2 * (np.sin(theta) ** 2 + k) / (1 + k)) - 1) < 1e-13
    assert abs(c.r / (-2 * np.sin(theta) ** 2 / (1 + k)) - 1) < 1e-13
    assert abs(c.q / (np.sin(2 * theta) / (1 + k)) - 1) < 1e-13
    assert abs(c.b1 / (2 * np.sqrt(k) / (1 + k) * np.cos(theta)) - 1) < 1e-13
    assert abs(c.b2 / (2 * np.sqrt(k) / (1 + k) * np.sin(theta)) - 1) < 1e-13
    assert abs(c.tap / (np.sqrt(k) / (2 * np.cos(theta))) - 1) < 1e-13


@pytest.mark.parametrize(("frequency", "bandwidth"), CORNERS)
def test_peak_gain_is_one_and_width_is_b_at_the_range_edges(
    frequency: float, bandwidth: float
) -> None:
    check_peak_and_width(frequency, bandwidth)


@settings(deadline=None, max_examples=60)
@given(frequencies, bandwidths)
def test_peak_gain_is_one_and_width_is_b(frequency: float, bandwidth: float) -> None:
    check_peak_and_width(frequency, bandwidth)


def check_peak_and_width(frequency: float, bandwidth: float) -> None:
    peq = one_band(frequency, bandwidth)
    assert peq.response([frequency])[0] == pytest.approx(1, abs=1e-10)
    assert peq.response(np.linspace(0, RATE_HZ / 2, 4001)).max() <= 1 + 1e-12

    def above_half_power(x: float) -> float:
        return float(peq.response([x])[0] ** 2 - 0.5)

    lower = brentq(above_half_power, 0.0, frequency, xtol=1e-11)
    upper = brentq(above_half_power, frequency, RATE_HZ / 2, xtol=1e-11)
    assert upper - lower == pytest.approx(bandwidth, rel=1e-8, abs=1e-8)


@settings(deadline=None, max_examples=60)
@given(frequencies, bandwidths, st.floats(0.5, 2499.0))
def test_response_is_that_of_the_state_equations(
    frequency: float, bandwidth: float, where: float
) -> None:
    A, b, c, d = state_space(frequency, bandwidth)
    z = np.exp(2j * np.pi * where / RATE_HZ)
    expected = c @ np.linalg.solve(z * np.eye(2) - A, b)[:, 0] + d
    actual = one_band(frequency, bandwidth).complex_response([where])[0]
    assert actual == pytest.approx(expected, abs=1e-8)


@settings(deadline=None, max_examples=100)
@given(frequencies, bandwidths)
def test_state_covariance_stays_at_identity(frequency: float, bandwidth: float) -> None:
    A, b = states_of_code(frequency, bandwidth)
    assert np.abs(np.eye(2) - A @ A.T - b @ b.T).max() < 1e-12


@settings(deadline=None, max_examples=60)
@given(st.lists(st.tuples(frequencies, bandwidths, st.floats(-3, 3)), min_size=1, max_size=60))
def test_energy_bound_holds_under_any_parameter_motion(
    jumps: list[tuple[float, float, float]],
) -> None:
    state = np.zeros(2)
    for frequency, bandwidth, w in jumps:
        A, b = states_of_code(frequency, bandwidth)
        following = A @ state + b[:, 0] * w
        assert following @ following <= (state @ state + w * w) * (1 + 1e-12) + 1e-300
        state = following


@pytest.mark.parametrize(("frequency", "bandwidth"), CORNERS)
def test_band_variance_is_exact(frequency: float, bandwidth: float) -> None:
    A, b, c, d = state_space(frequency, bandwidth)
    P = solve_discrete_lyapunov(A, b @ b.T)
    variance = float(c @ P @ c + d * d)
    k = np.tan(np.pi * bandwidth / RATE_HZ)
    assert variance == pytest.approx(k / (1 + k), rel=1e-6)
    peq = one_band(frequency, bandwidth, gain=-0.3)
    assert peq.band_rms[0] ** 2 == pytest.approx(0.09 * k / (1 + k), rel=1e-12)


def test_band_variance_is_the_integral_of_the_squared_response() -> None:
    grid = (np.arange(200000) + 0.5) / 200000 * RATE_HZ / 2
    peq = one_band(440.0, 30.0, gain=2.0)
    assert np.mean(peq.response(grid) ** 2) == pytest.approx(peq.band_rms[0] ** 2, rel=1e-6)


def test_bands_add_coherently_with_their_signs() -> None:
    grid = np.array([30.0, 100.0, 160.0, 200.0, 900.0])
    gains = np.array([0.7, -0.4])
    transfer = []
    for frequency, bandwidth in ((100.0, 20.0), (200.0, 30.0)):
        A, b, c, d = state_space(frequency, bandwidth)
        z = np.exp(2j * np.pi * grid / RATE_HZ)
        transfer.append([c @ np.linalg.solve(x * np.eye(2) - A, b)[:, 0] + d for x in z])
    expected = np.abs(0.1 + gains @ np.array(transfer))
    peq = PEQ(
        noise_gain=0.1,
        frequencies_hz=[100.0, 200.0],
        bandwidths_hz=[20.0, 30.0],
        gains=gains,
        rate_hz=RATE_HZ,
    )
    assert peq.response(grid) == pytest.approx(expected, rel=1e-9)


def test_equal_signs_dig_a_hole_and_alternating_signs_fill_it() -> None:
    def between(sign: float) -> float:
        peq = PEQ(
            noise_gain=0.0,
            frequencies_hz=[100.0, 200.0],
            bandwidths_hz=[5.0, 5.0],
            gains=[1.0, sign],
            rate_hz=RATE_HZ,
        )
        return float(peq.response(np.arange(120.0, 180.0, 0.5)).min())

    assert between(1.0) < 0.1 * between(-1.0)


def test_without_layers_the_response_is_flat() -> None:
    peq = PEQ(noise_gain=0.2, frequencies_hz=[], bandwidths_hz=[], gains=[], rate_hz=RATE_HZ)
    assert peq.response([0.0, 100.0, 2500.0]) == pytest.approx(0.2)
    assert peq.band_rms.shape == (0,)


@pytest.mark.parametrize("edge", [1.0, 0.49 * RATE_HZ])
def test_legal_edges_are_accepted(edge: float) -> None:
    for bandwidth_hz in (0.1, 0.45 * RATE_HZ):
        peq = one_band(edge, bandwidth_hz)
        assert (peq.frequencies_hz[0], peq.bandwidths_hz[0]) == (edge, bandwidth_hz)


@pytest.mark.parametrize(
    ("name", "value", "expected", "got"),
    [
        ("frequencies_hz", [0.999], ["frequency", "1…2450 Hz", "5000 Hz"], 0.999),
        ("frequencies_hz", [0.4901 * RATE_HZ], ["frequency", "1…2450 Hz", "5000 Hz"], 2450.5),
        ("frequencies_hz", [np.nan], ["frequency", "1…2450 Hz", "5000 Hz"], "nan"),
        ("frequencies_hz", [np.inf], ["frequency", "1…2450 Hz", "5000 Hz"], "inf"),
        ("frequencies_hz", [100.0, 200.0], ["frequency", "layer"], ["(1,)", "(2,)"]),
        ("bandwidths_hz", [0.099], ["bandwidth", "0.1…2250 Hz", "5000 Hz"], 0.099),
        ("bandwidths_hz", [0.4501 * RATE_HZ], ["bandwidth", "0.1…2250 Hz", "5000 Hz"], 2250.5),
        ("bandwidths_hz", [np.nan], ["bandwidth", "0.1…2250 Hz", "5000 Hz"], "nan"),
        ("gains", [np.nan], "gains", "[nan]"),
        ("gains", [-np.inf], "gains", "[-inf]"),
        ("gains", [[1.0]], ["gain", "layer"], ["(1,)", "(1, 1)"]),
        ("noise_gain", -0.1, ["noise gain", 0], -0.1),
        ("noise_gain", np.nan, ["noise gain", 0], "nan"),
        ("noise_gain", np.inf, ["noise gain", 0], "inf"),
        ("rate_hz", 0.0, "10000000 Hz", 0.0),
        ("rate_hz", np.nan, "10000000 Hz", "nan"),
    ],
)
def test_illegal_values_are_refused(
    name: str, value: object, expected: object, got: object
) -> None:
    good: dict[str, object] = {
        "noise_gain": 0.1,
        "frequencies_hz": [100.0],
        "bandwidths_hz": [20.0],
        "gains": [1.0],
        "rate_hz": RATE_HZ,
    }
    PEQ(**good)  # type: ignore[arg-type]
    with refused(InputError, expected=expected, got=got):
        PEQ(**{**good, name: value})  # type: ignore[arg-type]


def test_clamping_counts_what_it_moves() -> None:
    frequency, bandwidth, moved = clamp_bands(
        np.array([0.5, 100.0, 2499.0]), np.array([0.01, 20.0, 3000.0]), rate_hz=RATE_HZ
    )
    assert frequency.tolist() == [1.0, 100.0, 0.49 * RATE_HZ]
    assert bandwidth.tolist() == [0.1, 20.0, 0.45 * RATE_HZ]
    assert moved == 4


def test_arrays_of_a_peq_cannot_be_changed() -> None:
    gains = np.array([1.0])
    peq = PEQ(
        noise_gain=0.0,
        frequencies_hz=[100.0],
        bandwidths_hz=[20.0],
        gains=gains,
        rate_hz=RATE_HZ,
    )
    gains[0] = 5.0
    assert peq.gains[0] == 1.0
    with pytest.raises(ValueError, match="read-only"):
        peq.gains[0] = 2.0
