"""Whittle's likelihood of a sum of powers: closed forms, derivatives, bins, and the climb."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import butter, sosfilt

from tactileq.modeling import PEQ
from tactileq.modeling.arrays import Floats
from tactileq.modeling.estimation.likelihood import (
    Bins,
    Power,
    bins_near,
    centres_and_widths,
    limits_of_sum,
    maximise,
    misfit_of,
    offsets,
    power_sum,
    power_sum_of_peaks,
    signal_power,
)
from tactileq.modeling.estimation.peaks import find_peaks_jointly
from tactileq.modeling.recordings.spectrum import (
    Spectrum,
    mean_spectrum,
    spectrum_of_samples,
    subtract_floor,
)

RATE_HZ = 5000.0
NOTHING = np.zeros(0)


@st.composite
def parameters(draw: st.DrawFn) -> tuple[Floats, int]:
    """Log noise gain, frequencies, widths and gains of one to four layers."""
    m = draw(st.integers(1, 4))

    def logs(low: float, high: float) -> list[float]:
        return draw(st.lists(st.floats(np.log(low), np.log(high)), min_size=m, max_size=m))

    theta = [draw(st.floats(-4, 0)), *logs(15, 2400), *logs(3, 1000), *logs(0.01, 10)]
    return np.array(theta), m


def lines(frequency_hz: Floats) -> Bins:
    """One bin per frequency, without data."""
    tangent = np.tan(np.pi * frequency_hz / RATE_HZ)
    one = np.ones(tangent.size)
    return Bins(one, one, one, tangent, 1 / tangent, RATE_HZ)


def flat(power: Floats, *, step_hz: float = 1.0, records: float = 1.0) -> Power:
    """A periodogram from 15 Hz upwards, all of it heard."""
    frequency = 15.0 + step_hz * np.arange(power.size)
    heard = (power > 0).astype(float)
    return Power(frequency, power, 1.0, heard, RATE_HZ, step_hz, records)


def white(n: int = 5000, *, seed: int = 0, rate_hz: float = RATE_HZ) -> Spectrum:
    return spectrum_of_samples(np.random.default_rng(seed).standard_normal(n), rate_hz)


def relative_slopes(theta: Floats, m: int, bins: Bins) -> Floats:
    """Central differences of the log power sum, (p, n)."""
    step = 1e-6
    moves = step * np.eye(theta.size)
    up = [np.log(power_sum(theta + move, m, bins)[0]) for move in moves]
    down = [np.log(power_sum(theta - move, m, bins)[0]) for move in moves]
    return (np.array(up) - np.array(down)) / (2 * step)


# --- expected power


@settings(deadline=None, max_examples=50)
@given(parameters(), st.floats(np.log(0.8), np.log(8.0)))
def test_derivatives_of_the_power_sum(drawn: tuple[Floats, int], shape: float) -> None:
    theta, m = np.append(drawn[0], shape), drawn[1]
    bins = lines(np.geomspace(15, 2400, 60))
    _, derivative = power_sum(theta, m, bins)
    slopes = relative_slopes(theta, m, bins)
    # At the top of a narrow peak a difference quotient is off by what the slope beside it is.
    steepest = np.abs(derivative).max(axis=1, keepdims=True)
    assert (np.abs(derivative - slopes) <= 1e-4 * (1 + steepest)).all()


@settings(deadline=None)
@given(st.floats(20, 2000), st.floats(5, 300), st.floats(np.log(0.8), np.log(8.0)))
def test_a_peak_is_3_db_down_at_its_edges_whatever_its_shape(
    centre: float, width: float, shape: float
) -> None:
    """At u = ±1, which lie tan(πB/fs) apart on the filter's warped scale.

    docs/method/equalizer.md#recursion
    """
    g, k = np.tan(np.pi * centre / RATE_HZ), np.tan(np.pi * width / RATE_HZ)
    half = k * (1 + g * g) / 2
    root = np.sqrt(half**2 + g * g)
    edges = RATE_HZ / np.pi * np.arctan([root - half, g, root + half])
    theta = np.log([1e-9, centre, width, 3.0, np.exp(shape)])
    u, _, _ = offsets(theta, 1, lines(edges))
    assert u[0] == pytest.approx([1, 0, -1], abs=1e-8)
    # … and B apart in Hz, which is what a bandwidth means.
    assert edges[2] - edges[0] == pytest.approx(width, rel=1e-8)
    parts = power_sum_of_peaks(theta, 1, lines(edges))
    assert parts[1] == pytest.approx([4.5, 9.0, 4.5], rel=1e-7)
    assert parts.sum(axis=0) == pytest.approx(power_sum(theta, 1, lines(edges))[0], rel=1e-12)


# --- bins


@settings(deadline=None)
@given(
    st.integers(10, 3000),
    st.sampled_from([0.1, 1.0, 4.0]),
    st.lists(st.tuples(st.floats(15, 2000), st.floats(2, 500)), max_size=4),
)
def test_every_line_is_used_once(n: int, step_hz: float, peaks: list[tuple[float, float]]) -> None:
    rng = np.random.default_rng(0)
    power = flat(rng.exponential(size=n), step_hz=step_hz)
    power = replace(power, frequency_hz=power.frequency_hz[: 2480 if step_hz == 1 else n])
    n = min(n, int(2480 / step_hz))
    power = flat(power.power[:n], step_hz=step_hz)
    centre, width = np.array(peaks).reshape(-1, 2).T
    bins = bins_near(power, centre, width)
    assert bins.count.sum() == n
    assert bins.count @ bins.power == pytest.approx(power.power.sum(), rel=1e-12)
    assert (bins.weight <= bins.count).all()
    # Near a peak a bin is narrower than the peak, or a line.
    bin_hz = np.arctan(bins.tangent) * RATE_HZ / np.pi
    for f, b in peaks:
        near = np.abs(bin_hz - f) < b / 2
        assert (bins.count[near] * step_hz <= max(0.4 * b, 2 * step_hz)).all()


def test_lines_without_signal_say_nothing() -> None:
    rng = np.random.default_rng(0)
    power = rng.exponential(size=2000)
    power[::3] = 0.0
    power[700:900] = 0.0
    bins = bins_near(flat(power), NOTHING, NOTHING)
    assert bins.count.sum() == np.count_nonzero(power)
    assert (bins.power > 0).all()
    assert bins.count @ bins.power == pytest.approx(power.sum())
    bin_hz = np.arctan(bins.tangent) * RATE_HZ / np.pi
    assert not ((bin_hz > 760) & (bin_hz < 870)).any()


def test_records_count_and_misfit_is_forgiven_in_part() -> None:
    power = np.ones(1000)
    once, often = (bins_near(flat(power, records=r), NOTHING, NOTHING) for r in (1.0, 9.0))
    assert often.count == pytest.approx(9 * once.count)
    assert once.weight == pytest.approx(1 / (1 / once.count + 0.12**2))
    assert misfit_of(once, np.ones(once.power.size)) == 0.0
    assert misfit_of(once, np.full(once.power.size, 2.0)) == pytest.approx(
        once.weight.sum() * (np.log(2) - 0.5)
    )


# --- the band that holds signal


@pytest.mark.parametrize("repeats", [1, 2, 5, 20])
def test_averages_of_records_give_the_noise_gain(repeats: int) -> None:
    """The mean of K Rayleigh magnitudes has the mean square r²(1 + (4/π − 1)/K)."""
    measured = mean_spectrum([white(seed=100 * repeats + k) for k in range(repeats)])
    power = signal_power(measured)
    assert power is not None
    assert power.records == pytest.approx(repeats)
    mean = power.scale**2 * power.power.mean()
    # Of the unit variance; a line's own deviation is 1/√K of it, to first order.
    assert mean == pytest.approx(1.0, abs=4 / np.sqrt(repeats * power.power.size))
    gain = power.scale * find_peaks_jointly(power).noise_gain
    assert gain == pytest.approx(1.0, abs=4 * 0.5 / np.sqrt(repeats * power.power.size))


def test_silence_has_no_band() -> None:
    assert signal_power(spectrum_of_samples(np.zeros(5000), RATE_HZ)) is None
    # … nor has a line below 15 Hz, whose smoothed skirt reaches up.
    magnitude = np.zeros(2501)
    magnitude[12] = 1.0
    assert signal_power(Spectrum(np.arange(2501.0), magnitude, RATE_HZ, 5000)) is None


@settings(deadline=None, max_examples=20)
@given(st.floats(-280, 280))
def test_the_band_does_not_depend_on_the_unit(exponent: float) -> None:
    one, other = white(1000), white(1000)
    scaled = replace(other, magnitude=other.magnitude * 10.0**exponent)
    here, there = signal_power(one), signal_power(scaled)
    assert here is not None
    assert there is not None
    assert there.scale == pytest.approx(here.scale * 10.0**exponent)
    assert there.power == pytest.approx(here.power, rel=1e-12)


def test_an_empty_region_above_a_recorders_low_pass_is_left_out() -> None:
    """At −80 dB and more it would rule the likelihood; the layer below is found all the same."""
    rng = np.random.default_rng(0)
    peq = PEQ(
        noise_gain=0.1,
        frequencies_hz=[200.0],
        bandwidths_hz=[60.0],
        gains=[1.0],
        rate_hz=RATE_HZ,
    )
    frequency = np.fft.rfftfreq(20000, 1 / RATE_HZ)
    drawn = np.fft.rfft(rng.standard_normal(20000)) * peq.response(frequency)
    samples = sosfilt(butter(12, 800, fs=RATE_HZ, output="sos"), np.fft.irfft(drawn))
    power = signal_power(spectrum_of_samples(samples, RATE_HZ))
    assert power is not None
    assert 800 < power.frequency_hz[-1] < 1600
    found = find_peaks_jointly(power)
    strongest = int(np.argmax(found.gains))
    assert found.frequencies_hz[strongest] == pytest.approx(200, abs=8)
    assert power.scale * found.gains[strongest] == pytest.approx(1.0, rel=0.15)


def test_lines_count_by_what_the_floor_left_of_them() -> None:
    """Three quarters of the power left: 9/16 of a line's evidence. Under the floor: hardly any."""
    frequency = np.arange(2501.0)
    loud = Spectrum(frequency, np.where(frequency < 1000, 2.0, 1.0), RATE_HZ, 5000)
    floor = Spectrum(frequency, np.ones(2501), RATE_HZ, 5000)
    power = signal_power(subtract_floor(loud, floor))
    assert power is not None
    assert power.weight[100] == pytest.approx(9 / 16)
    assert power.weight[1300:].max(initial=0.0) < 1e-6
    bins = bins_near(power, NOTHING, NOTHING)
    assert bins.count.sum() == pytest.approx(power.weight.sum())
    untouched = signal_power(loud)
    assert untouched is not None
    assert (untouched.weight == 1).all()


def test_shares_of_repeats_are_averaged() -> None:
    floor = replace(white(seed=1), magnitude=np.full(2501, 0.5))
    pair = [subtract_floor(white(seed=s), floor) for s in (2, 3)]
    average = mean_spectrum(pair)
    expected = (np.asarray(pair[0].share) + np.asarray(pair[1].share)) / 2
    assert average.share == pytest.approx(expected)
    assert average.averaged == 2


# --- the climb


@settings(deadline=None, max_examples=50)
@given(parameters(), st.integers(0, 100))
def test_climbing_never_loses_and_stays_within_the_limits(
    drawn: tuple[Floats, int], seed: int
) -> None:
    theta, m = np.append(drawn[0], 0.0), drawn[1]
    power = signal_power(white(seed=seed))
    assert power is not None
    low, high = limits_of_sum(m, power)
    theta = np.clip(theta, low, high)
    bins = bins_near(power, *centres_and_widths(theta, m))
    before = misfit_of(bins, power_sum(theta, m, bins)[0])
    found, misfit = maximise(theta, bins, m=m, limits=(low, high), steps=6, enough=0.01)
    assert misfit <= before
    assert misfit == misfit_of(bins, power_sum(found, m, bins)[0])
    assert ((found >= low) & (found <= high)).all()


@pytest.mark.parametrize(("duration_s", "rate_hz"), [(0.0128, 5000.0), (1, 1000.0), (30, 1000.0)])
def test_limits_are_legal_for_any_record(duration_s: float, rate_hz: float) -> None:
    power = signal_power(white(round(duration_s * rate_hz), rate_hz=rate_hz))
    assert power is not None
    for limit in limits_of_sum(2, power):
        frequency, bandwidth = centres_and_widths(limit, 2)
        peq = PEQ(
            noise_gain=1.0,
            frequencies_hz=frequency,
            bandwidths_hz=bandwidth,
            gains=[1.0, 1.0],
            rate_hz=rate_hz,
        )
        assert peq.gains.size == 2
