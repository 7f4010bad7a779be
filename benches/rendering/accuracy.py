"""Accuracy of a rendering while the hand moves: late parameters, levels, and reversals."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from tactileq.benches.rendering.stability import (
    FORMS,
    OURS,
    STROKE_HZ,
    held_variances,
    moving_variances,
)
from tactileq.modeling import RegressedModel, Renderer, TextureModel
from tactileq.modeling.hand import Hand
from tactileq.modeling.models.parameter_table import Parameters
from tactileq.modeling.rendering.plan import SLOPE_S, RenderPlan
from tactileq.modeling.rendering.reference.hand import Extrapolator
from tactileq.stimuli.planted.textures import FORCES_N, SPEEDS_MM_S

FASTEST_MM_S = 300.0
FORCE_N = 2.0
PRESSING_HZ = 1.3
# Time constants of the smoothed slope after which a start from no slope is forgotten.
SETTLED = 5


def stroke(rate_hz: float, *, duration_s: float = 1.0, pressing_n: float = 0.0) -> Hand:
    """A hand that goes to and fro at 2 Hz, up to 300 mm/s, pressing with 2 N ± `pressing_n`."""
    time_s = np.arange(round(duration_s * rate_hz)) / rate_hz
    speed = FASTEST_MM_S * np.sin(2 * np.pi * STROKE_HZ * time_s)
    return Hand(speed, FORCE_N + pressing_n * np.sin(2 * np.pi * PRESSING_HZ * time_s))


def update_error_db(
    model: TextureModel,
    hand: Hand,
    update_samples: int,
    *,
    seed: int = 0,
    readings: Hand | None = None,
) -> float:
    """RMS difference from a rendering with an update at every sample, dB re that rendering.

    `readings` are what is known of the hand where that is not the hand itself.
    """
    rendered = Renderer(model, seed=seed, update_samples=update_samples).render(*(readings or hand))
    exact = Renderer(model, seed=seed, update_samples=1).render(*hand)
    return float(10 * np.log10(np.mean((rendered - exact) ** 2) / np.mean(exact**2)))


class SpeedErrors(NamedTuple):
    """Largest error of |speed| at the end of an update (mm/s).

    `as_read`: of the reading at its start; `extrapolated`: of what gains are set for.
    """

    as_read: float
    extrapolated: float


def speed_errors(hand: Hand, readings: Hand, *, plan: RenderPlan) -> SpeedErrors:
    """Errors of |speed| over a stroke, whatever the sample at which the first reading comes.

    Parameters
    ----------
    hand : Hand
        As it is, at each of n samples.
    readings : Hand
        What a device would read at each of them; those at the plan's updates are used.

    Notes
    -----
    The first updates, whose slope is not known yet, are left out.
    """
    period, count = plan.update_samples, hand.speed_mm_s.size
    settled = SETTLED * SLOPE_S * plan.rate_hz
    axes = (SPEEDS_MM_S, FORCES_N)  # of any grid: only what is tiny beside it matters
    as_read, extrapolated = list[float](), list[float]()
    for first in range(period):
        at = np.arange(first, count - period + 1, period)
        _, end = Extrapolator(plan, axes)(Hand(*(reading[at] for reading in readings)))
        wanted = np.abs(hand.speed_mm_s[at + period - 1])
        for errors, speed in ((as_read, readings.speed_mm_s[at]), (extrapolated, end.speed_mm_s)):
            errors.append(float(np.abs(np.abs(speed) - wanted)[at >= settled].max()))
    return SpeedErrors(max(as_read), max(extrapolated))


def rendered_parameters(
    model: TextureModel | RegressedModel, hand: Hand, update_samples: int
) -> Parameters:
    """The parameters that a renderer at the model's rate applies at each sample.

    docs/method/rendering.md#moving-parameters

    Frequencies and widths are held from update to update; gains move.
    """
    plan = RenderPlan(rate_hz=model.rate_hz, update_samples=update_samples)
    readings = (reading[::update_samples] for reading in hand)
    axes = (model.table.speeds_mm_s, model.table.forces_n)
    amid, end = (model.parameters(*at) for at in Extrapolator(plan, axes)(Hand(*readings)))
    gains = np.column_stack([end.noise_gain, end.gains])
    reached = [gains[0], *gains]
    for n in range(1, len(reached)):
        slews = plan.slews(model.table.largest_gains)
        reached[n] = reached[n - 1] + np.clip(reached[n] - reached[n - 1], -slews, slews)
    passed = np.arange(1, update_samples + 1)[:, None] / update_samples
    course = np.concatenate([a + (b - a) * passed for a, b in pairwise(reached)])
    count = hand.speed_mm_s.size
    held = np.arange(count) // update_samples
    return Parameters(
        course[:count, 0],
        amid.frequencies_hz[held],
        amid.bandwidths_hz[held],
        course[:count, 1:],
    )


class LevelErrors(NamedTuple):
    """How far a moving rendering's level is from the model's own at the speed of each sample.

    `within_grid_db`: largest absolute error in dB while speed and force are on the grid.
    `below_grid`: largest error of the RMS below it, as a share of the RMS on its edge (dB say
    nothing where the level goes to 0).
    """

    within_grid_db: float
    below_grid: float


def level_errors(model: TextureModel, hand: Hand, update_samples: int) -> LevelErrors:
    """Exact levels of a rendering along a stroke against those of the model held there.

    For one force on the grid.
    """
    rendered = rendered_parameters(model, hand, update_samples)
    level, wanted = (
        np.sqrt(variances.total)
        for variances in (
            moving_variances(rendered, FORMS[OURS], rate_hz=model.rate_hz),
            held_variances(model.parameters(*hand), FORMS[OURS], rate_hz=model.rate_hz),
        )
    )
    below = np.abs(hand.speed_mm_s) < model.speeds_mm_s[0]
    edge = model.parameters(model.speeds_mm_s[:1], hand.force_n[:1])
    at_edge = np.sqrt(held_variances(edge, FORMS[OURS], rate_hz=model.rate_hz).total[0])
    return LevelErrors(
        float(np.abs(20 * np.log10(level[~below] / wanted[~below])).max()),
        float(np.abs(level - wanted)[below].max(initial=0.0) / at_edge),
    )
