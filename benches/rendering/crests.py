"""Crest factors of uniform and of Gaussian noise, broadband and through a layer's band."""

from __future__ import annotations

import numpy as np

from tactileq.modeling.arrays import Floats
from tactileq.modeling.equalizer.bands import band_response
from tactileq.modeling.rendering.noise import stream_key, white_noise

RATE_HZ = 5000.0
CENTRE_HZ = 300.0


def crest_db(signals: Floats) -> Floats:
    """Crest factor, largest magnitude over RMS, in dB, of (…, n) signals: (…)."""
    rms = np.sqrt(np.mean(signals**2, axis=-1))
    crest: Floats = 20 * np.log10(np.abs(signals).max(axis=-1) / rms)
    return crest


def crest_difference_db(
    width_hz: float, *, duration_s: float, streams: int, seed: int = 0
) -> float:
    """By how much peaks of the rendered uniform noise are below those of Gaussian noise (dB).

    Mean crest factors behind a band of this width (NaN: of the broadband noise itself). Both noises
    are white and of unit variance, so their power spectra are equal, also behind a filter.
    """
    count = round(duration_s * RATE_HZ)
    uniform = np.stack([white_noise(stream_key(seed, i), 0, count) for i in range(streams)])
    gaussian = np.random.default_rng(seed).standard_normal((streams, count))
    crests = (crest_db(through_band(noise, width_hz=width_hz)) for noise in (gaussian, uniform))
    peaky, flat = (float(crest.mean()) for crest in crests)
    return peaky - flat


def through_band(noise: Floats, *, width_hz: float) -> Floats:
    """The steady output of a unit-gain band at 300 Hz for (…, n) periodic noise; NaN: the noise."""
    if np.isnan(width_hz):
        return noise
    count = noise.shape[-1]
    response = band_response(
        np.fft.rfftfreq(count, 1 / RATE_HZ),
        centres_hz=[CENTRE_HZ],
        bandwidths_hz=[width_hz],
        rate_hz=RATE_HZ,
    )[0]
    return np.fft.irfft(np.fft.rfft(noise) * response, count)
