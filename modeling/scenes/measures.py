"""Distance of one response from another by a scene's measures: GFC30, bands, level.

The GFC of two spectra is the cosine of the angle between them. Angles, the RMS of band errors in dB
and the error of the level all obey the triangle inequality, so that errors of different origin add
up to a bound of their sum.
"""

from __future__ import annotations

from functools import cached_property
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tactileq.modeling.arrays import Bools, Floats
from tactileq.modeling.equalizer.bands import clamp_bands, rational_tan
from tactileq.modeling.errors import InputError
from tactileq.modeling.models.parameter_table import Parameters
from tactileq.modeling.models.texture_model import TextureModel
from tactileq.modeling.recordings.spectrum import smooth
from tactileq.modeling.scenes.hands import Range
from tactileq.modeling.scenes.scene import Bound
from tactileq.modeling.similarity import BAND_EDGES_HZ, HIGHEST_SHARE, LOWEST_HZ, SIGMAS_HZ

BANDS = 9
STEPS_HZ = (1.0, 5.0)  # of the frequency axis: a third of the narrowest layer, within these
TINY = 1e-150


class Features(NamedTuple):
    """What is compared of n responses.

    Parameters
    ----------
    direction : (n, f) ndarray
        Smoothed magnitudes (σ = 30 Hz) of unit length; all 0 of silence.
    bands_db : (n, b) ndarray
        Levels in the bands.
    level_db : (n,) ndarray
    """

    direction: Floats
    bands_db: Floats
    level_db: Floats

    def at(self, places: NDArray[Any]) -> Features:
        """Those of some of the responses."""
        return Features(*(part[places] for part in self))


class Errors(NamedTuple):
    """Errors of n responses, each (n,): angle (rad), RMS of the bands and of the level (dB)."""

    angle: Floats
    bands_db: Floats
    level_db: Floats

    def __add__(self, other: object) -> Errors:
        assert isinstance(other, Errors)
        return Errors(*(a + b for a, b in zip(self, other, strict=True)))

    def at(self, places: NDArray[Any]) -> Errors:
        """Those of some of the responses."""
        return Errors(*(part[places] for part in self))

    @property
    def key(self) -> bytes:
        """Equal exactly where errors are equal."""
        return b"".join(np.asarray(part).tobytes() for part in self)

    @property
    def gfc30(self) -> Floats:
        """Share of the attainable, which is 1."""
        return np.cos(np.minimum(self.angle, np.pi / 2))

    @staticmethod
    def largest(several: list[Errors]) -> Errors:
        """The largest of each kind at each place."""
        return Errors(*(np.max(parts, axis=0) for parts in zip(*several, strict=True)))

    @staticmethod
    def none(count: int) -> Errors:
        """Of responses that are the same."""
        return Errors(*(np.zeros(count) for _ in Errors._fields))

    def shares(self, bound: Bound) -> Floats:
        """Each error as a share of what the bound allows, (3, n); infinite where it allows none."""
        allowed = allowed_by(bound)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            ratios = [e / a for e, a in zip(self, allowed, strict=True)]
        return np.array([np.where(np.isnan(ratio), 0.0, ratio) for ratio in ratios])

    def within(self, bound: Bound, *, taken: Errors | None = None) -> Bools:
        """Where all errors, and what is taken already, are within a bound, (n,)."""
        both = self if taken is None else self + taken
        kept: Bools = np.all(
            [
                error <= allowed + ROUNDING
                for error, allowed in zip(both, allowed_by(bound), strict=True)
            ],
            axis=0,
        )
        return kept


ROUNDING = 1e-9  # of an error that is 0 but for rounding


def allowed_by(bound: Bound) -> tuple[float, float, float]:
    """The bound as `Errors` are: angle (rad), bands and level (dB)."""
    return float(np.arccos(bound.gfc30)), bound.bands_db, bound.level_db


class ComparedBand:
    """What of a response is compared, in the band that an actuator plays.

    Parameters
    ----------
    rate_hz : float
        Of the models.
    narrowest_hz : float
        Width of the narrowest layer.
    band_hz : (float, float), optional
        All of 10 Hz … 0.98 of the Nyquist frequency by default.

    Raises
    ------
    InputError
        For a band that holds none of what is compared.
    """

    def __init__(self, rate_hz: float, *, narrowest_hz: float, band_hz: Range | None) -> None:
        self.rate_hz = rate_hz
        self._step_hz = float(np.clip(narrowest_hz / 3, *STEPS_HZ))
        count = int(rate_hz / 2 / self._step_hz)
        self.frequency_hz = np.arange(count + 1) * self._step_hz
        low, high = LOWEST_HZ, HIGHEST_SHARE * rate_hz / 2
        if band_hz is not None:
            low, high = max(low, band_hz[0]), min(high, band_hz[1])
        inside = (self.frequency_hz >= low) & (self.frequency_hz <= high)
        if not inside.any():
            raise InputError(
                f"expected an actuator's band that reaches into {LOWEST_HZ:g}…"
                f"{HIGHEST_SHARE * rate_hz / 2:g} Hz, where a model of {rate_hz:g} Hz is judged, "
                f"got {low:g} to {high:g} Hz; correct band_hz."
            )
        self._inside = inside
        bands = [
            inside & (self.frequency_hz >= a) & (self.frequency_hz < b)
            for a, b in pairwise(BAND_EDGES_HZ[: BANDS + 1])
        ]
        kept = [band / band.sum() for band in bands if band.any()]
        self._bands = np.reshape(kept, (len(kept), inside.size)).T
        angle = np.pi / rate_hz * self.frequency_hz
        self._product = np.sin(angle) * np.cos(angle)
        self._sine_squared, self._cosine_squared = np.sin(angle) ** 2, np.cos(angle) ** 2

    @staticmethod
    def of(model: TextureModel, *, band_hz: Range | None) -> ComparedBand:
        """For a model and what is made of it; errors as above."""
        narrowest_hz = float(model.bandwidths_hz.min(initial=model.rate_hz))
        return ComparedBand(model.rate_hz, narrowest_hz=narrowest_hz, band_hz=band_hz)

    @cached_property
    def _smoothing(self) -> Floats:
        """What smooths magnitudes (f,) and thins them out: a smoothed spectrum says all in steps of
        a third of what it is smoothed with."""
        every = max(1, round(SIGMAS_HZ[0] / 3 / self._step_hz))
        chosen = np.flatnonzero(self._inside)[::every]
        unit = np.eye(self.frequency_hz.size)
        return smooth(unit, SIGMAS_HZ[0], step_hz=self._step_hz)[:, chosen]

    def features(self, parameters: Parameters) -> Features:
        """Of the responses of n sets of parameters."""
        return self.features_of(self.responses(parameters))

    def features_of(self, responses: Floats) -> Features:
        """Of n magnitudes (n, f) at `frequency_hz`."""
        smoothed = responses @ self._smoothing
        length = np.sqrt(np.sum(smoothed**2, axis=1, keepdims=True))
        power = responses**2
        return Features(
            smoothed / np.maximum(length, TINY),
            _db(power @ self._bands),
            _db(power[:, self._inside].sum(axis=1)),
        )

    def responses(self, parameters: Parameters) -> Floats:
        """|G_w + Σ G_i H_i| of n sets of parameters, (n, f)."""
        shape = parameters.noise_gain.size, self.frequency_hz.size
        real = np.broadcast_to(parameters.noise_gain[:, None], shape).copy()
        imaginary = np.zeros(shape)
        for layer in range(parameters.gains.shape[1]):
            band = self._band(
                parameters.frequencies_hz[:, layer], parameters.bandwidths_hz[:, layer]
            )
            gain = parameters.gains[:, layer, None]
            real += gain * band[0]
            imaginary += gain * band[1]
        return np.sqrt(real**2 + imaginary**2)

    def _band(self, centre_hz: Floats, width_hz: Floats) -> tuple[Floats, Floats]:
        """Real and imaginary part of H, (n, f) each: `band_response` without complex numbers."""
        centre, width, _ = clamp_bands(centre_hz, width_hz, rate_hz=self.rate_hz)
        g, k = (rational_tan(np.pi / self.rate_hz * x)[:, None] for x in (centre, width))
        through = (k * (1 + g * g)) * self._product
        against = (g * g) * self._cosine_squared - self._sine_squared
        scale = through / (through**2 + against**2)
        return through * scale, against * scale

    def power(self, parameters: Parameters) -> Floats:
        """Mean square in the band, (n,), in the model's unit squared."""
        power = self.responses(parameters)[:, self._inside] ** 2
        mean: Floats = power.sum(axis=1) * self._step_hz / (self.rate_hz / 2)
        return mean


def errors_between(ours: Features, truth: Features) -> Errors:
    """Errors of n responses against n others."""
    # The chord of two unit vectors resolves small angles, whose cosine rounds to 1.
    chord = np.sqrt(np.sum((ours.direction - truth.direction) ** 2, axis=1))
    bands = ours.bands_db - truth.bands_db
    rms = np.sqrt(np.mean(bands**2, axis=1)) if bands.shape[1] else np.zeros(len(bands))
    return Errors(
        2 * np.arcsin(np.minimum(chord / 2, 1.0)), rms, np.abs(ours.level_db - truth.level_db)
    )


def _db(power: Floats) -> Floats:
    return 10 * np.log10(np.maximum(power, TINY))
