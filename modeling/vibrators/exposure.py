"""Hand-transmitted vibration: its frequency weighting, and the exposure of a day (ISO 5349-1)."""

from __future__ import annotations

from math import pi, sqrt, tan

import numpy as np

from tactileq.modeling.arrays import Floats
from tactileq.modeling.vibrators.vibrator import Vibrator

STANDARD_GRAVITY_M_S2 = 9.80665
DAY_S = 8 * 3600.0
# Directive 2002/44/EC, article 3: the daily exposure action value of hand-arm vibration. The limit
# of the same article is 5 m/s².
ACTION_VALUE_M_S2 = 2.5
# ISO 5349-1:2001, table A.1: weighting W_h, corner frequencies (Hz) and quality factors.
_F1_HZ, _F2_HZ, _Q1 = 6.310, 1258.9, 0.71
_F3_HZ, _F4_HZ, _Q2 = 15.915, 15.915, 0.64


def hand_arm_sections(rate_hz: float, *, vibrator: Vibrator | None = None) -> Floats:
    """The frequency weighting W_h as a digital filter.

    Parameters
    ----------
    rate_hz : float
        Of the samples, 1000 Hz or more.
    vibrator : Vibrator, optional
        The samples drive it, compensated: its resonance is put back, so that what is weighted is
        what the hand feels.

    Returns
    -------
    (k, 5) ndarray
        Sections b0, b1, b2, a1, a2 (a0 = 1) in series: band-limiting, the transition from
        acceleration to velocity, and the vibrator where there is one.

    Notes
    -----
    ISO 5349-1:2001, annex A: band limits of second order at f1 and f2 with Q1, transition
    (s + 2πf3) 2πf4² / ((s² + 2πf4/Q2 s + 4π²f4²) f3). Bilinear transform, each section exact at its
    corner; a corner above 0.45 of the rate is put there.
    """
    sections = [
        _section((1, 0, 0), (1, 1 / _Q1, 1), _F1_HZ, rate_hz),
        _section((0, 0, 1), (1, 1 / _Q1, 1), _F2_HZ, rate_hz),
        _section((0, _F4_HZ / _F3_HZ, 1), (1, 1 / _Q2, 1), _F4_HZ, rate_hz),
    ]
    if vibrator is not None:  # 1 + (R − 1) H, H a band-pass of height 1
        width = vibrator.bandwidth_hz / vibrator.frequency_hz
        peak = (1, vibrator.height * width, 1)
        sections.append(_section(peak, (1, width, 1), vibrator.frequency_hz, rate_hz))
    return np.array(sections)


def daily_exposure_m_s2(weighted_g2_s: float) -> float:
    """A(8), the exposure of a day normalised to eight hours (m/s²): ISO 5349-1, equation (2).

    Parameters
    ----------
    weighted_g2_s : float
        The square of the weighted acceleration (g²) over the time of all vibration of that day, in
        one direction, ≥ 0.
    """
    return STANDARD_GRAVITY_M_S2 * sqrt(weighted_g2_s / DAY_S)


def _section(
    above: tuple[float, float, float],
    below: tuple[float, float, float],
    corner_hz: float,
    rate_hz: float,
) -> list[float]:
    """(b2 s² + b1 s + b0) / (a2 s² + a1 s + a0) in s / (2π corner), as a digital section."""
    k = 1 / tan(pi * min(corner_hz, 0.45 * rate_hz) / rate_hz)  # s → k (1 − z⁻¹) / (1 + z⁻¹)

    def digital(s2: float, s1: float, s0: float) -> tuple[float, float, float]:
        return (
            s2 * k * k + s1 * k + s0,
            2 * (s0 - s2 * k * k),
            s2 * k * k - s1 * k + s0,
        )

    b, a = digital(*above), digital(*below)
    return [b[0] / a[0], b[1] / a[0], b[2] / a[0], a[1] / a[0], a[2] / a[0]]
