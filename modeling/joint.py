"""The `joint` estimator: all layers at once, coherent as they are rendered (METHOD 4).

Peaks are found first: a sum of powers, which needs no signs, grows by the largest residual; its
peaks share one shape between Lorentzian and Gaussian, so that no layers are spent on skirts of
another form. Then signs, gains, widths and frequencies are fitted to the coherent response
|G_w + Σ G_i H_i(f)|, which is what gets rendered.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import gammaincinv

from modeling.layers import Layers, no_layers
from modeling.likelihood import (
    FORGIVEN_MISFIT,
    Bins,
    Bools,
    Power,
    bins_near,
    centres_and_widths,
    coherent,
    limits_of,
    maximise,
    misfit_of,
    offsets,
    power_of,
    power_sum,
    power_sum_of_peaks,
    signal_power,
    split,
)
from modeling.peq import Floats
from modeling.spectra import Spectrum

# A layer must raise the log likelihood by this much in a record of 5000 samples, and by ln n more
# in one n times as long, where chance has more places to look like one (one record of white noise
# in ten has such a place). BIC would ask 10 to 12 for three parameters;
# 6 finds more of the weak layers, and what it finds is nearly always there.
PENALTY = 6.0
PENALTY_SAMPLES = 5000
SEVERAL_AT_ONCE = 40.0
MOST_LAYERS = 12
WIDEST_BOX_HZ = 520.0
# The coherent response holds where it fits as well as the power sum does, in log likelihood.
COHERENT_BY = 5.0
WIDTH_FACTOR = 5.0
FARTHEST_MOVE = 0.25  # of log frequency
NARROWEST_BOX = 5


@dataclass(frozen=True, eq=False)
class Peaks:
    """Peaks of one spectrum as a sum of powers, by rising frequency.

    Parameters
    ----------
    noise_gain : float
    frequencies_hz, bandwidths_hz, gains : (m,) ndarray
        Gains, relative to `Power.scale`, are those of the peaks' own power.
    shape : float
        Of all peaks: 1 is Lorentzian, larger falls off faster.
    evidence : (m,) ndarray
        What leaving a peak out costs in log likelihood, all else kept.
    """

    noise_gain: float
    frequencies_hz: Floats
    bandwidths_hz: Floats
    gains: Floats
    shape: float
    evidence: Floats

    def only(self, kept: list[int]) -> Peaks:
        """These peaks (0-based) alone."""
        names = ("frequencies_hz", "bandwidths_hz", "gains", "evidence")
        return replace(self, **{name: getattr(self, name)[kept] for name in names})


SILENCE = Peaks(0.0, *(np.zeros(0),) * 3, 1.0, np.zeros(0))


def find_peaks_jointly(power: Power) -> Peaks:
    """Noise and peaks of one spectrum: greedy growth, refitted as a whole after every addition.

    Growth ends where no further peak raises the log likelihood by `PENALTY`.
    """
    # Where three in ten lines of noise alone would lie; above are peaks. Exponentially distributed
    # lines, or means of several.
    below = gammaincinv(power.records, 0.3) / power.records
    floor = np.quantile(power.power[power.weight > 0], 0.3) / below
    theta, m = np.array([0.5 * np.log(floor), 0.0]), 0
    expected = np.full(power.power.size, floor)
    while m < MOST_LAYERS:
        candidates = _candidates(power, expected)[: MOST_LAYERS - m]
        if not len(candidates):
            break
        grown = _insert(theta, m, candidates, power, expected)
        bins = bins_near(power, *centres_and_widths(grown, m + len(candidates)))
        before = misfit_of(bins, power_sum(theta if m else _noise_alone(bins), m, bins)[0])
        m_grown = m + len(candidates)
        limits = limits_of(m_grown, power, shaped=True)
        grown, after = maximise(
            power_sum, grown, bins, m=m_grown, limits=limits, steps=4, enough=1.0
        )
        if before - after < penalty(power) * len(candidates):
            break
        theta, m = grown, m_grown
        expected = _expected_on_lines(theta, m, power)
    if not m:
        theta = _noise_alone(bins_near(power, np.zeros(0), np.zeros(0)))
    return _as_peaks(theta, m, power)


def _noise_alone(bins: Bins) -> Floats:
    """Parameters of the likeliest power sum without peaks."""
    return np.array([0.5 * np.log(bins.weight @ bins.power / bins.weight.sum()), 0.0])


def penalty(power: Power) -> float:
    """What a further layer must gain in log likelihood, at least 2."""
    samples = power.rate_hz / power.step_hz
    return max(2.0, PENALTY + float(np.log(samples / PENALTY_SAMPLES)))


def _candidates(power: Power, expected: Floats) -> Floats:
    """Where power stands above what is expected: rows of (frequency_hz, bandwidth_hz, ratio).

    The likelihood ratio of a box of raised power, over boxes of widths in octaves; the best one,
    and with it all that are beyond doubt and far from it.
    """
    total = np.concatenate(([0.0], np.cumsum(power.weight * power.power / expected)))
    lines = np.concatenate(([0.0], np.cumsum(power.weight)))
    found = []
    width = NARROWEST_BOX
    while width * power.step_hz <= WIDEST_BOX_HZ and width < expected.size:
        hop = max(1, width // 6)
        told = np.maximum(lines[width::hop] - lines[:-width:hop], 1e-9)
        raised = np.maximum((total[width::hop] - total[:-width:hop]) / told, 1.0)
        told *= power.records
        gain = told / (1 + told * FORGIVEN_MISFIT**2) * (raised - 1 - np.log(raised))
        for _ in range(4):
            best = int(np.argmax(gain))
            if gain[best] < penalty(power):
                break
            middle = best * hop + (width - 1) / 2
            found.append((float(gain[best]), middle, width, float(raised[best])))
            gain[max(0, best - 2 * width // hop - 1) : best + 2 * width // hop + 2] = 0.0
        width = 2 * width - 1
    chosen: list[tuple[float, float, int, float]] = []
    for candidate in sorted(found, reverse=True):
        if chosen and candidate[0] < max(SEVERAL_AT_ONCE, 0.15 * chosen[0][0]):
            break
        if all(abs(candidate[1] - c[1]) > 1.5 * (candidate[2] + c[2]) for c in chosen):
            chosen.append(candidate)
    # A Lorentzian of width B is told best by a box of about 1.4 B.
    rows = [
        (power.frequency_hz[0] + c[1] * power.step_hz, 0.7 * c[2] * power.step_hz, c[3])
        for c in chosen
    ]
    return np.array(rows).reshape(-1, 3)


def _insert(theta: Floats, m: int, candidates: Floats, power: Power, expected: Floats) -> Floats:
    """Parameters of the power sum with the candidates as further peaks."""
    noise, frequency, bandwidth, gain, shape = split(theta, m)
    centre, width, ratio = candidates.T
    there = np.interp(centre, power.frequency_hz, expected)
    height = 0.5 * np.log(there * np.maximum(ratio - 1, 0.3) / 0.7)
    parts = (noise, frequency, np.log(centre), bandwidth, np.log(width), gain, height, shape)
    return np.concatenate(parts)


def _expected_on_lines(theta: Floats, m: int, power: Power) -> Floats:
    """The power sum at every line of the periodogram."""
    tangent = np.tan(np.pi / power.rate_hz * power.frequency_hz)
    ones = np.ones(tangent.size)
    lines = Bins(ones, ones, ones, tangent, 1 / tangent, power.rate_hz)
    expected: Floats = power_sum_of_peaks(theta, m, lines).sum(axis=0)
    return expected


def _as_peaks(theta: Floats, m: int, power: Power) -> Peaks:
    bins = bins_near(power, *centres_and_widths(theta, m))
    parts = power_sum_of_peaks(theta, m, bins)
    whole = misfit_of(bins, parts.sum(axis=0))
    # Summed anew: next to a pure tone, the whole less the tone would be rounded to nothing.
    rest = [np.delete(parts, i, axis=0).sum(axis=0) for i in range(1, m + 1)]
    evidence = np.array([misfit_of(bins, expected) - whole for expected in rest])
    noise, frequency, bandwidth, gain, shape = split(theta, m)
    order = np.argsort(frequency)
    # Later peaks may have taken over for earlier ones.
    order = order[evidence[order] > penalty(power)]
    return Peaks(
        noise_gain=float(np.exp(noise[0])),
        frequencies_hz=np.exp(frequency)[order],
        bandwidths_hz=np.exp(bandwidth)[order],
        gains=np.exp(gain)[order],
        shape=float(np.exp(shape[0])),
        evidence=evidence[order],
    )


def sign_patterns(frequencies_hz: Floats) -> Floats:
    """Signs worth trying (METHOD 3): all equal, and the two that alternate along frequency.

    Parameters
    ----------
    frequencies_hz : (m,) ndarray
        Any order.

    Returns
    -------
    (k, m) ndarray of ±1
        k = 3, or 1 for m < 2: the sign of a layer alone only rescales its gain.
    """
    m = frequencies_hz.size
    if m < 2:
        return np.ones((1, m))
    alternating = np.empty(m)
    alternating[np.argsort(frequencies_hz, kind="stable")] = (-1.0) ** np.arange(m)
    return np.stack((np.ones(m), alternating, -alternating))


def neighbouring_patterns(frequencies_hz: Floats) -> Floats:
    """`sign_patterns`, and each of them with one relation between neighbours turned, (k, m).

    Turned means that all layers above a gap change their signs.
    """
    patterns = sign_patterns(frequencies_hz)
    turns = [np.where(frequencies_hz >= above, -1.0, 1.0) for above in np.sort(frequencies_hz)[1:]]
    return np.unique([*patterns, *(turn * p for turn in turns for p in patterns)], axis=0)


def coherent_gains(
    peaks: Peaks, bins: Bins, signs: Floats, *, steps: int = 4
) -> tuple[Floats, float]:
    """Log noise gain and log gains (m+1,) of the coherent response, and its misfit.

    Frequencies and widths stay those of the peaks.
    """
    noise, gain = peaks.noise_gain, peaks.gains
    theta = np.concatenate((np.log([noise]), np.log(peaks.frequencies_hz)))
    theta = np.concatenate((theta, np.log(peaks.bandwidths_hz)))
    u, _, _ = offsets(theta, gain.size, bins)
    real = 1 / (1 + u * u)
    imaginary = u * real

    def response(theta: Floats, m: int, bins: Bins) -> tuple[Floats, Floats]:
        signed = np.exp(theta[1:]) * signs
        in_phase, quadrature = np.exp(theta[0]) + signed @ real, signed @ imaginary
        expected = power_of(in_phase, quadrature)
        derivative = np.empty((theta.size, expected.size))
        derivative[0] = 2 * np.exp(theta[0]) * in_phase
        derivative[1:] = (real * in_phase + imaginary * quadrature) * (2 * signed)[:, None]
        derivative /= expected
        return expected, derivative

    # At its peak alone, G_w + s·G has the power G_w² + gain².
    start = np.log(np.hstack((noise, np.hypot(noise, gain) - signs * noise)))
    wide = np.full(start.size, 50.0)
    return maximise(
        response, start, bins, m=gain.size, limits=(-wide, wide), steps=steps, enough=0.3
    )


@dataclass(frozen=True, eq=False)
class CoherentFit:
    """Parameters (`likelihood.split`; gains relative to `Power.scale`), signs, and the misfit."""

    theta: Floats
    signs: Floats
    misfit: float
    bins: Bins


def coherent_fit(
    peaks: Peaks,
    power: Power,
    signs: Floats,
    *,
    known: Bools,
    move: bool,
    bins: Bins,
    steps: int = 8,
) -> CoherentFit:
    """Layers of the coherent response near peaks found as a power sum.

    Parameters
    ----------
    known : (m,) ndarray of bool
        Layers whose frequency and width stay as they are.
    move : bool
        Whether the frequencies of the others may move, too.
    steps : int
        At most.
    """
    m = peaks.gains.size
    gains, _ = coherent_gains(peaks, bins, signs)
    widths = np.log(peaks.bandwidths_hz)
    theta = np.concatenate((gains[:1], np.log(peaks.frequencies_hz), widths, gains[1:]))
    free = np.concatenate(([True], ~known & move, ~known, np.ones(m, dtype=bool)))
    low, high = limits_of(m, power, shaped=False)
    if move:
        # Far enough for what coherence does to a peak, not so far that layers change places.
        f = slice(1, 1 + m)
        low[f] = np.maximum(low[f], theta[f] - FARTHEST_MOVE)
        high[f] = np.minimum(high[f], theta[f] + FARTHEST_MOVE)
    else:
        # Where no coherent response fits, a width would run away.
        b = slice(1 + m, 1 + 2 * m)
        low[b] = np.maximum(low[b], widths - np.log(WIDTH_FACTOR))
        high[b] = np.minimum(high[b], widths + np.log(WIDTH_FACTOR))
    # What is known may lie outside of the band that was recorded.
    low, high = np.where(free, low, theta), np.where(free, high, theta)
    theta, misfit = maximise(
        coherent(signs), theta, bins, m=m, limits=(low, high), free=free, steps=steps, enough=0.3
    )
    return CoherentFit(theta, signs, misfit, bins)


def fit_jointly(spectrum: Spectrum) -> Layers:
    """Noise gain and layers of one spectrum, their number and signs chosen from it.

    Where independent layers overlap, no coherent response has their power sum; forced to fit, the
    layers would move. Then the frequencies stay where the power sum found them.
    """
    power = signal_power(spectrum)
    if power is None:
        return no_layers(0.0)
    peaks = find_peaks_jointly(power)
    if not peaks.gains.size:
        return no_layers(power.scale * peaks.noise_gain)
    bins = bins_near(power, peaks.frequencies_hz, peaks.bandwidths_hz)
    patterns = sign_patterns(peaks.frequencies_hz)
    signs = min(patterns, key=lambda signs: coherent_gains(peaks, bins, signs)[1])
    known = np.zeros(peaks.gains.size, dtype=bool)
    fitted = coherent_fit(peaks, power, signs, known=known, move=True, bins=bins)
    if fitted.misfit <= power_sum_misfit(peaks, bins) + COHERENT_BY:
        fitted = _pruned(fitted, power)
    else:
        fitted = coherent_fit(peaks, power, signs, known=known, move=False, bins=bins)
    return as_layers(fitted, power)


def power_sum_misfit(peaks: Peaks, bins: Bins) -> float:
    """How well the sum of the peaks' powers fits."""
    return misfit_of(bins, power_sum(_theta_of(peaks), peaks.gains.size, bins)[0])


def _theta_of(peaks: Peaks) -> Floats:
    parts = (peaks.noise_gain, peaks.frequencies_hz, peaks.bandwidths_hz, peaks.gains, peaks.shape)
    theta: Floats = np.log(np.hstack(parts))
    return theta


def _pruned(fitted: CoherentFit, power: Power) -> CoherentFit:
    """The fit without the layers that the coherent response does not need."""
    while fitted.signs.size > 1:
        fewer = [without(fitted, layer) for layer in range(fitted.signs.size)]
        least = min(fewer, key=lambda f: f.misfit)
        # Refitting the others makes up for part of the loss, hardly for more than three quarters.
        if least.misfit - fitted.misfit > 4 * penalty(power):
            break
        least = refitted(least, power)
        if least.misfit - fitted.misfit >= penalty(power):
            break
        fitted = least
    return fitted


def without(fitted: CoherentFit, layer: int) -> CoherentFit:
    """The same fit without one layer, all else kept."""
    noise, *columns, _ = split(fitted.theta, fitted.signs.size)
    theta = np.concatenate((noise, *(np.delete(column, layer) for column in columns)))
    signs = np.delete(fitted.signs, layer)
    expected, _ = coherent(signs)(theta, signs.size, fitted.bins)
    return CoherentFit(theta, signs, misfit_of(fitted.bins, expected), fitted.bins)


def refitted(fitted: CoherentFit, power: Power) -> CoherentFit:
    """A few steps towards the best fit from here."""
    m = fitted.signs.size
    theta, misfit = maximise(
        coherent(fitted.signs),
        fitted.theta,
        fitted.bins,
        m=m,
        limits=limits_of(m, power, shaped=False),
        steps=5,
        enough=0.3,
    )
    return replace(fitted, theta=theta, misfit=misfit)


def as_layers(fitted: CoherentFit, power: Power, *, known: Bools | None = None) -> Layers:
    """Layers by rising frequency, or in their own order where `known` (m,) is given.

    The standard deviations of the levels come from the likelihood's information. A layer whose
    amplitude is less than one standard deviation is left out; a `known` one is set to that bound,
    at most the noise gain, and marked `unresolved`, as is a width within the distance of two lines.
    """
    m = fitted.signs.size
    fixed = np.zeros(m, dtype=bool) if known is None else known
    noise, frequency, bandwidth, gain, _ = split(fitted.theta, m)
    alone_sd, level_sd = _deviations(fitted, fixed)
    lost = alone_sd > 1.0
    bound = np.minimum(np.exp(gain) * alone_sd, np.exp(noise[0]))
    gains = power.scale * fitted.signs * np.where(lost, bound, np.exp(gain))
    level_sd_db = 20 / np.log(10) * np.where(lost, 1.0, level_sd)
    widths = np.exp(bandwidth)
    unresolved = lost | (widths < 2 * power.step_hz)
    order = np.argsort(frequency)[~lost[np.argsort(frequency)]] if known is None else np.arange(m)
    return Layers(
        power.scale * float(np.exp(noise[0])),
        np.exp(frequency)[order],
        widths[order],
        gains[order],
        level_sd_db[order],
        unresolved[order],
    )


def _deviations(fitted: CoherentFit, known: Bools) -> tuple[Floats, Floats]:
    """Standard deviations (m,): of log gain with all else known, and of log level.

    The level is G·√(k/(1+k)), k = tan(πB/fs).
    """
    m, bins = fitted.signs.size, fitted.bins
    _, derivative = coherent(fitted.signs)(fitted.theta, m, bins)
    derivative[1 : 1 + m][known] = 0.0
    derivative[1 + m : 1 + 2 * m][known] = 0.0
    information = (derivative * bins.count) @ derivative.T
    # Scaled, so that a parameter that nothing depends on does not spoil the others.
    scale = 1 / np.sqrt(np.maximum(np.diag(information), 1e-12))
    scaled = information * scale[:, None] * scale
    scaled.flat[:: scaled.shape[0] + 1] += 1e-9
    covariance = np.linalg.inv(scaled) * scale[:, None] * scale
    _, width = centres_and_widths(fitted.theta, m)
    angle = np.pi / bins.rate_hz * width
    k = np.tan(angle)
    by_width = 0.5 * angle * (1 + k * k) / (k * (1 + k)) * ~known
    b, g = slice(1 + m, 1 + 2 * m), slice(1 + 2 * m, 1 + 3 * m)
    level = np.diag(covariance[g, g]) + 2 * by_width * np.diag(covariance[b, g])
    level = level + by_width**2 * np.diag(covariance[b, b])
    return scale[g], np.sqrt(np.maximum(level, 0.0))
