"""The rival: an autoregressive model of a texture over its grid (METHOD 4, last paragraph)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from modeling.errors import InputError, check_rate, check_texture_name
from modeling.fitting import only_unit, recording_spectra, spectra_by_condition
from modeling.grid import Cells, Floats, check_axes, fill_grid, grid_axes, within_grid
from modeling.line_spectral import (
    check_line_spectral,
    line_spectral_frequencies,
    prediction_coefficients,
    reflection_coefficients,
)
from modeling.recording import UNITS, Recording, RecordingSet
from modeling.saved import SavedModel
from modeling.spectra import Spectrum

HIGHEST_ORDER = 40
# White noise 90 dB below the record keeps an order that the data do not need from being singular.
_REGULARISATION = 1e-9


class ARParameters(NamedTuple):
    """At n points: line spectral frequencies (n, p) in radians per sample, gain (n,)."""

    line_spectral_frequencies: Floats
    gain: Floats


@dataclass(frozen=True, eq=False, kw_only=True)
class ARFilter:
    """An all-pole filter driven by white noise w: y[n] = gain·w[n] − Σ a_k·y[n−k].

    Parameters
    ----------
    coefficients : (p,) array_like
        a₁ … a_p, p ≥ 1; the filter must be stable.
    gain : float
        Standard deviation of the innovation, ≥ 0, in g per unit noise.
    rate_hz : float
        The rate at which it runs and w has unit variance.

    Raises
    ------
    InputError
        For values that are not finite, a negative gain, or an unstable filter.
    """

    coefficients: Floats
    gain: float
    rate_hz: float

    def __post_init__(self) -> None:
        coefficients = np.array(self.coefficients, dtype=np.float64)
        coefficients.setflags(write=False)
        object.__setattr__(self, "coefficients", coefficients)
        if coefficients.ndim != 1 or not coefficients.size:
            raise InputError(
                "expected one row of filter coefficients, got an array of shape "
                f"{coefficients.shape}; give a₁ … a_p without the leading 1."
            )
        reflection = reflection_coefficients(coefficients)
        if not (np.abs(reflection) < 1).all():
            raise InputError(
                f"expected a stable all-pole filter, got {coefficients.tolist()}, whose poles are "
                "not all within the unit circle; fit it again."
            )
        if not (np.isfinite(self.gain) and self.gain >= 0):
            raise InputError(f"expected a gain of at least 0, got {self.gain}; fix it.")
        check_rate(self.rate_hz)

    def response(self, frequency_hz: ArrayLike) -> Floats:
        """Magnitude response gain/|A| at (n,) frequencies of 0 … rate/2, in g per unit noise.

        The one-sided power spectral density of the output is response² · 2/rate_hz (g²/Hz).
        """
        from scipy.signal import freqz

        frequency = np.asarray(frequency_hz, dtype=np.float64)
        inverse = np.concatenate([[1.0], self.coefficients])
        _, response = freqz([self.gain], inverse, worN=frequency, fs=self.rate_hz)
        return np.abs(response)


@dataclass(frozen=True, eq=False, kw_only=True)
class ARModel(SavedModel):
    """An all-pole filter of order p in each condition of a grid of S speeds × F forces.

    Parameters
    ----------
    texture : str
        Name of the surface.
    rate_hz : float
        The rate at which the filters run and the driving noise has unit variance.
    speeds_mm_s, forces_n : (S,), (F,) array_like
        Rising, > 0, one at least.
    line_spectral_frequencies : (S, F, p) array_like
        Radians per sample, rising in (0, π); p ≥ 1.
    gains : (S, F) array_like
        Standard deviation of the innovation, ≥ 0, in `unit` per unit noise.
    level_sd_db : (S, F) array_like
        Standard deviation of the overall level in dB, from the length of the records.
    unit : {"g", "arbitrary"}
    simulated : bool
        True where the recordings behind it were simulated.
    interpolated : (S, F) array_like of bool, optional
        Condition without a recording, filled from its neighbours.

    Raises
    ------
    InputError
        For wrong shapes or values out of range.
    """

    FORMAT = "tactileq.ar-model"

    texture: str
    rate_hz: float
    speeds_mm_s: Floats
    forces_n: Floats
    line_spectral_frequencies: Floats
    gains: Floats
    level_sd_db: Floats
    unit: str = "g"
    simulated: bool = False
    interpolated: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, dtype=bool))

    def __post_init__(self) -> None:
        check_texture_name(self.texture)
        check_rate(self.rate_hz)
        if self.unit not in UNITS or not isinstance(self.simulated, bool):
            raise InputError(
                f"{self.texture}: expected a unit among {', '.join(UNITS)} and true or false for "
                f"simulated, got {self.unit!r} and {self.simulated!r}; fit the model again."
            )
        if np.size(self.interpolated) == 0:
            object.__setattr__(self, "interpolated", np.zeros(np.shape(self.gains), dtype=bool))
        self._freeze(_ARRAYS, booleans=("interpolated",))
        check_axes(self.speeds_mm_s, self.forces_n)
        self._check_arrays()

    def _check_arrays(self) -> None:
        grid = (self.speeds_mm_s.size, self.forces_n.size)
        for name in _ARRAYS[2:]:
            shape = getattr(self, name).shape
            filters = name == "line_spectral_frequencies"
            if shape[:2] != grid or len(shape) != 2 + filters or 0 in shape:
                raise InputError(
                    f"expected {name} on the model's grid of {grid[0]} speeds × {grid[1]} forces, "
                    f"got the shape {shape}; fit the model again."
                )
        for name in ("gains", "level_sd_db"):
            values = getattr(self, name)
            if not (np.isfinite(values).all() and (values >= 0).all()):
                raise InputError(
                    f"expected finite {name} of at least 0, got {values.min()}; fit it again."
                )
        check_line_spectral(self.line_spectral_frequencies, f"the model of {self.texture}")

    @property
    def order(self) -> int:
        """Order of the filters, p."""
        return int(self.line_spectral_frequencies.shape[2])

    @property
    def n_parameters(self) -> int:
        """Numbers per condition: p + 1."""
        return self.order + 1

    def parameters(self, speed_mm_s: ArrayLike, force_n: ArrayLike) -> ARParameters:
        """Bilinear interpolation over the grid, with the edges of METHOD 9.

        Line spectral frequencies are blended, not coefficients: any mean of rising frequencies
        rises, so every blend is stable. The gain is blended linearly, as a `TextureModel`'s gains
        are: it may be 0 in a condition, where a mean of logarithms would be 0 all around it.

        Parameters
        ----------
        speed_mm_s, force_n : (n,) array_like
            As in `TextureModel.parameters`.
        """
        hand = within_grid(self.speeds_mm_s, self.forces_n, speed_mm_s=speed_mm_s, force_n=force_n)
        cells = Cells(self.speeds_mm_s, self.forces_n, hand=hand)
        return ARParameters(
            cells.blend(self.line_spectral_frequencies), cells.blend(self.gains) * hand.ramp
        )

    def filter(self, speed_mm_s: float, force_n: float) -> ARFilter:
        """The filter at one speed (mm/s) and force (N), interpolated as in `parameters`."""
        at = self.parameters(speed_mm_s, force_n)
        return ARFilter(
            coefficients=prediction_coefficients(at.line_spectral_frequencies[0]),
            gain=float(at.gain[0]),
            rate_hz=self.rate_hz,
        )


_ARRAYS = (
    "speeds_mm_s",
    "forces_n",
    "line_spectral_frequencies",
    "gains",
    "level_sd_db",
    "interpolated",
)


def fit_ar(recordings: RecordingSet | Iterable[Recording], *, order: int) -> ARModel:
    """Model one texture by an all-pole filter per condition, on the grid of `fit_texture`.

    Yule–Walker: the autocorrelation is the inverse transform of the power spectrum, from which the
    sensor's floor has been subtracted (Burg's method needs the waveform, in which it cannot be),
    averaged over the repeats of a condition. Records are tapered at their ends, which makes it as
    good as Burg's: the gain is the geometric mean of the spectrum, so that what a rectangular
    window spills into quiet bands would count in full. Holes of the grid are interpolated linearly.

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
        Where the recordings lie on a line across the grid.
    InputError
        Where they mix textures or units, have contact without speed, or are shorter than the
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
    if not (isinstance(order, int) and 1 <= order <= highest):
        raise InputError(
            f"expected a whole order of 1 to {highest} for records of {samples} samples, got "
            f"{order}; choose another."
        )
