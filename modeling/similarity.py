"""How alike two spectra are (eq. 6, docs/method/similarity.md)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from tactileq.modeling.arrays import Bools, Floats
from tactileq.modeling.equalizer.peq import PEQ
from tactileq.modeling.errors import InputError
from tactileq.modeling.models.ar_model import ARModel
from tactileq.modeling.recordings.recording import Recording
from tactileq.modeling.recordings.spectrum import Spectrum, smooth, spectrum

LOWEST_HZ = 10.0
HIGHEST_SHARE = 0.98
SIGMAS_HZ = (30.0, 5.0)
BAND_EDGES_HZ = (10, 20, 35, 60, 90, 130, 180, 250, 350, 480, 800, 1300, 2500)
EXPECTED_DRAWS = 8


@runtime_checkable
class SpectralFilter(Protocol):
    """The interface of one condition's filter: a `PEQ`, an `ARFilter`, or another kind."""

    @property
    def rate_hz(self) -> float: ...

    def response(self, frequency_hz: ArrayLike) -> Floats:
        """Magnitude in g per unit noise at (n,) frequencies."""


class PEQModel(Protocol):
    """A model that gives a PEQ for any speed and force."""

    def peq(self, speed_mm_s: float, force_n: float) -> PEQ: ...


@dataclass(frozen=True)
class SimilarityReport:
    """Likeness of a model's response (not of a rendering) and a recording's spectrum.

    Beside every GFC stand its floor (white noise of equal RMS) and its expected value (what the
    true spectrum scores on average: the recording's smoothed spectrum against random draws shaped
    by it). A model that follows the scatter of the very recording may exceed the expected value.
    `gfc30_deficit` is 1 − GFC30/expected.
    `band_energy_error_db` has one value per band of `BAND_EDGES_HZ` that the data reach, in dB,
    model over recording; `band_edges_hz` holds those bands' edges. The log-spectral distance is
    over the frequencies where the sensor's floor has left anything of the recording.
    """

    gfc30: float
    gfc5: float
    floor_gfc30: float
    floor_gfc5: float
    expected_gfc30: float
    expected_gfc5: float
    log_spectral_distance_db: float
    rms_error_db: float
    band_edges_hz: Floats
    band_energy_error_db: Floats
    gfc30_deficit: float


def gfc(a: ArrayLike, b: ArrayLike) -> float:
    """Goodness-of-fit coefficient |Σ ab| / √(Σa²·Σb²) of two (n,) magnitude spectra (eq. 6).

    0 … 1; both spectra smoothed alike. 1 only for proportional spectra: the level is not judged.

    Raises
    ------
    InputError
        For different shapes, values that are not finite, or a spectrum that is all zero.
    """
    first, second = _pair(a, b)
    # Scaled by the maxima first, so that squares neither overflow nor vanish.
    first, second = first / np.abs(first).max(), second / np.abs(second).max()
    product = abs(float(first @ second))
    return min(1.0, product / float(np.sqrt((first @ first) * (second @ second))))


def log_spectral_distance_db(a: ArrayLike, b: ArrayLike) -> float:
    """RMS of 20·log10 of the ratio of two (n,) magnitude spectra > 0, in dB."""
    first, second = _pair(a, b)
    if (lowest := min(first.min(), second.min())) <= 0:
        raise InputError(
            f"expected magnitudes above 0 for a log-spectral distance, got {lowest:g}; smooth the "
            "spectra or choose a band that holds signal."
        )
    return float(np.sqrt(np.mean((20 * np.log10(first / second)) ** 2)))


def band_energy_error_db(
    frequency_hz: ArrayLike, a: ArrayLike, b: ArrayLike
) -> tuple[Floats, Floats]:
    """Edges (k+1,) in Hz and 10·log10 of the energy ratio a over b in each of the k bands, dB.

    Bands of `BAND_EDGES_HZ` that hold no frequency of the data are left out at the upper end.
    """
    first, second = _pair(a, b)
    frequency = np.asarray(frequency_hz, dtype=np.float64)
    reached = sum(edge < frequency[-1] for edge in BAND_EDGES_HZ[:-1])
    edges = np.array(BAND_EDGES_HZ[: reached + 1], dtype=np.float64)
    inside = [(frequency >= low) & (frequency < high) for low, high in pairwise(edges)]
    with np.errstate(divide="ignore", invalid="ignore"):
        errors = [10 * np.log10((first[i] ** 2).sum() / (second[i] ** 2).sum()) for i in inside]
    return edges, np.array(errors)


def report(
    recording: Recording | Spectrum,
    model: PEQModel | ARModel | SpectralFilter,
    *,
    rng: np.random.Generator | None = None,
) -> SimilarityReport:
    """All measures of docs/method/similarity.md for one condition, 10 Hz … 0.98 of Nyquist.

    Parameters
    ----------
    recording : Recording or Spectrum
        A Spectrum names no condition, so it goes with a filter.
    model : TextureModel, RegressedModel, ARModel; or PEQ, ARFilter
        A model is taken at the recording's speed and force. Any object with `rate_hz` and
        `response(frequency_hz)` will do for a filter.
    rng : Generator, optional
        Draws for the expected GFC; by default a generator of fixed seed, so that a table repeats.
    """
    fitted, measured = _at_condition(recording, model)
    return reports(measured, [fitted], rng=rng)[0]


def reports(
    measured: Spectrum,
    filters: Iterable[SpectralFilter],
    *,
    rng: np.random.Generator | None = None,
) -> list[SimilarityReport]:
    """`report` of several filters and one spectrum, against the same draws for the expected GFC.

    Parameters
    ----------
    measured : Spectrum
        At the rate of the filters.
    rng : Generator, optional
        As in `report`.
    """
    target = target_of(measured, rng=rng)
    return [target.report(fitted) for fitted in filters]


@dataclass(frozen=True, eq=False)
class Target:
    """A spectrum that filters are compared with, and what does not depend on the filter.

    Parameters
    ----------
    truths : tuple of (n,) ndarray
        Its smoothed magnitudes in the compared band, in the order of `SIGMAS_HZ`.
    floors, expected : tuple of float
        GFCs of white noise and of the true spectrum, in that order.
    """

    measured: Spectrum
    truths: tuple[Floats, ...]
    floors: tuple[float, ...]
    expected: tuple[float, ...]

    def report(self, fitted: SpectralFilter) -> SimilarityReport:
        """All measures of one filter at the spectrum's rate."""
        measured, truths = self.measured, self.truths
        frequency, band = measured.frequency_hz, _compared(measured)
        step_hz = measured.rate_hz / measured.n_samples
        response = fitted.response(frequency)
        smoothed = [smooth(response, sigma_hz, step_hz=step_hz)[band] for sigma_hz in SIGMAS_HZ]
        scores = [gfc(ours, truth) for ours, truth in zip(smoothed, truths, strict=True)]
        heard = measured.magnitude[band] > 0  # where the sensor's floor took all, dB mean nothing
        edges, band_errors = band_energy_error_db(
            frequency[band], response[band], measured.magnitude[band] * np.sqrt(np.pi) / 2
        )
        return SimilarityReport(
            gfc30=scores[0],
            gfc5=scores[1],
            floor_gfc30=self.floors[0],
            floor_gfc5=self.floors[1],
            expected_gfc30=self.expected[0],
            expected_gfc5=self.expected[1],
            log_spectral_distance_db=log_spectral_distance_db(smoothed[0][heard], truths[0][heard]),
            rms_error_db=_rms_error_db(response[band], measured.magnitude[band]),
            band_edges_hz=edges,
            band_energy_error_db=band_errors,
            gfc30_deficit=1 - scores[0] / self.expected[0],
        )


def target_of(measured: Spectrum, *, rng: np.random.Generator | None = None) -> Target:
    """A spectrum made ready for any number of filters.

    Parameters
    ----------
    measured : Spectrum
        Not silent.
    rng : Generator, optional
        As in `report`.
    """
    rng = np.random.default_rng(0) if rng is None else rng
    band = _compared(measured)
    step_hz = measured.rate_hz / measured.n_samples
    outline = measured.smoothed()
    draws = _draws(outline, rng)
    truths, floors, expected = [], [], []
    for sigma_hz in SIGMAS_HZ:
        truth = measured.smoothed(sigma_hz)[band]
        shape = smooth(outline, sigma_hz, step_hz=step_hz)[band]
        drawn = [smooth(draw, sigma_hz, step_hz=step_hz)[band] for draw in draws]
        truths.append(truth)
        floors.append(gfc(np.ones(truth.size), truth))
        expected.append(float(np.mean([gfc(shape, draw) for draw in drawn])))
    return Target(measured, tuple(truths), tuple(floors), tuple(expected))


def _compared(measured: Spectrum) -> Bools:
    """10 Hz … 0.98 of the Nyquist frequency."""
    frequency = measured.frequency_hz
    return (frequency >= LOWEST_HZ) & (frequency <= HIGHEST_SHARE * measured.rate_hz / 2)


def _rms_error_db(response: Floats, magnitude: Floats) -> float:
    """Level of the model over the recording, dB: its expected power over the measured one.

    A Rayleigh-distributed bin of mean r has the mean square (4/π)r², and a response is that mean.
    """
    power = 4 / np.pi * float(np.sum(response**2))
    return 10 * float(np.log10(power / float(np.sum(magnitude**2))))


def _draws(shape: Floats, rng: np.random.Generator) -> list[Floats]:
    """Magnitudes of Gaussian noise whose mean magnitude is `shape`."""
    return [shape * rng.rayleigh(np.sqrt(2 / np.pi), shape.size) for _ in range(EXPECTED_DRAWS)]


def _at_condition(
    recording: Recording | Spectrum, model: PEQModel | ARModel | SpectralFilter
) -> tuple[SpectralFilter, Spectrum]:
    fitted = model if isinstance(model, SpectralFilter) else _filter_at(recording, model)
    if isinstance(recording, Spectrum):
        measured = recording
    else:
        measured = spectrum(recording, rate_hz=fitted.rate_hz)
    if measured.rate_hz != fitted.rate_hz:
        raise InputError(
            f"expected data that reach the model's rate of {fitted.rate_hz:g} Hz, got "
            f"{measured.rate_hz:g} Hz; fit a model at the data's rate."
        )
    return fitted, measured


def _filter_at(recording: Recording | Spectrum, model: PEQModel | ARModel) -> SpectralFilter:
    """A model's filter at the recording's condition."""
    if isinstance(recording, Spectrum):
        raise InputError(
            "expected a recording or a PEQ, got a spectrum (which names no speed and force) and a "
            "whole model; take model.peq(speed_mm_s, force_n), or an AR model's filter(…)."
        )
    if isinstance(model, ARModel):
        return model.filter(*recording.condition)
    return model.peq(*recording.condition)


def _pair(a: ArrayLike, b: ArrayLike) -> tuple[Floats, Floats]:
    first = np.asarray(a, dtype=np.float64)
    second = np.asarray(b, dtype=np.float64)
    if not (first.ndim == 1 and first.shape == second.shape and first.size > 0):
        raise InputError(
            f"expected two spectra of one length, got shapes {first.shape} and {second.shape}; "
            "compare spectra on the same frequencies."
        )
    for magnitude in (first, second):
        if not np.isfinite(magnitude).all() or not magnitude.any():
            what = "only 0" if np.isfinite(magnitude).all() else "NaN or inf"
            raise InputError(f"expected finite spectra that hold signal, got {what}; correct them.")
    return first, second
