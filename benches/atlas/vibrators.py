"""Residue after compensating a resonance: mistuned, of any quality, with a noisy test.

Theory and how to read it: docs/stability.md#vibrators.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache, partial

import numpy as np

from tactileq.benches.atlas.case import Axis, Case
from tactileq.modeling import InputError, Vibrator, compensation_for, identify_vibrator
from tactileq.modeling.arrays import Floats
from tactileq.modeling.vibrators.compensation import FLAT_WITHIN_DB, Compensation
from tactileq.modeling.vibrators.identification import LEAST_COHERENCE
from tactileq.stimuli.planted.vibrators import SimulatedVibrator, planted_vibrator

RATE_HZ = 5000.0
RESONANCE_HZ = 80.0
USUAL_QUALITY = 5.0
# Of the white noise of the sensor, re the flat part's own RMS: a coherence of 0.96 there.
USUAL_NOISE = 0.2
TEST_S = 20.0  # and twice its quality in seconds, where that is longer
REPEATS = {False: 2, True: 5}
HOLDS_DB, DEGRADES_DB = FLAT_WITHIN_DB, 2 * FLAT_WITHIN_DB
# The flat band begins at 0.70 to 0.77 of the resonance: what rolls off below is left as it is.
FREQUENCIES_HZ = np.geomspace(0.8 * RESONANCE_HZ, 0.98 * RATE_HZ / 2, 4000)
ONE_LAYER, MASS = "one layer, known", "mass on a spring, identified"
COMPENSATED, OWN_WIDTH, WITHOUT = "compensation", "notch as wide as the peak", "none"


def found(quality: float, *, noise: float, duration_s: float, seed: int) -> Vibrator:
    """A mass on a spring as its simulated test with white noise identifies it."""
    truth, rng = SimulatedVibrator(RESONANCE_HZ, quality, RATE_HZ), np.random.default_rng(seed)
    drive = rng.standard_normal(round(duration_s * RATE_HZ))
    acceleration = truth.accelerate(drive, sensor_noise=noise, rng=rng)
    return identify_vibrator(drive, acceleration, rate_hz=RATE_HZ, simulated=True)


@cache
def _identified(quality: float) -> Vibrator:
    return found(quality, noise=USUAL_NOISE, duration_s=max(TEST_S, 2 * quality), seed=0)


def _layer(quality: float) -> Vibrator:
    """A vibrator of one exactly known layer, its height relative to the flat part given."""
    planted = planted_vibrator(RESONANCE_HZ, RESONANCE_HZ / quality)
    return replace(planted, rate_hz=RATE_HZ, height=quality)


def uneven_db(response: Floats, notch: Compensation | None) -> float:
    """Largest deviation (dB) of a true response, compensated, from the flat part, up or down."""
    gain = 1.0 if notch is None else np.abs(notch.response(FREQUENCIES_HZ))
    return float(np.abs(20 * np.log10(response * gain)).max())


def _mass_response(quality: float) -> Floats:
    return np.abs(SimulatedVibrator(RESONANCE_HZ, quality, RATE_HZ).response(FREQUENCIES_HZ))


def _layer_response(quality: float) -> Floats:
    vibrator = _layer(quality)
    response: Floats = vibrator.peq.response(FREQUENCIES_HZ) / vibrator.flat_gain
    return response


def mistuned(value: float, column: float, *, which: str, full: bool) -> float:
    """Unevenness (dB), the worse of both directions, of a notch off by this share; Q: `column`."""
    del full
    known = which == ONE_LAYER
    response = _layer_response(column) if known else _mass_response(column)
    tuned = compensation_for(_layer(column) if known else _identified(column))
    notches = (replace(tuned, frequency_hz=tuned.frequency_hz * (1 + o)) for o in (-value, value))
    return max(uneven_db(response, notch) for notch in notches)


def of_quality(value: float, column: float, *, how: str, full: bool) -> float:
    """Unevenness (dB) of a mass on a spring of this quality: compensated, otherwise, or not.

    inf where its test is refused.
    """
    del column, full
    if how == WITHOUT:
        return uneven_db(_mass_response(value), None)
    try:
        vibrator = _identified(value)
    except InputError:
        return math.inf
    notch = compensation_for(vibrator)
    if how == OWN_WIDTH:
        notch = replace(notch, bandwidth_hz=vibrator.bandwidth_hz)
    return uneven_db(_mass_response(value), notch)


def badly_measured(value: float, column: float, *, full: bool) -> float:
    """Unevenness (dB) at worst after tests of 20 s with sensor noise; inf where one is refused."""
    left_db = []
    for seed in range(REPEATS[full]):
        try:
            vibrator = found(column, noise=value, duration_s=TEST_S, seed=seed)
        except InputError:
            return math.inf
        left_db.append(uneven_db(_mass_response(column), compensation_for(vibrator)))
    return max(left_db)


def _edge_share(quality: float) -> float:
    """How far a notch may be off: what is left of a resonance of quality Q is 8.7 dB·asinh(Qδ).

    Near the resonance the notch's zeros stand against the resonance's poles: |1 + j(u − a)| over
    |1 + ju| with u = 2Q(f/f₀ − 1) and a = 2Qδ, whose largest value over u is a/2 + √(1 + a²/4).
    """
    return math.sinh(HOLDS_DB * math.log(10) / 20) / quality


def _edge_quality(how: str, column: float) -> float:
    """The quality to which a resonance is even: its own height, or what a narrow notch leaves.

    A notch of the resonance's own width leaves (R + 1/R)/2 at its half-power points.
    """
    del column
    limit = 10 ** (HOLDS_DB / 20)
    if how == WITHOUT:  # Q/√(1 − 1/4Q²), the peak of a mass on a spring
        return math.sqrt((limit**2 + limit * math.sqrt(limit**2 - 1)) / 2)
    return limit + math.sqrt(limit**2 - 1) if how == OWN_WIDTH else math.inf


def _edge_noise(column: float) -> float:
    """The sensor noise with which the coherence 1/(1 + n²) of the flat part is the least one."""
    del column
    return math.sqrt(1 / LEAST_COHERENCE - 1)


_uneven = partial(
    Case,
    family="vibrators",
    figure="unevenness",
    unit="dB",
    holds=HOLDS_DB,
    degrades=DEGRADES_DB,
)
_QUALITY = Axis(name="quality", unit="", mild=2.5, severe=35.0, default=USUAL_QUALITY)

CASES: tuple[Case, ...] = (
    *(
        _uneven(
            method=which,
            ours=which == MASS,
            axis=Axis(name="mistuning, share of frequency", unit="", mild=1e-3, severe=0.4),
            measure=partial(mistuned, which=which),
            across="quality",
            columns={f"Q {quality}": float(quality) for quality in (3, 5, 10, 20)},
            theory=_edge_share,
            source="8.7 dB·asinh(Qδ): zeros of the notch beside the poles of the resonance",
        )
        for which in (ONE_LAYER, MASS)
    ),
    *(
        _uneven(
            method=how,
            ours=how == COMPENSATED,
            axis=_QUALITY,
            measure=partial(of_quality, how=how),
            theory=partial(_edge_quality, how),
            source="height of the peak; (R + 1/R)/2 of a notch as wide as the peak; 1 of ours",
        )
        for how in (COMPENSATED, OWN_WIDTH, WITHOUT)
    ),
    _uneven(
        method=COMPENSATED,
        ours=True,
        axis=Axis(name="quality, low", unit="", mild=10.0, severe=1.5, default=USUAL_QUALITY),
        measure=partial(of_quality, how=COMPENSATED),
    ),
    _uneven(
        method=COMPENSATED,
        ours=True,
        axis=Axis(
            name="sensor noise re flat part", unit="", mild=0.02, severe=2.0, default=USUAL_NOISE
        ),
        measure=badly_measured,
        across="quality",
        columns={f"Q {USUAL_QUALITY:g}": USUAL_QUALITY},
        theory=_edge_noise,
        source=f"coherence 1/(1 + n²) = {LEAST_COHERENCE:g}, below which a test is refused",
    ),
)
