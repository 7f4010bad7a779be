"""What every estimator returns for one spectrum, and the names of the estimators."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from tactileq.modeling.arrays import Bools, Floats
from tactileq.modeling.equalizer.peq import PEQ
from tactileq.modeling.errors import InputError, shown
from tactileq.modeling.reprs import one_line


@dataclass(frozen=True, eq=False)
class Layers:
    """Noise gain and m layers of one spectrum, by rising frequency.

    Parameters
    ----------
    noise_gain : float
        G_w, in g per unit noise.
    frequencies_hz, bandwidths_hz, gains : (m,) ndarray
        As in `PEQ`.
    level_sd_db : (m,) ndarray
        Standard deviation of each layer's level in dB, from the record's length.
    unresolved : (m,) ndarray of bool
        The layer's width or level is a bound rather than an estimate: the width is below what the
        record or the smoothing resolves, the height within what the skirts of neighbours reach by
        themselves, or the amplitude within one standard deviation of nothing.
    """

    noise_gain: float
    frequencies_hz: Floats
    bandwidths_hz: Floats
    gains: Floats
    level_sd_db: Floats
    unresolved: Bools

    __repr__ = one_line

    def peq(self, *, rate_hz: float) -> PEQ:
        """The equalizer of these layers at the rate of the spectrum they were found in."""
        return PEQ(
            noise_gain=self.noise_gain,
            frequencies_hz=self.frequencies_hz,
            bandwidths_hz=self.bandwidths_hz,
            gains=self.gains,
            rate_hz=rate_hz,
        )


def no_layers(noise_gain: float) -> Layers:
    """Noise alone."""
    none = np.zeros(0)
    return Layers(noise_gain, none, none, none, none, np.zeros(0, dtype=bool))


EstimatorName = Literal["joint", "paper", "paper-consistent"]
ESTIMATORS: tuple[EstimatorName, ...] = ("joint", "paper", "paper-consistent")


def check_estimator(estimator: str) -> EstimatorName:
    """The name itself, or InputError where there is no such estimator."""
    for name in ESTIMATORS:
        if name == estimator:
            return name
    raise InputError(
        f"expected an estimator among {', '.join(ESTIMATORS)}, got {shown(estimator)}; choose one."
    )
