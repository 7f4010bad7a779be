"""A vibrator: one resonance above a flat part."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from tactileq.modeling.arrays import Floats
from tactileq.modeling.equalizer.bands import check_bands
from tactileq.modeling.equalizer.peq import PEQ
from tactileq.modeling.errors import InputError
from tactileq.modeling.files.described import key
from tactileq.modeling.files.kinds import Rate, Simulated
from tactileq.modeling.files.saved_model import SavedModel
from tactileq.modeling.reprs import one_line

_Positive = Annotated[float, key(gt=0)]


@dataclass(frozen=True, eq=False, kw_only=True)
class Vibrator(SavedModel):
    """A vibrator as its white-noise test shows it: one resonance above a flat part.

    R is the response at the resonance over that of the flat part, G_w. The curves are what was
    measured, in steps of 1/48 octave.
    """

    FORMAT = "tactileq.vibrator"
    WHAT = "the file of a vibrator"
    ADVICE = "identify the vibrator again"

    rate_hz: Annotated[Rate, key("at which it was identified")]
    frequency_hz: Annotated[_Positive, key("peak of the resonance's band H; see `PEQ`", unit="Hz")]
    bandwidth_hz: Annotated[_Positive, key("its −3 dB width", unit="Hz")]
    height: Annotated[_Positive, key("R = 1 + G/G_w > 1")]
    flat_gain: Annotated[_Positive, key("G_w, acceleration per drive")]
    coherence: Annotated[
        _Positive,
        key("median of γ² over the band that was fitted, along a logarithmic axis"),
    ]
    lowest_hz: Annotated[_Positive, key("of that band", unit="Hz")]
    highest_hz: Annotated[_Positive, key("of that band", unit="Hz")]
    curve_hz: Annotated[Floats, key("frequencies of the curves", unit="Hz", shape="steps")]
    curve_response: Annotated[
        Floats, key("|transfer|, acceleration per drive, RMS within a step", shape="steps")
    ]
    curve_coherence: Annotated[Floats, key("γ² of response and drive, 0…1", shape="steps")]
    simulated: Simulated = False

    __repr__ = one_line

    def __post_init__(self) -> None:
        super().__post_init__()
        check_height(self.height)
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
