"""The `joint` estimator for one spectrum: all layers at once, coherent as they are rendered.

Peaks are found as a sum of powers (`modeling.peaks`), then fitted as the coherent response that
gets rendered (`modeling.coherent`); METHOD 4.
"""

from __future__ import annotations

import numpy as np

from modeling.coherent import (
    CoherentFit,
    as_layers,
    coherent_fit,
    coherent_gains,
    refitted,
    sign_patterns,
    without,
)
from modeling.layers import Layers, no_layers
from modeling.likelihood import Power, bins_near, signal_power
from modeling.peaks import find_peaks_jointly, penalty, power_sum_misfit
from modeling.spectra import Spectrum

# The coherent response holds where it fits as well as the power sum does, in log likelihood.
COHERENT_BY = 5.0


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
