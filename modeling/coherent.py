"""Layers as they are rendered: signs, gains, widths and frequencies of a coherent response.

|G_w + Σ G_i H_i(f)| is fitted near peaks that were found as a sum of powers (METHOD 3 and 4).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from modeling.layers import Layers
from modeling.likelihood import (
    WIDEST_LOG_GAIN,
    Bins,
    Bools,
    Power,
    centres_and_widths,
    coherent,
    interference,
    limits_of,
    maximise,
    misfit_of,
    offsets,
    split,
)
from modeling.peaks import Peaks, theta_of
from modeling.peq import Floats

WIDTH_FACTOR = 5.0
FARTHEST_MOVE = 0.25  # of log frequency


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
    u, _, _ = offsets(theta_of(peaks), gain.size, bins)
    real = 1 / (1 + u * u)
    imaginary = u * real

    def response(theta: Floats, m: int, bins: Bins) -> tuple[Floats, Floats]:
        _, _, expected, by_gain = interference(
            np.exp(theta[0]), np.exp(theta[1:]) * signs, real=real, imaginary=imaginary
        )
        return expected, by_gain / expected

    # At its peak alone, G_w + s·G has the power G_w² + gain².
    start = np.log(np.hstack((noise, np.hypot(noise, gain) - signs * noise)))
    wide = np.full(start.size, WIDEST_LOG_GAIN)
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
    _, frequencies, widths, _, _ = split(theta_of(peaks), m)
    theta = np.concatenate((gains[:1], frequencies, widths, gains[1:]))
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
    order = np.arange(m)
    if known is None:
        order = np.argsort(frequency)
        order = order[~lost[order]]
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
