"""Simulated vibrators, whose response is known exactly."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.signal import bilinear, freqz, lfilter

from tactileq.modeling.arrays import Floats
from tactileq.modeling.checks import check_rate
from tactileq.modeling.equalizer.bands import HIGHEST_FREQUENCY_SHARE, LOWEST_FREQUENCY_HZ
from tactileq.modeling.errors import InputError
from tactileq.modeling.vibrators.vibrator import Vibrator


@dataclass(frozen=True)
class SimulatedVibrator:
    """A mass on a spring and a damper, driven by a force: acceleration per drive.

    H(s) = s²/(s² + s·ω/Q + ω²): 1 far above the resonance, Q at it, and 40 dB per decade less
    below it (−36 dB at 10 Hz for 80 Hz). Bilinear transform, exact at the resonance.

    Parameters
    ----------
    frequency_hz : float
        ω/2π, 1 Hz … 0.49 rate.
    quality : float
        Q > 0; the −3 dB width of the resonance is frequency_hz/Q.

    Raises
    ------
    InputError
        For values out of range.
    """

    frequency_hz: float
    quality: float
    rate_hz: float

    def __post_init__(self) -> None:
        check_rate(self.rate_hz)
        highest_hz = HIGHEST_FREQUENCY_SHARE * self.rate_hz
        if not LOWEST_FREQUENCY_HZ <= self.frequency_hz <= highest_hz:
            raise InputError(
                f"expected a resonance within {LOWEST_FREQUENCY_HZ:g}…{highest_hz:g} Hz, got "
                f"{self.frequency_hz:g}; choose another or raise the rate."
            )
        if not (np.isfinite(self.quality) and self.quality > 0):
            raise InputError(f"expected a quality above 0, got {self.quality:g}; choose another.")

    @property
    def simulated(self) -> bool:
        """True: nobody measured it."""
        return True

    def response(self, frequency_hz: ArrayLike) -> NDArray[np.complex128]:
        """Transfer function at (n,) frequencies, 0 … rate/2, acceleration per drive."""
        _, response = freqz(*self._coefficients(), np.asarray(frequency_hz), fs=self.rate_hz)
        return np.asarray(response, dtype=np.complex128)

    def accelerate(
        self, drive: ArrayLike, *, sensor_noise: float = 0.0, rng: np.random.Generator
    ) -> Floats:
        """Acceleration (n,) that a sensor with white noise of this RMS reports for a drive (n,)."""
        moved = np.asarray(lfilter(*self._coefficients(), np.asarray(drive, dtype=np.float64)))
        reported: Floats = moved + sensor_noise * rng.standard_normal(moved.shape)
        return reported

    def _coefficients(self) -> tuple[Floats, Floats]:
        """Numerator and denominator in z⁻¹."""
        omega = 2 * np.pi * self.frequency_hz
        warped_rate_hz = omega / (2 * np.tan(np.pi * self.frequency_hz / self.rate_hz))
        through = [1.0, 0.0, 0.0]
        damped = [1.0, omega / self.quality, omega**2]
        numerator, denominator = bilinear(through, damped, fs=warped_rate_hz)
        return np.asarray(numerator), np.asarray(denominator)


def planted_vibrator(frequency_hz: float = 80.0, bandwidth_hz: float = 25.0) -> Vibrator:
    """What a test of a vibrator of one layer would find: four times as strong there as elsewhere.

    Parameters
    ----------
    frequency_hz, bandwidth_hz : float
        Peak and −3 dB width; see `PEQ`.
    """
    return Vibrator(
        rate_hz=22_050.0,
        frequency_hz=frequency_hz,
        bandwidth_hz=bandwidth_hz,
        height=4.0,
        flat_gain=0.3,
        coherence=0.99,
        lowest_hz=frequency_hz / 2,
        highest_hz=4 * frequency_hz,
        curve_hz=np.array([frequency_hz]),
        curve_response=np.array([1.2]),
        curve_coherence=np.array([0.99]),
        simulated=True,
    )
