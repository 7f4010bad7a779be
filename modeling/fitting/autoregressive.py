"""Fitting the rival: autoregressive filters by the Yule–Walker equations."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from tactileq.modeling.arrays import Floats
from tactileq.modeling.checks import is_whole
from tactileq.modeling.errors import InputError
from tactileq.modeling.fitting.conditions import only_unit, recording_spectra, spectra_by_condition
from tactileq.modeling.models.ar_model import ARFilter, ARModel
from tactileq.modeling.models.grid import fill_grid, grid_axes
from tactileq.modeling.models.line_spectral import line_spectral_frequencies
from tactileq.modeling.recordings.recording import Recording
from tactileq.modeling.recordings.recording_set import RecordingSet
from tactileq.modeling.recordings.spectrum import Spectrum

HIGHEST_ORDER = 40
# White noise 90 dB below the record keeps an order that the data do not need from being singular.
_REGULARISATION = 1e-9


def fit_ar(recordings: RecordingSet | Iterable[Recording], *, order: int) -> ARModel:
    """Model one texture by an all-pole filter per condition, on the grid of `fit_texture`.

    Yule–Walker: the autocorrelation is the inverse transform of the power spectrum, from which the
    sensor's floor has been subtracted (Burg's method needs the waveform, in which it cannot be),
    averaged over the repeats of a condition. Records are tapered at their ends, which makes it as
    good as Burg's: the gain is the geometric mean of the spectrum, so that what a rectangular
    window leaks into quiet bands would count in full. Holes of the grid are interpolated linearly.

    Parameters
    ----------
    recordings : RecordingSet or iterable of Recording
        One texture, one unit; any rates.
    order : int
        p, 1 … 40, and below half the number of samples.

    Returns
    -------
    ARModel
        At 5 kHz, or at the lowest rate among the recordings where that is lower.

    Raises
    ------
    GridError
        If the recordings lie on a line across the grid.
    InputError
        If they mix textures or units, have contact without speed, or are shorter than the
        order asks for.
    """
    records = recordings if isinstance(recordings, RecordingSet) else RecordingSet(recordings)
    only_unit(records)
    return fit_ar_spectra(recording_spectra(records), order=order)


def fit_ar_spectra(measured: Sequence[tuple[Recording, Spectrum]], *, order: int) -> ARModel:
    """Model one texture from spectra that `recording_spectra` has prepared; see `fit_ar`.

    Silent conditions count as not recorded.
    """
    first = measured[0][0]
    heard = [pair for pair in measured if pair[1].magnitude.any()]
    by_condition = spectra_by_condition(heard or measured)
    _check_order(order, min(s.n_samples for found in by_condition.values() for s in found))
    speeds, forces = grid_axes(by_condition)
    rows = {condition: _fit_row(found, order) for condition, found in by_condition.items()}
    full, interpolated = fill_grid(rows, first.texture)
    return ARModel(
        texture=first.texture,
        rate_hz=measured[0][1].rate_hz,
        speeds_mm_s=np.array(speeds),
        forces_n=np.array(forces),
        line_spectral_frequencies=full[:, :, :order],
        gains=full[:, :, order],
        level_sd_db=full[:, :, order + 1],
        unit=first.unit,
        simulated=any(r.simulated for r, _ in measured),
        interpolated=interpolated,
    )


def fit_filter(spectra: Sequence[Spectrum], *, order: int) -> ARFilter:
    """The all-pole filter of one condition, by Yule–Walker on its mean autocorrelation.

    Parameters
    ----------
    spectra : sequence of Spectrum
        One or more repeats at one rate.
    order : int
        1 … 40, and below half the number of samples.
    """
    from scipy.linalg import solve_toeplitz

    _check_order(order, min(s.n_samples for s in spectra))
    lags = np.array([_autocorrelation(s)[: order + 1] for s in spectra])
    r = np.average(lags, axis=0, weights=[s.n_samples for s in spectra])
    if r[0] <= 0:  # the sensor's floor took all of it
        return ARFilter(coefficients=np.zeros(order), gain=0.0, rate_hz=spectra[0].rate_hz)
    r[0] *= 1 + _REGULARISATION
    coefficients = solve_toeplitz(r[:-1], -r[1:])
    variance = r[0] + float(coefficients @ r[1:])
    return ARFilter(
        coefficients=coefficients, gain=float(np.sqrt(variance)), rate_hz=spectra[0].rate_hz
    )


def _fit_row(spectra: Sequence[Spectrum], order: int) -> Floats:
    """Line spectral frequencies, gain and the level's standard deviation of one condition."""
    fitted = fit_filter(spectra, order=order)
    level_sd_db = _level_sd_db(fitted.coefficients, sum(s.n_samples for s in spectra))
    frequencies = line_spectral_frequencies(fitted.coefficients)
    return np.concatenate([frequencies, [fitted.gain, level_sd_db]])


def _autocorrelation(spectrum: Spectrum) -> Floats:
    """E[y(n)·y(n+lag)] from the power spectrum, lags 0 … n/2."""
    power = spectrum.without_leakage**2 * np.pi / 4  # |FFT|²/n, see `Spectrum.magnitude`
    autocorrelation: Floats = np.fft.irfft(power, n=spectrum.n_samples)
    return autocorrelation


def _level_sd_db(coefficients: Floats, samples: int) -> float:
    """Spread of the level of `samples` samples: independent bins of exponential power."""
    inverse = np.fft.rfft(np.concatenate([[1.0], coefficients]), n=samples)[1 : (samples + 1) // 2]
    power = np.abs(inverse) ** -2.0
    return float(10 / np.log(10) * np.sqrt(np.sum(power**2)) / np.sum(power))


def _check_order(order: int, samples: int) -> None:
    highest = min(HIGHEST_ORDER, (samples - 1) // 2)
    if not (is_whole(order) and 1 <= order <= highest):
        raise InputError(
            f"expected a whole order of 1 to {highest} for records of {samples} samples, got "
            f"{order}; choose another."
        )
