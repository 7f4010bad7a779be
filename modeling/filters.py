"""What the renderer runs: the recursion of a model's filters under parameters that move.

Both filters pass white noise through orthogonal steps, so that their states keep unit variance (or
lose some) at every sample, whatever the parameters do from one update to the next.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from scipy.signal import firwin

from modeling.autoregressive import ARModel
from modeling.errors import InputError
from modeling.line_spectral import prediction_coefficients, reflection_coefficients
from modeling.model import Parameters
from modeling.noise import white_noise
from modeling.peq import Floats, band_coefficients, clamp_bands

_EDGE_SHARE = 0.2
# Rounding must not put a pole on the unit circle.
_HIGHEST_REFLECTION = 1 - 1e-12


class LayeredModel(Protocol):
    """A model that gives PEQ parameters for any speed and force."""

    @property
    def rate_hz(self) -> float: ...

    @property
    def n_layers(self) -> int: ...

    def parameters(self, speed_mm_s: Floats, force_n: Floats) -> Parameters: ...


class StreamFilter(Protocol):
    """A filter whose state carries on from block to block.

    A setting holds its coefficients from one parameter update to the next.
    """

    clamped: int

    def silence(self) -> Any:
        """The setting before the first update."""

    def settings(self, speed_mm_s: Floats, force_n: Floats) -> list[Any]:
        """One setting for each of (n,) speeds and forces."""

    def inputs(self, key: np.uint64, start: int, *, count: int) -> tuple[list[float], ...]:
        """Its driving noise from position `start` on: one or more lists of `count` samples."""

    def filter(self, setting: Any, *inputs: list[float]) -> list[float]:
        """The output for the next samples of its inputs."""


class BandFilter:
    """A PEQ of m bands (METHOD 3) at the model's rate or above."""

    def __init__(self, model: LayeredModel, rate_hz: float) -> None:
        if not (np.isfinite(rate_hz) and rate_hz >= model.rate_hz):
            raise InputError(
                f"expected a rendering rate of at least the model's {model.rate_hz:g} Hz, got "
                f"{rate_hz:g}; render at that rate and resample."
            )
        self.clamped = 0
        self._model, self._rate_hz = model, rate_hz
        self._state = [(0.0, 0.0)] * model.n_layers
        self._lowpass = _lowpass(model.rate_hz, rate_hz)

    def silence(self) -> Any:
        """No noise and no band."""
        return 0.0, [(0.0,) * 5] * self._model.n_layers

    def settings(self, speed_mm_s: Floats, force_n: Floats) -> list[Any]:
        """Noise gain and coefficients of every band at each update."""
        at = self._model.parameters(speed_mm_s, force_n)
        frequency, bandwidth, clamped = clamp_bands(
            at.frequencies_hz, at.bandwidths_hz, rate_hz=self._rate_hz
        )
        self.clamped += clamped
        c = band_coefficients(frequency, bandwidth, rate_hz=self._rate_hz)
        table = np.stack([c.a1, c.a2, c.a3, c.drive, at.gains * c.tap], axis=-1)
        bands = [[tuple(band) for band in update] for update in table.tolist()]
        return list(zip(at.noise_gain.tolist(), bands, strict=True))

    def inputs(self, key: np.uint64, start: int, *, count: int) -> tuple[list[float], ...]:
        """The next noise for the bands and, low-passed without delay, for the noise branch.

        The noise is known ahead, so the low-pass has zero phase and the sum stays coherent.
        """
        half = self._lowpass.size // 2
        scale = np.sqrt(self._rate_hz / self._model.rate_hz)
        wide = scale * white_noise(key, start - half, count + 2 * half)
        # Tap by tap: the order of additions, and so the result, is the same for any block size.
        floor_noise = np.zeros(count)
        for tap, weight in enumerate(self._lowpass):
            floor_noise += weight * wide[tap : tap + count]
        return wide[half : half + count].tolist(), floor_noise.tolist()

    def filter(self, setting: Any, *inputs: list[float]) -> list[float]:
        """The recursion of METHOD 3 with the parameters in force; plain floats are IEEE doubles."""
        noise, floor_noise = inputs
        noise_gain, bands = setting
        output = [noise_gain * w for w in floor_noise]
        for layer, (a1, a2, a3, drive, tap) in enumerate(bands):
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


class LatticeFilter:
    """An all-pole filter as a normalised lattice (Gray and Markel 1975), at the model's rate.

    Every stage turns (its input, its state) by an angle, so with white noise of unit variance all
    states and the unscaled output have unit variance too; the gain is applied behind it. A direct
    form, stable as each of its filters is, can grow without bound when they change.
    """

    def __init__(self, model: ARModel, rate_hz: float) -> None:
        if rate_hz != model.rate_hz:
            raise InputError(
                f"expected the AR model's own rate of {model.rate_hz:g} Hz, got {rate_hz:g} (an "
                "all-pole filter has no equal at another rate); render at that rate and resample."
            )
        self.clamped = 0
        self._model = model
        self._state = [0.0] * model.order

    def silence(self) -> Any:
        """No output; the stages only delay."""
        return 0.0, [(0.0, 1.0)] * self._model.order

    def settings(self, speed_mm_s: Floats, force_n: Floats) -> list[Any]:
        """Output RMS, and sine and cosine of every stage from the highest order down."""
        at = self._model.parameters(speed_mm_s, force_n)
        sine = reflection_coefficients(prediction_coefficients(at.line_spectral_frequencies))
        sine = np.nan_to_num(np.clip(sine, -_HIGHEST_REFLECTION, _HIGHEST_REFLECTION))
        cosine = np.sqrt((1 - sine) * (1 + sine))
        rms = at.gain / cosine.prod(axis=-1)
        table = np.stack([sine, cosine], axis=-1)[:, ::-1]
        stages = [[tuple(stage) for stage in update] for update in table.tolist()]
        return list(zip(rms.tolist(), stages, strict=True))

    def inputs(self, key: np.uint64, start: int, *, count: int) -> tuple[list[float], ...]:
        """The next noise, of unit variance."""
        return (white_noise(key, start, count).tolist(),)

    def filter(self, setting: Any, *inputs: list[float]) -> list[float]:
        """The lattice with the angles in force."""
        rms, stages = setting
        state, output = self._state, []
        highest = len(stages) - 1
        for forward in inputs[0]:
            for stage, (sine, cosine) in enumerate(stages):
                held = state[highest - stage]
                backward = sine * forward + cosine * held
                forward = cosine * forward - sine * held
                if stage:
                    state[highest - stage + 1] = backward
            state[0] = forward
            output.append(rms * forward)
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
