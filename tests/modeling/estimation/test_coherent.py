"""The coherent response of many spectra at once: closed forms, derivatives, limits, the climb."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from tactileq.modeling import PEQ
from tactileq.modeling.arrays import Floats
from tactileq.modeling.equalizer.bands import band_rms
from tactileq.modeling.estimation.coherent import (
    CANCELLING,
    LARGEST_SHARE,
    Observed,
    climb,
    level_deviations,
    limits_of,
    misfits,
    observe,
    record_information,
    response,
    slopes,
    without_layer,
)
from tactileq.modeling.estimation.likelihood import centres_and_widths, signal_power
from tactileq.modeling.recordings.spectrum import spectrum_of_samples

RATE_HZ = 5000.0
SIGNS = st.lists(st.sampled_from([1.0, -1.0]), min_size=4, max_size=4)


@st.composite
def parameters(draw: st.DrawFn) -> tuple[Floats, int]:
    """Log noise gain, frequencies, widths and gains of one to four layers."""
    m = draw(st.integers(1, 4))

    def logs(low: float, high: float) -> list[float]:
        return draw(st.lists(st.floats(np.log(low), np.log(high)), min_size=m, max_size=m))

    theta = [draw(st.floats(-4, 0)), *logs(15, 2400), *logs(3, 1000), *logs(0.01, 10)]
    return np.array(theta), m


def at(frequency_hz: Floats, *, line_hz: float = 0.0, rows: int = 1) -> Observed:
    """One bin per frequency, without data."""
    tangent = np.tile(np.tan(np.pi * frequency_hz / RATE_HZ), (rows, 1))
    one = np.ones(tangent.shape)
    return Observed(one, one, one, tangent, 1 / tangent, np.full(rows, line_hz), RATE_HZ)


def as_peq(theta: Floats, signs: Floats) -> PEQ:
    m, values = signs.size, np.exp(theta)
    return PEQ(
        noise_gain=values[0],
        frequencies_hz=values[1 : 1 + m],
        bandwidths_hz=values[1 + m : 1 + 2 * m],
        gains=signs * values[1 + 2 * m :],
        rate_hz=RATE_HZ,
    )


@settings(deadline=None)
@given(parameters(), SIGNS)
def test_power_is_the_squared_response_of_the_equalizer(
    drawn: tuple[Floats, int], up: list[float]
) -> None:
    theta, m = drawn
    signs, frequency = np.array(up[:m]), np.geomspace(15, 2400, 200)
    power = response(theta[None], signs, at(frequency)).power[0]
    largest = np.exp(theta[np.r_[0, 1 + 2 * m : 1 + 3 * m]]).sum() ** 2
    expected = as_peq(theta, signs).response(frequency) ** 2
    assert power == pytest.approx(expected, rel=1e-9, abs=1e-11 * largest)


@settings(deadline=None)
@given(parameters())
def test_powers_of_independent_layers_add(drawn: tuple[Floats, int]) -> None:
    theta, m = drawn
    frequency = np.geomspace(15, 2400, 200)
    power = response(theta[None], None, at(frequency)).power[0]
    floor = np.exp(2 * theta[0])
    bands = [
        np.abs(replace(as_peq(theta, np.eye(m)[layer]), noise_gain=0.0).complex_response(frequency))
        ** 2
        for layer in range(m)
    ]
    assert power == pytest.approx(floor + np.sum(bands, axis=0), rel=1e-9)


def exact_log_power(theta: Any, signs: Floats | None, tangent: Any, line_hz: float) -> Any:
    """ln power by its equation (docs/method/equalizer.md#response), for complex numbers."""
    m = (theta.size - 1) // 3
    noise, (frequency, bandwidth, gain) = theta[0], np.exp(theta[1:]).reshape(3, m, 1)
    seen = np.sqrt(bandwidth**2 + line_hz**2)
    g, k = np.tan(np.pi * frequency / RATE_HZ), np.tan(np.pi * seen / RATE_HZ)
    u = (g * g / tangent - tangent) / (k * (1 + g * g))
    amplitude = gain * np.sqrt(bandwidth / seen)
    if signs is None:
        return np.log(np.exp(2 * noise) + (amplitude**2 / (1 + u * u)).sum(axis=0))
    band = signs[:, None] * amplitude / (1 + u * u)
    return np.log((np.exp(noise) + band.sum(axis=0)) ** 2 + (u * band).sum(axis=0) ** 2)


# One narrow band that nearly cancels the noise in the middle of it, where difference quotients with
# steps of 1e-6 are 0.3 % off; found by hypothesis.
NEARLY_CANCELLED = (np.array([0, 7.78322402, 1.5, 0.125]), 1), [-1.0] * 4, True


@settings(max_examples=50)
@given(parameters(), SIGNS, st.booleans(), st.sampled_from([0.0, 1.0, 4.0]))
@example(*NEARLY_CANCELLED, 0.0)
@example(*NEARLY_CANCELLED, 4.0)
def test_derivatives(
    drawn: tuple[Floats, int], up: list[float], coherent: bool, line_hz: float
) -> None:
    """By complex steps, in which nothing cancels (Squire & Trapp 1998, SIAM Review 40, 110)."""
    theta, m = drawn
    signs = np.array(up[:m]) if coherent else None
    here = at(np.geomspace(15, 2400, 60), line_hz=line_hz)
    power, derivative, by_tangent = (v[0] for v in response(theta[None], signs, here))
    tangent, step = here.tangent[0], 1e-30
    exact = [
        exact_log_power(theta + 1j * step * unit, signs, tangent, line_hz).imag / step
        for unit in np.eye(theta.size)
    ]
    along = exact_log_power(theta, signs, tangent * (1 + 1j * step), line_hz).imag / step
    # Rounding of a narrow band's place, divided by a nearly cancelled power, is below 1e-8 there.
    clear = power > 1e-6 * power.max()
    steepest = np.abs(derivative).max(axis=1, keepdims=True)
    assert (np.abs(derivative - exact) <= 1e-7 * (1 + steepest))[:, clear].all()
    found = by_tangent * tangent
    assert (np.abs(found - along) <= 1e-7 * (1 + np.abs(found).max()))[clear].all()


@settings(deadline=None)
@given(st.floats(100, 2000), st.floats(0.1, 5), st.sampled_from([0.5, 1.0, 4.0]))
def test_a_band_seen_through_a_line_keeps_its_power(
    centre: float, width: float, line_hz: float
) -> None:
    """Lower by the ratio of the widths, and wider by as much."""
    theta = np.log([1e-9, centre, width, 1.0])[None]
    top = np.array([centre])
    seen = response(theta, np.ones(1), at(top, line_hz=line_hz)).power[0, 0]
    as_wide = np.hypot(width, line_hz)
    assert seen == pytest.approx(width / as_wide, rel=1e-6)
    edge = np.array([centre, centre + as_wide / 2])
    power = response(theta, np.ones(1), at(edge, line_hz=line_hz)).power[0]
    # −3 dB half the width away, but for the filter's warping.
    assert power[1] / power[0] == pytest.approx(0.5, abs=0.06)


def test_hidden_rows_and_chosen_rows() -> None:
    power = signal_power(
        spectrum_of_samples(np.random.default_rng(0).standard_normal(5000), RATE_HZ)
    )
    nowhere = np.zeros((3, 0))
    observed = observe([power, None, power], nowhere, nowhere, scale=1.0)
    assert observed.weight[1].sum() == 0
    assert (observed.power[0] == observed.power[2]).all()
    hidden = observed.without(np.array([True, False, False]))
    assert hidden.weight[0].sum() == hidden.count[0].sum() == 0
    assert (hidden.weight[2] == observed.weight[2]).all()
    theta = np.zeros((3, 1))
    assert misfits(response(theta, np.zeros(0), hidden).power, hidden)[:2].tolist() == [0.0, 0.0]
    twice = observed.rows(np.array([2, 2]))
    assert twice.power.shape[0] == 2
    assert (twice.power[0] == observed.power[2]).all()


def test_scatter_is_the_misfit_of_the_truth() -> None:
    """Whatever the bins: 200 records of white noise, whose truth is known."""
    rng = np.random.default_rng(1)
    powers = [
        signal_power(spectrum_of_samples(rng.standard_normal(5000), RATE_HZ)) for _ in range(200)
    ]
    for centre, width in (([], []), ([300.0, 900.0], [20.0, 50.0])):
        places = (np.tile(np.array(values, dtype=float), (200, 1)) for values in (centre, width))
        observed = observe(powers, *places, scale=1.0)
        misfit = misfits(response(np.zeros((200, 1)), np.zeros(0), observed).power, observed)
        assert misfit.mean() == pytest.approx(observed.scatter.mean(), rel=0.03)


def test_layers_that_cancel_cost() -> None:
    """Two nearly equal layers of opposite signs: each far higher than what they leave."""
    frequency = np.arange(15.0, 2400.0, 5.0)
    pair = np.log([0.01, 300.0, 310.0, 60.0, 60.0, 2.0, 2.0])[None]
    alone = np.log([0.01, 300.0, 60.0, 0.3])[None]
    truth = at(frequency)
    signs = np.array([1.0, -1.0])
    left = response(pair, signs, truth).power
    told_exactly = replace(truth, power=left)
    found = slopes(pair, signs, told_exactly)
    assert found.misfit[0] == pytest.approx(0.0, abs=1e-9)
    own = np.sqrt(response(pair, signs, at(np.array([300.0, 310.0]))).power[0])
    assert (LARGEST_SHARE * own < 2.0).all()
    excess = np.log(2.0 / (LARGEST_SHARE * own))
    assert found.objective[0] == pytest.approx(0.5 * CANCELLING * (excess**2).sum(), rel=1e-6)
    assert found.objective[0] > 4.0
    single = replace(truth, power=response(alone, np.ones(1), truth).power)
    assert slopes(alone, np.ones(1), single).objective[0] == pytest.approx(0.0, abs=1e-9)


@settings(deadline=None, max_examples=40)
@given(parameters(), SIGNS, st.integers(0, 100))
def test_climbing_never_loses_and_stays_within_the_limits(
    drawn: tuple[Floats, int], up: list[float], seed: int
) -> None:
    theta, m = drawn
    white = np.random.default_rng(seed).standard_normal((2, 5000))
    powers = [signal_power(spectrum_of_samples(x, RATE_HZ)) for x in white]
    limits = limits_of(m, rate_hz=RATE_HZ, step_hz=1.0)
    starts = np.clip(np.stack([theta, theta + 0.1]), *limits)
    signs = np.tile(up[:m], (2, 1))
    observed = observe(powers, *centres_and_widths(starts, m), scale=1.0)
    before = slopes(starts, signs, observed).objective
    found = climb(starts, signs, observed, limits=limits, steps=6, enough=0.01)
    assert (found.objective <= before).all()
    assert ((found.theta >= limits[0]) & (found.theta <= limits[1])).all()
    again = slopes(found.theta, signs, observed)
    assert again.objective == pytest.approx(found.objective, rel=1e-12)
    # What is not free stays to the bit, and rows do not know of each other.
    free = np.arange(theta.size) % 2 == 0
    held = climb(starts, signs, observed, limits=limits, free=free, steps=3, enough=0.01)
    assert (held.theta[:, ~free] == starts[:, ~free]).all()
    alone = climb(
        starts[:1], signs[:1], observed.rows(np.array([0])), limits=limits, steps=6, enough=1e-9
    )
    both = climb(starts, signs, observed, limits=limits, steps=6, enough=1e-9)
    assert both.theta[0] == pytest.approx(alone.theta[0], abs=1e-6)


def test_the_climb_reaches_the_truth_where_nothing_scatters() -> None:
    truth = np.log([0.1, 200.0, 700.0, 40.0, 90.0, 1.0, 0.5])
    signs = np.array([[1.0, -1.0]])
    lines = at(np.arange(15.0, 2400.0))
    observed = replace(lines, power=response(truth[None], signs, lines).power)
    start = truth + np.array([0.2, 0.05, -0.05, 0.3, -0.3, 0.3, -0.2])
    wide = np.full(7, 50.0)
    found = climb(start[None], signs, observed, limits=(-wide, wide), steps=60, enough=1e-13)
    assert found.theta[0] == pytest.approx(truth, abs=1e-5)
    assert found.misfit[0] < 1e-9


def test_a_lone_bands_level_is_told_as_well_as_theory_allows() -> None:
    """10/ln 10/√(πBT) dB, from above (docs/method/estimation.md#level-deviations)."""
    width, seconds = 50.0, 1.0
    theta = np.log([1e-4, 500.0, width, 1.0])[None]
    information = record_information(theta, np.ones(1), at(np.arange(15.0, 2450.0, 1 / seconds)))
    covariance = np.linalg.inv(information)
    deviation_db = 20 / np.log(10) * level_deviations(theta, covariance, rate_hz=RATE_HZ)[0, 0]
    bound_db = 10 / np.log(10) / np.sqrt(np.pi * width * seconds)
    assert bound_db < deviation_db < 1.15 * bound_db
    # The level itself is that of the band.
    gain, k = 1.0, np.tan(np.pi * width / RATE_HZ)
    assert band_rms(gain, width, rate_hz=RATE_HZ) == pytest.approx(np.sqrt(k / (1 + k)), rel=1e-9)


@pytest.mark.parametrize(("step_hz", "rate_hz"), [(78.0, 5000.0), (1.0, 1000.0), (0.03, 1000.0)])
def test_limits_are_legal_for_any_record(step_hz: float, rate_hz: float) -> None:
    for limit in limits_of(2, rate_hz=rate_hz, step_hz=step_hz):
        frequency, bandwidth = centres_and_widths(limit, 2)
        peq = PEQ(
            noise_gain=1.0,
            frequencies_hz=frequency,
            bandwidths_hz=bandwidth,
            gains=[1.0, 1.0],
            rate_hz=rate_hz,
        )
        assert peq.gains.size == 2


def test_taking_a_layer_away() -> None:
    theta = np.arange(10.0)  # noise, 3 frequencies, 3 widths, 3 gains
    assert without_layer(theta, 1).tolist() == [0, 1, 3, 4, 6, 7, 9]
    assert without_layer(theta[None], 0).tolist() == [[0, 2, 3, 5, 6, 8, 9]]
