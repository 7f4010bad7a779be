"""Filters whose parameters move, and filters in single precision.

Theory and how to read it: docs/stability.md#filters.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import sosfilt

from tactileq.benches.atlas.case import Axis, Case
from tactileq.benches.rendering.stability import (
    CENTRES_HZ,
    DIRECT,
    FORMS,
    OURS,
    PLAIN,
    STROKE_HZ,
    WIDTHS_HZ,
    excess_db,
    held_variances,
    moving_variances,
)
from tactileq.modeling import Renderer, TextureModel
from tactileq.modeling.arrays import Floats
from tactileq.modeling.equalizer.bands import band_rms
from tactileq.modeling.models.parameter_table import Parameters
from tactileq.stimuli.planted.textures import CATALOGUE

RATE_HZ = 5000.0
CENTRE_HZ, WIDTH_HZ = 300.0, 40.0
DURATION_S = {False: 0.25, True: 1.0}
# People can tell vibrations apart that differ by 1 to 2 dB in level.
HOLDS_DB, DEGRADES_DB = 1.0, 6.0
# From the grid's lowest speed to its highest, 50 to 350 mm/s, are 2.8 octaves.
STROKE_OCTAVES = 1.4
AT_RANDOM = math.inf
NARROWEST_HZ = float(min(layer.bandwidth_hz for t in CATALOGUE.values() for layer in t.layers))
LOWEST_HZ = float(min(layer.frequency_hz for t in CATALOGUE.values() for layer in t.layers)) / 4

# Errors of a filter in single precision, in dB re its output.
HOLDS_ERROR_DB, DEGRADES_ERROR_DB = -60.0, -20.0
SINGLE_WIDTH_HZ, SINGLE_CENTRE_HZ = 10.0, 40.0
SINGLE_RATE_HZ = 48_000.0
NEIGHBOURS = {False: 4, True: 12}
SETTLED = {False: 1, True: 2}
# The spacing of single-precision numbers from 1 to 2, where a direct form has its a1.
SPACING = {"float32": 2.0**-23, "float64": 2.0**-52}


def modulated(
    speed_hz: float, depth_octaves: float, *, width_hz: float = WIDTH_HZ, full: bool
) -> Parameters:
    """One band around 300 Hz whose frequency oscillates; at random where the speed is inf."""
    samples = round(DURATION_S[full] * RATE_HZ)
    if speed_hz == AT_RANDOM:
        octaves = np.random.default_rng(0).standard_normal(samples)
    else:
        octaves = np.sin(2 * np.pi * speed_hz / RATE_HZ * np.arange(samples))
    frequency = np.clip(CENTRE_HZ * 2 ** (depth_octaves * octaves), 1.0, 0.49 * RATE_HZ)
    ones = np.ones((samples, 1))
    return Parameters(np.zeros(samples), frequency[:, None], width_hz * ones, ones)


def band_excess_db(at: Parameters, form: str) -> float:
    """The largest deviation of a band's level from that of held parameters, up or down."""
    moving, held = (
        variances(at, FORMS[form], rate_hz=RATE_HZ)
        for variances in (moving_variances, held_variances)
    )
    return float(np.abs(excess_db(moving, held).bands).max())


def faster(value: float, column: float, *, form: str, full: bool) -> float:
    """Excess (dB) at this speed of modulation (Hz) and depth (octaves)."""
    return band_excess_db(modulated(value, column, full=full), form)


def deeper(value: float, column: float, *, form: str, full: bool) -> float:
    """Excess (dB) at this depth (octaves) and speed (Hz; inf: at random at every sample)."""
    return band_excess_db(modulated(column, value, full=full), form)


def narrower(value: float, column: float, *, form: str, full: bool) -> float:
    """Excess (dB) of a band of this width (Hz), one octave up and down at this speed (Hz)."""
    return band_excess_db(modulated(column, 1.0, width_hz=value, full=full), form)


def sum_faster(value: float, column: float, *, full: bool) -> float:
    """Excess (dB) of the sum of three bands that move together, as in a stroke."""
    factor = modulated(value, column, full=full).frequencies_hz / CENTRE_HZ
    frequency = np.clip(np.array(CENTRES_HZ) * factor, 1.0, 0.49 * RATE_HZ)
    width = np.ones_like(frequency) * WIDTHS_HZ
    gains = np.array([1.0, -1.0, 1.0]) / band_rms(1.0, width, rate_hz=RATE_HZ)
    at = Parameters(np.full(len(gains), 10**-0.5), frequency, width, gains)
    moving, held = (
        variances(at, FORMS[OURS], rate_hz=RATE_HZ)
        for variances in (moving_variances, held_variances)
    )
    return float(np.abs(excess_db(moving, held).total).max())


# --- Theory of motion


def _edge_hz(form: str, depth_octaves: float, *, width_hz: float) -> float:
    """The speed of modulation from which a band is off by more than `HOLDS_DB`.

    The variance of a band decays with the time constant 1/(2πB); within it a motion that is slow
    compared with f preserves what a lossless filter preserves. The level therefore follows log f^c
    behind a high-pass of the first order at B, with c = 2 for the state-variable filter (its
    state's norm is kept, its output is that times 1/f) and −1 for the direct form (f times the
    squared output is kept). The direct form is also a parametric amplifier near twice its
    frequency (Landau and Lifshitz, Mechanics, § 27).
    """
    if form == OURS:
        return math.inf
    depth = depth_octaves * math.log(2)
    largest_db = 10 / math.log(10) * (2 if form == PLAIN else 1) * depth
    ratio = HOLDS_DB / largest_db
    edge = math.inf if ratio >= 1 else width_hz * ratio / math.sqrt(1 - ratio**2)
    if form == PLAIN:
        return edge
    reach_hz = depth * CENTRE_HZ / (1 - 10 ** (-HOLDS_DB / 10))
    if width_hz < reach_hz < CENTRE_HZ:  # a small depth, for which the formula was derived
        edge = min(edge, 2 * CENTRE_HZ - math.sqrt(reach_hz**2 - width_hz**2))
    return edge


def _edge_octaves(form: str, speed_hz: float) -> float:
    """The depth of modulation from which a band is off by more than `HOLDS_DB`, as `_edge_hz`."""
    if form == OURS:
        return math.inf
    if speed_hz == AT_RANDOM:
        return math.nan
    db_per_octave = 10 * math.log10(2) * (2 if form == PLAIN else 1)
    edge = HOLDS_DB / db_per_octave * math.hypot(speed_hz, WIDTH_HZ) / speed_hz
    off_hz = math.hypot(WIDTH_HZ, speed_hz - 2 * CENTRE_HZ)
    if form == DIRECT and off_hz < CENTRE_HZ:
        edge = min(edge, (1 - 10 ** (-HOLDS_DB / 10)) * off_hz / CENTRE_HZ / math.log(2))
    return edge


def _edge_width_hz(form: str, speed_hz: float) -> float:
    """The width (Hz) below which a band is off by more than `HOLDS_DB`, as `_edge_hz`."""
    if form == OURS:
        return 0.0
    ratio = HOLDS_DB / (10 * math.log10(2) * (2 if form == PLAIN else 1))
    return speed_hz * math.sqrt(1 - ratio**2) / ratio


# --- Filters in single precision

Numbers = NDArray[np.floating[Any]]


def _direct_output(noise: Floats, frequency: Floats, width: Floats, *, precision: str) -> Numbers:
    """Unit-gain bands (k, n) by SciPy's transposed direct form II, all in one precision."""
    g, k = np.tan(np.pi * frequency), np.tan(np.pi * width)
    rows = []
    for g_one, k_one in zip(g, k, strict=True):
        cosine = (1 - g_one**2) / (1 + g_one**2)
        gain = k_one / (1 + k_one)
        section = [gain, 0, -gain, 1, -2 * cosine / (1 + k_one), (1 - k_one) / (1 + k_one)]
        rows.append(sosfilt(np.array([section], dtype=precision), noise.astype(precision)))
    return np.stack(rows)


def _plain_output(noise: Floats, frequency: Floats, width: Floats, *, precision: str) -> Numbers:
    """The same by a topology-preserving state-variable filter, as `stability.PLAIN`."""
    g, k = np.tan(np.pi * frequency), np.tan(np.pi * width)
    damping = k * (1 + g * g) / g
    a1 = 1 / (1 + g * (g + damping))
    a1, a2, a3, damping = (part.astype(precision) for part in (a1, a1 * g, a1 * g * g, damping))
    s1 = s2 = np.zeros_like(a1)
    bands = np.empty((noise.size, a1.size), dtype=precision)
    for n, w in enumerate(noise.astype(precision)):
        v3 = w - s2
        v1 = a1 * s1 + a2 * v3
        v2 = s2 + a2 * s1 + a3 * v3
        s1, s2 = v1 + v1 - s1, v2 + v2 - s2
        bands[n] = v1
    output: Numbers = (damping * bands).T
    return output


OUTPUTS: dict[str, Callable[..., Numbers]] = {DIRECT: _direct_output, PLAIN: _plain_output}


def _error_db(
    frequency_hz: float, width_hz: float, *, rate_hz: float, form: str, precision: str, full: bool
) -> float:
    """RMS error of a held band by its precision, re its output: the largest of neighbouring bands.

    Numbers that round well by chance say nothing of others beside them. Against the same recursion
    in a higher precision; the first half of some time constants is left out.
    """
    count = NEIGHBOURS[full]
    near = np.geomspace(0.9, 1.1, count)
    settled = round(SETTLED[full] * rate_hz / (np.pi * width_hz))
    if form == OURS:
        pairs = [
            [
                Renderer(_held_band(f, width_hz, rate_hz=rate_hz), single=single).render(
                    100.0, 1.0, samples=2 * settled
                )
                for single in (True, False)
            ]
            for f in frequency_hz * near
        ]
        rough, exact = np.swapaxes(np.array(pairs), 0, 1)
    else:
        noise = np.random.default_rng(0).standard_normal(2 * settled)
        finer = {"float32": "float64", "float64": "longdouble"}[precision]
        shares = frequency_hz * near / rate_hz, np.full(count, width_hz / rate_hz)
        rough, exact = (OUTPUTS[form](noise, *shares, precision=p) for p in (precision, finer))
    rough, exact = rough[:, settled:], exact[:, settled:]
    errors = np.mean((rough - exact) ** 2, axis=1) / np.mean(exact**2, axis=1)
    return float(10 * np.log10(max(errors.max(), 1e-40)))


def _held_band(frequency_hz: float, width_hz: float, *, rate_hz: float) -> TextureModel:
    one = np.ones((1, 1, 1))
    return TextureModel(
        texture="band",
        rate_hz=rate_hz,
        speeds_mm_s=np.array([100.0]),
        forces_n=np.array([1.0]),
        noise_gains=np.zeros((1, 1)),
        frequencies_hz=frequency_hz * one,
        bandwidths_hz=width_hz * one,
        gains=one,
        level_sd_db=0 * one,
        estimator="planted",
        simulated=True,
    )


def lower(value: float, column: float, *, form: str, precision: str, full: bool) -> float:
    """Error (dB) of a band of 10 Hz width at this frequency (Hz) and rate (Hz)."""
    return _error_db(
        value, SINGLE_WIDTH_HZ, rate_hz=column, form=form, precision=precision, full=full
    )


def thinner(value: float, column: float, *, form: str, precision: str, full: bool) -> float:
    """Error (dB) at 48 kHz of a band of this width (Hz) at this frequency (Hz)."""
    return _error_db(
        column, value, rate_hz=SINGLE_RATE_HZ, form=form, precision=precision, full=full
    )


def _rounding_edge(form: str, *, precision: str, rate_hz: float) -> float:
    """f·B (Hz²) from which on no rounding of coefficients shifts a direct form's pole too far.

    1 + a1 + a2 is nearly θ², so rounding errors of a1 (up to half of `SPACING`) and a2 (up to a
    quarter) shift θ by their sum over 2θ. Two narrow bands driven by one noise, Δθ apart and
    both λ = πB/fs to their half-power points, differ by 2x²/(1 + x²) of their power, x = Δθ/2λ
    (Gold and Rader, 1967: the poles of direct forms crowd near z = ±1, those of coupled forms do
    not).
    """
    if form != DIRECT:
        return math.nan
    error = 10 ** (HOLDS_ERROR_DB / 10)
    x = math.sqrt(error / (2 - error))
    rounding = 0.75 * SPACING[precision]
    # x = rounding/(2θ)/(2λ), θ = 2πf/fs, λ = πB/fs
    return rounding * rate_hz**2 / (8 * math.pi**2 * x)


def _edge_frequency_hz(form: str, precision: str, rate_hz: float) -> float:
    return _rounding_edge(form, precision=precision, rate_hz=rate_hz) / SINGLE_WIDTH_HZ


def _edge_thinnest_hz(form: str, precision: str, frequency_hz: float) -> float:
    return _rounding_edge(form, precision=precision, rate_hz=SINGLE_RATE_HZ) / frequency_hz


_level = partial(
    Case,
    family="filters",
    figure="level while moving re held",
    unit="dB",
    holds=HOLDS_DB,
    degrades=DEGRADES_DB,
)
_error = partial(
    Case,
    family="filters",
    figure="error re output",
    unit="dB",
    holds=HOLDS_ERROR_DB,
    degrades=DEGRADES_ERROR_DB,
)
_MOTION = (
    "level follows f^c behind a first-order high-pass at B (c = 2 state-variable, −1 direct); "
    "parametric resonance at 2f (Landau & Lifshitz, Mechanics, § 27); ‖A‖ ≤ 1 for ours"
)
_ROUNDING = "poles of a direct form near z = 1 move by δ/2θ (Gold & Rader 1967)"

CASES: tuple[Case, ...] = (
    *(
        _level(
            method=form,
            ours=form == OURS,
            axis=Axis(
                name="speed of modulation",
                unit="Hz",
                mild=0.5,
                severe=2 * CENTRE_HZ,
                default=STROKE_HZ,
            ),
            measure=partial(faster, form=form),
            across="depth",
            columns={"±0.1 octaves": 0.1, "±1 octave": 1.0},
            theory=partial(_edge_hz, form, width_hz=WIDTH_HZ),
            source=_MOTION,
        )
        for form in FORMS
    ),
    *(
        _level(
            method=form,
            ours=form == OURS,
            axis=Axis(
                name="depth of modulation",
                unit="octaves",
                mild=0.01,
                severe=3.0,
                default=STROKE_OCTAVES,
            ),
            measure=partial(deeper, form=form),
            across="speed",
            columns={"2 Hz": 2.0, "50 Hz": 50.0, "600 Hz": 600.0, "at random": AT_RANDOM},
            theory=partial(_edge_octaves, form),
            source=_MOTION,
        )
        for form in FORMS
    ),
    *(
        _level(
            method=form,
            ours=form == OURS,
            axis=Axis(
                name="width, ±1 octave", unit="Hz", mild=400.0, severe=1.0, default=NARROWEST_HZ
            ),
            measure=partial(narrower, form=form),
            across="speed",
            columns={"2 Hz": 2.0, "10 Hz": 10.0},
            theory=partial(_edge_width_hz, form),
            source=_MOTION,
        )
        for form in FORMS
    ),
    _level(
        method=f"{OURS}, sum of 3",
        ours=True,
        axis=Axis(
            name="speed of modulation", unit="Hz", mild=0.5, severe=2 * CENTRE_HZ, default=STROKE_HZ
        ),
        measure=sum_faster,
        across="depth",
        columns={"±0.1 octaves": 0.1, "±1 octave": 1.0},
    ),
    *(
        _error(
            method=f"{form}, {precision}",
            ours=form == OURS,
            axis=Axis(
                name="frequency, 10 Hz wide", unit="Hz", mild=1000.0, severe=2.0, default=LOWEST_HZ
            ),
            measure=partial(lower, form=form, precision=precision),
            across="rate",
            columns={"5 kHz": 5000.0, "48 kHz": 48_000.0},
            theory=partial(_edge_frequency_hz, form, precision),
            source=_ROUNDING,
        )
        for form, precision in (
            (DIRECT, "float32"),
            (PLAIN, "float32"),
            (OURS, "float32"),
            (DIRECT, "float64"),
        )
    ),
    *(
        _error(
            method=f"{form}, float32",
            ours=form == OURS,
            axis=Axis(
                name="width, at 48 kHz", unit="Hz", mild=400.0, severe=5.0, default=NARROWEST_HZ
            ),
            measure=partial(thinner, form=form, precision="float32"),
            across="frequency",
            columns={"40 Hz": SINGLE_CENTRE_HZ, "300 Hz": CENTRE_HZ},
            theory=partial(_edge_thinnest_hz, form, "float32"),
            source=_ROUNDING,
        )
        for form in FORMS
    ),
)
