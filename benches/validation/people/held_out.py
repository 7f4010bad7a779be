"""Held-out situations with known truth, by mechanisms of another kind than `validation_people`.

They judge a procedure once, after its rule is fixed: no procedure may be chosen by them. Ratings
depend on the trials before or are given up; odd ones are detected or guessed, by strategies that
change; choices perseverate and confuse within clusters. All effects are planted at a bound.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from math import comb, nan, sqrt
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from tactileq.benches.validation.people.drawn import (
    BOUNDS,
    CHOICE_KIND,
    N_TEXTURES,
    ODDITY_KIND,
    RATING_KIND,
    DrawnStudies,
    Shape,
    Situation,
    counterbalanced,
    normal_quantiles,
    on_slider,
    shuffled,
)
from tactileq.modeling.arrays import Floats

Integers = NDArray[np.intp]

LEVEL, ANCHOR = 60.0, 25.0  # mean sensation of the textures, and of the two anchors
PERSON_SD, TEXTURE_SD, CELL_SD, NOISE_SD = 7.0, 7.0, 4.0, 8.0
ANCHORS = 2
LOW, HIGH = BOUNDS[RATING_KIND]

GAIN_SPREAD = 0.35  # SD of the logarithm of people's gains
FELT_SPREAD = 0.3  # SD of people's effects in sensation, as a share of the mean
ADAPTING, CONTRAST = 0.3, 0.4  # speed of the adaptation level; how much of it is subtracted
ASSIMILATION = 0.35  # most of the previous rating that enters the next
FATIGUE, SINKING = 0.6, 4.0  # growth of the noise; points lost until the last trial

NEVER = 0.1  # share of people who do not attend at all
GIVEN_UP = 0.4  # share of the others who stop attending before the last trial
LITTLE, MUCH, GROUP_SD = 3.0, 12.0, 2.0  # effects of two halves of people
EFFECT_TEXTURE_SD, REPEATS = 3.0, 2

ODDITY_REPEATS, CATCHES, CAUGHT, CARELESS = 6, 6, 0.96, 0.15
MOST_EXCESS, EXCESS_SHAPE = 0.3, (2, 4)  # share right beyond chance: beta, mean 1/3 of the most
FACTORS = np.array([1.3, 0.8, 1.1, 0.7, 1.2, 0.9, 1.0])  # of detection by texture; mean 1
WAVE = 0.3  # amplitude of attention that comes and goes
MOST_FIRST, STAYING = 0.4, 0.9  # share of trials by the first interval; of trials without a switch

CHOICE_REPEATS = 3
CLUSTERS = np.array([0, 0, 0, 1, 1, 2, 2])
WITHIN = 0.75  # of wrong answers within the cluster
EASE = np.array([0.10, -0.12, -0.05, 0.08, 0.0, -0.06, 0.05])  # share right by texture; mean 0
DAY_GAIN = 0.06  # share right gained from the first day to the second
MOST_PERSEVERATION = 0.2
MOST_LOSS, LOSS_SHAPE = 0.25, (2, 3)  # share right lost with the other model: beta, mean 2/5


def _beta_above(shape: tuple[int, int], x: float) -> float:
    """Chance that a beta variable with whole parameters exceeds x (by the binomial)."""
    a, b = shape
    of = a + b - 1
    return sum(comb(of, j) * x**j * (1 - x) ** (of - j) for j in range(a))


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
    ratings: Floats, positions: Integers, effects: Floats, *, truth: tuple[float, float]
) -> DrawnStudies:
    """Latent ratings (k, n, trials), the anchors last, as a batch of studies."""
    cells = (*effects.shape, N_TEXTURES, 2, (ratings.shape[-1] - ANCHORS) // (2 * N_TEXTURES))
    kept, orders = on_slider(ratings), positions / (positions.shape[-1] - 1)
    return DrawnStudies(
        values=kept[..., :-ANCHORS].reshape(cells),
        checks=kept[..., -ANCHORS:],
        days=np.zeros(cells, dtype=np.intp),
        orders=orders[..., :-ANCHORS].reshape(cells),
        effects=effects,
        mean=truth[0],
        outside=truth[1],
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


@cache
def _gained_outside() -> float:
    """Share of people outside, whose effect is LOW · gain · a normal variable around 1."""
    from scipy.special import ndtr

    gain = np.exp(GAIN_SPREAD * normal_quantiles(4000) - GAIN_SPREAD**2 / 2)
    below = ndtr((1 - 1 / gain) / FELT_SPREAD)
    above = ndtr((HIGH / LOW / gain - 1) / FELT_SPREAD)
    return float((below + above).mean())


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
    return _rated(ratings, positions, effects, truth=(LOW, _gained_outside()))


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
    by_texture = rng.normal(0, EFFECT_TEXTURE_SD, (shape[0], 1, N_TEXTURES))
    by_texture -= by_texture.mean(axis=-1, keepdims=True)
    felt = _sensations(rng, shape, REPEATS)
    felt[..., 1, :] += (effects[..., None] + by_texture)[..., None]
    skewed = (rng.gamma(2.0, 1.0, (*shape, trials)) - 2.0) / sqrt(2)
    ratings = _with_anchors(rng, felt) + NOISE_SD * skewed
    positions = shuffled(rng, ratings.shape)
    stops = _stops(rng, shape)
    attended = positions / (trials - 1) <= stops[..., None]
    last = np.where(attended, positions, -1).argmax(axis=-1, keepdims=True)
    place = np.take_along_axis(ratings, last, axis=-1)
    place = np.where(stops[..., None] < 0, rng.uniform(0, 100, place.shape), place)
    left = place + rng.normal(0, 3.0, ratings.shape)
    groups = [NormalDist(mean, GROUP_SD) for mean in (LITTLE, MUCH)]
    outside = sum(group.cdf(LOW) + 1 - group.cdf(HIGH) for group in groups) / 2
    return _rated(
        np.where(attended, ratings, left),
        positions,
        np.where(stops < 0, nan, effects),
        truth=((LITTLE + MUCH) / 2, outside),
    )


# Oddity by detection and guesses


def preferred(rng: np.random.Generator, preferences: Floats, trials: int) -> Integers:
    """Answers (k, n, trials) by each person's preferences (k, n, answers)."""
    drawn = rng.random((*preferences.shape[:2], trials, 1))
    ends = np.cumsum(preferences, axis=-1)[..., None, :-1]
    return np.asarray((drawn > ends).sum(axis=-1))


def _by_first(rng: np.random.Generator, share: Floats, trials: int) -> NDArray[np.bool_]:
    """In which trials a person compares with the first interval; runs, with the given share."""
    anew = rng.random((*share.shape, trials)) < share[..., None]
    kept = rng.random((*share.shape, trials)) < STAYING
    for trial in range(1, trials):
        anew[..., trial] = np.where(kept[..., trial], anew[..., trial - 1], anew[..., trial])
    return anew


def _attention(rng: np.random.Generator, shape: Shape, trials: int) -> Floats:
    """Factors of detection in the order of trials: whole waves, whose mean is exactly 1."""
    waves = rng.integers(1, 3, (*shape, 1)) * np.arange(trials) / trials
    return np.asarray(1 + WAVE * np.cos(2 * np.pi * (waves + rng.random((*shape, 1)))))


def _found(
    rng: np.random.Generator, detection: Floats, first_share: Floats, *, positions: Integers
) -> tuple[Integers, Integers]:
    """The odd intervals, and those answered, −1 where a person has to guess; (k, n, trials)."""
    trials = positions.shape[-1] + CATCHES
    waves = _attention(rng, detection.shape, trials)
    attention = np.take_along_axis(waves, positions, axis=-1)
    chances = detection[..., None] * attention * np.repeat(FACTORS, ODDITY_REPEATS)
    first = np.take_along_axis(_by_first(rng, first_share, trials), positions, axis=-1)
    odd = rng.integers(0, 3, positions.shape)
    answered = np.where(first & (odd == 0), rng.integers(1, 3, odd.shape), odd)
    return odd, np.where(rng.random(chances.shape) < chances, answered, -1)


def _strategies(rng: np.random.Generator, shape: Shape) -> DrawnStudies:
    """What is detected is found, except by who compares with a first interval that is the odd one.

    The share right beyond chance is detection · (2/3 − share of such trials / 3).
    """
    own, cells = N_TEXTURES * ODDITY_REPEATS, (*shape, N_TEXTURES, 1, ODDITY_REPEATS)
    effects = MOST_EXCESS * rng.beta(*EXCESS_SHAPE, shape)
    first_share = MOST_FIRST * rng.beta(1, 2, shape)
    positions = shuffled(rng, (*shape, own + CATCHES))[..., :own]
    detection = effects / ((2 - first_share) / 3)
    odd, found = _found(rng, detection, first_share, positions=positions)
    careless = rng.random(shape) < CARELESS
    guesses = preferred(rng, rng.dirichlet([3.0] * 3, shape), own)
    answers = np.where((found < 0) | careless[..., None], guesses, found)
    caught = np.where(careless, 1 / 3, CAUGHT)[..., None]
    return DrawnStudies(
        values=(answers == odd).astype(float).reshape(cells),
        checks=(rng.random((*shape, CATCHES)) < caught).astype(float),
        days=np.zeros(cells, dtype=np.intp),
        orders=(positions / (own + CATCHES - 1)).reshape(cells),
        effects=np.where(careless, nan, effects),
        mean=MOST_EXCESS * EXCESS_SHAPE[0] / sum(EXCESS_SHAPE),
        outside=_beta_above(EXCESS_SHAPE, BOUNDS[ODDITY_KIND][1] / MOST_EXCESS),
    )


# Choices that perseverate


def confusions() -> Floats:
    """Shares (7, 7) of wrong answers by texture (row): mostly within its cluster."""
    same = CLUSTERS[:, None] == CLUSTERS
    within = same & ~np.eye(N_TEXTURES, dtype=bool)
    shares = WITHIN * within / within.sum(axis=1, keepdims=True)
    return np.asarray(shares + (1 - WITHIN) * ~same / (~same).sum(axis=1, keepdims=True))


def _answered(
    rng: np.random.Generator, shown: Integers, right: Floats, *, perseveration: Floats
) -> Integers:
    """Answers (k, n, trials) in the order of trials; some repeat the answer before."""
    ends = np.cumsum(confusions(), axis=1)[:, :-1]
    wrong = (rng.random((*shown.shape, 1)) > ends[shown]).sum(axis=-1)
    answers = np.where(rng.random(shown.shape) < right, shown, wrong)
    repeated = rng.random(shown.shape) < perseveration[..., None]
    for trial in range(1, shown.shape[-1]):
        answers[..., trial] = np.where(
            repeated[..., trial], answers[..., trial - 1], answers[..., trial]
        )
    return np.asarray(answers)


def _day(
    rng: np.random.Generator, right: Floats, perseveration: Floats
) -> tuple[NDArray[np.bool_], Floats]:
    """Right answers and positions (k, n, 7, R) with one model; `right`: share identified (k, n)."""
    positions = shuffled(rng, (*right.shape, N_TEXTURES * CHOICE_REPEATS))
    shown = np.argsort(positions, axis=-1) // CHOICE_REPEATS
    identified = right[..., None] + EASE[shown]
    answers = _answered(rng, shown, identified, perseveration=perseveration)
    cells = (*right.shape, N_TEXTURES, CHOICE_REPEATS)
    given = np.take_along_axis(answers == shown, positions, axis=-1)
    return given.reshape(cells), (positions / (positions.shape[-1] - 1)).reshape(cells)


def _perseveration(rng: np.random.Generator, shape: Shape) -> DrawnStudies:
    """Repeats of the answer before are right by chance, 1/7, in orders of equally many trials.

    The share right is hence (1 − perseveration) · identified + perseveration / 7, exactly.
    """
    cells = (*shape, N_TEXTURES, 2, CHOICE_REPEATS)
    effects = -MOST_LOSS * rng.beta(*LOSS_SHAPE, shape)
    perseveration = rng.uniform(0, MOST_PERSEVERATION, shape)
    identified = rng.uniform(0.5, 0.8, shape)
    careless = rng.random(shape) < CARELESS
    names = rng.dirichlet([1.0] * N_TEXTURES, shape)  # what the careless answer, whatever is shown
    values = rng.random(cells) < names[..., None, None]
    days, orders = counterbalanced(cells), np.empty(cells)
    for model in (0, 1):
        gained = DAY_GAIN * (days[:, :, 0, model, 0] - 0.5)
        right = identified + model * effects / (1 - perseveration) + gained
        given, orders[..., model, :] = _day(rng, right, perseveration)
        values[~careless, :, model] = given[~careless]
    return DrawnStudies(
        values=values.astype(float),
        checks=np.empty((*shape, 0)),
        days=days,
        orders=orders,
        effects=np.where(careless, nan, effects),
        mean=-MOST_LOSS * LOSS_SHAPE[0] / sum(LOSS_SHAPE),
        outside=_beta_above(LOSS_SHAPE, -BOUNDS[CHOICE_KIND][0] / MOST_LOSS),
    )


HELD_OUT: Mapping[str, Situation] = {
    "ratings: adaptation": Situation(
        RATING_KIND,
        "at the lower bound; gains differ, ratings follow the trials before, noise grows",
        _adaptation,
    ),
    "ratings: giving up": Situation(
        RATING_KIND,
        "at the bound in two groups; a tenth never attend, two fifths of the others stop",
        _giving_up,
    ),
    "oddity: strategies": Situation(
        ODDITY_KIND,
        "at the bound; detection or guess, comparison with the first interval, waves of attention",
        _strategies,
    ),
    "choice: perseveration": Situation(
        CHOICE_KIND,
        "at the bound; answers repeat those before, confusions lie within clusters",
        _perseveration,
    ),
}
