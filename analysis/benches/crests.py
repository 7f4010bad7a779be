"""Crest factors of uniform and of Gaussian noise, broadband and through a layer's band."""

from __future__ import annotations

import numpy as np
import pandas as pd

from modeling.arrays import Floats
from modeling.equalizer.bands import band_response
from modeling.rendering.noise import stream_key, white_noise

RATE_HZ = 5000.0
DURATIONS_S = (1.0, 10.0)
STREAMS = 100
CENTRE_HZ = 300.0
WIDTHS_HZ = (10.0, 30.0, 100.0, 300.0)


def crest_db(signals: Floats) -> Floats:
    """Crest factor, largest magnitude over RMS, in dB, of (…, n) signals: (…)."""
    rms = np.sqrt(np.mean(signals**2, axis=-1))
    crest: Floats = 20 * np.log10(np.abs(signals).max(axis=-1) / rms)
    return crest


def crest_table(*, streams: int = STREAMS, seed: int = 0) -> pd.DataFrame:
    """Mean crest factors of the noise that is rendered (uniform) and of Gaussian noise.

    Both are white and of unit variance, so their power spectra are equal, also behind a filter.

    Returns
    -------
    DataFrame
        One row per duration and signal: duration_s, width_hz (NaN: the broadband noise branch),
        uniform_db and gaussian_db, means over the streams; `simulated` is True.
    """
    longest = round(max(DURATIONS_S) * RATE_HZ)
    keys = [stream_key(seed, stream) for stream in range(streams)]
    noises = {
        "uniform_db": np.stack([white_noise(key, 0, longest) for key in keys]),
        "gaussian_db": np.random.default_rng(seed).standard_normal((streams, longest)),
    }
    rows = []
    for duration_s in DURATIONS_S:
        count = round(duration_s * RATE_HZ)
        for width_hz in (np.nan, *WIDTHS_HZ):
            row = {"duration_s": duration_s, "width_hz": width_hz}
            for name, noise in noises.items():
                signals = through_band(noise[:, :count], width_hz=width_hz)
                row[name] = float(crest_db(signals).mean())
            rows.append(row | {"simulated": True})
    return pd.DataFrame(rows)


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
