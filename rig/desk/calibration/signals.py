"""Test signals in g: noise in a band, with soft ends."""

from __future__ import annotations

import numpy as np

from tactileq.modeling.arrays import Floats
from tactileq.modeling.checks import check_duration
from tactileq.modeling.errors import InputError
from tactileq.modeling.rendering.limits import Limits
from tactileq.modeling.seeds import generator, number_of

FADE_S = 0.05
# The peaks of a noise of RMS 1: one sample in four million is larger.
CREST = 5.0
USUAL_SHARE = 0.5


def noise_signal(
    duration_s: float, *, rate_hz: float, rms_g: float, band_hz: tuple[float, float], seed: int = 0
) -> Floats:
    """Gaussian noise, white within a band and nothing outside; fades in and out over 50 ms.

    Parameters
    ----------
    rms_g : float
        Between the fades; peaks beyond 5 times as much are cut.
    band_hz : (low, high)

    Raises
    ------
    InputError
        For a band without a line of the spectrum.
    """
    check_duration(duration_s, rate_hz)
    count = round(duration_s * rate_hz)
    frequency = np.fft.rfftfreq(count, 1 / rate_hz)
    band = (frequency >= band_hz[0]) & (frequency <= band_hz[1])
    if not band.any():
        raise InputError(
            f"expected a band within 0…{rate_hz / 2:g} Hz, got {band_hz[0]:g} to {band_hz[1]:g} "
            "Hz; correct it."
        )
    noise = np.fft.irfft(
        np.fft.rfft(generator(seed, number_of("test noise")).standard_normal(count)) * band, count
    )
    noise *= rms_g / np.sqrt(np.mean(noise**2))
    noise = np.clip(noise, -CREST * rms_g, CREST * rms_g)
    fade = np.minimum(1.0, np.arange(1, count + 1) / (FADE_S * rate_hz))
    faded: Floats = noise * fade * fade[::-1]
    return faded


def usual_rms_g(limits: Limits) -> float:
    """Half of what the limits allow a noise."""
    return USUAL_SHARE * min(limits.rms, limits.peak / CREST)
