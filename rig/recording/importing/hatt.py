"""Models of the Penn Haptic Texture Toolkit as recordings.

The toolkit (Culbertson, Lopez Delgado and Kuchenbecker, IEEE Haptics Symposium 2014) holds one XML
file per texture: filters driven by white noise, at scattered speeds (mm/s) and forces (N) that a
triangulation joins, for an acceleration in m/s². It may not be redistributed; users bring it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.signal import freqz, lfilter, resample

from tactileq.modeling import InputError, Recording, RecordingSet
from tactileq.modeling.arrays import Floats, Integers
from tactileq.modeling.checks import (
    HIGHEST_FORCE_N,
    HIGHEST_SPEED_MM_S,
    LOWEST_RATE_HZ,
    check_duration,
)
from tactileq.modeling.errors import counted
from tactileq.modeling.models.line_spectral import prediction_coefficients
from tactileq.modeling.perception.thresholds import STANDARD_GRAVITY_M_S2
from tactileq.modeling.recordings.recording import MIN_SAMPLES
from tactileq.modeling.seeds import generator, number_of

AGREEMENT = 5e-5
HATT_UNITS = {"AccelUnits": "m/s^2", "SpeedUnits": "mm/s", "ForceUnits": "N"}
# A pole 2 Hz wide has forgotten where it began to 1e-5 by then.
_RUN_IN_S = 2.0
_INSIDE = -1e-9
# Twice the area of a triangle, relative to the fastest speed and the strongest force, that is a
# line: one of several, and the largest of a file, whose six decimals give lines an area.
_FLAT = 1e-12
_ONLY_LINES = 1e-6
_TINY = 1e-300
# Toolkit models describe their surfaces whatever the length of the record.
DURATION_S = 10.0


@dataclass(frozen=True, eq=False)
class ARMAFilter:
    """Numerator and denominator of a filter of white noise of unit variance at its rate; in g."""

    numerator: Floats
    denominator: Floats
    rate_hz: float

    def response(self, frequency_hz: ArrayLike) -> Floats:
        """Magnitude response at (n,) frequencies of 0 … rate/2, in g per unit noise."""
        frequency = np.asarray(frequency_hz, dtype=np.float64)
        _, response = freqz(self.numerator, self.denominator, worN=frequency, fs=self.rate_hz)
        return np.abs(response)


@dataclass(frozen=True, eq=False)
class HattTexture:
    """One texture of the toolkit: n filters at scattered conditions, joined by t triangles.

    Parameters
    ----------
    rate_hz : float
        The rate at which the filters run.
    conditions : (n, 2) ndarray
        Speed (mm/s) and force (N) of each filter.
    triangles : (t, 3) ndarray of int
        Rows of `conditions`, from 0.
    ar_frequencies, ma_frequencies : (n, p), (n, q) ndarray
        Line spectral frequencies, radians per sample; q may be 0.
    variances : (n,) ndarray
        Of the driving noise, (m/s²)².
    gains : (n,) ndarray
        Of the moving-average part; 1 where there is none.
    """

    material: str
    rate_hz: float
    conditions: Floats
    triangles: Integers
    ar_frequencies: Floats
    ma_frequencies: Floats
    variances: Floats
    gains: Floats

    def weights(self, speed_mm_s: float, force_n: float) -> Floats:
        """Barycentric weights (n,) of the filters at one condition, two or three of them not 0.

        Outside all triangles those of the nearest point of their hull count; distances are taken
        relative to the fastest speed and the strongest force.
        """
        scale = self.conditions.max(axis=0)
        point = np.array([speed_mm_s, force_n]) / scale
        corners = (self.conditions / scale)[self.triangles]
        shares = _barycentric(corners, point)
        chosen = int(np.argmax(shares.min(axis=1)))
        weights = np.zeros(len(self.conditions))
        if shares[chosen].min() >= _INSIDE:
            inside = np.clip(shares[chosen], 0.0, 1.0)
            weights[self.triangles[chosen]] = inside / inside.sum()
            return weights
        triangle, side, along = _nearest_on_sides(corners, point)
        first, second = self.triangles[triangle, [side, (side + 1) % 3]]
        weights[first], weights[second] = 1 - along, along
        return weights

    def nearest(self, speed_mm_s: float, force_n: float) -> tuple[float, float]:
        """The condition itself, or the nearest one within the hull of the triangles."""
        speed, force = self.weights(speed_mm_s, force_n) @ self.conditions
        return float(speed), float(force)

    def filter(self, speed_mm_s: float, force_n: float) -> ARMAFilter:
        """The filter at one speed (mm/s) and force (N).

        Line spectral frequencies, variance and gain are weighted linearly, as the toolkit's own
        renderer does: between two conditions the power of the driving noise is blended, not its
        amplitude. Its filters at rest and at no force have variance 0, so levels fade there.
        """
        return self._blended(self.weights(speed_mm_s, force_n))

    def _blended(self, weights: Floats) -> ARMAFilter:
        denominator = prediction_coefficients(weights @ self.ar_frequencies)
        numerator = np.ones(1)
        if self.ma_frequencies.shape[1]:
            moving = prediction_coefficients(weights @ self.ma_frequencies)
            numerator = np.concatenate([numerator, moving])
        level_g = float(np.sqrt(weights @ self.variances)) * float(weights @ self.gains)
        return ARMAFilter(
            numerator * level_g / STANDARD_GRAVITY_M_S2,
            np.concatenate([[1.0], denominator]),
            self.rate_hz,
        )

    def recordings(
        self,
        speeds_mm_s: Sequence[float],
        forces_n: Sequence[float],
        *,
        duration_s: float = DURATION_S,
        rate_hz: float | None = None,
        seed: int = 0,
    ) -> RecordingSet:
        """Simulated recordings over a grid: Gaussian noise through the filter of each condition.

        Conditions outside the hull of the file's models, and silent ones, have no recording.

        Parameters
        ----------
        speeds_mm_s, forces_n : sequence of float
            > 0.
        duration_s : float
            > 0.
        rate_hz : float, optional
            At most the toolkit's (the default): there is nothing above its Nyquist frequency.
        seed : int
            Textures of one seed differ in their noise.

        Raises
        ------
        InputError
            For values out of range, and where no condition lies within the hull and vibrates.
        """
        rate = self._checked_rate(rate_hz, duration_s=duration_s)
        grid = [(float(speed), float(force)) for speed in speeds_mm_s for force in forces_n]
        for condition in grid:
            self.check_condition(*condition)
        inside = self.conditions_inside(grid)
        if not inside:
            raise InputError(
                f"{self.material}: expected a condition within the file's models and with "
                f"vibration, got none of {len(grid)}; choose another grid, or take the file's own "
                "conditions."
            )
        return RecordingSet(
            self._recording(
                condition,
                self.filter(*condition),
                rate,
                duration_s=duration_s,
                rng=self._generator(seed, number),
            )
            for number, condition in enumerate(grid)
            if condition in inside
        )

    def own_recordings(
        self, *, duration_s: float = DURATION_S, rate_hz: float | None = None, seed: int = 0
    ) -> RecordingSet:
        """Simulated recordings at the file's own conditions, each through its own filter.

        Parameters
        ----------
        duration_s, rate_hz, seed
            As in `recordings`.

        Returns
        -------
        RecordingSet
            One recording per filter with vibration, at exactly its speed and force (see
            `vibrating`), in the order of the file.

        Raises
        ------
        InputError
            For values out of range, and where no filter vibrates.
        """
        rate = self._checked_rate(rate_hz, duration_s=duration_s)
        rows = self.vibrating()
        for row in rows:
            self.check_condition(*self._condition(row))
        alone = np.eye(len(self.conditions))
        return RecordingSet(
            self._recording(
                self._condition(row),
                self._blended(alone[row]),
                rate,
                duration_s=duration_s,
                rng=self._generator(seed, row),
            )
            for row in rows
        )

    def vibrating(self) -> list[int]:
        """The rows of `conditions` whose filters vibrate: at a speed, a force and a level above 0.

        Of filters at one condition (to the six decimals of the files) the first one counts.

        Raises
        ------
        InputError
            Where there is none.
        """
        level = self.variances * np.abs(self.gains)
        loud = np.flatnonzero((self.conditions > 0).all(axis=1) & (level > 0))
        if not loud.size:
            raise InputError(
                f"{self.material}: expected a model with vibration, at a speed, a force and a "
                f"variance above 0, got none among {counted(len(self.conditions), 'model')}; "
                "leave the file out."
            )
        first: dict[tuple[float, float], int] = {}
        for row in loud.tolist():
            first.setdefault(condition_key(*self._condition(row)), row)
        return list(first.values())

    def conditions_inside(
        self, conditions: Sequence[tuple[float, float]]
    ) -> list[tuple[float, float]]:
        """Those of some (speed, force) conditions that the file covers, and not with silence."""
        return [
            (speed, force)
            for speed, force in conditions
            if np.allclose((speed, force), self.nearest(speed, force), rtol=1e-9)
            and self.filter(speed, force).numerator.any()
        ]

    def _condition(self, row: int) -> tuple[float, float]:
        speed, force = self.conditions[row].tolist()
        return speed, force

    def _generator(self, seed: int, number: int) -> np.random.Generator:
        return generator([seed, number_of(self.material)], number)

    def _checked_rate(self, rate_hz: float | None, *, duration_s: float) -> float:
        """The rate of recordings, once it and their duration are usable."""
        rate = self.rate_hz if rate_hz is None else rate_hz
        if not LOWEST_RATE_HZ <= rate <= self.rate_hz:
            raise InputError(
                f"{self.material}: expected a rate from {LOWEST_RATE_HZ:.0f} to the file's "
                f"{self.rate_hz:g} Hz, got {rate:g}; leave it out to keep the file's."
            )
        check_duration(duration_s, self.rate_hz)
        if round(duration_s * rate) < MIN_SAMPLES:
            raise InputError(
                f"{self.material}: expected at least {MIN_SAMPLES} samples, got {duration_s:g} s "
                f"at {rate:g} Hz; give a longer duration, or leave the rate out."
            )
        return rate

    def check_condition(self, speed_mm_s: float, force_n: float) -> None:
        """Refuse a speed and a force for which no recording can be made: 0, NaN, beyond hands."""
        if not (0 < speed_mm_s <= HIGHEST_SPEED_MM_S and 0 < force_n <= HIGHEST_FORCE_N):
            raise InputError(
                f"{self.material}: expected speeds and forces above 0, up to "
                f"{HIGHEST_SPEED_MM_S:g} mm/s and {HIGHEST_FORCE_N:g} N, got {speed_mm_s:g} mm/s "
                f"and {force_n:g} N; choose others."
            )

    def _recording(
        self,
        condition: tuple[float, float],
        fitted: ARMAFilter,
        rate_hz: float,
        *,
        duration_s: float,
        rng: np.random.Generator,
    ) -> Recording:
        run_in = round(_RUN_IN_S * self.rate_hz)
        noise = rng.standard_normal(run_in + round(duration_s * self.rate_hz))
        samples = lfilter(fitted.numerator, fitted.denominator, noise)[run_in:]
        if rate_hz != self.rate_hz:
            samples = resample(samples, round(samples.size * rate_hz / self.rate_hz))
        return Recording(samples, rate_hz, *condition, self.material, simulated=True)


def _cross(a: Floats, b: Floats) -> Floats:
    area: Floats = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return area


def _areas(corners: Floats) -> Floats:
    """Twice the signed areas (t,) of triangles (t, 3, 2)."""
    return _cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def _barycentric(corners: Floats, point: Floats) -> Floats:
    """Barycentric coordinates (t, 3) of a point (2,) in each triangle (t, 3, 2); −inf in lines."""
    to_corners = corners - point
    areas = np.stack(
        [_cross(to_corners[:, (i + 1) % 3], to_corners[:, (i + 2) % 3]) for i in range(3)], axis=-1
    )
    whole = _areas(corners)
    flat = np.abs(whole) < _FLAT
    shares = areas / np.where(flat, 1.0, whole)[:, None]
    return np.where(flat[:, None], -np.inf, shares)


def _nearest_on_sides(corners: Floats, point: Floats) -> tuple[int, int, float]:
    """Triangle, side (from corner i to i+1) and share along it of the point nearest to `point`."""
    start, stop = corners, np.roll(corners, -1, axis=1)
    side = stop - start
    along = ((point - start) * side).sum(axis=-1) / np.maximum((side**2).sum(axis=-1), _TINY)
    along = np.clip(along, 0.0, 1.0)
    distance = np.linalg.norm(start + along[..., None] * side - point, axis=-1)
    triangle, which = np.unravel_index(int(np.argmin(distance)), distance.shape)
    return int(triangle), int(which), float(along[triangle, which])


def condition_key(speed_mm_s: float, force_n: float) -> tuple[float, float]:
    """A condition to the six decimals that the files hold."""
    return round(float(speed_mm_s), 6), round(float(force_n), 6)
