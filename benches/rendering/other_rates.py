"""Levels of a rendering at another rate than the model's against those at its own, calculated.

From responses: no random numbers. docs/method/rendering.md#other-rates
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tactileq.modeling import PEQ
from tactileq.modeling.arrays import Floats
from tactileq.modeling.rendering.interpolation import interpolation

# Midpoints of intervals: far below the width of any layer; above the model's band there are images.
STEP_HZ = 0.5
STEP_ABOVE_HZ = 2.5
# Exact centres of the nominal 16 Hz to 2 kHz: the highest whose band ends below 2.5 kHz.
THIRD_OCTAVES_HZ = 1000.0 * 10.0 ** (np.arange(-18, 4) / 10)


class RateErrors(NamedTuple):
    """Levels of n conditions at another rate against those at the model's own, in dB.

    `within_band_db`, (n,): of all below the model's Nyquist frequency; `whole_db`, (n,): of all up
    to half the rate; `third_octaves_db`, (n, k): of each of the k `THIRD_OCTAVES_HZ`.
    """

    within_band_db: Floats
    whole_db: Floats
    third_octaves_db: Floats


def rate_errors(conditions: Sequence[PEQ], *, model_rate_hz: float, rate_hz: float) -> RateErrors:
    """Level errors of each condition when it is rendered at another rate.

    Parameters
    ----------
    conditions : sequence of PEQ
        All at the model's rate.
    model_rate_hz : float
        4.5 kHz or above, so that all third octaves are below its Nyquist frequency.
    rate_hz : float
        At which they are rendered, at least the model's.

    Raises
    ------
    InputError
        For a rate below the model's.
    """
    within = _midpoints(0.0, model_rate_hz / 2, step_hz=STEP_HZ)
    above = _midpoints(model_rate_hz / 2, rate_hz / 2, step_hz=STEP_ABOVE_HZ)
    way = interpolation(model_rate_hz, rate_hz)
    own = np.array([peq.response(within) ** 2 for peq in conditions])
    folded = np.abs((above + model_rate_hz / 2) % model_rate_hz - model_rate_hz / 2)
    imaged = np.array([peq.response(folded) ** 2 for peq in conditions])
    rendered, images = (
        power if way is None else power * np.abs(way.response(at / model_rate_hz)) ** 2
        for power, at in ((own, within), (imaged, above))
    )
    own_power, power = (part.sum(axis=1) * STEP_HZ for part in (own, rendered))
    thirds = [
        rendered[:, inside].sum(axis=1) / own[:, inside].sum(axis=1)
        for inside in (np.abs(np.log10(within / centre)) < 0.05 for centre in THIRD_OCTAVES_HZ)
    ]
    return RateErrors(
        10 * np.log10(power / own_power),
        10 * np.log10((power + images.sum(axis=1) * STEP_ABOVE_HZ) / own_power),
        10 * np.log10(np.stack(thirds, axis=1)),
    )


def _midpoints(low_hz: float, high_hz: float, *, step_hz: float) -> Floats:
    return np.arange(low_hz + step_hz / 2, high_hz, step_hz)
