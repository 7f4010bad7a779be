"""Levels between two conditions, against a surface whose layers are powers of speed.

Theory and how to read it: docs/stability.md#blending.
"""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from tactileq.benches.atlas.case import Axis, Case
from tactileq.benches.rendering.stability import FORMS, OURS, held_variances
from tactileq.modeling import TextureModel
from tactileq.modeling.arrays import Floats
from tactileq.modeling.equalizer.bands import band_rms
from tactileq.modeling.models.line_spectral import (
    line_spectral_frequencies,
    prediction_coefficients,
    reflection_coefficients,
)
from tactileq.modeling.models.parameter_table import Parameters
from tactileq.modeling.models.texture_model import Blending

RATE_HZ = 5000.0
SLOW_MM_S, FORCE_N = 50.0, 1.0
# At the slow condition; the first follows speed, as the period of a surface does.
CENTRES_HZ = np.array([40.0, 250.0, 900.0])
SPEED_LAWS = np.array([1.0, 0.1, 0.05])
WIDTHS_HZ = np.array([20.0, 35.0, 120.0])
SIGNS = np.array([1.0, -1.0, 1.0])
FLOOR_DB = -10.0
POINTS = {False: 9, True: 33}
HOLDS_DB, DEGRADES_DB = 1.0, 6.0
USUAL_GROWTH = 0.5
# The grid's speeds are 50, 100, 150 … mm/s: the first step is the largest.
USUAL_RATIO = 2.0
SPECTRUM_SAMPLES = 20_000
SIGN_WIDTH_HZ, SIGN_CENTRE_HZ = 30.0, 300.0


def surface(speed_mm_s: Floats, growth: float) -> Parameters:
    """The truth at (n,) speeds: levels grow as speed to this power."""
    ratio = (np.asarray(speed_mm_s) / SLOW_MM_S)[:, None]
    widths = np.ones_like(ratio) * WIDTHS_HZ
    gains = SIGNS / band_rms(1.0, widths, rate_hz=RATE_HZ) * ratio**growth
    floor = 10 ** (FLOOR_DB / 20) * ratio[:, 0] ** growth
    return Parameters(floor, CENTRES_HZ * ratio**SPEED_LAWS, widths, gains)


def levels(at: Parameters) -> Floats:
    """RMS at each of n sets of parameters, if held."""
    rms: Floats = np.sqrt(held_variances(at, FORMS[OURS], rate_hz=RATE_HZ).total)
    return rms


def between(ratio: float, *, full: bool) -> Floats:
    """Speeds strictly between two conditions, evenly in octaves."""
    return np.geomspace(SLOW_MM_S, ratio * SLOW_MM_S, POINTS[full] + 2)[1:-1]


def equalizer(value: float, column: float, *, blending: Blending, full: bool) -> float:
    """Largest level error (dB) between speeds of this ratio, levels growing with this power."""
    ends = np.array([SLOW_MM_S, value * SLOW_MM_S])
    at = surface(ends, column)
    model = TextureModel(
        texture="two conditions",
        rate_hz=RATE_HZ,
        speeds_mm_s=ends,
        forces_n=np.array([FORCE_N]),
        noise_gains=at.noise_gain[:, None],
        frequencies_hz=at.frequencies_hz[:, None],
        bandwidths_hz=at.bandwidths_hz[:, None],
        gains=at.gains[:, None],
        level_sd_db=np.zeros((2, 1, at.gains.shape[1])),
        estimator="planted",
        simulated=True,
        blending=blending,
    )
    speeds = between(value, full=full)
    blended = model.parameters(speeds, np.full(speeds.size, FORCE_N))
    return _largest_db(levels(blended) / levels(surface(speeds, column)))


def predictor(value: float, column: float, *, spectral: bool, full: bool) -> float:
    """The same of an all-pole filter of the order in `column`; inf where it is unstable."""
    speeds = between(value, full=full)
    ends = surface(np.array([SLOW_MM_S, value * SLOW_MM_S]), USUAL_GROWTH)
    filters = [_all_pole(ends, number, order=round(column)) for number in (0, 1)]
    share = ((speeds / SLOW_MM_S - 1) / (value - 1))[:, None]
    if spectral:
        low, high = (line_spectral_frequencies(a) for a, _ in filters)
        coefficients = prediction_coefficients(low + share * (high - low))
    else:
        low, high = (a for a, _ in filters)
        coefficients = low + share * (high - low)
    gain = filters[0][1] + share[:, 0] * (filters[1][1] - filters[0][1])
    reflection = np.abs(reflection_coefficients(coefficients))
    if not (reflection < 1).all():
        return math.inf
    level = gain / np.sqrt(np.prod(1 - reflection**2, axis=-1))
    return _largest_db(level / levels(surface(speeds, USUAL_GROWTH)))


def _all_pole(at: Parameters, number: int, *, order: int) -> tuple[Floats, float]:
    """Coefficients and gain by Yule–Walker on the truth's own autocorrelation."""
    from scipy.linalg import solve_toeplitz

    from tactileq.modeling.models.texture_model import first_peq

    one = Parameters(*(part[number : number + 1] for part in at))
    frequency = np.fft.rfftfreq(SPECTRUM_SAMPLES, 1 / RATE_HZ)
    power = first_peq(one, rate_hz=RATE_HZ).response(frequency) ** 2
    lags = np.fft.irfft(power)[: order + 1]
    coefficients = solve_toeplitz(lags[:-1], -lags[1:])
    return coefficients, float(np.sqrt(lags[0] + coefficients @ lags[1:]))


def _largest_db(ratio: Floats) -> float:
    return float(np.abs(20 * np.log10(ratio)).max())


def signs(value: float, column: float, *, alternating: bool, full: bool) -> float:
    """Level error (dB) of two equally loud layers so many widths apart, re their powers' sum."""
    del column, full  # one run is exact
    apart = value * SIGN_WIDTH_HZ / 2
    gains = np.array([[1.0, -1.0 if alternating else 1.0]])
    at = Parameters(
        np.zeros(1),
        np.array([[SIGN_CENTRE_HZ - apart, SIGN_CENTRE_HZ + apart]]),
        np.full((1, 2), SIGN_WIDTH_HZ),
        gains,
    )
    variances = held_variances(at, FORMS[OURS], rate_hz=RATE_HZ)
    ratio = variances.total / variances.bands.sum(axis=1)
    return float(np.abs(10 * np.log10(np.maximum(ratio, 1e-300)))[0])


def _edge_ratio(blending: Blending, growth: float) -> float:
    """The ratio of speeds at which a chord and a power law differ by `HOLDS_DB` between its ends.

    Gains of a linear blend are on the chord from 1 to r^p, those of the truth are x^p.
    """
    if blending == "logarithmic":
        return math.inf
    from scipy.optimize import brentq

    def beyond(ratio: float) -> float:
        x = np.geomspace(1.0, ratio, 513)
        chord = 1 + (ratio**growth - 1) * (x - 1) / (ratio - 1)
        return _largest_db(chord / x**growth) - HOLDS_DB

    return float(brentq(beyond, 1 + 1e-6, 1e3))


def _edge_apart(alternating: bool, column: float) -> float:
    """At how many widths from one another two layers' levels add as powers within `HOLDS_DB`.

    Narrow bands of one width B, D apart and driven by one noise, have a correlation of
    ±1/(1 + (D/B)²).
    """
    del column
    correlation = 1 - 10 ** (-HOLDS_DB / 10) if alternating else 10 ** (HOLDS_DB / 10) - 1
    return math.sqrt(1 / correlation - 1)


_between = partial(
    Case,
    family="blending",
    figure="level between conditions re truth",
    unit="dB",
    axis=Axis(
        name="ratio of speeds of two conditions",
        unit="",
        mild=1.1,
        severe=10.0,
        default=USUAL_RATIO,
    ),
    holds=HOLDS_DB,
    degrades=DEGRADES_DB,
)
_METHODS: tuple[tuple[str, Blending], ...] = (
    ("PEQ, logarithmic", "logarithmic"),
    ("PEQ, linear", "linear"),
)

CASES: tuple[Case, ...] = (
    *(
        _between(
            method=method,
            ours=blending == "logarithmic",
            measure=partial(equalizer, blending=blending),
            across="growth of level",
            columns={"level ∝ √v": USUAL_GROWTH, "level ∝ v²": 2.0},
            theory=partial(_edge_ratio, blending),
            source="a chord beside a power law; a power law is kept exactly in logarithms",
        )
        for method, blending in _METHODS
    ),
    *(
        _between(
            method=method,
            ours=False,
            measure=partial(predictor, spectral=spectral),
            across="order",
            columns={f"AR({order})": float(order) for order in (2, 6, 20)},
        )
        for method, spectral in (("AR coefficients", False), ("line spectral frequencies", True))
    ),
    *(
        Case(
            family="blending",
            method=f"{which} signs",
            ours=False,
            axis=Axis(name="distance of two layers", unit="widths", mild=10.0, severe=0.1),
            figure="level re the sum of powers",
            unit="dB",
            holds=HOLDS_DB,
            degrades=DEGRADES_DB,
            measure=partial(signs, alternating=which == "alternating"),
            theory=partial(_edge_apart, which == "alternating"),
            source="correlation ±1/(1 + (D/B)²) of two bands driven by one noise",
        )
        for which in ("equal", "alternating")
    ),
)
