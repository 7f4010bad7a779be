"""Tracking in the atlas: which layer is which over the grid, where layers move, cross, come and go.

Two layers are planted over speeds at one force, recorded and modelled; the number of layers is
given to the estimator that takes one, so that what fails is the naming. The rules:
docs/method/fitting.md#tracking.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from scipy.optimize import linear_sum_assignment

from tactileq.analysis.textures.recovery import match_layers
from tactileq.benches.atlas.case import Axis, Case
from tactileq.modeling import TextureModel, fit_texture
from tactileq.modeling.arrays import Floats
from tactileq.modeling.estimation.paper import BANDWIDTH_PER_S
from tactileq.modeling.recordings.spectrum import SMOOTHING_HZ
from tactileq.modeling.seeds import generator
from tactileq.stimuli.planted.textures import record_texture

FAMILY = "tracking"
SEED = 23
# A fit of the joint estimator takes longer than everything else.
DRAWS = {"joint": {False: 1, True: 2}, "paper": {False: 1, True: 4}}
RATE_HZ, DURATION_S = 5000.0, 0.5
SPEED_MM_S, SPEED_STEP_MM_S, FORCE_N = 100.0, 50.0, 2.0
NOISE_GAIN, HEIGHT = 0.01, 8.0  # of a layer over the noise
WIDTH_HZ, GAP_HZ = 25.0, 120.0
LOWEST_HZ, PLACE_RANGE = 200.0, 0.1
CROSSING_HZ = 700.0
STEADY_HZ, CHANGING_HZ = 200.0, 500.0
Scene = Callable[[float, float], tuple[Floats, Floats]]
Fitted = tuple[TextureModel, TextureModel]


def measured(
    value: float,
    column: float,
    *,
    full: bool,
    estimator: str,
    scene: Scene,
    figure: Callable[[Fitted], float],
) -> float:
    """The figure of the models of a planted scene, on average."""
    frequency_hz, heights = scene(value, column)
    figures = []
    for draw in range(DRAWS[estimator][full]):
        place = 1 + PLACE_RANGE * generator([SEED, draw]).uniform(-1, 1)
        truth = planted(frequency_hz * place, heights)
        records = record_texture(truth, duration_s=DURATION_S, seed=draw)
        layers = frequency_hz.shape[1] if estimator == "joint" else None
        figures.append(figure((truth, fit_texture(records, estimator=estimator, layers=layers))))
    return float(np.mean(figures))


def planted(frequency_hz: Floats, heights: Floats) -> TextureModel:
    """Layers over speeds at one force, from their frequencies and heights over the noise (S, m)."""
    shape = (len(frequency_hz), 1, frequency_hz.shape[1])
    return TextureModel(
        texture="planted",
        rate_hz=RATE_HZ,
        speeds_mm_s=np.array([SPEED_MM_S + SPEED_STEP_MM_S * n for n in range(shape[0])]),
        forces_n=np.array([FORCE_N]),
        noise_gains=np.full(shape[:2], NOISE_GAIN),
        frequencies_hz=frequency_hz[:, None, :],
        bandwidths_hz=np.full(shape, WIDTH_HZ),
        gains=NOISE_GAIN * heights[:, None, :],
        level_sd_db=np.zeros(shape),
        estimator="planted",
        simulated=True,
    )


# Scenes: frequencies (Hz) and heights over the noise, (S, 2).


def moving(jump: float, column: float) -> tuple[Floats, Floats]:
    """Two layers rise together, by this share of their gap from one speed to the next."""
    rise = jump * GAP_HZ * np.arange(2.0)
    frequency = LOWEST_HZ + rise[:, None] + np.array([0.0, GAP_HZ])
    return frequency, np.full(frequency.shape, HEIGHT)


def crossing(step_widths: float, column: float) -> tuple[Floats, Floats]:
    """One layer passes another between the second and the third of four speeds."""
    way = step_widths * WIDTH_HZ * (np.arange(4.0) - 1.5)
    frequency = np.column_stack((np.full(4, CROSSING_HZ), CROSSING_HZ + way))
    return frequency, np.full(frequency.shape, HEIGHT)


def changing(factor: float, direction: float) -> tuple[Floats, Floats]:
    """One layer is lower by this factor at the highest speed (direction 1) or the lowest (−1)."""
    fall = factor ** -np.linspace(0.0, 1.0, 3)[:: int(direction)]
    frequency = np.tile([STEADY_HZ, CHANGING_HZ], (3, 1))
    return frequency, HEIGHT * np.column_stack((np.ones(3), fall))


def neighbouring(spacing_widths: float, column: float) -> tuple[Floats, Floats]:
    """Two layers at this spacing at both speeds."""
    apart = spacing_widths * WIDTH_HZ * np.array([-0.5, 0.5])
    frequency = np.tile(CROSSING_HZ + apart, (2, 1))
    return frequency, np.full(frequency.shape, HEIGHT)


# Errors of the tracked layers.


def wrong_names(fitted: Fitted) -> float:
    """Share of layers and conditions in which a layer has a different name from elsewhere."""
    truth, model = fitted
    named = np.zeros((truth.n_layers, max(model.n_layers, truth.n_layers)))
    for true_hz, width_hz, found_hz in zip(
        truth.frequencies_hz[:, 0],
        truth.bandwidths_hz[:, 0],
        model.frequencies_hz[:, 0],
        strict=True,
    ):
        partner = match_layers(true_hz, width_hz, estimated_frequency_hz=found_hz)
        named[np.flatnonzero(partner >= 0), partner[partner >= 0]] += 1
    rows, columns = linear_sum_assignment(-named)
    return float(1 - named[rows, columns].sum() / (truth.n_layers * truth.speeds_mm_s.size))


def changing_level_error_db(fitted: Fitted) -> float:
    """RMS error of the response's power within the width of the layer that changes, in dB."""
    errors = []
    for speed in fitted[0].speeds_mm_s.tolist():
        planted_peq, found = (model.peq(speed, FORCE_N) for model in fitted)
        centre = planted_peq.frequencies_hz[1]
        near = centre + WIDTH_HZ * np.linspace(-0.5, 0.5, 26)
        powers = [np.sum(peq.response(near) ** 2) for peq in (found, planted_peq)]
        errors.append(10 * np.log10(powers[0] / powers[1]))
    return float(np.sqrt(np.mean(np.square(errors))))


# Where theory predicts failure.


def half_the_gap(column: float) -> float:
    """Names go to the nearest layer: beyond half of the gap that is the neighbour."""
    return 0.5


def spacing_of_merging(column: float) -> float:
    """Widths at which two equal Gaussian peaks of the smoothed spectrum become one, 2σ."""
    return float(2 * np.hypot(SMOOTHING_HZ, WIDTH_HZ / BANDWIDTH_PER_S) / WIDTH_HZ)


# One wrong name in five is visible in the figure; two in five mean two layers are confused.
WRONG, WRONG_AT_MOST = 0.2, 0.4
# As for peaks: people can tell apart differences of about 1 dB or more; 3 dB are twice the power.
LEVEL_DB, LEVEL_DB_AT_MOST = 1.0, 3.0

JOINT, EITHER = "joint", "paper, either reading"  # both readings find and name the same peaks
# The lowest layers of the planted textures, whose frequencies go with the speed, move by less than
# a tenth of the gap to the next from speed to speed; levels grow 2.6 times over the grid.
JUMP = Axis(name="jump over gap, from speed to speed", unit="", mild=0.05, severe=2.0, default=0.1)
CROSSING = Axis(name="step of a layer that crosses another", unit="widths", mild=12.0, severe=0.5)
CHANGE = Axis(
    name="change of a layer's height over the grid", unit="", mild=1.0, severe=300.0, default=2.6
)
SPACING = Axis(
    name="spacing of two layers at all speeds", unit="widths", mild=6.0, severe=0.5, default=3.5
)
DIRECTIONS = {"gone at high speed": 1.0, "gone at low speed": -1.0}


def _case(method: str, axis: Axis, scene: Scene, **rest: Any) -> Case:
    by_level = scene is changing
    return Case(
        family=FAMILY,
        method=method,
        ours=method == JOINT,
        axis=axis,
        figure="error of the layer's level (RMS)" if by_level else "layers under a wrong name",
        unit="dB" if by_level else "",
        holds=LEVEL_DB if by_level else WRONG,
        degrades=LEVEL_DB_AT_MOST if by_level else WRONG_AT_MOST,
        measure=partial(
            measured,
            estimator="joint" if method == JOINT else "paper",
            scene=scene,
            figure=changing_level_error_db if by_level else wrong_names,
        ),
        **rest,
    )


CASES: tuple[Case, ...] = (
    _case(JOINT, JUMP, moving),
    _case(
        EITHER,
        JUMP,
        moving,
        theory=half_the_gap,
        source="names go to the nearest layer: past half the gap that is the neighbour",
    ),
    *(_case(method, CROSSING, crossing) for method in (JOINT, EITHER)),
    *(
        _case(method, CHANGE, changing, across="where the layer is gone", columns=DIRECTIONS)
        for method in (JOINT, EITHER)
    ),
    _case(JOINT, SPACING, neighbouring),
    _case(
        EITHER,
        SPACING,
        neighbouring,
        theory=spacing_of_merging,
        source="two equal Gaussian peaks merge at 2σ, smoothing included",
    ),
)
