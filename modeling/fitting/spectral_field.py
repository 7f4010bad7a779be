"""A rival without layers: the log power spectrum as one smooth random field.

docs/method/fitting.md#field-of-spectra
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import ArrayLike

from tactileq.modeling.arrays import Floats
from tactileq.modeling.errors import InputError
from tactileq.modeling.estimation.likelihood import NEPER_POWER_DB, Power, signal_power
from tactileq.modeling.fitting.conditions import only_unit, recording_spectra, spectra_by_condition
from tactileq.modeling.models.grid import Condition
from tactileq.modeling.recordings.recording import Recording
from tactileq.modeling.recordings.recording_set import RecordingSet
from tactileq.modeling.recordings.spectrum import Spectrum, mean_spectrum

# A band is no narrower than this many lines and this share of its frequency.
BAND_LINES, BAND_SHARE = 4, 0.04
# Prior variances relative to the field's: of the mean, of slopes and of curvatures in ln v, ln F.
TREND = np.array([30.0, 10.0, 10.0, 1.0, 1.0, 1.0])
LENGTHS = (0.5, 1.0, 2.0, 4.0)  # of ln v and ln F, among which the likelihood chooses
# Of the field over ln f before the texture's own covariance is learnt: standard deviation of the
# log power, length, and what this prior counts in conditions.
PRIOR_SD, PRIOR_LENGTH, PRIOR_CONDITIONS = 0.3, 1.0, 20.0
ROUNDS, STEPS, SCORING_STEPS = 3, 4, 3
LARGEST_EXCESS = 3.0  # of a line's power over what is expected, relative: no further in one step


class Eigen(NamedTuple):
    """A covariance by its n eigenvalues, ≥ 0, and eigenvectors (n, n)."""

    values: Floats
    vectors: Floats

    def product(self, other: Floats) -> Floats:
        """The covariance times an (n, m) matrix."""
        return np.asarray(self.vectors * self.values @ (self.vectors.T @ other))


@dataclass(frozen=True, eq=False, kw_only=True)
class FieldFilter:
    """The spectrum of a field in one condition.

    Parameters
    ----------
    frequency_hz : (B,) ndarray
        Of the bands.
    magnitude : (B,) ndarray
        In g per unit noise at `rate_hz`.
    """

    frequency_hz: Floats
    magnitude: Floats
    rate_hz: float

    def response(self, frequency_hz: ArrayLike) -> Floats:
        """Magnitude at (n,) frequencies, log-linear over ln f, constant beyond the bands."""
        frequency = np.maximum(np.asarray(frequency_hz, dtype=np.float64), self.frequency_hz[0])
        log = np.interp(np.log(frequency), np.log(self.frequency_hz), np.log(self.magnitude))
        return np.asarray(np.exp(log))


@dataclass(frozen=True, eq=False, kw_only=True)
class SpectralField:
    """Log power in B bands, predicted at any speed and force from K conditions.

    Parameters
    ----------
    rate_hz : float
        At which the driving noise has unit variance.
    frequency_hz, mean : (B,) ndarray
        Of the bands; log power about which the field varies.
    places : (K, 2) ndarray
        ln v and ln F, less those of `centre`.
    centre : (2,) ndarray
    lengths : (2,) ndarray
        Over which the field changes, in ln v and ln F.
    weights : (K, B) ndarray
        What each condition's covariance with a place contributes to the log power there.
    space : Eigen
        Covariance of the conditions.
    covariance : Eigen
        Of the bands, in units of their noise.
    noise : (B,) ndarray
        Variance of a record's log power.
    """

    rate_hz: float
    frequency_hz: Floats
    mean: Floats
    places: Floats
    centre: Floats
    lengths: Floats
    weights: Floats
    space: Eigen
    covariance: Eigen
    noise: Floats

    @property
    def n_parameters(self) -> int:
        """Numbers per condition: one per band."""
        return int(self.frequency_hz.size)

    def filter(self, speed_mm_s: float, force_n: float) -> FieldFilter:
        """The spectrum at one speed (mm/s, > 0) and force (N, > 0), recorded or not."""
        place = np.log([[speed_mm_s, force_n]]) - self.centre
        to_records = _over_places(place, self.places, self.lengths)[0]
        return FieldFilter(
            frequency_hz=self.frequency_hz,
            magnitude=np.exp((self.mean + to_records @ self.weights) / 2),
            rate_hz=self.rate_hz,
        )

    def sd_db(self, speed_mm_s: float, force_n: float) -> Floats:
        """Posterior standard deviation of the bands' levels there, (B,)."""
        place = np.log([[speed_mm_s, force_n]]) - self.centre
        to_records = _over_places(place, self.places, self.lengths)[0]
        own = _over_places(place, place, self.lengths)[0, 0]
        (s, u), (c, v) = self.space, self.covariance
        explained = (to_records @ u) ** 2 @ (c * c / (np.outer(s, c) + 1))
        variance = self.noise * (v * v @ np.maximum(own * c - explained, 0.0))
        return np.asarray(NEPER_POWER_DB * np.sqrt(variance))


def fit_spectral_field(recordings: RecordingSet | Iterable[Recording]) -> SpectralField:
    """The field of spectra of one texture.

    Parameters
    ----------
    recordings : RecordingSet or iterable of Recording
        One texture, one unit; any rates, any conditions, one at least. Repeats of a condition are
        averaged, silent recordings left out.

    Raises
    ------
    InputError
        If they mix textures or units, have contact without speed, or are all silent.
    """
    records = recordings if isinstance(recordings, RecordingSet) else RecordingSet(recordings)
    only_unit(records)
    return fit_field_to_spectra(recording_spectra(records))


def fit_field_to_spectra(measured: Sequence[tuple[Recording, Spectrum]]) -> SpectralField:
    """The same from spectra that `recording_spectra` has prepared."""
    powers: dict[Condition, Power] = {}
    for condition, found in spectra_by_condition(measured).items():
        heard = [spectrum for spectrum in found if spectrum.magnitude.any()]
        power = signal_power(mean_spectrum(heard), empty_below_db=-np.inf) if heard else None
        if power is not None and power.weight.any():
            powers[condition] = power
    if not powers:
        raise InputError(
            f"{measured[0][0].texture}: expected a recording with vibration, got silence in all "
            f"of {len(measured)} recordings; check the sensor, or leave its floor out."
        )
    edges = _band_edges(list(powers.values()))
    banded = [_in_bands(power, edges) for power in powers.values()]
    frequency = np.sqrt(edges[1:] * edges[:-1])
    places = np.log(np.array(list(powers)))
    return _fitted(places, frequency, banded, rate_hz=next(iter(powers.values())).rate_hz)


def _band_edges(powers: Sequence[Power]) -> Floats:
    """Edges (B + 1,) in Hz between the lines of the shortest record."""
    shortest = max(powers, key=lambda power: power.step_hz)
    step_hz, frequency = shortest.step_hz, shortest.frequency_hz
    highest = min(power.frequency_hz[-1] for power in powers)
    frequency = frequency[frequency <= highest]
    passed = np.cumsum(1 / np.maximum(BAND_LINES, BAND_SHARE * frequency / step_hz))
    count = max(1, round(passed[-1]))
    band = np.floor((passed - passed[0] / 2) / passed[-1] * count)
    between = frequency[np.flatnonzero(np.diff(band))] + step_hz / 2
    ends = frequency[[0, -1]] + step_hz / 2 * np.array([-1, 1])
    return np.concatenate((ends[:1], between, ends[1:]))


def _in_bands(power: Power, edges: Floats) -> tuple[Floats, Floats]:
    """Log of the mean power, (B,), NaN where nothing is left of it, and number of lines."""
    band = np.searchsorted(edges, power.frequency_hz) - 1
    inside = (band >= 0) & (band < edges.size - 1)
    band, weight = band[inside], power.weight[inside]
    lines: Floats = np.bincount(band, weight, edges.size - 1).astype(np.float64)
    total = np.bincount(band, weight * power.power[inside], edges.size - 1)
    mean = np.where(lines > 0, total, np.nan) / np.where(lines > 0, lines, 1.0)
    return np.log(mean) + 2 * np.log(power.scale), lines * power.records


def _fitted(
    places: Floats, frequency_hz: Floats, banded: Sequence[tuple[Floats, Floats]], *, rate_hz: float
) -> SpectralField:
    """Lengths by likelihood and the bands' covariance by expectation–maximisation, in turns."""
    logs, lines = (np.array(values) for values in zip(*banded, strict=True))
    noise = 1 / np.maximum(lines.mean(axis=0), 1)
    x, unit = np.log(frequency_hz), np.sqrt(noise)
    # The log of a mean over n lines is too low by about 1/(2n).
    start = np.array([_filled(row, x) for row in logs + 0.5 / np.maximum(lines, 1)])
    mean = Polynomial.fit(x, start.mean(axis=0), min(1, x.size - 1))(x)
    centre = places.mean(axis=0)
    places = places - centre
    lengths = np.array(list(product(LENGTHS, repeat=2)))
    spaces = [_eigen(_over_places(places, places, each)) for each in lengths]
    prior = PRIOR_SD**2 * _over_bands(x) / np.outer(unit, unit)
    found, response, best = _eigen(prior), (start - mean) / unit, 0
    for step in range(ROUNDS + SCORING_STEPS):
        if step < ROUNDS:
            best = int(np.argmax([_likelihood(space, found, response) for space in spaces]))
            for _ in range(STEPS):
                found = _learnt(spaces[best], found, response, prior=prior)
        expected = spaces[best].product(_weights(spaces[best], found, response))
        response = expected + _excess(logs - mean - unit * expected) / unit
    return SpectralField(
        rate_hz=rate_hz,
        frequency_hz=frequency_hz,
        mean=mean,
        places=places,
        centre=centre,
        lengths=lengths[best],
        weights=unit * _weights(spaces[best], found, response),
        space=spaces[best],
        covariance=found,
        noise=noise,
    )


def _filled(row: Floats, x: Floats) -> Floats:
    """Without the holes where no line of a band is left."""
    known = np.isfinite(row)
    return np.asarray(np.interp(x, x[known], row[known]))


def _excess(above: Floats) -> Floats:
    """P/S − 1 from the log of P/S: Fisher scoring's step in ln S; 0 where nothing is known."""
    step = np.exp(np.minimum(above, np.log1p(LARGEST_EXCESS))) - 1
    return np.where(np.isfinite(step), step, 0.0)


def _over_places(a: Floats, b: Floats, lengths: Floats) -> Floats:
    """Covariance (n, m) of the field and its trend between places (n, 2) and (m, 2)."""
    apart = np.abs(a[:, None] - b[None]) / lengths
    return np.asarray(np.exp(-apart.sum(axis=2)) + (_terms(a) * TREND) @ _terms(b).T)


def _terms(places: Floats) -> Floats:
    """Trend: 1, a, b, a², ab, b²."""
    a, b = places.T
    return np.column_stack((np.ones(a.size), a, b, a * a, a * b, b * b))


def _over_bands(x: Floats) -> Floats:
    """Correlation (B, B) over ln f before anything is known: Matérn's of order 5/2."""
    r = np.sqrt(5) / PRIOR_LENGTH * np.abs(x[:, None] - x)
    return np.asarray((1 + r + r * r / 3) * np.exp(-r))


def _eigen(covariance: Floats) -> Eigen:
    values, vectors = np.linalg.eigh(covariance)
    return Eigen(np.maximum(values, 0.0), vectors)


# Below, in units of the noise, response (K, B) has the covariance space ⊗ bands + 1. In the
# eigenvectors of both its elements are independent, with variances s·c + 1.


def _rotated(space: Eigen, bands: Eigen, response: Floats) -> tuple[Floats, Floats]:
    """The response in the eigenvectors of both, and its variances, (K, B)."""
    variance = np.outer(space.values, bands.values) + 1
    return np.asarray(space.vectors.T @ response @ bands.vectors), variance


def _likelihood(space: Eigen, bands: Eigen, response: Floats) -> float:
    """Log likelihood but for a constant."""
    rotated, variance = _rotated(space, bands, response)
    return float(-0.5 * np.sum(rotated**2 / variance + np.log(variance)))


def _weights(space: Eigen, bands: Eigen, response: Floats) -> Floats:
    """(K, B), whose product with the covariance of places is the field's posterior mean."""
    rotated, variance = _rotated(space, bands, response)
    return np.asarray(space.vectors @ (bands.values * rotated / variance) @ bands.vectors.T)


def _learnt(space: Eigen, bands: Eigen, response: Floats, *, prior: Floats) -> Eigen:
    """One step of expectation–maximisation in the bands' covariance, inverse Wishart before."""
    rotated, variance = _rotated(space, bands, response)
    mean = np.sqrt(space.values)[:, None] * bands.values / variance * rotated
    moment = mean.T @ mean
    moment.flat[:: moment.shape[0] + 1] += (bands.values / variance).sum(axis=0)
    moment = bands.vectors @ moment @ bands.vectors.T
    return _eigen((PRIOR_CONDITIONS * prior + moment) / (PRIOR_CONDITIONS + response.shape[0]))
