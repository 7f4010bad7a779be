"""Whittle's likelihood of a spectrum: expected power, its derivatives, and their best fit.

The power of a periodogram's line scatters exponentially about its expected value, so the log
likelihood of a model is −Σ (P/S + ln S) over the lines (Whittle 1953, "Estimation and information
in stationary time series"), here over averages of neighbouring lines.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tactileq.modeling.arrays import Bools, Floats
from tactileq.modeling.equalizer.bands import HIGHEST_FREQUENCY_SHARE, LOWEST_BANDWIDTH_HZ
from tactileq.modeling.estimation.compiled import CompiledLines, is_compiled
from tactileq.modeling.recordings.spectrum import HIGH_PASS_HZ, Spectrum

# Half an octave above its corner the preparation's high-pass takes less than 0.2 dB.
LOWEST_FITTED_HZ = 1.5 * HIGH_PASS_HZ
HIGHEST_SHARE = 0.98
EMPTY_BELOW_DB = -50.0  # smoothed spectrum relative to its maximum: no signal there
# Real spectra are no exact sums of bands: a bin's relative misfit that is forgiven.
FORGIVEN_MISFIT = 0.12
BIN_SHARE = 0.05
# A bin near a peak is no wider than these shares of the peak's width and of its distance.
PEAK_SHARE, DISTANCE_SHARE = 0.2, 0.15
SHAPE_RANGE = (0.8, 8.0)  # 1 is Lorentzian, 8 all but Gaussian
NARROWEST_LINES = 1.5
WIDEST_SHARE = 0.3
LEAST_POWER = 1e-200
NEPER_DB, NEPER_POWER_DB = 20 / np.log(10), 10 / np.log(10)  # of amplitudes and of powers
WIDEST_LOG_GAIN = 50.0  # only so that nothing overflows


@dataclass(frozen=True, eq=False)
class Power:
    """The periodogram in the band that holds signal: (response/scale)² is expected in each line.

    Parameters
    ----------
    frequency_hz, power : (n,) ndarray
        Evenly spaced; power relative to the square of `scale`, so that no unit overflows.
    scale : float
        The smoothed spectrum's maximum, in the unit per unit noise.
    weight : (n,) ndarray
        What a line counts. Where the sensor's floor has left the share q of a line's power, the
        relative error of the rest is 1/q times as large, so the line counts q².
    records : float
        How many records it is the mean of.
    """

    frequency_hz: Floats
    power: Floats
    scale: float
    weight: Floats
    rate_hz: float
    step_hz: float
    records: float

    @cached_property
    def compiled(self) -> CompiledLines:
        """The same for the compiled engine."""
        return CompiledLines(
            self.frequency_hz,
            self.power,
            self.weight,
            step_hz=self.step_hz,
            per_hz=np.pi / self.rate_hz,
            records=self.records,
            bin_share=BIN_SHARE,
            peak_share=PEAK_SHARE,
            distance_share=DISTANCE_SHARE,
            forgiven=FORGIVEN_MISFIT**2,
        )


@dataclass(frozen=True, eq=False)
class Bins:
    """Averages over n bins, narrow near peaks and of nearly constant relative width elsewhere.

    Parameters
    ----------
    power : (n,) ndarray
        Mean power of the bin's lines, as in `Power`.
    weight, count : (n,) ndarray
        Of a bin's log likelihood, with and without forgiveness for what no model fits; `count` is
        the number of lines, times records, that it is worth.
    tangent, cotangent : (n,) ndarray
        tan(πF/fs) and its inverse in the middle F of the bin.
    rate_hz : float
        fs.
    """

    power: Floats
    weight: Floats
    count: Floats
    tangent: Floats
    cotangent: Floats
    rate_hz: float


def signal_power(spectrum: Spectrum, *, empty_below_db: float = EMPTY_BELOW_DB) -> Power | None:
    """The band of a spectrum that holds signal; None for silence.

    From 15 Hz to 0.98 of the Nyquist frequency, or to where the smoothed spectrum last stands
    within 50 dB of its maximum: above a recorder's own low-pass there is nothing to model, and an
    empty region would rule the likelihood.

    Parameters
    ----------
    empty_below_db : float
        Instead of −50 dB; −inf for the whole band.
    """
    within = _fitted_band(spectrum)
    if is_silent(spectrum):
        return None
    magnitude, smoothed = spectrum.without_leakage, spectrum.smoothed_without_leakage
    loudest = float(smoothed[within].max())
    last = np.flatnonzero(within & (smoothed >= loudest * 10 ** (empty_below_db / 20)))[-1]
    within[last + 1 :] = False
    # Of a Rayleigh-distributed magnitude of mean r the mean square is (4/π)r²; of the mean of K
    # such magnitudes it is r² + (4/π − 1)r²/K.
    records = spectrum.averaged
    power = (magnitude[within] / loudest) ** 2 / (1 + (4 / np.pi - 1) / records)
    share = np.broadcast_to(spectrum.share, within.shape)[within]
    return Power(
        spectrum.frequency_hz[within],
        power,
        loudest,
        np.where(power > 0, share**2, 0.0),
        spectrum.rate_hz,
        spectrum.rate_hz / spectrum.n_samples,
        records,
    )


def is_silent(spectrum: Spectrum) -> bool:
    """Whether a spectrum holds nothing that a layer or a noise gain could be fitted to."""
    loudest = spectrum.without_leakage[_fitted_band(spectrum)].max(initial=0.0)
    return bool(loudest < np.finfo(np.float64).tiny)


def _fitted_band(spectrum: Spectrum) -> Bools:
    """Lines (n,) from 15 Hz to 0.98 of the Nyquist frequency."""
    frequency = spectrum.frequency_hz
    return (frequency >= LOWEST_FITTED_HZ) & (frequency <= HIGHEST_SHARE * spectrum.rate_hz / 2)


def split(theta: Floats, m: int) -> tuple[Floats, Floats, Floats, Floats]:
    """Log noise gain (…, 1), log frequencies, bandwidths and gains (…, m) of m layers."""
    return (
        theta[..., :1],
        theta[..., 1 : 1 + m],
        theta[..., 1 + m : 1 + 2 * m],
        theta[..., 1 + 2 * m : 1 + 3 * m],
    )


def centres_and_widths(theta: Floats, m: int) -> tuple[Floats, Floats]:
    """Frequencies and bandwidths (Hz) among the parameters."""
    _, frequency, bandwidth, _ = split(theta, m)
    return np.exp(frequency), np.exp(bandwidth)


def bins_near(power: Power, centres_hz: Floats, widths_hz: Floats) -> Bins:
    """Bins of 5 % of the frequency, but narrow against each peak that is near."""
    if is_compiled():
        average, weight, count, tangent, cotangent = power.compiled.bins(centres_hz, widths_hz)
        return Bins(average, weight, count, tangent, cotangent, power.rate_hz)
    frequency, step = power.frequency_hz, power.step_hz
    width = np.maximum(BIN_SHARE * frequency, 2 * step)
    for centre, peak_width in zip(centres_hz, widths_hz, strict=True):
        np.minimum(
            width, PEAK_SHARE * peak_width + DISTANCE_SHARE * np.abs(frequency - centre), out=width
        )
    number = np.cumsum(step / np.maximum(width, step)).astype(np.intp)
    starts = np.concatenate(([0], np.flatnonzero(number[1:] != number[:-1]) + 1))
    lines = np.diff(np.append(starts, frequency.size))
    heard = np.add.reduceat(power.weight, starts)
    tangent = np.tan(np.pi / power.rate_hz * (frequency[starts] + (lines - 1) * step / 2))
    kept = heard > 0  # lines that the sensor's floor took whole say nothing
    heard, tangent = heard[kept], tangent[kept]
    average = np.add.reduceat(power.power * power.weight, starts)[kept] / heard
    count = heard * power.records
    weight = count / (1 + count * FORGIVEN_MISFIT**2)
    return Bins(average, weight, count, tangent, 1 / tangent, power.rate_hz)


def offsets(theta: Floats, m: int, bins: Bins) -> tuple[Floats, Floats, Floats]:
    """u (m, n), where a band is 1/(1 − ju), and its derivatives by log f and log B.

    H = 1/(1 − ju) with u = (g²·cot(πF/fs) − tan(πF/fs))/(k(1+g²)) at the frequency F, where
    g = tan(πf/fs) and k = tan(πB/fs): `bands.band_response`, rearranged.
    """
    per_hz = np.pi / bins.rate_hz
    centre, width = centres_and_widths(theta, m)
    g, k = np.tan(per_hz * centre), np.tan(per_hz * width)
    scale = 1 / (k * (1 + g * g))
    u = (g * g * scale)[:, None] * bins.cotangent - scale[:, None] * bins.tangent
    growth = 2 * g * per_hz * centre
    by_frequency = (growth * (1 + g * g) * scale)[:, None] * bins.cotangent - growth[:, None] * u
    by_width = u * (-per_hz * width * (1 + k * k) / k)[:, None]
    return u, by_frequency, by_width


def power_sum_of_peaks(theta: Floats, m: int, bins: Bins) -> Floats:
    """The parts of `power_sum`, noise first, (m+1, n)."""
    noise, _, _, gain = split(theta, m)
    u, _, _ = offsets(theta, m, bins)
    nu = np.exp(theta[-1])
    phi = np.exp(-nu * np.log1p((2 ** (1 / nu) - 1) * u * u))
    floor = np.full((1, bins.tangent.size), np.exp(2 * noise[0]))
    return np.concatenate((floor, np.exp(2 * gain)[:, None] * phi))


def power_sum(theta: Floats, m: int, bins: Bins) -> tuple[Floats, Floats]:
    """Expected power G_w² + Σ G_i²·φ(u_i) (n,) and its relative derivatives (3m+2, n).

    φ = (1 + (2^(1/ν) − 1)·u²)^(−ν): −3 dB at u = ±1 whatever the shape ν.
    """
    noise, _, _, gain = split(theta, m)
    u, by_frequency, by_width = offsets(theta, m, bins)
    nu, twice = np.exp(theta[-1]), (2 * np.exp(2 * gain))[:, None]
    c = 2 ** (1 / nu) - 1
    square = u * u
    log_base = np.log1p(c * square)
    phi = np.exp(-nu * log_base)
    slope = phi / (1 + c * square)
    floor = np.exp(2 * noise[0])
    expected = floor + 0.5 * twice[:, 0] @ phi
    by_u = twice * slope * u * (-nu * c)
    derivative = np.empty((theta.size, expected.size))
    derivative[0] = 2 * floor
    derivative[1 : 1 + m] = by_u * by_frequency
    derivative[1 + m : 1 + 2 * m] = by_u * by_width
    derivative[1 + 2 * m : 1 + 3 * m] = twice * phi
    by_shape = square * slope * ((1 + c) * np.log(2) / nu) - log_base * phi
    derivative[-1] = nu * (0.5 * twice[:, 0] @ by_shape)
    derivative /= expected
    return expected, derivative


def misfit_of(bins: Bins, expected: Floats) -> float:
    """Minus the log likelihood, 0 where every bin is as expected."""
    ratio = bins.power / expected
    return float(bins.weight @ (ratio - 1 - np.log(ratio)))


def maximise(
    theta: Floats,
    bins: Bins,
    *,
    m: int,
    limits: tuple[Floats, Floats],
    steps: int,
    enough: float,
) -> tuple[Floats, float]:
    """Parameters of the likeliest power sum near a start, and the misfit there.

    Fisher scoring with Levenberg–Marquardt damping.

    Parameters
    ----------
    theta : (3m + 2,) ndarray
        The start; see `power_sum`.
    limits : pair of (3m + 2,) ndarray
    steps : int
        At most.
    enough : float
        Stop where a step gains less log likelihood than this.
    """
    low, high = limits
    theta = np.minimum(np.maximum(theta, low), high)
    damping = 1e-2
    expected, derivative = power_sum(theta, m, bins)
    misfit = misfit_of(bins, expected)
    information, score = _information(bins, expected, derivative)
    while steps > 0:
        tried = np.minimum(np.maximum(theta + _step(information, score, damping), low), high)
        expected, derivative = power_sum(tried, m, bins)
        misfit_tried = misfit_of(bins, expected)
        if misfit_tried < misfit:
            gained = misfit - misfit_tried
            theta, misfit, steps = tried, misfit_tried, steps - 1
            if gained < enough:
                break
            information, score = _information(bins, expected, derivative)
            damping = max(damping / 10, 1e-4)
        elif damping > 100:
            break
        else:
            damping *= 10
    return theta, misfit


def _information(bins: Bins, expected: Floats, derivative: Floats) -> tuple[Floats, Floats]:
    """Fisher information (p, p) and score (p,)."""
    weighted = derivative * bins.weight
    return weighted @ derivative.T, weighted @ (bins.power / expected - 1)


def _step(information: Floats, score: Floats, damping: float) -> Floats:
    """Levenberg–Marquardt step, at most a factor of e in any parameter."""
    damped = information.copy()
    damped.flat[:: damped.shape[0] + 1] += damping * np.diag(information) + 1e-9
    step: Floats = np.minimum(np.maximum(np.linalg.solve(damped, score), -1.0), 1.0)
    return step


def limits_of_sum(m: int, power: Power) -> tuple[Floats, Floats]:
    """Lowest and highest parameters of a power sum of m peaks: what a record can resolve."""
    narrowest_hz = max(NARROWEST_LINES * power.step_hz, LOWEST_BANDWIDTH_HZ)

    def limit(gain: float, frequency_hz: float, bandwidth_hz: float, shape: float) -> Floats:
        places = np.repeat(np.log([frequency_hz, bandwidth_hz]), m)
        return np.concatenate(([gain], places, np.full(m, gain), [np.log(shape)]))

    low = limit(-WIDEST_LOG_GAIN, LOWEST_FITTED_HZ, narrowest_hz, SHAPE_RANGE[0])
    highest_hz = HIGHEST_FREQUENCY_SHARE * power.rate_hz
    return low, limit(WIDEST_LOG_GAIN, highest_hz, WIDEST_SHARE * power.rate_hz, SHAPE_RANGE[1])
