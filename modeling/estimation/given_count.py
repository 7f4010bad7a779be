"""A spectrum by a given number of layers: what a prescribed size can do.

docs/method/estimation.md#given-number
"""

from __future__ import annotations

from itertools import product

import numpy as np

from tactileq.modeling.arrays import Floats
from tactileq.modeling.equalizer.bands import clamp_bands
from tactileq.modeling.equalizer.peq import PEQ
from tactileq.modeling.equalizer.signs import sign_patterns
from tactileq.modeling.errors import InputError, counted
from tactileq.modeling.estimation.coherent import Climbed, climb, limits_of, observe
from tactileq.modeling.estimation.likelihood import Power, centres_and_widths, signal_power, split
from tactileq.modeling.recordings.spectrum import Spectrum

_WIDTH_SHARES = (0.5, 1.0)
_NOISE_DB = (0.0, -20.0)
_ROUNDS = 2


def fit_layer_count(spectrum: Spectrum, count: int) -> PEQ:
    """The PEQ of exactly `count` layers that is likeliest behind a spectrum.

    Coherent layers are fitted from several starts by Whittle's likelihood, with the likeliest of
    all signs equal and the two alternations; no layer is dropped.

    Parameters
    ----------
    count : int
        m ≥ 1.

    Raises
    ------
    InputError
        For a spectrum without power, or fewer than one layer.
    """
    power = signal_power(spectrum)
    if power is None or count < 1:
        got = counted(count, "layer") if power is not None else "silence"
        raise InputError(f"expected a spectrum with power and a layer or more, got {got}; fix it.")
    patterns = sign_patterns(np.arange(float(count)))
    fitted = _likeliest(power, starts_of(power, count), patterns)
    noise, frequency, bandwidth, gain = split(fitted.theta, count)
    order = np.argsort(frequency)
    # At a limit, the exponential of its logarithm may be a rounding error beyond it.
    frequencies_hz, bandwidths_hz, _ = clamp_bands(
        np.exp(frequency), np.exp(bandwidth), rate_hz=spectrum.rate_hz
    )
    return PEQ(
        noise_gain=power.scale * float(np.exp(noise[0])),
        frequencies_hz=frequencies_hz[order],
        bandwidths_hz=bandwidths_hz[order],
        gains=power.scale * (fitted.signs * np.exp(gain))[order],
        rate_hz=spectrum.rate_hz,
    )


def starts_of(power: Power, count: int) -> Floats:
    """Layers spread over the power, evenly or in its upper half, wide or narrow; quiet noise."""
    heard = power.power * power.weight
    share = np.cumsum(heard) / heard.sum()
    low, high = np.interp([0.1, 0.9], share, power.frequency_hz)
    noise = np.log(np.quantile(power.power[heard > 0], 0.05)) / 2
    starts = []
    for places in ((np.arange(count) + 0.5) / count, np.linspace(0.5, 0.98, count)):
        centre = np.interp(places, share, power.frequency_hz)
        height = np.interp(centre, power.frequency_hz, power.power) + power.power[heard > 0].mean()
        for width_share, noise_db in product(_WIDTH_SHARES, _NOISE_DB):
            width = np.full(count, max(width_share * (high - low) / count, 2 * power.step_hz))
            parts = ([noise + noise_db * np.log(10) / 20], np.log(centre), np.log(width))
            starts.append(np.concatenate([*parts, np.log(height) / 2]))
    return np.array(starts)


def _likeliest(power: Power, starts: Floats, patterns: Floats) -> Climbed:
    """The nearest maximum of the likelihood from any start with any signs."""
    count = patterns.shape[1]
    theta = np.repeat(starts, len(patterns), axis=0)
    signs = np.tile(patterns, (len(starts), 1))
    limits = limits_of(count, rate_hz=power.rate_hz, step_hz=power.step_hz)
    for _ in range(_ROUNDS):  # bins are finest near the layers, so they are drawn again
        near = centres_and_widths(theta, count)
        observed = observe([power] * len(theta), *near, scale=power.scale)
        theta = climb(theta, signs, observed, limits=limits, steps=60, enough=1e-3).theta
    # Misfits are compared on the same bins, whatever layers they belong to.
    nowhere = np.zeros((len(theta), 0))
    common = observe([power] * len(theta), nowhere, nowhere, scale=power.scale)
    fits = climb(theta, signs, common, limits=limits, steps=0)
    return fits.row(int(np.argmin(fits.misfit)))
