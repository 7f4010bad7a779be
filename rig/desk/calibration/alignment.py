"""Alignment of a played signal with its recording: delay, and drift between two clocks.

docs/method/rig.md#alignment
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from tactileq.modeling.arrays import Floats
from tactileq.modeling.checks import check_rate
from tactileq.modeling.errors import InputError

# A trace of what is played stands this far above what chance correlates.
LEAST_CONTRAST = 8.0
PIECES = 8
LARGEST_DRIFT = 5e-4  # two quartz clocks are within 1e-4 of each other
SHORTEST_S = 0.2


@dataclass(frozen=True, eq=False)
class Aligned:
    """A played signal and what was recorded of it, sample by sample.

    Parameters
    ----------
    played, recorded : (n,) ndarray
        At `rate_hz`, that of the recording.
    delay_s : float
        From the beginning of the recording to that of the played signal in it.
    drift : float
        Share by which the recording's clock runs faster than the player's.
    """

    played: Floats
    recorded: Floats
    delay_s: float
    drift: float
    rate_hz: float


def aligned(
    played: ArrayLike, recorded: ArrayLike, *, played_rate_hz: float, rate_hz: float
) -> Aligned:
    """Find a played noise in a recording, by cross-correlation, and cut both alike.

    Parameters
    ----------
    played : (m,) array_like
        Noise, 0.2 s at least, at `played_rate_hz`.
    recorded : (n,) array_like
        At `rate_hz`; holds all that was played.

    Raises
    ------
    InputError
        If nothing of what was played is found.
    """
    check_rate(played_rate_hz)
    check_rate(rate_hz)
    drive = _at_rate(np.asarray(played, dtype=np.float64), played_rate_hz, rate_hz)
    record = np.asarray(recorded, dtype=np.float64)
    record = record - record.mean()
    if not SHORTEST_S * rate_hz <= drive.size <= record.size:
        raise InputError(
            f"expected a recording that holds all of a played signal of {SHORTEST_S:g} s at least, "
            f"got {record.size / rate_hz:.3g} s for {drive.size / rate_hz:.3g} s; record longer."
        )
    offset, step = _line(*_delays(drive, record))
    from scipy.interpolate import CubicSpline  # late: as scipy.signal

    positions = np.arange(record.size, dtype=np.float64)
    own = (positions - offset) / (1 + step)
    within = (own >= 0) & (own <= drive.size - 1)
    follow = CubicSpline(np.arange(drive.size), drive)(own[within])
    return Aligned(np.asarray(follow), record[within], offset / rate_hz, step, rate_hz)


def _at_rate(signal: Floats, from_hz: float, to_hz: float) -> Floats:
    if from_hz == to_hz:
        return signal
    from scipy.signal import resample_poly  # late: takes longer to load than all of modeling

    share = Fraction(to_hz / from_hz).limit_denominator(1000)
    return np.asarray(resample_poly(signal, share.numerator, share.denominator))


def _delays(drive: Floats, record: Floats) -> tuple[Floats, Floats]:
    """Middle of each piece of the drive, and by how many samples it comes later in the record."""
    coarse = _found(drive, record)
    reach = int(np.ceil(LARGEST_DRIFT * drive.size)) + 64
    edges = np.linspace(0, drive.size, PIECES + 1).astype(int)
    middles, delays = [], []
    for start, end in pairwise(edges):
        first = max(start + coarse - reach, 0)
        part = record[first : end + coarse + reach]
        if part.size < end - start:
            continue
        strength = _correlation(drive[start:end], part)
        middles.append((start + end) / 2)
        delays.append(first - start + _peak(strength))
    return np.array(middles), np.array(delays)


def _found(drive: Floats, record: Floats) -> int:
    strength = np.abs(_correlation(drive, record))
    best = int(np.argmax(strength))
    level = float(np.sqrt(np.mean(strength**2)))
    # In a short search window the level is mostly that of the peak itself.
    chance = float(np.linalg.norm(drive) * np.sqrt(np.mean(record**2)))
    if not strength[best] > LEAST_CONTRAST * min(level, chance) > 0:
        raise InputError(
            "expected the accelerometer to record what is played, got no trace of it; check the "
            "amplifier, the sensor, its cable, and the channel under [accelerometer]."
        )
    return best


def _correlation(drive: Floats, record: Floats) -> Floats:
    from scipy.signal import correlate  # late: takes longer to load than all of modeling

    return np.asarray(correlate(record, drive, mode="valid", method="fft"))


def _peak(strength: Floats) -> float:
    """Where it is largest, between samples by a parabola."""
    size = np.abs(strength)
    best = int(np.argmax(size))
    if not 0 < best < size.size - 1:
        return float(best)
    before, at, after = size[best - 1 : best + 2]
    return best + 0.5 * float(before - after) / float(before - 2 * at + after)


def _line(middles: Floats, delays: Floats) -> tuple[float, float]:
    """Delay at the beginning, and its growth per sample; robust to single outliers."""
    from scipy.stats import theilslopes  # late: as scipy.signal

    step, offset, *_ = theilslopes(delays, middles)
    if abs(step) > LARGEST_DRIFT:
        raise InputError(
            f"expected clocks within {LARGEST_DRIFT:.2%} of each other, got a drift of "
            f"{step:.2%}; check the rates of the card and of the accelerometer."
        )
    return float(offset), float(step)
