"""Random spectra with known layers, of three kinds: what estimators are tested on.

docs/method/stimuli.md#random-spectra

Nothing here was measured. Layers are drawn 6–30 dB above the noise, anywhere between 20 and
1500 Hz, so they overlap, and some lie hidden under others.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from tactileq.modeling import PEQ
from tactileq.modeling.arrays import Floats
from tactileq.modeling.equalizer.bands import band_response

TruthKind = Literal["coherent", "independent", "Gaussian"]
KINDS: tuple[TruthKind, ...] = ("coherent", "independent", "Gaussian")
RATE_HZ = 5000.0
NOISE_GAIN = 0.02
MOST_LAYERS = 5
FREQUENCIES_HZ = (20.0, 1500.0)
BANDWIDTHS_HZ = (4.0, 400.0)
WIDEST_SHARE = 1.5  # of the frequency
LEVELS_DB = (6.0, 30.0)
# The spectrum is drawn on a circle of noise this many times as long as what is cut from it.
CIRCLE = 4


@dataclass(frozen=True, eq=False)
class RandomTruth:
    """One spectrum with known layers.

    Parameters
    ----------
    layers : PEQ
        Noise gain, frequencies, −3 dB widths and (positive) gains.
    kind : {"coherent", "independent", "Gaussian"}
        How they add up: one noise through all bands (the PEQ itself); a noise of its own through
        each; or bells on the magnitude, of the same height and −3 dB width.
    """

    layers: PEQ
    kind: TruthKind

    def expected_power(self, frequency_hz: Floats) -> Floats:
        """Power at (n,) frequencies, in (g per unit noise)²."""
        if self.kind == "coherent":
            return self.layers.response(frequency_hz) ** 2
        if self.kind == "Gaussian":
            return self._bells(frequency_hz) ** 2
        parts = self.layers.gains[:, None] * np.abs(self._bands(frequency_hz))
        power: Floats = self.layers.noise_gain**2 + (parts**2).sum(axis=0)
        return power

    def record(self, *, rng: np.random.Generator, duration_s: float = 1.0) -> Floats:
        """A stationary record of it, (n,) samples in g at 5 kHz."""
        n = round(duration_s * RATE_HZ)
        frequency = np.asarray(np.fft.rfftfreq(CIRCLE * n, 1 / RATE_HZ), dtype=np.float64)
        branches = self._branches(frequency)
        noise = np.fft.rfft(rng.standard_normal((len(branches), CIRCLE * n)))
        samples: Floats = np.fft.irfft((noise * branches).sum(axis=0), CIRCLE * n)[:n]
        return samples

    def _branches(self, frequency_hz: Floats) -> NDArray[np.complex128]:
        """Responses (k, n), each for a noise of its own."""
        if self.kind == "coherent":
            return self.layers.complex_response(frequency_hz)[None, :]
        if self.kind == "Gaussian":
            return self._bells(frequency_hz)[None, :].astype(np.complex128)
        floor = np.full((1, frequency_hz.size), self.layers.noise_gain, dtype=np.complex128)
        return np.concatenate((floor, self.layers.gains[:, None] * self._bands(frequency_hz)))

    def _bands(self, frequency_hz: Floats) -> NDArray[np.complex128]:
        return band_response(
            frequency_hz,
            centres_hz=self.layers.frequencies_hz,
            bandwidths_hz=self.layers.bandwidths_hz,
            rate_hz=RATE_HZ,
        )

    def _bells(self, frequency_hz: Floats) -> Floats:
        s = self.layers.bandwidths_hz / (2 * np.sqrt(np.log(2)))
        offset = (frequency_hz - self.layers.frequencies_hz[:, None]) / s[:, None]
        magnitude: Floats = self.layers.noise_gain + self.layers.gains @ np.exp(-0.5 * offset**2)
        return magnitude


def random_truth(kind: TruthKind, *, rng: np.random.Generator) -> RandomTruth:
    """One to five layers: frequency even over 20–1500 Hz, width even in log over 4–400 Hz.

    Widths are at most 1.5 f; gains are even in dB, 6–30 dB above the noise gain.
    """
    m = int(rng.integers(1, MOST_LAYERS + 1))
    frequency = np.sort(rng.uniform(FREQUENCIES_HZ[0], FREQUENCIES_HZ[1], m))
    lowest, highest = np.log(BANDWIDTHS_HZ)
    width = np.minimum(np.exp(rng.uniform(lowest, highest, m)), WIDEST_SHARE * frequency)
    layers = PEQ(
        noise_gain=NOISE_GAIN,
        frequencies_hz=frequency,
        bandwidths_hz=width,
        gains=NOISE_GAIN * 10 ** (rng.uniform(LEVELS_DB[0], LEVELS_DB[1], m) / 20),
        rate_hz=RATE_HZ,
    )
    return RandomTruth(layers, kind)
