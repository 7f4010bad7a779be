"""The `joint` estimator for one spectrum: all layers at once, coherent as they are rendered.

Peaks are found as a sum of powers (`estimation.peaks`), then fitted as the coherent response that
gets rendered (`estimation.coherent`); docs/method/estimation.md#single-spectra.
"""

from __future__ import annotations

import numpy as np

from tactileq.modeling.arrays import Bools
from tactileq.modeling.equalizer.signs import sign_patterns
from tactileq.modeling.estimation.coherent import (
    LINE_WIDTH,
    Climbed,
    Observed,
    climb,
    covariance_alone,
    level_deviations,
    limits_of,
    misfits,
    one_spectrum,
    record_information,
    response,
    without_layer,
)
from tactileq.modeling.estimation.layers import Layers, no_layers
from tactileq.modeling.estimation.likelihood import NEPER_DB, Power, bins_near, signal_power, split
from tactileq.modeling.estimation.peaks import Peaks, find_peaks_jointly, penalty, power_sum_misfit
from tactileq.modeling.recordings.spectrum import Spectrum

# The coherent response holds where it fits as well as the power sum does, in log likelihood.
COHERENT_BY = 5.0
FARTHEST_MOVE = 0.25  # of log frequency: what coherence does to a peak, and no change of places
WIDTH_FACTOR = 5.0
TRIED_SIGNS = 3


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
    observed = one_spectrum(bins, line_hz=LINE_WIDTH * power.step_hz)
    fitted = _fitted_to(peaks, power, observed, move=True)
    alone = power_sum_misfit(peaks, bins)
    if fitted.misfit <= alone + COHERENT_BY:
        fitted = _pruned(fitted, power, observed)
    else:
        fitted = _fitted_to(peaks, power, observed, move=False)
    return as_layers(fitted, power, observed)


def _fitted_to(peaks: Peaks, power: Power, observed: Observed, *, move: bool) -> Climbed:
    """The likeliest coherent response near the peaks, with the signs that suit it best."""
    signs = sign_patterns(peaks.frequencies_hz)
    m, count = peaks.gains.size, len(signs)
    # At its peak alone, G_w + s·G has the power G_w² + gain².
    gains = np.hypot(peaks.noise_gain, peaks.gains) - signs * peaks.noise_gain
    places = np.log(np.hstack((peaks.noise_gain, peaks.frequencies_hz, peaks.bandwidths_hz)))
    theta = np.hstack((np.tile(places, (count, 1)), np.log(gains)))
    low, high = limits_of(m, rate_hz=power.rate_hz, step_hz=power.step_hz)
    held = np.zeros(low.size, dtype=bool)
    held[1 : 1 + m if move else 1 + 2 * m] = True
    rows = observed.rows(np.zeros(count, dtype=np.intp))
    first = climb(theta, signs, rows, limits=(low, high), free=_gains_only(m), steps=4, enough=0.3)
    best = np.argsort(first.objective, kind="stable")[:TRIED_SIGNS]
    near = np.full(low.size, FARTHEST_MOVE if move else 0.0)
    if move:
        near[1 + m : 1 + 2 * m] = np.inf
    else:  # where no coherent response fits, a width would run away
        near[1 + m : 1 + 2 * m] = np.log(WIDTH_FACTOR)
    near[0] = near[1 + 2 * m :] = np.inf
    start = first.theta[best]
    limits = np.maximum(low, start - near), np.minimum(high, start + near)
    fits = climb(
        start,
        signs[best],
        observed.rows(np.zeros(best.size, dtype=np.intp)),
        limits=limits,
        steps=8,
        enough=0.3,
    )
    return fits.row(int(np.argmin(fits.objective)))


def _gains_only(m: int) -> Bools:
    free = np.ones(1 + 3 * m, dtype=bool)
    free[1 : 1 + 2 * m] = False
    return free


def _pruned(fitted: Climbed, power: Power, observed: Observed) -> Climbed:
    """The fit without the layers that the coherent response does not need."""
    while fitted.signs.size > 1:
        m = fitted.signs.size
        theta = np.array([without_layer(fitted.theta, layer) for layer in range(m)] * 2)
        signs = np.array([np.delete(fitted.signs, layer) for layer in range(m)])
        # Neighbours that it kept apart may need the other sign towards each other.
        places = fitted.theta[1 : 1 + m]
        above = np.array([np.delete(places, layer) > places[layer] for layer in range(m)])
        signs = np.concatenate((signs, np.where(above, -signs, signs)))
        rows = observed.rows(np.zeros(len(signs), dtype=np.intp))
        limits = limits_of(m - 1, rate_hz=power.rate_hz, step_hz=power.step_hz)
        # Refitting the others makes up for part of the loss, hardly for more than three quarters.
        losses = misfits(response(theta, signs, rows).power, rows) - fitted.misfit
        few = np.flatnonzero(losses <= 4 * penalty(power))
        if not few.size:
            break
        fits = climb(theta[few], signs[few], rows.rows(few), limits=limits, steps=5, enough=0.3)
        least = fits.row(int(np.argmin(fits.misfit)))
        if least.misfit - fitted.misfit >= penalty(power):
            break
        fitted = least
    return fitted


def as_layers(fitted: Climbed, power: Power, observed: Observed) -> Layers:
    """Layers of one spectrum by rising frequency.

    The standard deviations of the levels come from the likelihood's information. A layer whose
    amplitude is less than one standard deviation is left out; `unresolved` is a width within the
    distance of two lines.
    """
    m = fitted.signs.size
    noise, frequency, bandwidth, gain = split(fitted.theta, m)
    information = record_information(fitted.theta[None], fitted.signs[None], observed)
    deviation = level_deviations(
        fitted.theta[None], covariance_alone(information), rate_hz=power.rate_hz
    )[0]
    alone = 1 / np.sqrt(np.maximum(np.einsum("pp->p", information[0])[1 + 2 * m :], 1e-12))
    order = np.argsort(frequency)
    order = order[alone[order] <= 1.0]
    width = np.exp(bandwidth)
    return Layers(
        power.scale * float(np.exp(noise[0])),
        np.exp(frequency)[order],
        width[order],
        (power.scale * fitted.signs * np.exp(gain))[order],
        NEPER_DB * deviation[order],
        (width < 2 * power.step_hz)[order],
    )
