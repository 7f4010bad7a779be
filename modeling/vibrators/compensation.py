"""What drives the hand: a vibrator's resonance, and the filter that undoes it.

A vibrator that answers a drive w by G_w·w + G·H(w), H a band-pass, is R = 1 + G/G_w times as strong
at its resonance as elsewhere. Eq. 7, ã = G_o·â + G_BEF·H_BEF(â), undoes that exactly where the
notch H_BEF = 1 − H_BP belongs to the band-pass whose tan(πB/fs) is R times that of H, with G_o =
1/R and G_BEF = 1 − 1/R (docs/method/vibrators.md#compensation). A notch of H's own width leaves a
resonance nearly as high as the one it was to take away.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactileq.modeling.arrays import Floats
from tactileq.modeling.checks import check_rate
from tactileq.modeling.equalizer.bands import HIGHEST_BANDWIDTH_SHARE, band_response, rational_tan
from tactileq.modeling.errors import InputError
from tactileq.modeling.vibrators.vibrator import Vibrator, check_band, check_height

FLAT_WITHIN_DB = 3.0
# What is left of a filter's past is negligible: −60 dB.
_SETTLED = 1e-3


@dataclass(frozen=True, kw_only=True)
class Compensation:
    """Eq. 7 as one filter: y = x − (1 − 1/R)·H_BP(x), never louder than x.

    Parameters
    ----------
    frequency_hz : float
        The resonance.
    bandwidth_hz : float
        −3 dB width of the notch: tan(πB/rate) is R times that of the resonance.
    height : float
        R > 1, the resonance's height over the flat part.
    rate_hz : float
        At which the filter runs.

    Raises
    ------
    InputError
        For a band outside the legal range (see `PEQ`) or R ≤ 1.
    """

    frequency_hz: float
    bandwidth_hz: float
    height: float
    rate_hz: float

    def __post_init__(self) -> None:
        check_rate(self.rate_hz)
        check_height(self.height)
        check_band(self.frequency_hz, self.bandwidth_hz, rate_hz=self.rate_hz)

    @property
    def output_gain(self) -> float:
        """G_o = 1/R of eq. 7, for what is not filtered."""
        return 1 / self.height

    @property
    def band_share(self) -> float:
        """G_BEF = 1 − 1/R of eq. 7, for what passes the notch: the share of the band taken away."""
        return 1 - 1 / self.height

    def response(self, frequency_hz: ArrayLike) -> NDArray[np.complex128]:
        """1 − (1 − 1/R)·H_BP at (n,) frequencies: 1/R at the resonance, 1 far from it."""
        (band,) = band_response(
            frequency_hz,
            centres_hz=[self.frequency_hz],
            bandwidths_hz=[self.bandwidth_hz],
            rate_hz=self.rate_hz,
        )
        response: NDArray[np.complex128] = 1 - self.band_share * band
        return response

    @property
    def settling_s(self) -> float:
        """Time after which a thousandth at most (−60 dB) is left of what the band held."""
        slowest = np.abs(np.roots(self._coefficients()[1])).max()
        return float(np.log(_SETTLED) / np.log(slowest) / self.rate_hz)

    def apply(self, signal: ArrayLike) -> Floats:
        """What to send to the vibrator for (n,) samples at `rate_hz`; begins at rest."""
        from scipy.signal import lfilter  # late: takes longer to load than all of modeling

        samples = np.asarray(signal, dtype=np.float64)
        return np.asarray(lfilter(*self._coefficients(), samples))

    def _coefficients(self) -> tuple[Floats, Floats]:
        """Numerator and denominator in z⁻¹.

        With t = (1 − z⁻¹)/(1 + z⁻¹), g = tan(πf/fs) and k = tan(πB/fs) the band is H_BP =
        k(1+g²)t/(g² + k(1+g²)t + t²), the transfer function of docs/method/equalizer.md#recursion.
        """
        g = float(rational_tan(np.pi / self.rate_hz * self.frequency_hz))
        damping = float(rational_tan(np.pi / self.rate_hz * self.bandwidth_hz)) * (1 + g * g)
        band = np.array([damping, 0.0, -damping])
        whole = np.array([1 + g * g + damping, 2 * (g * g - 1), 1 + g * g - damping])
        return whole - self.band_share * band, whole


def compensation_for(vibrator: Vibrator, *, rate_hz: float | None = None) -> Compensation:
    """The exact inverse, up to 1/G_w, of a vibrator's one layer.

    docs/method/vibrators.md#compensation

    Parameters
    ----------
    rate_hz : float, optional
        At which the compensation is to run; the vibrator's without it.

    Raises
    ------
    InputError
        If the notch would be too wide for this rate, or the resonance too high.
    """
    fs = vibrator.rate_hz if rate_hz is None else rate_hz
    check_rate(fs)
    frequency_hz, bandwidth_hz = vibrator.frequency_hz, vibrator.bandwidth_hz
    check_band(frequency_hz, bandwidth_hz, rate_hz=fs)
    widened = vibrator.height * float(rational_tan(np.pi / fs * bandwidth_hz))
    notch_hz = fs / np.pi * float(np.arctan(widened))
    if notch_hz > HIGHEST_BANDWIDTH_SHARE * fs:
        raise InputError(
            f"expected a notch of at most {HIGHEST_BANDWIDTH_SHARE * fs:g} Hz, got {notch_hz:g} Hz "
            f"for a resonance {vibrator.height:.3g} times as high as the flat part and "
            f"{bandwidth_hz:.4g} Hz wide; render at a higher rate."
        )
    return Compensation(
        frequency_hz=frequency_hz, bandwidth_hz=notch_hz, height=vibrator.height, rate_hz=float(fs)
    )


def flat_band(
    frequency_hz: ArrayLike,
    product_response: ArrayLike,
    *,
    level: float,
    within_db: float = FLAT_WITHIN_DB,
) -> tuple[float, float]:
    """The widest band, in octaves, in which a response stays near a level.

    Parameters
    ----------
    frequency_hz : (n,) array_like
        Rising, > 0.
    product_response : (n,) array_like
        |vibrator × compensation| (or without), real or complex.
    level : float
        That of the flat part, in the response's unit, > 0.
    within_db : float
        How far from the level, upwards or downwards.

    Returns
    -------
    low, high : float
        The first and last of the given frequencies in that band.

    Raises
    ------
    InputError
        If the response comes nowhere near the level.
    """
    frequency = np.asarray(frequency_hz, dtype=np.float64)
    with np.errstate(divide="ignore"):  # a response of 0 is far from any level
        deviation_db = 20 * np.log10(np.abs(product_response) / level)
    near = np.concatenate(([False], np.abs(deviation_db) <= within_db, [False]))
    first, end = np.flatnonzero(near[1:] != near[:-1]).reshape(-1, 2).T
    if not first.size:
        raise InputError(
            f"expected a response within {within_db:g} dB of {level:g} somewhere, got none; give "
            "the level of its flat part."
        )
    widest = int(np.argmax(frequency[end - 1] / frequency[first]))
    return float(frequency[first[widest]]), float(frequency[end[widest] - 1])
