"""Which layers are peaks of their own, and which only fill the shape of another's."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from modeling.model import TextureModel
from modeling.peq import PEQ, Floats, band_response

PEAK = -1
POINTS = 400
LEAST_REACH_HZ = 10.0
LOWEST_HZ = 5.0
HIGHEST_SHARE = 0.98


def filled_layers(model: TextureModel) -> NDArray[np.intp]:
    """The layer that each one fills, (m,) of 0-based indices; −1 for peaks of their own.

    A peak of its own has a local maximum of the response within half its width (10 Hz at least) in
    most recorded conditions, nearer to it than to any other layer. What has none widens, flattens
    or sharpens the peak of the layer that is the loudest at its place. Where no layer has a maximum
    the loudest one counts as a peak.
    """
    m = model.n_layers
    recorded = np.argwhere(~model.interpolated)
    seen, shares, levels = np.zeros(m), np.zeros((m, m)), np.zeros(m)
    for at in map(tuple, recorded):
        own, share, level = _one_condition(model, at)
        seen, shares, levels = seen + own, shares + share, levels + level
    peaks = seen > 0.5 * len(recorded)
    if m and not peaks.any():
        peaks[int(np.argmax(levels))] = True
    loudest = np.argmax(np.where(peaks[None, :], shares, -1.0), axis=1) if m else np.zeros(0)
    filled: NDArray[np.intp] = np.where(peaks, PEAK, loudest).astype(np.intp)
    return filled


def _one_condition(model: TextureModel, at: tuple[int, ...]) -> tuple[Floats, Floats, Floats]:
    """Layers with a maximum of their own (m,); who is how loud at whose place (m, m); levels."""
    peq = PEQ(
        noise_gain=float(model.noise_gains[at]),
        frequencies_hz=model.frequencies_hz[at],
        bandwidths_hz=model.bandwidths_hz[at],
        gains=model.gains[at],
        rate_hz=model.rate_hz,
    )
    centre, width = peq.frequencies_hz, peq.bandwidths_hz
    maxima = _maxima(peq)
    reach = np.maximum(width / 2, LEAST_REACH_HZ)
    away = np.abs(maxima[:, None] - centre[None, :]) / reach[None, :]
    own = np.zeros(centre.size)
    if away.size:
        nearest = np.argmin(away, axis=1)
        own[nearest[away.min(axis=1) <= 1]] = 1.0
    bands = band_response(centre, centres_hz=centre, bandwidths_hz=width, rate_hz=peq.rate_hz)
    loudness = (np.abs(peq.gains)[:, None] * np.abs(bands)).T
    total = np.maximum(loudness.sum(axis=1, keepdims=True), 1e-300)
    return own, loudness / total, peq.band_rms


def _maxima(peq: PEQ) -> Floats:
    """Frequencies of the response's local maxima, (k,), in Hz."""
    near = peq.frequencies_hz[:, None] + peq.bandwidths_hz[:, None] * np.linspace(-1, 1, 33)
    frequency = np.geomspace(LOWEST_HZ, HIGHEST_SHARE * peq.rate_hz / 2, POINTS)
    frequency = np.unique(np.concatenate((frequency, near.ravel())))
    frequency = frequency[(frequency >= 1.0) & (frequency < peq.rate_hz / 2)]
    response = peq.response(frequency)
    inside = (response[1:-1] > response[:-2]) & (response[1:-1] >= response[2:])
    return np.asarray(frequency[1:-1][inside], dtype=np.float64)
