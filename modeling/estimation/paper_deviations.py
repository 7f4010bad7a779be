"""How far sampling error moves a level that is read from the smoothed spectrum.

docs/method/estimation.md#level-deviations

A record of T seconds fixes the level of a band of width B to 10/ln 10/√(πBT) dB at best. Heights
and widths read from a smoothed spectrum do not reach that: the smoothing and the floor take part of
the signal, and an error of the width is one of the level, too.
"""

from __future__ import annotations

import numpy as np

from tactileq.modeling.arrays import Floats
from tactileq.modeling.recordings.spectrum import SMOOTHING_HZ, Spectrum, smooth

DB_PER_NEPER = float(20 / np.log(10))
# A layer without height above the floor would have an infinite deviation, which no file can hold.
WIDEST_NEPER = 2.0
WINDOW_WIDTHS = 1.5
SMOOTHING_REACH = 4.0  # gaussian_filter1d's own


def smoothed_level_sd_db(
    spectrum: Spectrum,
    heights: Floats,
    *,
    frequencies_hz: Floats,
    fitted_s_hz: Floats,
    deconvolved: bool,
) -> Floats:
    """Standard deviation of levels that are read from the 30 Hz smoothed spectrum, (m,), in dB.

    Propagation of errors: what each bin of the raw spectrum moves a level, 20·log10(G·√B), times
    the bin's deviation, √(4/π − 1) of its mean (Rayleigh) and independent of the others. Height and
    Gaussian width are linear in smoothed bins to first order; smoothing is its own transpose.

    Parameters
    ----------
    heights : (n,) ndarray
        The smoothed spectrum, in g per unit noise, less the floor where one is subtracted (whose
        own error, from many more bins, is left out).
    frequencies_hz : (m,) ndarray
    fitted_s_hz : (m,) ndarray
        Standard deviation of the Gaussian fitted to the smoothed peak, > 0; NaN where the width was
        not estimated, so that only the height brings in error.
    deconvolved : bool
        False: G is the height and B ∝ s (`paper`). True: the smoothing is taken out by
        s² = s_fit² − σ² and G = height·s_fit/s, as for two Gaussians (`paper-consistent`).

    Returns
    -------
    (m,) ndarray
        At most 17.4 dB.
    """
    nepers = [
        _deviation_nepers(spectrum, heights, centre_hz=f, s_hz=s, deconvolved=deconvolved)
        for f, s in zip(frequencies_hz.tolist(), fitted_s_hz.tolist(), strict=True)
    ]
    deviation_db: Floats = DB_PER_NEPER * np.minimum(nepers, WIDEST_NEPER)
    return deviation_db


def _deviation_nepers(
    spectrum: Spectrum, heights: Floats, *, centre_hz: float, s_hz: float, deconvolved: bool
) -> float:
    estimated = np.isfinite(s_hz)
    window_hz = WINDOW_WIDTHS * (max(SMOOTHING_HZ, s_hz) if estimated else SMOOTHING_HZ)
    step_hz = spectrum.rate_hz / spectrum.n_samples
    offset_hz = spectrum.frequency_hz - centre_hz
    near = np.abs(offset_hz) <= window_hz + SMOOTHING_REACH * SMOOTHING_HZ + step_hz
    offset_hz, heights = offset_hz[near], heights[near]
    pulls = _height_pulls(heights, offset_hz)
    if estimated:
        by_width = _width_pulls(heights, offset_hz, s_hz=s_hz, window_hz=window_hz)
        pulls += _share_of_width(s_hz, deconvolved) * by_width
    by_bin = smooth(pulls, SMOOTHING_HZ, step_hz=step_hz)
    return float(np.linalg.norm(by_bin * np.sqrt(1 - np.pi / 4) * spectrum.magnitude[near]))


def _share_of_width(s_hz: float, deconvolved: bool) -> float:
    """d ln(G·√B) by d ln s_fit: ½ from B; taking the smoothing out changes G and B with s_fit."""
    ratio = (SMOOTHING_HZ / s_hz) ** 2 if deconvolved else 0.0
    return (0.5 - ratio) / max(1 - ratio, 1e-6)


def _height_pulls(heights: Floats, offset_hz: Floats) -> Floats:
    """d ln of the height at the centre by d height, (n,)."""
    pulls = np.zeros(heights.shape)
    peak = int(np.argmin(np.abs(offset_hz)))
    pulls[peak] = 1 / max(heights[peak], 1e-100)
    return pulls


def _width_pulls(heights: Floats, offset_hz: Floats, *, s_hz: float, window_hz: float) -> Floats:
    """d ln s by d height, (n,), of a Gaussian fitted by least squares within the window."""
    inside = np.abs(offset_hz) <= window_hz
    offset = offset_hz[inside] / s_hz
    bell = np.exp(-0.5 * offset**2)
    top = (heights[inside] @ bell) / (bell @ bell)
    pulls = np.zeros(heights.shape)
    pulls[inside] = np.linalg.pinv(np.column_stack([bell, top * bell * offset**2]))[1]
    return pulls
