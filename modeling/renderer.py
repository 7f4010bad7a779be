"""Rendering a texture model as a stroke goes on: the reference, sample by sample."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.signal import firwin

from modeling.errors import InputError
from modeling.model import TextureModel
from modeling.noise import stream_key, white_noise
from modeling.peq import Floats, band_coefficients, clamp_bands

UPDATE_S = 1e-3
_EDGE_SHARE = 0.2


@dataclass
class RenderCounters:
    """What the renderer had to correct so far."""

    lift_offs: int = 0
    clamped: int = 0


class Renderer:
    """Vibration of a texture model under a moving hand (eq. 1–2, METHOD 3 and 9).

    The state carries on from call to call: rendering in blocks of any size gives the same bits.

    Parameters
    ----------
    model : TextureModel
        What to render.
    rate_hz : float, optional
        Output rate, at least the model's (the default). Level and spectrum stay the same: w
        gets the variance rate/model rate and the noise branch ends at the model's Nyquist
        frequency (only a band's far skirts rise, by up to 1 dB, as the filter warps less).
    seed, stream : int
        Which noise; two renderers with the same pair give the same signal.

    Raises
    ------
    InputError
        For a rate below the model's.
    """

    def __init__(
        self, model: TextureModel, *, rate_hz: float | None = None, seed: int = 0, stream: int = 0
    ) -> None:
        self.model = model
        self.rate_hz = model.rate_hz if rate_hz is None else float(rate_hz)
        if not (np.isfinite(self.rate_hz) and self.rate_hz >= model.rate_hz):
            raise InputError(
                f"expected a rendering rate of at least the model's {model.rate_hz:g} Hz, got "
                f"{self.rate_hz:g}; render at that rate and resample."
            )
        # One parameter update per millisecond: 5 samples at 5 kHz (METHOD 9).
        self.update_samples = max(1, round(UPDATE_S * self.rate_hz))
        self.counters = RenderCounters()
        self._key = stream_key(seed, stream)
        self._position = 0
        self._state = [(0.0, 0.0)] * model.n_layers
        self._noise_gain = 0.0
        self._bands: list[tuple[float, ...]] = [(0.0,) * 5] * model.n_layers
        self._lowpass = _lowpass(model.rate_hz, self.rate_hz)

    def render(
        self, speed_mm_s: ArrayLike, force_n: ArrayLike, *, samples: int | None = None
    ) -> Floats:
        """The next samples of the vibration.

        Parameters
        ----------
        speed_mm_s, force_n : (n,) array_like, or two scalars with `samples`
            Tangential speed (mm/s, either direction) and normal force (N) at each sample. NaN and
            infinite values count as lift-off and are counted.
        samples : int, optional
            Number of samples where speed and force are scalars.

        Returns
        -------
        (n,) ndarray
            Acceleration in the model's unit (g).

        Raises
        ------
        InputError
            For arrays of different lengths, or scalars without `samples`.
        """
        speed, force = _trajectory(speed_mm_s, force_n, samples)
        count = speed.size
        finite = np.isfinite(speed) & np.isfinite(force)
        self.counters.lift_offs += count - int(np.count_nonzero(finite))
        noise, floor_noise = (part.tolist() for part in self._noise(count))
        starts = list(range(-self._position % self.update_samples, count, self.update_samples))
        self._position += count
        bounds = [*starts, count]
        output = self._filter(noise[: bounds[0]], floor_noise[: bounds[0]])
        updates = self._updates(speed[starts], force[starts])
        for start, stop, update in zip(starts, bounds[1:], updates, strict=True):
            self._noise_gain, self._bands = update
            output += self._filter(noise[start:stop], floor_noise[start:stop])
        return np.array(output, dtype=np.float64)

    def _noise(self, count: int) -> tuple[Floats, Floats]:
        """The next noise for the bands and, low-passed without delay, for the noise branch.

        The noise is known ahead, so the low-pass has zero phase and the sum stays coherent.
        """
        half = self._lowpass.size // 2
        scale = np.sqrt(self.rate_hz / self.model.rate_hz)
        wide = scale * white_noise(self._key, self._position - half, count + 2 * half)
        # Tap by tap: the order of additions, and so the result, is the same for any block size.
        floor_noise = np.zeros(count)
        for tap, weight in enumerate(self._lowpass):
            floor_noise += weight * wide[tap : tap + count]
        return wide[half : half + count], floor_noise

    def _updates(self, speed: Floats, force: Floats) -> list[tuple[float, list[tuple[float, ...]]]]:
        """Noise gain and coefficients of every band at each update."""
        at = self.model.parameters(speed, force)
        frequency, bandwidth, clamped = clamp_bands(
            at.frequencies_hz, at.bandwidths_hz, rate_hz=self.rate_hz
        )
        self.counters.clamped += clamped
        c = band_coefficients(frequency, bandwidth, rate_hz=self.rate_hz)
        table = np.stack([c.a1, c.a2, c.a3, c.drive, at.gains * c.tap], axis=-1)
        bands = [[tuple(band) for band in update] for update in table.tolist()]
        return list(zip(at.noise_gain.tolist(), bands, strict=True))

    def _filter(self, noise: list[float], floor_noise: list[float]) -> list[float]:
        """The recursion of METHOD 3 with the parameters in force; plain floats are IEEE doubles."""
        output = [self._noise_gain * w for w in floor_noise]
        for layer, (a1, a2, a3, drive, tap) in enumerate(self._bands):
            s1, s2 = self._state[layer]
            for n, w in enumerate(noise):
                v3 = drive * w - s2
                v1 = a1 * s1 + a2 * v3
                v2 = s2 + a2 * s1 + a3 * v3
                s1 = 2.0 * v1 - s1
                s2 = 2.0 * v2 - s2
                output[n] += tap * v1
            self._state[layer] = (s1, s2)
        return output


def _lowpass(model_rate_hz: float, rate_hz: float) -> Floats:
    """Taps of a linear-phase low-pass at the model's Nyquist frequency; [1] at its own rate."""
    if rate_hz == model_rate_hz:
        return np.ones(1)
    transition_hz = _EDGE_SHARE * model_rate_hz / 2
    taps = 2 * round(1.65 * rate_hz / transition_hz) + 1  # Hamming: 3.3 fs/transition
    cutoff_hz = min(model_rate_hz / 2, rate_hz / 2 * 0.999)
    lowpass: Floats = firwin(taps, cutoff_hz, fs=rate_hz)
    return lowpass


def _trajectory(
    speed_mm_s: ArrayLike, force_n: ArrayLike, samples: int | None
) -> tuple[Floats, Floats]:
    speed = np.asarray(speed_mm_s, dtype=np.float64)
    force = np.asarray(force_n, dtype=np.float64)
    if speed.ndim == force.ndim == 0 and samples is not None and samples >= 0:
        return np.full(samples, float(speed)), np.full(samples, float(force))
    if speed.ndim != 1 or speed.shape != force.shape or samples is not None:
        raise InputError(
            "expected speed and force as two arrays of one length, or two scalars with samples=, "
            f"got shapes {speed.shape} and {force.shape} with samples={samples}; match them."
        )
    return speed, force
