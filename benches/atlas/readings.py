"""Readings at times of their own, missing, without contact, in steps; and few recorded conditions.

The truth is the rendering with the true hand at every sample, or the drawn surface itself. How to
read it: docs/stability.md#readings.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from tactileq.benches.atlas.case import Axis, Case
from tactileq.benches.atlas.hands import (
    AS_READ,
    DEGRADES_LEVEL_DB,
    HOLDS_LEVEL_DB,
    LEAST_DIFFERENCE_DB,
    RATE_HZ,
    STROKE_S,
    UPDATE_S,
    error_case,
)
from tactileq.benches.rendering.accuracy import stroke
from tactileq.modeling import Renderer
from tactileq.modeling.arrays import Floats
from tactileq.modeling.hand import Hand
from tactileq.modeling.models.grid import Cells
from tactileq.modeling.seeds import generator
from tactileq.modeling.similarity import BAND_EDGES_HZ
from tactileq.stimuli.planted.drawn import FORCES_N, SPEEDS_MM_S, DrawnSurface, draw_surface
from tactileq.stimuli.planted.textures import planted_texture

WITH_TIMES, AS_OF_NOW = "readings with their times", "readings as of now"
CHATTER_PER_S = 40
SURFACES, PLACES = {False: 2, True: 8}, {False: 8, True: 25}
MEDIAN, NEARLY_ALL = 50.0, 95.0
BANDS = 9  # those of real surfaces' tables, 10 … 480 Hz
_EDGES_HZ = BAND_EDGES_HZ[: BANDS + 1]
_FINEST_HZ = 2.0


def _error_db(rendered: Floats, hand: Hand) -> float:
    exact = Renderer(planted_texture("canvas"), update_samples=1).render(*hand)
    with np.errstate(divide="ignore"):  # no difference at all
        error_db = 10 * np.log10(np.mean((rendered - exact) ** 2) / np.mean(exact**2))
    return float(max(error_db, LEAST_DIFFERENCE_DB))


def rendered_from(times_s: Floats, hand: Hand, *, timed: bool = True) -> Floats:
    """Canvas by readings of a hand at rising times (s), each taken in at the next sample.

    Where they are not `timed`, readings count as made at that sample.
    """
    renderer = Renderer(planted_texture("canvas"))
    count = hand.speed_mm_s.size
    at = times_s[times_s * RATE_HZ <= count - 1] * RATE_HZ
    samples = np.arange(count)
    readings = [np.interp(at, samples, part).tolist() for part in hand]
    parts, done = [], 0
    for time, speed, force in zip(at.tolist(), *readings, strict=True):
        now = int(np.ceil(time))
        parts.append(renderer.render_on(now - done))
        done = now
        renderer.read(speed, force, ago=now - time if timed else 0.0)
    return np.concatenate([*parts, renderer.render_on(count - done)])


def off_the_beat(value: float, column: float, *, timed: bool, full: bool) -> float:
    """Error (dB) for readings every … ms, `column` ms later than updates."""
    hand = stroke(RATE_HZ, duration_s=STROKE_S[full])
    times = np.arange(0, STROKE_S[full], 1e-3 * value) + 1e-3 * column
    return _error_db(rendered_from(times, hand, timed=timed), hand)


def jittered(value: float, column: float, *, timed: bool, full: bool) -> float:
    """Error (dB) for readings every millisecond, each late by up to … ms at random."""
    del column
    hand = stroke(RATE_HZ, duration_s=STROKE_S[full])
    beat = np.arange(0, STROKE_S[full], UPDATE_S)
    times = np.sort(beat + generator([0x4A]).uniform(0, 1e-3 * value, beat.size))
    return _error_db(rendered_from(times, hand, timed=timed), hand)


def missing(value: float, column: float, *, full: bool) -> float:
    """Error (dB) where this share of readings is missing, `column` ms in a row each time."""
    hand = stroke(RATE_HZ, duration_s=STROKE_S[full])
    period, lost = round(RATE_HZ * UPDATE_S), round(column)
    updates = -(-hand.speed_mm_s.size // period)
    begins = generator([0x4D]).uniform(size=updates) < 1 - (1 - value) ** (1 / lost)
    begins[:lost] = False  # the hand is known at first
    gone = np.convolve(begins, np.ones(lost))[:updates] > 0
    speed = np.where(np.repeat(gone, period)[: hand.speed_mm_s.size], np.nan, hand.speed_mm_s)
    return _error_db(Renderer(planted_texture("canvas")).render(speed, hand.force_n), hand)


def chattering(value: float, column: float, *, full: bool) -> float:
    """Error (dB) where a sensor misses contact 40 times a second for … ms."""
    del column
    hand = stroke(RATE_HZ, duration_s=STROKE_S[full])
    time_s = np.arange(hand.force_n.size) / RATE_HZ
    begun = np.arange(1, round(CHATTER_PER_S * STROKE_S[full])) / CHATTER_PER_S
    begun += generator([0x43]).uniform(0, 5e-3, begun.size)
    since = time_s[:, None] - begun
    force = np.where(((since >= 0) & (since < 1e-3 * value)).any(axis=1), 0.0, hand.force_n)
    return _error_db(Renderer(planted_texture("canvas")).render(hand.speed_mm_s, force), hand)


def in_steps(value: float, column: float, *, every: int, full: bool) -> float:
    """Error (dB) where readings, once a millisecond, are rounded to multiples of … mm/s."""
    del column
    hand = stroke(RATE_HZ, duration_s=STROKE_S[full])
    period = round(RATE_HZ * UPDATE_S)
    at = np.arange(hand.speed_mm_s.size) // period * period
    speed = value * np.round(hand.speed_mm_s / value)
    renderer = Renderer(planted_texture("canvas"), update_samples=every)
    return _error_db(renderer.render(speed[at], hand.force_n), hand)


def between(value: float, column: float, *, full: bool) -> float:
    """Error (dB) in nine bands, inside a grid of … recorded speeds and as many forces.

    Every recorded condition is known exactly, and levels blend in logarithms between them.
    `column`: which percentile, over surfaces, places and bands.
    """
    recorded = max(2, round(value))
    speeds = np.linspace(SPEEDS_MM_S[0], SPEEDS_MM_S[-1], recorded)
    forces = np.linspace(FORCES_N[0], FORCES_N[-1], recorded)
    rng = generator([0x47])
    places = rng.uniform((speeds[0], forces[0]), (speeds[-1], forces[-1]), (PLACES[full], 2))
    errors = [
        _band_errors_db(draw_surface(1000 + seed), speeds, forces, places=places)
        for seed in range(SURFACES[full])
    ]
    return float(np.percentile(np.abs(errors), column))


def _band_errors_db(
    surface: DrawnSurface, speeds: Floats, forces: Floats, *, places: Floats
) -> Floats:
    """(places, 9) errors of the levels in bands of a surface recorded at speeds × forces."""
    frequency = np.arange(_EDGES_HZ[0], _EDGES_HZ[-1], _FINEST_HZ)

    def magnitude(speed: float, force: float) -> Floats:
        return surface.magnitude(frequency, speed_mm_s=speed, force_n=force)

    nodes = np.log([[magnitude(speed, force) for force in forces] for speed in speeds])
    cells = Cells(np.log(speeds), np.log(forces), hand=Hand(*np.log(places).T))
    blended = np.exp(cells.blend(nodes))
    wanted = np.array([magnitude(*place) for place in places])
    band = np.searchsorted(_EDGES_HZ, frequency, side="right") - 1
    power = [
        np.stack([(of[:, band == which] ** 2).sum(axis=1) for which in range(BANDS)], axis=1)
        for of in (blended, wanted)
    ]
    errors: Floats = 10 * np.log10(power[0] / power[1])
    return errors


CASES: tuple[Case, ...] = (
    *(
        error_case(
            method=method,
            ours=method == WITH_TIMES,
            axis=Axis(
                name="interval of readings off updates",
                unit="ms",
                mild=1.0,
                severe=20.0,
                default=2.0,
            ),
            measure=partial(off_the_beat, timed=method == WITH_TIMES),
            across="late by",
            columns={"on updates": 0.0, "0.2 ms": 0.2, "0.5 ms": 0.5},
        )
        for method in (WITH_TIMES, AS_OF_NOW)
    ),
    *(
        error_case(
            method=method,
            ours=method == WITH_TIMES,
            axis=Axis(name="jitter of readings", unit="ms", mild=0.1, severe=20.0, default=1.0),
            measure=partial(jittered, timed=method == WITH_TIMES),
        )
        for method in (WITH_TIMES, AS_OF_NOW)
    ),
    error_case(
        method=WITH_TIMES,
        ours=True,
        axis=Axis(name="missing readings", unit="", mild=0.01, severe=0.9, default=0.05),
        measure=missing,
        across="in a row",
        columns={"1 ms": 1.0, "8 ms": 8.0},
    ),
    error_case(
        method="contact that ends after 3 ms",
        ours=True,
        axis=Axis(name="contact missed, 40 times a second", unit="ms", mild=0.5, severe=12.0),
        measure=chattering,
    ),
    *(
        error_case(
            method=method,
            ours=method == "smoothed slope",
            axis=Axis(
                name="steps of the measured speed", unit="mm/s", mild=0.5, severe=100.0, default=5.0
            ),
            measure=partial(in_steps, every=every),
        )
        for method, every in (("smoothed slope", 5), (AS_READ, 1))
    ),
    Case(
        family="blending",
        method="levels blend in logarithms",
        ours=True,
        axis=Axis(name="recorded speeds, and forces", unit="", mild=13.0, severe=2.0, default=4.0),
        figure="level in nine bands between conditions",
        unit="dB",
        holds=HOLDS_LEVEL_DB,
        degrades=DEGRADES_LEVEL_DB,
        measure=between,
        across="percentile",
        columns={"median": MEDIAN, "95 %": NEARLY_ALL},
        exception="the conditions are too far apart, whatever blends between them; record more",
    ),
)
