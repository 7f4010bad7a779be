"""A vibrator before and after its compensation, and the residue where they do not match."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tactileq.modeling.arrays import Floats
from tactileq.modeling.vibrators.compensation import (
    FLAT_WITHIN_DB,
    Compensation,
    compensation_for,
    flat_band,
)
from tactileq.modeling.vibrators.identification import LEAST_COHERENCE
from tactileq.modeling.vibrators.vibrator import Vibrator

MISTUNINGS = (-0.1, 0.1)


@dataclass(frozen=True, eq=False)
class CompensatedVibrator:
    """The measured response of a vibrator with and without its compensation.

    Parameters
    ----------
    compensation : Compensation
        For the vibrator as it was identified.
    before_db, after_db : (n,) ndarray
        Response re its flat part, at the frequencies of the vibrator's curves.
    flat_before_hz, flat_after_hz : (low, high)
        The widest bands within ±`within_db`.
    mistunings : (k,) ndarray
        How far off the compensation is, as a share of the resonance's frequency.
    mistuned_db : (k, n) ndarray
        Response with a compensation as far off.
    left_db : (k,) ndarray
        The largest deviation from the flat part, up or down, over `flat_after_hz`.
    within_db, least_coherence : float
        What counts as flat, and what a test must reach.
    """

    vibrator: Vibrator
    compensation: Compensation
    before_db: Floats
    after_db: Floats
    flat_before_hz: tuple[float, float]
    flat_after_hz: tuple[float, float]
    mistunings: Floats
    mistuned_db: Floats
    left_db: Floats
    within_db: float = FLAT_WITHIN_DB
    least_coherence: float = LEAST_COHERENCE


def compensated(
    vibrator: Vibrator, *, mistunings: Sequence[float] = MISTUNINGS
) -> CompensatedVibrator:
    """Hold a vibrator's measured curve against its compensation, tuned and mistuned.

    Parameters
    ----------
    mistunings : sequence of float
        Shares of the frequency by which the notch is off, such as −0.1 for 10 % below.

    Raises
    ------
    InputError
        Where the compensation is not possible at the vibrator's rate.
    """
    tuned = compensation_for(vibrator)
    frequency = vibrator.curve_hz
    notches = [
        tuned,
        *(replace(tuned, frequency_hz=tuned.frequency_hz * (1 + off)) for off in mistunings),
    ]
    relative = vibrator.curve_response / vibrator.flat_gain
    products = np.stack([np.abs(notch.response(frequency)) * relative for notch in notches])
    with np.errstate(divide="ignore"):  # lines without drive have no response
        before_db, products_db = 20 * np.log10(relative), 20 * np.log10(products)
    flat = flat_band(frequency, products[0], level=1.0)
    inside = (frequency >= flat[0]) & (frequency <= flat[1])
    return CompensatedVibrator(
        vibrator=vibrator,
        compensation=tuned,
        before_db=before_db,
        after_db=products_db[0],
        flat_before_hz=flat_band(frequency, relative, level=1.0),
        flat_after_hz=flat,
        mistunings=np.array(mistunings, dtype=np.float64),
        mistuned_db=products_db[1:],
        left_db=np.abs(products_db[1:, inside]).max(axis=1),
    )
