"""Bands of the equalizer: legal range, coefficients, response and level.

docs/method/equalizer.md
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactileq.modeling.arrays import Floats
from tactileq.modeling.errors import InputError

LOWEST_FREQUENCY_HZ = 1.0
HIGHEST_FREQUENCY_SHARE = 0.49
LOWEST_BANDWIDTH_HZ = 0.1
HIGHEST_BANDWIDTH_SHARE = 0.45
_ROUNDING = 1e-6


def _half_tangent(angle: ArrayLike) -> tuple[Floats, Floats]:
    """Numerator and denominator of tan(angle/2): the [9/8] Padé approximant (Lambert)."""
    half = np.asarray(angle, dtype=np.float64) * 0.5
    z = half * half
    numerator = half * (34459425 + z * (-4729725 + z * (135135 + z * (-990 + z))))
    denominator = 34459425 + z * (-16216200 + z * (945945 + z * (-13860 + z * 45)))
    return numerator, denominator


def rational_tan(angle: ArrayLike) -> Floats:
    """Tangent by one rational formula, the same in every implementation of the filter.

    A rational approximant of tan(angle/2), then the double-angle formula.

    Parameters
    ----------
    angle : array_like
        Radians, 0 … 0.49 π.

    Returns
    -------
    ndarray
        Relative error at most 2e-14 over that range.
    """
    n, d = _half_tangent(angle)
    result: Floats = 2 * n * d / ((d - n) * (d + n))
    return result


# Why this form. Write one step as s' = A·s + b·w with A = [[1 + p, −q], [q, 1 + r]] and b = (b1,
# b2). For every legal frequency and width A·Aᵀ + b·bᵀ = I: the rows of [A b] are orthonormal. Two
# things follow for any course of the parameters, because each of them holds for a single step
# alone. [A b] never lengthens a vector, so |s'|² ≤ |s|² + w²: no jump can make the state grow
# faster than the input. And unit white noise takes a state of covariance I into another of
# covariance I, so a band has its level at once, without a time to settle. What keeps the
# identity: all numbers come from one angle and one k; parameters are interpolated, never
# coefficients; the noise enters both states. A direct form has no such identity, and products of
# its matrices may grow without bound.
class BandCoefficients(NamedTuple):
    """Coefficients of the unit-covariance state-variable filter, one per band.

    docs/method/equalizer.md#recursion
    """

    p: Floats
    q: Floats
    r: Floats
    b1: Floats
    b2: Floats
    tap: Floats


def band_coefficients(
    frequency_hz: ArrayLike, bandwidth_hz: ArrayLike, *, rate_hz: float
) -> BandCoefficients:
    """Coefficients of unit-gain band-passes with peak at f and −3 dB width B.

    Parameters
    ----------
    frequency_hz, bandwidth_hz : array_like of one shape
        1 Hz ≤ f ≤ 0.49 rate, 0.1 Hz ≤ B ≤ 0.45 rate; see `clamp_bands`.
    rate_hz : float
        Rate at which the filter runs.

    Notes
    -----
    The recursion of docs/method/equalizer.md: s1 ← s1 + p·s1 − q·s2 + b1·w,
    s2 ← s2 + q·s1 + r·s2 + b2·w, band = tap·(s1 before + s1 after). With θ = πf/fs and
    k = tan(πB/fs): p = −2(sin²θ + k)/(1+k), r = −2 sin²θ/(1+k), q = sin 2θ/(1+k),
    (b1, b2) = 2√k/(1+k)·(cos θ, sin θ) and tap = √k/(2 cos θ). Operation by operation as
    `tq_band_of` in `kernel.h`.
    """
    n, d = _half_tangent(np.pi / rate_hz * np.asarray(frequency_hz, dtype=np.float64))
    scale = 1 / (d * d + n * n)
    cosine = (d - n) * (d + n) * scale
    sine = 2 * n * d * scale
    n, d = _half_tangent(np.pi / rate_hz * np.asarray(bandwidth_hz, dtype=np.float64))
    k_n = 2 * n * d
    k_d = (d - n) * (d + n)
    scale = 1 / (k_d + k_n)
    share = k_d * scale
    root = np.sqrt(k_n * k_d)
    r = -2 * sine * sine * share
    return BandCoefficients(
        p=r - 2 * k_n * scale,
        q=2 * sine * cosine * share,
        r=r,
        b1=2 * root * scale * cosine,
        b2=2 * root * scale * sine,
        tap=root / (2 * k_d * cosine),
    )


def clamp_bands(
    frequency_hz: Floats, bandwidth_hz: Floats, *, rate_hz: float
) -> tuple[Floats, Floats, int]:
    """Frequencies and widths moved into the legal range, and how many values had to move.

    What an interpolation between legal values misses by rounding (a millionth) is moved, but not
    counted.
    """
    frequency = np.clip(frequency_hz, LOWEST_FREQUENCY_HZ, HIGHEST_FREQUENCY_SHARE * rate_hz)
    bandwidth = np.clip(bandwidth_hz, LOWEST_BANDWIDTH_HZ, HIGHEST_BANDWIDTH_SHARE * rate_hz)
    moved = np.count_nonzero(np.abs(frequency - frequency_hz) > _ROUNDING * frequency)
    moved += np.count_nonzero(np.abs(bandwidth - bandwidth_hz) > _ROUNDING * bandwidth)
    return frequency, bandwidth, int(moved)


def band_response(
    frequency_hz: ArrayLike, *, centres_hz: ArrayLike, bandwidths_hz: ArrayLike, rate_hz: float
) -> NDArray[np.complex128]:
    """Complex response H_i(f) of unit-gain bands.

    Parameters
    ----------
    frequency_hz : (n,) array_like
        Where, 0 … rate/2.
    centres_hz, bandwidths_hz : (m,) array_like
        Peak frequency and −3 dB width of each band.

    Returns
    -------
    (m, n) complex ndarray
        1 at the band's centre; 0 at 0 Hz and at the Nyquist frequency.
    """
    angle = np.pi / rate_hz * np.asarray(frequency_hz, dtype=np.float64)
    sine, cosine = np.sin(angle), np.cos(angle)
    g = rational_tan(np.pi / rate_hz * np.asarray(centres_hz, dtype=np.float64))[:, None]
    k = rational_tan(np.pi / rate_hz * np.asarray(bandwidths_hz, dtype=np.float64))[:, None]
    through = 1j * k * (1 + g * g) * sine * cosine
    response: NDArray[np.complex128] = through / ((g * cosine) ** 2 - sine**2 + through)
    return response


def check_bands(frequencies_hz: Floats, bandwidths_hz: Floats, rate_hz: float) -> None:
    """Refuse frequencies and widths out of range (docs/method/equalizer.md#legal-ranges).

    Raises
    ------
    InputError
        Naming the first value that is out of range or not finite.
    """
    limits = (
        ("frequency", frequencies_hz, LOWEST_FREQUENCY_HZ, HIGHEST_FREQUENCY_SHARE * rate_hz),
        ("bandwidth", bandwidths_hz, LOWEST_BANDWIDTH_HZ, HIGHEST_BANDWIDTH_SHARE * rate_hz),
    )
    for name, values, low, high in limits:
        wrong = values[~((values >= low) & (values <= high))]
        if wrong.size:
            raise InputError(
                f"expected each layer's {name} within {low:g}…{high:g} Hz at a rate of "
                f"{rate_hz:g} Hz, got {wrong.flat[0]:g}; correct the layer or raise the rate."
            )


def band_rms(gains: ArrayLike, bandwidths_hz: ArrayLike, *, rate_hz: float) -> Floats:
    """RMS (g) of unit white noise through bands of peak gain G and width B.

    docs/method/equalizer.md#band-variance

    Any shape; `gains` may be signed. Variance is G²·k/(1+k) with k = tan(πB/rate).
    """
    k = rational_tan(np.pi / rate_hz * np.asarray(bandwidths_hz, dtype=np.float64))
    rms: Floats = np.abs(gains) * np.sqrt(k / (1 + k))
    return rms
