"""Renderings for a moving hand: late, noisy and unsigned readings, steps, other rates, crests.

Theory and how to read it: docs/stability.md#hands.
"""

from __future__ import annotations

import math
from functools import cache, partial

import numpy as np

from tactileq.benches.atlas.case import Axis, Case
from tactileq.benches.rendering.accuracy import (
    FASTEST_MM_S,
    level_errors,
    speed_errors,
    stroke,
    update_error_db,
)
from tactileq.benches.rendering.clicks import loudest_above_click_hz_db, switched, this_renderer
from tactileq.benches.rendering.crests import crest_difference_db
from tactileq.benches.rendering.other_rates import rate_errors
from tactileq.benches.rendering.stability import DIRECT, OURS, PLAIN, STROKE_HZ
from tactileq.modeling import TextureModel
from tactileq.modeling.hand import Hand
from tactileq.modeling.rendering.plan import SLOPE_S, RenderPlan
from tactileq.stimuli.planted.textures import SPEEDS_MM_S, planted_texture

RATE_HZ = 5000.0
UPDATE_S = 1e-3  # the default of `Renderer`
STROKE_S = {False: 0.5, True: 1.0}
SIGNED, UNSIGNED, AS_READ = "speed with its sign", "|v|", "as read"
# A tenth and a half of the lowest speed of the grid.
HOLDS_MM_S, DEGRADES_MM_S = 0.1 * SPEEDS_MM_S[0], 0.5 * SPEEDS_MM_S[0]
HOLDS_LEVEL_DB, DEGRADES_LEVEL_DB = 1.0, 6.0
HOLDS_ERROR_DB, DEGRADES_ERROR_DB = -30.0, -10.0
LEAST_DIFFERENCE_DB = -200.0
# What a step may add above 1 kHz to what the layer has there, and where it is most of what is felt.
HOLDS_CLICK_DB, DEGRADES_CLICK_DB = 3.0, 10.0
STREAMS = {False: 40, True: 200}
# From there a step of speed shifts the layer; the hum's grid ends at 350 mm/s.
STEP_FROM_MM_S, STEP_FORCE_N = 70.0, 0.5
WIDEST_HZ = 150.0  # of the planted layers
CORNERS = ((350.0, 3.5), (50.0, 0.5))  # of the planted grid
WHOLE_LEVEL, THIRD_OCTAVES = 0.0, 1.0


@cache
def _canvas() -> TextureModel:
    return planted_texture("canvas")


def _samples(interval_ms: float) -> int:
    return max(1, round(1e-3 * interval_ms * RATE_HZ))


def followed(value: float, column: float, *, read: str, full: bool) -> float:
    """Largest error (mm/s) of the speed at the end of an update, for readings every … ms."""
    del column
    hand = stroke(RATE_HZ, duration_s=STROKE_S[full])
    readings = Hand(np.abs(hand.speed_mm_s), hand.force_n) if read == UNSIGNED else hand
    plan = RenderPlan(rate_hz=RATE_HZ, update_samples=_samples(value))
    errors = speed_errors(hand, readings, plan=plan)
    return errors.as_read if read == AS_READ else errors.extrapolated


def rendered(value: float, column: float, *, read: str, full: bool) -> float:
    """Error (dB) of rendering canvas from readings every … ms, re an update at every sample."""
    del column
    hand, period = stroke(RATE_HZ, duration_s=STROKE_S[full]), _samples(value)
    speed = np.abs(hand.speed_mm_s) if read == UNSIGNED else hand.speed_mm_s
    held = speed[np.arange(speed.size) // period * period]
    readings = Hand(held, hand.force_n)
    every = 1 if read == AS_READ else period
    return _difference_db(hand, readings, every=every)


def _difference_db(hand: Hand, readings: Hand, *, every: int) -> float:
    with np.errstate(divide="ignore"):  # no difference at all
        error_db = update_error_db(_canvas(), hand, every, readings=readings)
    return max(error_db, LEAST_DIFFERENCE_DB)


def late_level(value: float, column: float, *, full: bool) -> float:
    """Largest error (dB) of the exact level along a stroke, for updates every … ms."""
    del column
    hand = stroke(RATE_HZ, duration_s=STROKE_S[full])
    with np.errstate(divide="ignore"):  # silence, where there should be a level
        return level_errors(_canvas(), hand, _samples(value)).within_grid_db


def noisy(value: float, column: float, *, every: int, full: bool) -> float:
    """Error (dB) of rendering canvas where readings, once a millisecond, have noise (mm/s)."""
    del column
    hand = stroke(RATE_HZ, duration_s=STROKE_S[full])
    noise = value * np.random.default_rng(0).standard_normal(hand.speed_mm_s.size)
    period = _samples(1e3 * UPDATE_S)
    at = np.arange(noise.size) // period * period
    readings = Hand((hand.speed_mm_s + noise)[at], hand.force_n)
    return _difference_db(hand, readings, every=every)


def lifted(value: float, column: float, *, form: str, full: bool) -> float:
    """The level added above 1 kHz by a sudden loss of this share of the level (dB).

    The hand's force goes from 0.5 N, below which levels fall with force, to so much less. `form`:
    how the band is realised where gains are switched; "" for the program's own renderer.
    """
    del column
    before = (100.0, STEP_FORCE_N)
    after = (100.0, STEP_FORCE_N * (1 - value))
    return _click_db(before, after, form=form, full=full)


def shifted(value: float, column: float, *, form: str, full: bool) -> float:
    """The level added above 1 kHz by a sudden frequency shift of a layer by this ratio (dB)."""
    del column
    before = (STEP_FROM_MM_S, 2.0)
    after = (STEP_FROM_MM_S * value, 2.0)
    return _click_db(before, after, form=form, full=full)


def _click_db(
    before: tuple[float, float], after: tuple[float, float], *, form: str, full: bool
) -> float:
    streams = STREAMS[full]
    signals = (
        switched(before, after, form=form, streams=streams)
        if form
        else this_renderer(before, after, streams=streams)
    )
    return loudest_above_click_hz_db(signals, before, after=after)


def at_rate(value: float, column: float, *, full: bool) -> float:
    """Largest deviation (dB) of MDF's levels from those at its own rate, at the next 50 Hz."""
    model = planted_texture("MDF")
    corners = [model.peq(*at) for at in CORNERS[: 2 if full else 1]]
    errors = rate_errors(corners, model_rate_hz=model.rate_hz, rate_hz=50.0 * round(value / 50))
    which = errors.third_octaves_db if column == THIRD_OCTAVES else errors.within_band_db
    return float(np.abs(which).max())


def peaky(value: float, column: float, *, full: bool) -> float:
    """By how much (dB) peaks of uniform noise are below Gaussian ones in a layer this wide (Hz)."""
    return crest_difference_db(value, duration_s=column, streams=2 * STREAMS[full])


# --- Theory


def _followed_edge_ms(read: str, column: float) -> float:
    """The interval (ms) up to which the speed at the end of an update is accurate enough."""
    del column
    omega = 2 * math.pi * STROKE_HZ
    sample_s, steepest = 1 / RATE_HZ, FASTEST_MM_S * omega

    def error(interval_s: float) -> float:
        ahead_s = interval_s - sample_s
        if read == AS_READ:
            return FASTEST_MM_S * math.sin(min(omega * ahead_s, math.pi / 2))
        share = min(1.0, interval_s / SLOPE_S)
        if read == UNSIGNED:  # the smoothed slope of |v| still points down past the corner
            return steepest * (ahead_s + ahead_s / (1 + 2 * share * ahead_s / interval_s))
        late_s = interval_s * (1 - share) / share + interval_s / 2 + ahead_s / 2
        return steepest * omega * late_s * ahead_s

    intervals_s = np.geomspace(sample_s, 1.0, 20_001)
    errors = np.array([error(interval_s) for interval_s in intervals_s])
    return float(1e3 * intervals_s[np.argmax(errors > HOLDS_MM_S)])


def _peaky_edge_hz(duration_s: float) -> float:
    """The width from which the peaks are further than `HOLDS_LEVEL_DB` from those of a Gaussian.

    A band's output is a sum of uniform numbers of excess kurtosis −1.2; its own is that times
    Σh⁴/(Σh²)² = 1.5·πB/fs. By Cornish and Fisher a quantile z becomes z + κ(z³ − 3z)/24, and the
    largest of about B·T independent values is at z² = 2 ln(B·T) and so.
    """
    widths = np.geomspace(10.0, 2000.0, 4001)
    kurtosis = -1.2 * 1.5 * np.pi * widths / RATE_HZ
    squared = 2 * np.log(np.maximum(2 * widths * duration_s, 2.0))
    lower_db = 20 * np.log10(np.maximum(1 + kurtosis * (squared - 3) / 24, 1e-3))
    return float(widths[np.argmax(lower_db < -HOLDS_LEVEL_DB)])


_INTERVAL = Axis(
    name="interval of readings", unit="ms", mild=0.2, severe=100.0, default=1e3 * UPDATE_S
)
_click = partial(
    Case,
    family="hands",
    figure="a step's sound above 1 kHz re the layer's",
    unit="dB",
    holds=HOLDS_CLICK_DB,
    degrades=DEGRADES_CLICK_DB,
)
error_case = partial(
    Case,
    family="hands",
    figure="difference from a rendering with the exact hand movement",
    unit="dB",
    holds=HOLDS_ERROR_DB,
    degrades=DEGRADES_ERROR_DB,
)

CASES: tuple[Case, ...] = (
    *(
        Case(
            family="hands",
            method=read,
            ours=read == SIGNED,
            axis=_INTERVAL,
            figure="error of the speed in use",
            unit="mm/s",
            holds=HOLDS_MM_S,
            degrades=DEGRADES_MM_S,
            measure=partial(followed, read=read),
            theory=partial(_followed_edge_ms, read),
            source="curvature of a sine, lag of a smoothed slope, the corner of |v|",
        )
        for read in (SIGNED, UNSIGNED, AS_READ)
    ),
    *(
        error_case(
            method=read,
            ours=read == SIGNED,
            axis=_INTERVAL,
            measure=partial(rendered, read=read),
        )
        for read in (SIGNED, UNSIGNED, AS_READ)
    ),
    Case(
        family="hands",
        method="gains on ramps",
        ours=True,
        axis=_INTERVAL,
        figure="level re that of the speed",
        unit="dB",
        holds=HOLDS_LEVEL_DB,
        degrades=DEGRADES_LEVEL_DB,
        measure=late_level,
    ),
    *(
        error_case(
            method=method,
            ours=method == "smoothed slope",
            axis=Axis(name="noise of readings", unit="mm/s", mild=0.1, severe=100.0),
            measure=partial(noisy, every=every),
        )
        for method, every in (("smoothed slope", 5), (AS_READ, 1))
    ),
    *(
        _click(
            method=method,
            ours=not form,
            axis=Axis(name="step, share of the level", unit="", mild=0.01, severe=1.0),
            measure=partial(lifted, form=form),
        )
        for method, form in (("this renderer", ""), ("gains switched at once", OURS))
    ),
    *(
        _click(
            method=method,
            ours=not form,
            axis=Axis(name="step, ratio of frequencies", unit="", mild=1.02, severe=5.0),
            measure=partial(shifted, form=form),
        )
        for method, form in (
            ("this renderer", ""),
            (f"{PLAIN}, switched", PLAIN),
            (f"{DIRECT}, switched", DIRECT),
        )
    ),
    Case(
        family="hands",
        method="this renderer",
        ours=True,
        axis=Axis(name="rate, of a 5 kHz model", unit="Hz", mild=5e3, severe=96e3, default=48e3),
        figure="level re that at 5 kHz",
        unit="dB",
        holds=HOLDS_LEVEL_DB,
        degrades=DEGRADES_LEVEL_DB,
        measure=at_rate,
        across="level",
        columns={"whole level": WHOLE_LEVEL, "third octaves": THIRD_OCTAVES},
    ),
    Case(
        family="hands",
        method="uniform noise",
        ours=True,
        axis=Axis(name="width of a layer", unit="Hz", mild=10.0, severe=1000.0, default=WIDEST_HZ),
        figure="crest factor re Gaussian noise",
        unit="dB",
        holds=HOLDS_LEVEL_DB,
        degrades=DEGRADES_LEVEL_DB,
        measure=peaky,
        across="duration",
        columns={"1 s": 1.0},
        theory=_peaky_edge_hz,
        source="excess kurtosis −1.2·1.5·πB/fs (Cornish & Fisher 1938)",
        exception="lower peaks are not an error: the spectrum is the same and less is clipped",
    ),
)
