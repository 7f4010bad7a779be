"""Worlds by mechanisms of another kind than `ratings`, all at a bound.

Ratings depend on the trials before, or are given up on the way.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from tactileq.benches.validation.people.drawn import (
    N_TEXTURES,
    POINTS,
    DrawnStudies,
    Shape,
    World,
    on_slider,
    shuffled,
)
from tactileq.modeling.arrays import Bools, Floats

Integers = NDArray[np.intp]

LEVEL, ANCHOR = 60.0, 25.0  # mean sensation of the textures, and of the two anchors
PERSON_SD, TEXTURE_SD, CELL_SD, NOISE_SD = 7.0, 7.0, 4.0, 8.0
ANCHORS = 2
LOW, HIGH = POINTS

GAIN_SPREAD = 0.35  # SD of the logarithm of people's gains
FELT_SPREAD = 0.3  # SD of people's effects in sensation, as a share of the mean
ADAPTING, CONTRAST = 0.3, 0.4  # speed of the adaptation level; how much of it is subtracted
ASSIMILATION = 0.35  # most of the previous rating that enters the next
FATIGUE, SINKING = 0.6, 4.0  # growth of the noise; points lost until the last trial

NEVER = 0.1  # share of people who do not attend at all
GIVEN_UP = 0.4  # share of the others who stop attending before the last trial
LITTLE, MUCH, GROUP_SD = 3.0, 12.0, 2.0  # effects of two halves of people
REPEATS = 2


def _sensations(rng: np.random.Generator, shape: Shape, repeats: int) -> Floats:
    """Sensations (k, n, 7, 2, R) without effects: people, textures and people × textures."""
    k, n = shape
    level = LEVEL + rng.normal(0, PERSON_SD, (k, n, 1)) + rng.normal(0, TEXTURE_SD, (k, 1, 7))
    level = level + rng.normal(0, CELL_SD, (k, n, N_TEXTURES))
    return np.array(np.broadcast_to(level[..., None, None], (k, n, N_TEXTURES, 2, repeats)))


def _with_anchors(rng: np.random.Generator, cells: Floats) -> Floats:
    """All sensations of a person (k, n, trials), the anchors last."""
    flat = cells.reshape(*cells.shape[:2], -1)
    anchors = ANCHOR + rng.normal(0, PERSON_SD, (*flat.shape[:2], ANCHORS))
    return np.concatenate([flat, anchors], axis=-1)


def _rated(ratings: Floats, positions: Integers, attends: Bools, *, mean: Floats) -> DrawnStudies:
    """Latent ratings (k, n, trials), the anchors last, as a batch of studies."""
    cells = (*attends.shape, N_TEXTURES, 2, (ratings.shape[-1] - ANCHORS) // (2 * N_TEXTURES))
    kept, orders = on_slider(ratings), positions / (positions.shape[-1] - 1)
    return DrawnStudies(
        values=kept[..., :-ANCHORS].reshape(cells),
        days=np.zeros(cells[1:], dtype=np.intp),
        orders=orders[..., :-ANCHORS].reshape(cells),
        anchors=kept[..., -ANCHORS:],
        planted=mean,
        attends=attends,
    )


# Ratings beside the trials before


def adapted(sensations: Floats, gain: Floats, assimilation: Floats) -> Floats:
    """Ratings in the order of trials, as deviations from the start; (k, n, trials) each.

    A sensation is rated beside an adaptation level that follows the sensations before, times
    the person's gain, and is drawn towards the previous rating. Linear in the sensations.
    """
    level = np.zeros(sensations.shape[:-1])
    before = np.zeros(sensations.shape[:-1])
    ratings = np.empty(sensations.shape)
    for trial in range(sensations.shape[-1]):
        felt = sensations[..., trial]
        before = (1 - assimilation) * gain * (felt - CONTRAST * level) + assimilation * before
        level = (1 - ADAPTING) * level + ADAPTING * felt
        ratings[..., trial] = before
    return ratings


def mean_response(gain: Floats, assimilation: Floats, trials: int) -> Floats:
    """How many points the ratings of a person's models differ per unit of sensation; (k, n).

    Averaged over random orders of half of the trials with an effect (anchors apart): a trial
    follows one of its own model more rarely than one of the other, by 1 / (trials − 1).
    """
    impulse = np.zeros((*gain.shape, trials))
    impulse[..., 0] = 1.0
    lags = np.arange(trials)
    weights = np.where(lags == 0, 1.0, -(trials - lags) / (trials * (trials - 1)))
    return np.asarray((adapted(impulse, gain, assimilation) * weights).sum(axis=-1))


def _adaptation(rng: np.random.Generator, shape: Shape) -> DrawnStudies:
    trials = 2 * N_TEXTURES + ANCHORS
    gain = np.exp(rng.normal(-(GAIN_SPREAD**2) / 2, GAIN_SPREAD, shape))
    assimilation = rng.uniform(0, ASSIMILATION, shape)
    effects = LOW * gain * rng.normal(1, FELT_SPREAD, shape)
    felt = _sensations(rng, shape, 1)
    response = mean_response(gain, assimilation, trials)
    felt[..., 1, :] += (effects / response)[..., None, None]
    positions = shuffled(rng, (*shape, trials))
    in_time = np.take_along_axis(
        _with_anchors(rng, felt) - LEVEL, np.argsort(positions, axis=-1), axis=-1
    )
    passed = np.linspace(0, 1, trials)
    noise = NOISE_SD * (1 + FATIGUE * passed) * rng.standard_normal(in_time.shape)
    rated = LEVEL + adapted(in_time, gain, assimilation) + noise - SINKING * passed
    ratings = np.take_along_axis(rated, positions, axis=-1)
    everybody = np.ones(shape, dtype=bool)
    return _rated(ratings, positions, everybody, mean=np.full(N_TEXTURES, LOW))


# Ratings that are given up


def _stops(rng: np.random.Generator, shape: Shape) -> Floats:
    """Position after which a person does not attend; −1 for those who never do.

    From the middle on, the share who stopped grows with the square of the time.
    """
    drawn = rng.random(shape)
    stops = np.where(drawn < GIVEN_UP, 0.5 + 0.5 * np.sqrt(drawn / GIVEN_UP), 1.0)
    return np.where(rng.random(shape) < NEVER, -1.0, stops)


def _giving_up(rng: np.random.Generator, shape: Shape) -> DrawnStudies:
    """Two groups of people; noise is skewed, and a slider stays where attention left it."""
    trials = 2 * N_TEXTURES * REPEATS + ANCHORS
    effects = rng.normal(np.where(rng.random(shape) < 0.5, LITTLE, MUCH), GROUP_SD)
    felt = _sensations(rng, shape, REPEATS)
    felt[..., 1, :] += effects[..., None, None]
    skewed = (rng.gamma(2.0, 1.0, (*shape, trials)) - 2.0) / sqrt(2)
    ratings = _with_anchors(rng, felt) + NOISE_SD * skewed
    positions = shuffled(rng, ratings.shape)
    stops = _stops(rng, shape)
    attended = positions / (trials - 1) <= stops[..., None]
    last = np.where(attended, positions, -1).argmax(axis=-1, keepdims=True)
    place = np.take_along_axis(ratings, last, axis=-1)
    place = np.where(stops[..., None] < 0, rng.uniform(0, 100, place.shape), place)
    left = place + rng.normal(0, 3.0, ratings.shape)
    mean = np.full(N_TEXTURES, (LITTLE + MUCH) / 2)
    return _rated(np.where(attended, ratings, left), positions, stops >= 0, mean=mean)


OTHER_WORLDS: Mapping[str, World] = {
    "adaptation": World(
        line="at the lower bound; gains differ, ratings follow the trials before, noise grows",
        draw=_adaptation,
    ),
    "giving up": World(
        line="at the bound in two groups; a tenth never attend, two fifths of the others stop",
        draw=_giving_up,
    ),
}
