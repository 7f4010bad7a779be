"""How close a response is to the truth or to a recording's spectrum: the chart's five measures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tactileq.modeling import Spectrum, similarity
from tactileq.modeling.arrays import Bools, Floats
from tactileq.modeling.recordings.spectrum import smooth
from tactileq.modeling.similarity import (
    HIGHEST_SHARE,
    LOWEST_HZ,
    SIGMAS_HZ,
    SpectralFilter,
    target_of,
)

POINTS = 1000  # of the frequency axis, from 0 to the Nyquist frequency
COARSEST_STEP_HZ = 1.0
SILENT = 1e-3
BANDS = 9  # those of real surfaces' tables, 10 … 480 Hz


class Accuracy(NamedTuple):
    """One condition. The GFCs as in `tactileq.modeling.similarity`; the rest in dB.

    `distance_db`: RMS of the log ratio over frequency, of a known truth unsmoothed, of recordings
    smoothed with σ = 30 Hz. `bands_db`: RMS of the level errors in nine bands, 10 … 480 Hz.
    `level_db`: error of the level of the whole band, model over truth.
    """

    gfc30: float
    gfc5: float
    distance_db: float
    bands_db: float
    level_db: float


def frequencies_hz(rate_hz: float) -> Floats:
    """Where responses are compared: evenly from 0 to the Nyquist frequency."""
    points = min(POINTS, round(rate_hz / 2 / COARSEST_STEP_HZ))
    return np.linspace(0.0, rate_hz / 2, points + 1)


class ReferenceMagnitude:
    """A known magnitude, (n,) at `frequencies_hz` and > 0, by which responses are judged.

    10 Hz … 0.98 of the Nyquist frequency. A response more than 60 dB below the truth counts as 60
    dB below: a model may be silent where the truth is not.
    """

    def __init__(self, true: Floats, frequency_hz: Floats) -> None:
        self._true, self._frequency = true, frequency_hz
        self._band = _compared(frequency_hz)
        self._smoothed = self._smooth(true)

    def _smooth(self, magnitude: Floats) -> list[Floats]:
        step_hz = float(self._frequency[1])
        return [smooth(magnitude, sigma, step_hz=step_hz)[self._band] for sigma in SIGMAS_HZ]

    def accuracy(self, response: Floats) -> Accuracy:
        """Of a response, (n,)."""
        audible = np.maximum(response, SILENT * self._true)
        smoothed = zip(self._smooth(audible), self._smoothed, strict=True)
        gfc30, gfc5 = (similarity.gfc(*pair) for pair in smoothed)
        ours, truth = audible[self._band], self._true[self._band]
        _, bands = similarity.band_energy_error_db(self._frequency[self._band], ours, truth)
        return Accuracy(
            gfc30,
            gfc5,
            similarity.log_spectral_distance_db(ours, truth),
            rms(bands[:BANDS]),
            10 * float(np.log10(np.sum(ours**2) / np.sum(truth**2))),
        )


class RecordYardstick:
    """The same by a recording's spectrum, whose own scatter is in every figure; not silent."""

    def __init__(self, spectrum: Spectrum) -> None:
        self._target = target_of(spectrum)
        self._least = SILENT * spectrum.smoothed()

    def accuracy(self, heard: SpectralFilter) -> Accuracy:
        """Of a filter at the spectrum's rate."""
        report = self._target.report(_Audible(heard, self._least))
        return Accuracy(
            report.gfc30,
            report.gfc5,
            report.log_spectral_distance_db,
            rms(report.band_energy_error_db[:BANDS]),
            report.rms_error_db,
        )


@dataclass(frozen=True, eq=False)
class _Audible:
    """A filter that is at most 60 dB below a spectrum."""

    filter: SpectralFilter
    least: Floats

    @property
    def rate_hz(self) -> float:
        return self.filter.rate_hz

    def response(self, frequency_hz: ArrayLike) -> Floats:
        at_least: Floats = np.maximum(self.filter.response(frequency_hz), self.least)
        return at_least


def rms(values: Floats) -> float:
    """Root mean square of the finite ones among (n,) values; NaN where there is none."""
    finite = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(finite**2))) if finite.size else float("nan")


def over_conditions(found: Sequence[Accuracy]) -> dict[str, float]:
    """Means of the GFCs, RMS of what is in dB, and the worst level; NaN where nothing was found."""
    if not found:
        return {name: float("nan") for name in SUMMARIES}
    columns = dict(zip(Accuracy._fields, np.array(found).T, strict=True))
    return {
        "gfc30": float(columns["gfc30"].mean()),
        "gfc5": float(columns["gfc5"].mean()),
        "distance_db": rms(columns["distance_db"]),
        "bands_db": rms(columns["bands_db"]),
        "level_db": rms(columns["level_db"]),
        "worst_level_db": float(np.abs(columns["level_db"]).max()),
    }


SUMMARIES = (*Accuracy._fields, "worst_level_db")


def _compared(frequency_hz: Floats) -> Bools:
    """10 Hz … 0.98 of the Nyquist frequency."""
    compared: Bools = (frequency_hz >= LOWEST_HZ) & (
        frequency_hz <= HIGHEST_SHARE * frequency_hz[-1]
    )
    return compared
