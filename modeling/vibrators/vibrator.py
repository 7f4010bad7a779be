"""A vibrator: one resonance above a flat part."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from modeling.arrays import Floats
from modeling.checks import check_rate, is_positive
from modeling.equalizer.bands import check_bands
from modeling.equalizer.peq import PEQ
from modeling.errors import InputError, shown
from modeling.files.saved_model import SavedModel

_CURVES = ("curve_hz", "curve_response", "curve_coherence")
_NUMBERS = ("rate_hz", "frequency_hz", "bandwidth_hz", "height", "flat_gain", "coherence")


@dataclass(frozen=True, eq=False, kw_only=True)
class Vibrator(SavedModel):
    """A vibrator as its white-noise test shows it: one resonance above a flat part.

    Parameters
    ----------
    rate_hz : float
        At which it was identified.
    frequency_hz, bandwidth_hz : float
        Peak and −3 dB width of the resonance's band H; see `PEQ`.
    height : float
        R = 1 + G/G_w > 1: response at the resonance over that of the flat part.
    flat_gain : float
        G_w > 0, the response of the flat part, acceleration per drive.
    coherence : float
        Median of γ² over the band that was fitted, along a logarithmic axis.
    lowest_hz, highest_hz : float
        That band.
    curve_hz, curve_response, curve_coherence : (n,) array_like
        What was measured, in steps of 1/48 octave: frequency, |transfer| (acceleration per drive;
        RMS within a step) and coherence γ² of response and drive, 0…1.
    simulated : bool
        True where the test was simulated.

    Raises
    ------
    InputError
        For values out of range, not finite, or curves of different lengths.
    """

    FORMAT = "tactileq.vibrator"

    rate_hz: float
    frequency_hz: float
    bandwidth_hz: float
    height: float
    flat_gain: float
    coherence: float
    lowest_hz: float
    highest_hz: float
    curve_hz: Floats
    curve_response: Floats
    curve_coherence: Floats
    simulated: bool = False

    def __post_init__(self) -> None:
        for name in (*_NUMBERS, "lowest_hz", "highest_hz"):
            value = getattr(self, name)
            _check_positive(name, value)
            object.__setattr__(self, name, float(value))
        check_rate(self.rate_hz)
        check_height(self.height)
        self._freeze(_CURVES)
        curves = np.array([getattr(self, name).size for name in _CURVES])
        if self.curve_hz.ndim != 1 or curves.min() != curves.max():
            raise InputError(
                f"expected three curves of one length, got {curves.tolist()} values; identify the "
                "vibrator again."
            )
        if not isinstance(self.simulated, bool):
            raise InputError(
                f"expected true or false for simulated, got {shown(self.simulated)}; identify the "
                "vibrator again."
            )
        check_band(self.frequency_hz, self.bandwidth_hz, rate_hz=self.rate_hz)

    @property
    def peq(self) -> PEQ:
        """The vibrator as one layer, G_w·w + G·H(w), in acceleration per drive."""
        return PEQ(
            noise_gain=self.flat_gain,
            frequencies_hz=np.array([self.frequency_hz]),
            bandwidths_hz=np.array([self.bandwidth_hz]),
            gains=np.array([self.flat_gain * (self.height - 1)]),
            rate_hz=self.rate_hz,
        )


def _check_positive(name: str, value: float) -> None:
    if not is_positive(value):
        raise InputError(
            f"expected a finite {name} above 0, got {shown(value)}; identify the vibrator again."
        )


def check_band(frequency_hz: float, bandwidth_hz: float, *, rate_hz: float) -> None:
    """Refuse a frequency or width (Hz) outside the legal range of a band."""
    check_bands(np.array([frequency_hz]), np.array([bandwidth_hz]), rate_hz)


def check_height(height: float) -> None:
    """Refuse a height R over the flat part that is not finite and above 1."""
    if not (np.isfinite(height) and height > 1):
        raise InputError(
            f"expected a resonance higher than the flat part (R > 1), got R = {height:g}; only a "
            "resonance is compensated."
        )
