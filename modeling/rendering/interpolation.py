"""From the model's rate to that of the output: the weights of both stages in `kernel.h`.

docs/method/rendering.md#other-rates
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from tactileq.modeling.arrays import Floats
from tactileq.modeling.errors import InputError

MOST_PHASES = 4000
DOUBLING, PHASE = 32, 10  # TQ_DOUBLING and TQ_PHASE of kernel.h
# In shares of the model's rate: what passes, and where the images of that begin.
_PASSED, _IMAGES = 0.45, 0.55
_IMAGES_WEIGHT = 4.0
_BETA = 7.0  # of the Kaiser window of the second stage: 70 dB
_DECIMALS = 12  # so that no library's rounding changes the weights


@dataclass(frozen=True, eq=False)
class Interpolation:
    """How `up`/`down` samples are made of each sample at twice the model's rate.

    Both filters have minimum phase, since the phase of noise is not felt.

    Parameters
    ----------
    up, down : int
        Without a common factor; `up` is at most 4000.
    doubling : (32, 2) ndarray
        Weights of the two samples that each sample of the model becomes, that of the oldest first.
    phases : (up, 10) ndarray
        Weights for each phase of the output, that of the oldest sample first.
    """

    up: int
    down: int
    doubling: Floats
    phases: Floats

    @property
    def delay_samples(self) -> float:
        """Group delay at low frequencies, in samples of the model."""
        first, second = self._impulses
        return (_mean_place(first) + _mean_place(second) / self.up) / 2

    @property
    def _impulses(self) -> tuple[Floats, Floats]:
        """Impulse responses of both stages, each at the rate that it leads to."""
        return self.doubling[::-1].ravel(), self.phases.T[::-1].ravel()

    def response(self, frequency: Floats) -> NDArray[np.complex128]:
        """Gain (n,) at frequencies in shares of the model's rate, that at 0 being 1."""
        gain = np.ones(np.shape(frequency), dtype=np.complex128)
        for impulse, rate in zip(self._impulses, (2, 2 * self.up), strict=True):
            at = np.exp(-2j * np.pi * np.asarray(frequency) / rate)
            gain = gain * np.polynomial.polynomial.polyval(at, impulse) / impulse.sum()
        return gain


def interpolation(model_rate_hz: float, rate_hz: float) -> Interpolation | None:
    """How to get from the model's rate to the output's; None where both are the same.

    Raises
    ------
    InputError
        For a rate below the model's, not finite, or one to twice the model's in a ratio that needs
        whole numbers above 4000.
    """
    if not (np.isfinite(rate_hz) and rate_hz >= model_rate_hz):
        raise InputError(
            f"expected a rendering rate of at least the model's {model_rate_hz:g} Hz, got "
            f"{rate_hz:g}; render at that rate and resample."
        )
    if rate_hz == model_rate_hz:
        return None
    ratio = Fraction(rate_hz) / (2 * Fraction(model_rate_hz))
    if ratio.numerator > MOST_PHASES:
        raise InputError(
            "expected rates of which the output's and twice the model's have a ratio of whole "
            f"numbers up to {MOST_PHASES}, got {rate_hz!r} Hz for a model of {model_rate_hz!r} Hz; "
            "choose rounder rates, or render at the model's and resample."
        )
    phases = _phases(ratio.numerator)
    return Interpolation(ratio.numerator, ratio.denominator, _doubling(), phases)


@lru_cache(maxsize=1)
def _doubling() -> Floats:
    from scipy.signal import remez

    # Equiripple, an odd number of taps; at twice the model's rate.
    edges = [0.0, _PASSED / 2, _IMAGES / 2, 0.5]
    linear = remez(2 * DOUBLING - 1, edges, [1, 0], weight=[1, _IMAGES_WEIGHT], fs=1.0)
    return _by_phase(linear, 2).T.copy()


@lru_cache(maxsize=8)
def _phases(up: int) -> Floats:
    if up == 1:  # twice the model's rate: the sample is there already
        there = np.append(np.zeros(PHASE - 1), 1.0)[None]
        there.setflags(write=False)
        return there
    from scipy.signal import firwin

    # Images of the model's band lie around whole multiples of twice its rate. The length is odd.
    length = PHASE * up - 1
    return _by_phase(firwin(length, 0.5, fs=up, window=("kaiser", _BETA)), up)


def _by_phase(linear: Floats, phases: int) -> Floats:
    """The low-pass of minimum phase with this magnitude, (phases, taps), the last tap first."""
    from scipy.signal import minimum_phase

    points = 2 ** int(np.ceil(np.log2(64 * linear.size)))
    impulse = minimum_phase(linear, half=False, n_fft=points)
    padded = np.append(impulse, np.zeros(-impulse.size % phases))
    weights = padded.reshape(-1, phases).T[:, ::-1] * (phases / impulse.sum())
    rounded: Floats = np.ascontiguousarray(np.round(weights, _DECIMALS))
    rounded.setflags(write=False)
    return rounded


def _mean_place(impulse: Floats) -> float:
    return float(np.arange(impulse.size) @ impulse / impulse.sum())
