"""All-pole models at a sound card's rate: their representation in `lattice.h`.

docs/method/rendering.md#ar-models-at-a-cards-rate
"""

from __future__ import annotations

from fractions import Fraction
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from modeling.arrays import Floats
from modeling.errors import InputError
from modeling.models.ar_model import ARModel
from modeling.models.parameter_table import wide_enough
from modeling.rendering.plan import RenderPlan, plan_for

MOST_ORDER = 100  # fits go up to 40; the coefficients of one update take time with its square
MOST_PHASES = 1000
_PASS_SHARE = 0.9  # of the model's Nyquist frequency: from there on its spectrum falls
_REJECTION_DB = 70.0


class LatticeFields(NamedTuple):
    """Members of `tq_texture` and of `tq_lattice`, by name."""

    texture: dict[str, Any]
    lattice: dict[str, Any]


def lattice_fields(model: ARModel, plan: RenderPlan) -> LatticeFields:
    """What an all-pole model is in `lattice.h`, played as this plan says.

    Parameters
    ----------
    model : ARModel
        Of an order up to 100; updated every millisecond.
    plan : RenderPlan
        Its rate, at least the model's, its limits and its compensation are those of the output.

    Raises
    ------
    InputError
        For a higher order; for rates that `rate_ratio` refuses.
    """
    if model.order > MOST_ORDER:
        raise InputError(
            f"expected an AR model of order {MOST_ORDER} at most for real time, got order "
            f"{model.order} of {model.texture}; fit a lower one."
        )
    ratio, own = rate_ratio(model.rate_hz, plan.rate_hz), plan_for(model.rate_hz)
    values = np.concatenate([model.gains[..., None], model.line_spectral_frequencies], axis=-1)
    speeds, values = wide_enough(model.speeds_mm_s, values, along=0)
    forces, values = wide_enough(model.forces_n, values, along=1)
    lowpass = upsampling_phases(ratio.numerator)
    speed_change, force_change = own.hand_changes
    texture = {
        "speeds": speeds.size,
        "forces": forces.size,
        "speed_mm_s": speeds,
        "force_n": forces,
        "values": values[..., 0].ravel(),
        "rate_hz": plan.rate_hz,
        "noise_scale": 1.0,
        "lowpass": np.ones(1),
        "taps": 1,
        "update_samples": own.update_samples,
        "speed_change": speed_change,
        "force_change": force_change,
        "slope_share": own.slope_share,
        **own.readings,
        "slews": own.slews(np.array([model.gains.max()])),
    }
    lattice = {
        "order": model.order,
        "frequencies": values[..., 1:].ravel(),
        "up": ratio.numerator,
        "down": ratio.denominator,
        "taps": lowpass.shape[1],
        "lowpass": lowpass.ravel(),
    }
    return LatticeFields(texture | plan.restraints(), lattice)


def rate_ratio(model_rate_hz: float, rate_hz: float) -> Fraction:
    """By how much a model's samples become more at this rate, as a ratio of whole numbers.

    Raises
    ------
    InputError
        For a rate below the model's, or one with which it shares no ratio of small numbers.
    """
    if not rate_hz >= model_rate_hz:
        raise InputError(
            f"expected an output rate of at least the model's {model_rate_hz:g} Hz, got "
            f"{rate_hz:g}; choose a higher rate of the card."
        )
    ratio = Fraction(rate_hz) / Fraction(model_rate_hz)
    if ratio.numerator > MOST_PHASES:
        raise InputError(
            f"expected rates whose ratio is one of whole numbers up to {MOST_PHASES}, got an AR "
            f"model of {model_rate_hz!r} Hz for {rate_hz!r} Hz; fit it to recordings of a round "
            "rate, such as 5000 Hz."
        )
    return ratio


@lru_cache(maxsize=4)
def upsampling_phases(up: int) -> Floats:
    """Weights (up, taps) of the low-pass that makes `up` samples of each, phase by phase.

    Flat within 0.01 dB up to 0.9 of the model's Nyquist frequency; from that frequency on, where
    the images are, at least 60 dB below that. It has minimum phase, since the phase of noise is not
    felt and a linear phase would be late by 43 samples of the model: this one is late by 2.5 at low
    frequencies, 14 at the end of its flat part.

    Parameters
    ----------
    up : int
        1 … 1000; of 1 a single weight of 1.
    """
    if up == 1:
        return np.ones((1, 1))
    from scipy.signal import firwin, kaiserord, minimum_phase

    count, beta = kaiserord(_REJECTION_DB, (1 - _PASS_SHARE) / up)
    count |= 1  # odd, as `minimum_phase` wants it for a low-pass
    linear = firwin(count, (1 + _PASS_SHARE) / 2 / up, window=("kaiser", beta))
    points = 2 ** int(np.ceil(np.log2(8 * count)))
    weights = minimum_phase(linear, half=False, n_fft=points)
    padded = np.append(weights, np.zeros(-weights.size % up))
    phases: Floats = np.ascontiguousarray(padded.reshape(-1, up).T) * (up / weights.sum())
    phases.setflags(write=False)
    return phases
