"""A vibrator and the accelerometer at the held pen, in silico, with known truth.

What a sound card plays goes in, what the accelerometer gives the card comes out, block by block.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactileq.modeling.arrays import Floats
from tactileq.modeling.checks import check_keys, check_number, check_rate, check_whole
from tactileq.modeling.equalizer.bands import band_response, rational_tan
from tactileq.modeling.files.documents import read_toml
from tactileq.modeling.seeds import generator
from tactileq.modeling.vibrators.vibrator import check_band, check_height

LONGEST_DELAY_S = 1.0
_RANGES = {
    "frequency_hz": (1.0, 1e5),
    "bandwidth_hz": (0.1, 1e5),
    "height": (1.0, 1e3),
    "g_per_fullscale": (1e-6, 1e3),
    "sensor_fullscale_g": (1e-3, 1e3),
    "noise_g": (0.0, 1e2),
    "hum_g": (0.0, 1e2),
    "hum_hz": (1.0, 1e3),
    "delay_s": (0.0, LONGEST_DELAY_S),
}


@dataclass(frozen=True, kw_only=True)
class SimulatedTransducers:
    """What is known of a simulated vibrator and of the accelerometer that it shakes.

    It answers a drive w by G_w·(w + (R − 1)·H_BP(w)), one layer as
    `tactileq.Vibrator` describes it.

    Parameters
    ----------
    frequency_hz, bandwidth_hz : float
        Peak and −3 dB width of the resonance.
    height : float
        R > 1, response at the resonance over that of the flat part.
    g_per_fullscale : float
        G_w, acceleration of the flat part for full scale of the sound card.
    sensor_fullscale_g : float
        Acceleration that full scale of the card's input stands for; more is clipped.
    noise_g : float
        RMS of the sensor's white noise.
    hum_g, hum_hz : float
        Peak and frequency of what the mains add.
    delay_s : float
        From what is played to what is felt, at most 1 s.
    seed : int
        Of the noise.

    Raises
    ------
    InputError
        For values out of range.
    """

    frequency_hz: float = 120.0
    bandwidth_hz: float = 30.0
    height: float = 4.0
    g_per_fullscale: float = 5.0
    sensor_fullscale_g: float = 10.0
    noise_g: float = 0.005
    hum_g: float = 0.0
    hum_hz: float = 50.0
    delay_s: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        for name, (low, high) in _RANGES.items():
            check_number(name, getattr(self, name), low=low, high=high)
        check_whole("seed", self.seed, low=0, high=2**31)
        check_height(self.height)

    @classmethod
    def load(cls, path: Path) -> SimulatedTransducers:
        """From a TOML file whose keys are these parameters; what it leaves out is as above."""
        values = read_toml(path, "the file of a simulated vibrator")
        check_keys(values, [field.name for field in fields(cls)], where=str(path))
        return cls(**values)

    def response(self, frequency_hz: ArrayLike, *, rate_hz: float) -> NDArray[np.complex128]:
        """Acceleration (g) per full scale played, (n,), at (n,) frequencies, without the delay."""
        (band,) = band_response(
            frequency_hz,
            centres_hz=[self.frequency_hz],
            bandwidths_hz=[self.bandwidth_hz],
            rate_hz=rate_hz,
        )
        response: NDArray[np.complex128] = self.g_per_fullscale * (1 + (self.height - 1) * band)
        return response


class SimulatedAccelerometer:
    """The accelerometer's signal, block after block of what is played.

    Parameters
    ----------
    rate_hz : float
        Of both signals.

    Raises
    ------
    InputError
        For a resonance that this rate does not hold.
    """

    def __init__(self, vibrator: SimulatedTransducers, *, rate_hz: float) -> None:
        check_rate(rate_hz)
        check_band(vibrator.frequency_hz, vibrator.bandwidth_hz, rate_hz=rate_hz)
        self._vibrator = vibrator
        self._rate_hz = rate_hz
        self._filter = _coefficients(vibrator, rate_hz=rate_hz)
        self._state = np.zeros(2)
        self._delayed = np.zeros(round(vibrator.delay_s * rate_hz))
        self._rng = generator(vibrator.seed)
        self._position = 0

    def give(self, played: ArrayLike) -> Floats:
        """What the card's input receives, (n,) within ±1, for (n,) samples played (full scale 1).

        Noise and hum are there whether anything is played or not.
        """
        from scipy.signal import lfilter  # late: takes longer to load than all of modeling

        v = self._vibrator
        drive = np.concatenate([self._delayed, np.asarray(played, dtype=np.float64)])
        due = drive.size - self._delayed.size
        self._delayed = drive[due:]
        felt_g, self._state = lfilter(*self._filter, drive[:due], zi=self._state)
        moments = (self._position + np.arange(due)) / self._rate_hz
        self._position += due
        felt_g = felt_g + v.hum_g * np.sin(2 * np.pi * v.hum_hz * moments)
        felt_g += v.noise_g * self._rng.standard_normal(due)
        clipped: Floats = np.clip(felt_g / v.sensor_fullscale_g, -1.0, 1.0)
        return clipped


def _coefficients(vibrator: SimulatedTransducers, *, rate_hz: float) -> tuple[Floats, Floats]:
    """Numerator and denominator in z⁻¹ of G_w·(1 + (R − 1)·H_BP), as in docs/method/equalizer.md.

    Multiplied out with t = (1 − z⁻¹)/(1 + z⁻¹): H_BP = k(1+g²)t/(g² + k(1+g²)t + t²).
    """
    g = float(rational_tan(np.pi / rate_hz * vibrator.frequency_hz))
    damping = float(rational_tan(np.pi / rate_hz * vibrator.bandwidth_hz)) * (1 + g * g)
    band = np.array([damping, 0.0, -damping])
    whole = np.array([1 + g * g + damping, 2 * (g * g - 1), 1 + g * g - damping])
    return vibrator.g_per_fullscale * (whole + (vibrator.height - 1) * band), whole
