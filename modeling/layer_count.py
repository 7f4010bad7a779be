"""A spectrum by a given number of layers: what a prescribed size can do (METHOD 3 and 4)."""

from __future__ import annotations

from itertools import product

import numpy as np

from modeling.coherent import sign_patterns
from modeling.errors import InputError
from modeling.likelihood import (
    Power,
    bins_near,
    centres_and_widths,
    coherent,
    limits_of,
    maximise,
    misfit_of,
    signal_power,
    split,
)
from modeling.peq import PEQ, Floats, clamp_bands
from modeling.spectra import Spectrum

_WIDTH_SHARES = (0.5, 1.0)
_NOISE_DB = (0.0, -20.0)
_ROUNDS = 2


def fit_layer_count(spectrum: Spectrum, count: int, *, equal_signs: bool = False) -> PEQ:
    """The PEQ of exactly `count` layers that is likeliest behind a spectrum.

    Coherent layers are fitted from several starts by Whittle's likelihood; no layer is dropped.

    Parameters
    ----------
    spectrum : Spectrum
    count : int
        m ≥ 1.
    equal_signs : bool
        All gains positive; else the likeliest of all equal and the two alternations.

    Raises
    ------
    InputError
        For a spectrum without power, or fewer than one layer.
    """
    power = signal_power(spectrum)
    if power is None or count < 1:
        got = f"{count} layers" if power is not None else "silence"
        raise InputError(f"expected a spectrum with power and a layer or more, got {got}; fix it.")
    patterns = sign_patterns(np.arange(float(count)))
    fits = [
        _climbed(power, start, signs)
        for signs in (patterns[:1] if equal_signs else patterns)
        for start in _starts(power, count)
    ]
    _, theta, signs = min(fits, key=lambda fit: fit[0])
    noise, frequency, bandwidth, gain, _ = split(theta, count)
    order = np.argsort(frequency)
    # At a limit, the exponential of its logarithm may be a rounding error beyond it.
    frequencies_hz, bandwidths_hz, _ = clamp_bands(
        np.exp(frequency), np.exp(bandwidth), rate_hz=spectrum.rate_hz
    )
    return PEQ(
        noise_gain=power.scale * float(np.exp(noise[0])),
        frequencies_hz=frequencies_hz[order],
        bandwidths_hz=bandwidths_hz[order],
        gains=power.scale * (signs * np.exp(gain))[order],
        rate_hz=spectrum.rate_hz,
    )


def _starts(power: Power, count: int) -> list[Floats]:
    """Layers spread over the power, evenly or in its upper half, wide or narrow; quiet noise."""
    share = np.cumsum(power.power) / power.power.sum()
    low, high = np.interp([0.1, 0.9], share, power.frequency_hz)
    noise = np.log(np.quantile(power.power[power.power > 0], 0.05)) / 2
    starts = []
    for places in ((np.arange(count) + 0.5) / count, np.linspace(0.5, 0.98, count)):
        centre = np.interp(places, share, power.frequency_hz)
        height = np.interp(centre, power.frequency_hz, power.power) + power.power.mean()
        for width_share, noise_db in product(_WIDTH_SHARES, _NOISE_DB):
            width = np.full(count, max(width_share * (high - low) / count, 2 * power.step_hz))
            parts = ([noise + noise_db * np.log(10) / 20], np.log(centre), np.log(width))
            starts.append(np.concatenate([*parts, np.log(height) / 2]))
    return starts


def _climbed(power: Power, theta: Floats, signs: Floats) -> tuple[float, Floats, Floats]:
    """Misfit, parameters and signs at the nearest maximum of the likelihood."""
    count, response = signs.size, coherent(signs)
    limits = limits_of(count, power, shaped=False)
    for _ in range(_ROUNDS):  # bins are finest near the layers, so they are drawn anew
        bins = bins_near(power, *centres_and_widths(theta, count))
        theta, _ = maximise(response, theta, bins, m=count, limits=limits, steps=60, enough=1e-3)
    # Misfits are compared on the same bins, whatever layers they belong to.
    common = bins_near(power, np.zeros(0), np.zeros(0))
    return misfit_of(common, response(theta, count, common)[0]), theta, signs
