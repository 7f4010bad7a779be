"""The level of a vibration at the held pen, relative to the requested one.

docs/method/rig.md#level
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tactileq.modeling.arrays import Floats
from tactileq.modeling.errors import InputError
from tactileq.modeling.recordings.recording import clipped_samples
from tactileq.modeling.vibrators.identification import LEAST_COHERENCE, MOST_CLIPPED_SHARE

SEGMENT_S = 0.1
LEAST_SEGMENTS = 8
LEAST_PLACEMENTS = 3
CONFIDENCE = 0.95


@dataclass(frozen=True)
class BandGain:
    """What one placement of the pen shows.

    Parameters
    ----------
    gain : float
        Acceleration per drive, RMS over the band, of what the drive explains.
    coherence : float
        Share of the acceleration's power in the band that the drive explains, 0…1.
    drive_rms, acceleration_rms : float
        In the band; the latter with the sensor's noise.
    """

    gain: float
    coherence: float
    drive_rms: float
    acceleration_rms: float


def band_gain(
    drive: ArrayLike, acceleration: ArrayLike, *, rate_hz: float, band_hz: tuple[float, float]
) -> BandGain:
    """Acceleration per drive over a band: √(Σ γ²·S_yy / Σ S_xx), noise of the sensor left out.

    Parameters
    ----------
    drive, acceleration : (n,) array_like
        Recorded together or aligned, without clipping.
    band_hz : (low, high)

    Raises
    ------
    InputError
        For a band outside 0 … rate/2, a record too short, clipping, or a poor coherence.
    """
    from scipy.signal import csd  # late: takes longer to load than all of modeling

    x, y = np.asarray(drive, dtype=np.float64), np.asarray(acceleration, dtype=np.float64)
    check_unclipped(y)
    low_hz, high_hz = band_hz
    segment = max(round(SEGMENT_S * rate_hz), int(np.ceil(4 * rate_hz / max(high_hz - low_hz, 1))))
    _check(x, y, rate_hz=rate_hz, band_hz=band_hz, segment=segment)
    segments = 2 * x.size // segment - 1
    frequency, of_drive = csd(x, x, fs=rate_hz, nperseg=segment)
    of_response = csd(y, y, fs=rate_hz, nperseg=segment)[1].real
    cross = np.abs(csd(x, y, fs=rate_hz, nperseg=segment)[1])
    band = (frequency >= low_hz) & (frequency <= high_hz)
    sxx, syy, sxy = (np.asarray(s)[band] for s in (of_drive.real, of_response, cross))
    coherence = np.divide(sxy**2, sxx * syy, out=np.zeros_like(sxx), where=sxx * syy > 0)
    # Chance correlates n segments of anything by 1/n (Hann windows half overlapping: n·18/19).
    explained = np.maximum(coherence - (1 - coherence) / (segments * 18 / 19 - 1), 0.0) * syy
    share = float(explained.sum() / syy.sum()) if syy.sum() > 0 else 0.0
    if share < LEAST_COHERENCE:
        raise InputError(
            f"expected a coherence of drive and acceleration of at least {LEAST_COHERENCE:g} from "
            f"{low_hz:g} to {high_hz:g} Hz, got {share:.2f}; hold the pen still, fix the sensor "
            "firmly, or raise the level."
        )
    step_hz = float(frequency[1])
    return BandGain(
        gain=float(np.sqrt(explained.sum() / sxx.sum())),
        coherence=share,
        drive_rms=float(np.sqrt(sxx.sum() * step_hz)),
        acceleration_rms=float(np.sqrt(syy.sum() * step_hz)),
    )


def check_unclipped(samples: Floats) -> None:
    """Refuse a record of the accelerometer of which more than 1 % is clipped, or that is still."""
    if np.ptp(samples) == 0:
        raise InputError(
            f"expected a signal of the accelerometer, got the constant value {samples.flat[0]:g}; "
            "check the sensor, its cable, and the channel under [accelerometer]."
        )
    clipped = float(clipped_samples(samples).mean())
    if clipped > MOST_CLIPPED_SHARE:
        raise InputError(
            f"expected at most {MOST_CLIPPED_SHARE:.0%} of clipped samples of the accelerometer, "
            f"got {clipped:.1%}; lower the level, or the gain of its input."
        )


def _check(
    drive: Floats, acceleration: Floats, *, rate_hz: float, band_hz: tuple[float, float],
    segment: int,
) -> None:  # fmt: skip
    low_hz, high_hz = band_hz
    if not 0 < low_hz < high_hz <= rate_hz / 2:
        raise InputError(
            f"expected a band within 0…{rate_hz / 2:g} Hz, got {low_hz:g} to {high_hz:g} Hz; give "
            "the lower edge first, and no more than half the rate."
        )
    least = (LEAST_SEGMENTS + 1) * segment / 2
    if drive.shape != acceleration.shape or drive.size < least:
        raise InputError(
            f"expected drive and acceleration of one length, {least / rate_hz:.2g} s at least, got "
            f"{drive.size / rate_hz:.2g} and {acceleration.size / rate_hz:.2g} s; record longer."
        )


@dataclass(frozen=True)
class MeasuredLevel:
    """Gain over several placements of the pen, which is picked up again each time.

    Parameters
    ----------
    gain : float
        Geometric mean.
    low, high : float
        Interval of the mean, 95 % (Student's t of the logarithms).
    spread_db : float
        Standard deviation of the placements.
    """

    gain: float
    low: float
    high: float
    spread_db: float
    placements: int


def level_of(gains: Sequence[float]) -> MeasuredLevel:
    """The gain over placements, with its interval and spread.

    Raises
    ------
    InputError
        For fewer than three placements: the spread says how far one holds a pen alike.
    """
    from scipy.stats import t  # late: as scipy.signal

    if len(gains) < LEAST_PLACEMENTS:
        raise InputError(
            f"expected at least {LEAST_PLACEMENTS} placements of the pen, got "
            f"{len(gains)}; pick it up again each time."
        )
    logs = np.log(gains)
    spread = float(logs.std(ddof=1))
    half = float(t.ppf((1 + CONFIDENCE) / 2, logs.size - 1)) * spread / np.sqrt(logs.size)
    mean = float(logs.mean())
    return MeasuredLevel(
        gain=float(np.exp(mean)),
        low=float(np.exp(mean - half)),
        high=float(np.exp(mean + half)),
        spread_db=spread * 20 / float(np.log(10)),
        placements=len(gains),
    )
