"""How far above the detection threshold a vibration is: its sensation level.

docs/method/perception.md#sensation-level
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tactileq.modeling.arrays import Floats
from tactileq.modeling.errors import InputError
from tactileq.modeling.perception.thresholds import Threshold


class SensationLevel(NamedTuple):
    """Level in dB above threshold (dB SL), and the share of power without a known threshold.

    `share_without_threshold` (0 … 1) is the power at frequencies where no threshold is known.
    """

    level_db: float
    share_without_threshold: float


def sensation_level(vibration_g: Floats, rate_hz: float, *, threshold: Threshold) -> SensationLevel:
    """Threshold-weighted RMS of a vibration.

    The power sum over frequency of (√2·RMS/threshold)²: every line of the spectrum counts as the
    sinusoid of equal power (criterion `energy`, docs/method/perception.md#criteria) against the
    threshold at its frequency, so a sinusoid at threshold has 0 dB. Frequencies where no threshold
    is known are left out.

    Parameters
    ----------
    vibration_g : (n,) ndarray
        n ≥ 1, in g.

    Raises
    ------
    InputError
        For silence, or where all power lies at frequencies without a known threshold.
    """
    lines = np.abs(np.fft.rfft(vibration_g)) ** 2 / vibration_g.size**2
    lines[1 : (vibration_g.size + 1) // 2] *= 2  # two-sided power, but for 0 Hz and Nyquist
    at = threshold.at(np.fft.rfftfreq(vibration_g.size, 1 / rate_hz))
    known = np.isfinite(at)
    weighted = float(np.sum(2 * lines[known] / at[known] ** 2))
    if not weighted > 0:
        low, high = threshold.valid_range_hz
        raise InputError(
            f"expected vibration between {low:g} and {high:g} Hz, where the threshold "
            f"{threshold.name} is known, got none; leave this stimulus out or match RMS levels."
        )
    share = float(lines[~known].sum() / lines.sum())
    return SensationLevel(10 * float(np.log10(weighted)), share)
