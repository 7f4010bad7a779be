"""The accelerometer's noise floor, without contact and without playback.

docs/method/rig.md#floor
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tactileq.modeling.arrays import Floats
from tactileq.modeling.errors import InputError
from tactileq.modeling.recordings.sinusoids import MAINS_HZ, Sinusoids, mains_harmonics
from tactileq.rig.desk.calibration.level import check_unclipped

SHORTEST_FLOOR_S = 2.0
LOWEST_HZ = 10.0
# As recordings are modelled: what is further up counts for nobody's skin.
HIGHEST_HZ = 1000.0
SEGMENT_S = 0.5


@dataclass(frozen=True, eq=False)
class Floor:
    """The floor of an accelerometer.

    Parameters
    ----------
    rms_g : float
        From 10 to 1000 Hz, or to half the rate.
    peak_g : float
        Largest deviation from the mean, of all samples.
    band_hz, band_rms_g : (k,) ndarray
        Middles of third-octave bands, and the RMS in each.
    mains_hz : float, optional
        50 or 60 where the mains are heard.
    hum : Sinusoids
        Their harmonics, amplitudes in g (peak).
    """

    rms_g: float
    peak_g: float
    band_hz: Floats
    band_rms_g: Floats
    mains_hz: float | None
    hum: Sinusoids

    @property
    def hum_rms_g(self) -> float:
        """RMS of all harmonics of the mains together."""
        return float(np.sqrt(np.sum(self.hum.amplitude**2) / 2))


def no_contact_floor(samples_g: ArrayLike, *, rate_hz: float) -> Floor:
    """Level, spectrum and hum of an accelerometer at rest.

    Parameters
    ----------
    samples_g : (n,) array_like
        2 s at least, in g.

    Raises
    ------
    InputError
        For a short record, a constant one, or a clipped one.
    """
    samples = np.asarray(samples_g, dtype=np.float64)
    if samples.size < SHORTEST_FLOOR_S * rate_hz:
        raise InputError(
            f"expected at least {SHORTEST_FLOOR_S:g} s of the accelerometer at rest, got "
            f"{samples.size / rate_hz:.2g} s; record longer."
        )
    check_unclipped(samples)
    samples = samples - samples.mean()
    rms_g, band_hz, band_rms_g = _spectrum(samples, rate_hz)
    mains_hz, hum = _mains(samples, rate_hz)
    peak_g = float(np.abs(samples).max())
    return Floor(rms_g, peak_g, band_hz, band_rms_g, mains_hz, hum)


def _spectrum(samples: Floats, rate_hz: float) -> tuple[float, Floats, Floats]:
    """RMS of the whole band, middles of third octaves, and the RMS in each."""
    from scipy.signal import welch  # late: takes longer to load than all of modeling

    frequency, density = welch(samples, fs=rate_hz, nperseg=round(SEGMENT_S * rate_hz))
    highest_hz = min(HIGHEST_HZ, rate_hz / 2)
    step_hz = float(frequency[1])
    count = int(3 * np.log2(highest_hz / 20.0)) + 1  # bands of fewer lines say little
    middles = 20.0 * 2 ** (np.arange(count) / 3)
    edges = np.append(middles, middles[-1] * 2 ** (1 / 3)) * 2 ** (-1 / 6)
    whole = (frequency >= LOWEST_HZ) & (frequency <= highest_hz)
    # The power up to an edge, each line spread over its width.
    power = np.concatenate(([0.0], np.cumsum(density * step_hz)))
    up_to = np.interp(edges, np.append(frequency - step_hz / 2, frequency[-1] + step_hz / 2), power)
    return float(np.sqrt(density[whole].sum() * step_hz)), middles, np.sqrt(np.diff(up_to))


def _mains(samples: Floats, rate_hz: float) -> tuple[float | None, Sinusoids]:
    """Which mains are heard, if any, by the power of their harmonics."""
    found = {mains_hz: mains_harmonics(samples, rate_hz, mains_hz) for mains_hz in MAINS_HZ}
    power = {mains_hz: float(np.sum(hum.amplitude**2)) for mains_hz, hum in found.items()}
    loudest = max(power, key=lambda mains_hz: power[mains_hz])
    return (loudest if power[loudest] > 0 else None), found[loudest]
