"""From a spectrum to noise gain and layers by the paper's recipe, in two readings.

`paper` reads the recipe plainly: B is the full width at half maximum of the smoothed peak and G its
height. That counts the noise floor twice and the smoothing as width. `paper-consistent` fits the
peak above the floor, takes the smoothing out of its width, and chooses gains such that the model,
smoothed alike, has the measured heights (docs/method/estimation.md).
"""

from __future__ import annotations

import numpy as np

from tactileq.modeling.arrays import Bools, Floats
from tactileq.modeling.equalizer.bands import (
    HIGHEST_BANDWIDTH_SHARE,
    LOWEST_BANDWIDTH_HZ,
    LOWEST_FREQUENCY_HZ,
    band_response,
)
from tactileq.modeling.estimation.layers import EstimatorName, Layers
from tactileq.modeling.estimation.paper_deviations import smoothed_level_sd_db
from tactileq.modeling.recordings.spectrum import SMOOTHING_HZ, Spectrum, smooth

NOISE_BAND = (0.8, 1.0)  # of the Nyquist frequency (2.0–2.5 kHz at 5 kHz)
# A hill counts as a peak where it rises above its saddle by more than the smoothed spectrum's own
# scatter: the paper names no limit, and with none every ripple of the floor would be a layer.
PROMINENCE_SD = 1.0
RAYLEIGH_VARIATION = np.sqrt(4 / np.pi - 1)
WINDOW_WIDTHS = 1.5
UNRESOLVED_S_HZ = 5.0
FWHM_PER_S = 2 * np.sqrt(2 * np.log(2))
BANDWIDTH_PER_S = 1.36
GAIN_STEPS = 12
HIDDEN_SHARE = 0.5


def find_peak_frequencies(spectrum: Spectrum) -> Floats:
    """Frequencies (Hz, rising) of the peaks of the 30 Hz smoothed spectrum.

    A peak is a local maximum above the noise amount, below 0.8 of the Nyquist frequency, whose
    prominence exceeds the smoothed spectrum's standard deviation there (0.52/√(2√π·30 Hz·T),
    relative).
    """
    from scipy.signal import find_peaks

    smoothed = spectrum.smoothed()
    relative_sd = RAYLEIGH_VARIATION / np.sqrt(
        2 * np.sqrt(np.pi) * SMOOTHING_HZ * spectrum.duration_s
    )
    peaks, found = find_peaks(smoothed, height=noise_amount(spectrum), prominence=0.0)
    clear = found["prominences"] > PROMINENCE_SD * relative_sd * smoothed[peaks]
    frequency = spectrum.frequency_hz[peaks[clear]]
    legal = frequency >= LOWEST_FREQUENCY_HZ
    # The noise amount is taken where there are no peaks, so none is looked for there.
    legal &= frequency < NOISE_BAND[0] * spectrum.rate_hz / 2
    peak_frequency: Floats = frequency[legal]
    return peak_frequency


def noise_amount(spectrum: Spectrum) -> float:
    """A_w: mean magnitude between 0.8 and 1.0 of the Nyquist frequency, in g per unit noise."""
    low, high = (share * spectrum.rate_hz / 2 for share in NOISE_BAND)
    band = (spectrum.frequency_hz >= low) & (spectrum.frequency_hz <= high)
    return float(spectrum.magnitude[band].mean())


def fit_layers(
    spectrum: Spectrum,
    frequencies_hz: Floats,
    *,
    fallback_bandwidths_hz: Floats,
    estimator: EstimatorName,
) -> Layers:
    """Widths and gains, by the paper's recipe, of layers whose frequencies are known.

    Parameters
    ----------
    frequencies_hz : (m,) ndarray
    fallback_bandwidths_hz : (m,) ndarray
        Taken where the width's fit fails; NaN where there is none (then the smoothing's own).
    estimator : {"paper", "paper-consistent"}
    """
    consistent = estimator == "paper-consistent"
    smoothed, floor = spectrum.smoothed(), noise_amount(spectrum)
    heights = smoothed - floor if consistent else smoothed
    fits = [_peak_width(spectrum.frequency_hz, heights, f) for f in frequencies_hz]
    bandwidth, unresolved = _bandwidths(np.array(fits, dtype=np.float64), consistent)
    fitted_s = np.where(unresolved, np.nan, fits)
    failed = ~np.isfinite(bandwidth)
    instead = np.where(
        np.isfinite(fallback_bandwidths_hz), fallback_bandwidths_hz, FWHM_PER_S * SMOOTHING_HZ
    )
    bandwidth = np.where(failed, instead, bandwidth)
    bandwidth = np.clip(bandwidth, LOWEST_BANDWIDTH_HZ, HIGHEST_BANDWIDTH_SHARE * spectrum.rate_hz)
    at_peak = np.interp(frequencies_hz, spectrum.frequency_hz, smoothed)
    if consistent:
        gains, hidden = _consistent_gains(
            spectrum, frequencies_hz, bandwidth, at_peak - floor, floor
        )
        unresolved = (unresolved & ~failed) | hidden
    else:
        gains = at_peak
    level_sd_db = smoothed_level_sd_db(
        spectrum,
        heights,
        frequencies_hz=frequencies_hz,
        fitted_s_hz=fitted_s,
        deconvolved=consistent,
    )
    return Layers(floor, frequencies_hz, bandwidth, gains, level_sd_db, unresolved)


def _gaussian_misfit(shape: Floats, offset: Floats, values: Floats) -> Floats:
    height, s = shape
    misfit: Floats = height * np.exp(-0.5 * (offset / s) ** 2) - values
    return misfit


def _gaussian_jacobian(shape: Floats, offset: Floats, values: Floats) -> Floats:
    height, s = shape
    bell = np.exp(-0.5 * (offset / s) ** 2)
    return np.column_stack([bell, height * bell * offset**2 / s**3])


def _peak_width(frequency_hz: Floats, heights: Floats, centre_hz: float) -> float:
    """Standard deviation s (Hz) of a Gaussian fitted within ±1.5·max(30 Hz, s); NaN on failure."""
    from scipy.optimize import leastsq

    s = SMOOTHING_HZ
    for _ in range(2):
        reach = WINDOW_WIDTHS * max(SMOOTHING_HZ, s)
        near = np.abs(frequency_hz - centre_hz) <= reach
        offset, values = frequency_hz[near] - centre_hz, heights[near]
        if values.size < 4 or not (values > 0).any():
            return np.nan
        top = float(values.max())
        # For a few numbers `least_squares` takes longer to prepare than MINPACK to find them.
        (height, width), _, _, _, status = leastsq(
            _gaussian_misfit,
            (1.0, s),
            args=(offset, values / top),
            Dfun=_gaussian_jacobian,
            full_output=True,
            ftol=1e-8,
            xtol=1e-8,
            gtol=1e-8,
            maxfev=200,
        )
        s = abs(float(width))
        if not (1 <= status <= 4 and height > 0 and 0 < s < frequency_hz[-1]):
            return np.nan
    return s


def _bandwidths(fitted_s_hz: Floats, consistent: bool) -> tuple[Floats, Bools]:
    """−3 dB widths from fitted s, and which of them the smoothing hides.

    docs/method/estimation.md#paper-consistent
    """
    if not consistent:
        return FWHM_PER_S * fitted_s_hz, np.zeros(fitted_s_hz.shape, dtype=bool)
    excess = fitted_s_hz**2 - SMOOTHING_HZ**2
    unresolved = excess < UNRESOLVED_S_HZ**2
    s = np.sqrt(np.where(unresolved, UNRESOLVED_S_HZ**2, excess))
    return BANDWIDTH_PER_S * s, unresolved


def _consistent_gains(
    spectrum: Spectrum, frequencies_hz: Floats, bandwidths_hz: Floats, targets: Floats, floor: float
) -> tuple[Floats, Bools]:
    """Gains ≥ 0 that give the smoothed coherent model its measured heights above the floor.

    A multiplicative fixed point, each step held to a factor of 2. Where the skirts of neighbours
    reach a layer's height by themselves it has no such gain; then it keeps half of the gain that
    it would need alone, and is marked as hidden.
    """
    step_hz = spectrum.rate_hz / spectrum.n_samples
    bands = band_response(
        spectrum.frequency_hz,
        centres_hz=frequencies_hz,
        bandwidths_hz=bandwidths_hz,
        rate_hz=spectrum.rate_hz,
    )
    # The smoothed value at a layer's frequency is a weighted sum over all frequencies; reflected
    # smoothing is symmetric, so a smoothed impulse holds the weights.
    impulses = np.zeros(bands.shape)
    impulses[np.arange(frequencies_hz.size), np.rint(frequencies_hz / step_hz).astype(int)] = 1.0
    weights = smooth(impulses, SMOOTHING_HZ, step_hz=step_hz)
    targets = np.maximum(targets, 0.0)
    alone = targets.copy()
    for _ in range(GAIN_STEPS):
        reached = (weights * np.abs(floor + alone[:, None] * bands)).sum(axis=1) - floor
        alone = alone * _step(targets, reached)
    gains = alone.copy()
    for _ in range(GAIN_STEPS):
        reached = weights @ np.abs(floor + gains @ bands) - floor
        gains = np.maximum(gains * _step(targets, reached), HIDDEN_SHARE * alone)
    return gains, gains <= HIDDEN_SHARE * alone


def _step(targets: Floats, reached: Floats) -> Floats:
    factor = np.divide(targets, reached, out=np.full(targets.shape, 2.0), where=reached > 0)
    step: Floats = np.clip(factor, 0.5, 2.0)
    return step
