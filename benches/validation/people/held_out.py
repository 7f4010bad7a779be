"""Worlds by mechanisms of another kind than `ratings`, at a bound or without an effect.

Ratings depend on the trials before or on the slider, are given up on the way, or take a texture
for another.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import nan, sqrt

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
HIGH = POINTS[1]

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


def _rated(
    ratings: Floats, positions: Integers, attends: Bools, *, mean: Floats, people_sd: float = nan
) -> DrawnStudies:
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
        people_sd=people_sd,
    )


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


# Ratings where the slider stops, beside memories, and of textures mistaken for others

MIDDLE_SD = 8.0  # of the noise in the middle of the scale; less towards the ends

STOPPED_REPEATS, STOPPED_SD = 3, 4.0  # repeats; SD of the normal effects
SCATTERED = 0.2  # by how much the logarithm of the noise grows per SD of the effects
MISTAKEN = 0.12  # share of trials in which a texture is taken for the one it resembles
SHORT = 6.0  # the most points by which a slider is stopped short, seen from where it starts
NUDGING, NUDGE = 0.1, 15.0  # share of people who only nudge the slider; by how much
STROLL = 0.7  # SD of the steps of a criterion from trial to trial, over 44 trials

CAMP, CAMP_SHARE = 6.0, 0.2  # preference for either model; share of people in each camp
FLAWED, FLAWS = 0.3, (5.0, 20.0)  # how often a person finds a flaw in a texture; points lost
WALK, BLOCKS, BLOCK_SD = 1.2, 3, 5.0  # steps of a criterion, over 16 trials; shifts after breaks
BESIDE, FORGETTING = 0.4, 8.0  # contrast with what is remembered; trials until a third is left
MEMORY_DRIFT = 3.0  # SD of the drift of a memory over one trial
STRICTER, STRICTER_SD = 3.0, 4.0  # points by which the second model of a texture is rated lower
UNMOVED = 6.0  # the most points that are not worth moving the slider
WANDERING, STRIDE = 0.1, 15.0  # share of people who move it anyhow; SD of their moves


def _middling(rng: np.random.Generator, felt: Floats) -> Floats:
    """Noise of symmetric distribution whose SD falls from the middle of the scale to its ends."""
    share = np.clip(felt / 100, 0.05, 0.95)
    sd = MIDDLE_SD * 2 * np.sqrt(share * (1 - share))
    return np.asarray(sd * rng.standard_normal(felt.shape))


def _walked(rng: np.random.Generator, positions: Integers, step: float) -> Floats:
    """A criterion that walks at random over the trials of a person, at the trials."""
    walks = np.cumsum(rng.normal(0, step, positions.shape), axis=-1)
    return np.take_along_axis(walks, positions, axis=-1)


def _stopped_short(rng: np.random.Generator, shape: Shape) -> DrawnStudies:
    """Sliders start at the left or right end and are stopped as soon as they are near enough.

    Some trials are of a texture mistaken for its look-alike, the criterion walks, who makes more
    of the models' difference scatters more, and a tenth of people only nudge the slider.

    The mean is exact: a person's effect, normal about the bound, is the same on all textures, so
    that mistaking one for another leaves it; sides, walk and noise have mean 0 given the model.
    """
    felt = _sensations(rng, shape, STOPPED_REPEATS)
    deviates = rng.standard_normal((*shape, 1))
    felt[..., 1, :] += HIGH + STOPPED_SD * deviates[..., None]
    mistaken = rng.random(felt.shape) < MISTAKEN
    flat = _with_anchors(rng, np.where(mistaken, np.roll(felt, 1, axis=2), felt))
    positions = shuffled(rng, flat.shape)
    sides = rng.choice([-1.0, 1.0], size=flat.shape)
    noise = np.exp(SCATTERED * deviates) * _middling(rng, flat)
    ratings = flat + noise + _walked(rng, positions, STROLL)
    ratings += sides * rng.uniform(0, SHORT, (*shape, 1))
    nudges = 50 + sides * (50 - rng.gamma(2.0, NUDGE / 2, flat.shape))
    attends = rng.random(shape) >= NUDGING
    ratings = np.where(attends[..., None], ratings, nudges)
    mean = np.full(N_TEXTURES, HIGH)
    return _rated(ratings, positions, attends, mean=mean, people_sd=STOPPED_SD)


def _flaws(rng: np.random.Generator, shape: Shape) -> Floats:
    """What each model (k, n, 7, 2, 1) gains or loses with a person; either model as often."""
    camps = rng.choice([-1, 0, 1], p=[CAMP_SHARE, 1 - 2 * CAMP_SHARE, CAMP_SHARE], size=shape)
    found = rng.random((*shape, N_TEXTURES)) < FLAWED
    lost = np.where(found, rng.uniform(*FLAWS, found.shape), 0.0)[..., None]
    models = np.array([-0.5, 0.5])
    worse = rng.integers(0, 2, found.shape)[..., None] == np.arange(2)
    return np.asarray((camps[..., None, None] * CAMP * models - lost * worse)[..., None])


def _unmoved(ratings: Floats, positions: Integers, reluctance: Floats) -> Floats:
    """Ratings with a slider left where it is if it would be moved by less than the reluctance."""
    in_time = np.take_along_axis(ratings, np.argsort(positions, axis=-1), axis=-1)
    for trial in range(1, in_time.shape[-1]):
        near = np.abs(in_time[..., trial] - in_time[..., trial - 1]) < reluctance
        in_time[..., trial] = np.where(near, in_time[..., trial - 1], in_time[..., trial])
    return np.take_along_axis(in_time, positions, axis=-1)


def _remembered(rng: np.random.Generator, shape: Shape) -> DrawnStudies:
    """The second model of a texture is rated beside a drifting memory of the first.

    People find flaws in single models or are in the camp of one; their criterion walks and jumps
    after breaks, a slider that is nearly right is not moved, and a tenth move it anyhow.

    The mean is exact: the order is random, nothing after `_flaws` knows the models, and there
    both are treated alike, so that their names may be swapped: all effects are symmetric about 0.
    """
    flat = _with_anchors(rng, _sensations(rng, shape, 1) + _flaws(rng, shape))
    positions = shuffled(rng, flat.shape)
    jumps = rng.normal(0, BLOCK_SD, (*shape, BLOCKS))
    ratings = flat + _middling(rng, flat) + _walked(rng, positions, WALK)
    ratings += np.take_along_axis(jumps, positions * BLOCKS // flat.shape[-1], axis=-1)
    pairs, at = (a[..., :-ANCHORS].reshape(*shape, N_TEXTURES, 2) for a in (ratings, positions))
    lags = np.maximum(at - at[..., ::-1], 0)  # 0 for the first model of a texture
    memory = pairs[..., ::-1] + MEMORY_DRIFT * np.sqrt(lags) * rng.standard_normal(lags.shape)
    contrast = BESIDE * np.exp(-lags / FORGETTING) * (pairs - memory)
    stricter = rng.normal(STRICTER, STRICTER_SD, (*shape, 1, 1))
    second = np.where(lags > 0, pairs + contrast - stricter, pairs)
    ratings[..., :-ANCHORS] = second.reshape(*shape, -1)
    ratings = _unmoved(ratings, positions, rng.uniform(0, UNMOVED, shape))
    anyhow = rng.uniform(0, 100, (*shape, 1)) + _walked(rng, positions, STRIDE)
    attends = rng.random(shape) >= WANDERING
    folded = 100 - np.abs(anyhow % 200 - 100)
    ratings = np.where(attends[..., None], ratings, folded)
    return _rated(ratings, positions, attends, mean=np.zeros(N_TEXTURES))


OTHER_WORLDS: Mapping[str, World] = {
    "giving up": World(
        line="at the bound in two groups; a tenth never attend, two fifths of the others stop",
        draw=_giving_up,
    ),
    "stopped short": World(
        line="at the bound; sliders stop short, textures are mistaken, a tenth only nudge",
        draw=_stopped_short,
        held_out="9122c5d0",
    ),
    "remembered": World(
        line="no mean effect; flaws and camps, memories of the first model, jumping criteria",
        draw=_remembered,
        held_out="9122c5d0",
    ),
}
