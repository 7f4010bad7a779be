"""Which layers are peaks of their own, and which only fill the shape of another layer."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tactileq.modeling.arrays import Bools, Floats, Integers
from tactileq.modeling.equalizer.bands import band_response
from tactileq.modeling.equalizer.peq import PEQ
from tactileq.modeling.models.texture_model import TextureModel

POINTS = 400
LEAST_REACH_HZ = 10.0
LOWEST_HZ = 5.0
HIGHEST_SHARE = 0.98
SHAPING_SHARE = 0.5
TINY = 1e-300


class OwnPeaks(NamedTuple):
    """The role of each of m layers in the response.

    Parameters
    ----------
    is_peak : (m,) ndarray of bool
        It has a local maximum of the response within half its width (10 Hz at least) in most
        recorded conditions, nearer to it than to any other layer. Where no layer has one the
        loudest counts as a peak.
    fills : (m,) ndarray of int
        The peak (0-based) that a layer without a maximum of its own widens, flattens or sharpens:
        the loudest one at its place. −1 for peaks, and for what makes up less than half of the
        response there in most conditions: such a layer is hidden, but shapes nothing.
    """

    is_peak: Bools
    fills: Integers

    @property
    def groups(self) -> list[tuple[int, ...]]:
        """Layers that go together or not at all: a peak and those that fill its shape."""
        fills = self.fills.tolist()
        peaks = [layer for layer, peak in enumerate(fills) if peak < 0]
        return [
            tuple(layer for layer, filled in enumerate(fills) if peak in (layer, filled))
            for peak in peaks
        ]


def own_peaks(model: TextureModel) -> OwnPeaks:
    """Which layers of a model are peaks of their own, and which peaks the others fill."""
    m = model.n_layers
    recorded = [tuple(at) for at in np.argwhere(~model.interpolated)]
    found = [_one_condition(model, at) for at in recorded]
    if not (m and found):
        return OwnPeaks(np.ones(m, dtype=bool), np.full(m, -1, dtype=np.intp))
    is_peak = np.mean([condition.own for condition in found], axis=0) > 0.5
    if not is_peak.any():
        is_peak[int(np.argmax(np.sum([condition.rms for condition in found], axis=0)))] = True
    shaping = np.mean([condition.shaping for condition in found], axis=0) > 0.5
    loudness = np.sum([condition.share for condition in found], axis=0)
    loudest = np.argmax(np.where(is_peak[None, :], loudness, -1.0), axis=1)
    return OwnPeaks(is_peak, np.where(shaping & ~is_peak, loudest, -1).astype(np.intp))


class _Condition(NamedTuple):
    """Of m layers: who has a maximum, who makes up half of the response at its own place, how loud
    the others are there (m, m), and each one's RMS."""

    own: Bools
    shaping: Bools
    share: Floats
    rms: Floats


def _one_condition(model: TextureModel, at: tuple[int, ...]) -> _Condition:
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
    own = np.zeros(centre.size, dtype=bool)
    for distances in away:
        if distances.min() <= 1:  # of layers in one place the loudest
            nearest = np.flatnonzero(distances == distances.min())
            own[nearest[np.argmax(peq.band_rms[nearest])]] = True
    bands = band_response(centre, centres_hz=centre, bandwidths_hz=width, rate_hz=peq.rate_hz)
    loudness = (np.abs(peq.gains)[:, None] * np.abs(bands)).T
    share = loudness / np.maximum(loudness.sum(axis=1, keepdims=True), TINY)
    shaping = np.abs(peq.gains) >= SHAPING_SHARE * peq.response(centre)
    return _Condition(own, shaping, share, peq.band_rms)


def _maxima(peq: PEQ) -> Floats:
    """Frequencies of the response's local maxima, (k,), in Hz."""
    near = peq.frequencies_hz[:, None] + peq.bandwidths_hz[:, None] * np.linspace(-1, 1, 33)
    frequency = np.geomspace(LOWEST_HZ, HIGHEST_SHARE * peq.rate_hz / 2, POINTS)
    frequency = np.unique(np.concatenate((frequency, near.ravel())))
    frequency = frequency[(frequency >= 1.0) & (frequency < peq.rate_hz / 2)]
    response = peq.response(frequency)
    inside = (response[1:-1] > response[:-2]) & (response[1:-1] >= response[2:])
    return np.asarray(frequency[1:-1][inside], dtype=np.float64)
