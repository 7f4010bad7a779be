"""The worlds in which procedures are judged: ratings and choices with a known truth.

docs/method/validation.md
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import sqrt

import numpy as np

from tactileq.benches.raters import (
    at_random,
    ended,
    mean_at_the_end,
)
from tactileq.modeling.arrays import Floats

DIFFERENCE_SD = 11.0  # of participants' differences, in points; 7.5 are 0.68 of it
PERSON_SD = 6.0  # of participants' means
MIDDLE = 60.0  # mean rating, far from both ends
LATENT = -10.0  # difference that a ceiling hides
AT_END = 0.65  # share of the reference's ratings at 100 there
CARELESS = 0.2  # share of participants who answer at random
ABORTED = 0.15  # share of participants who do not finish
N_TEXTURES = 7
TRIALS = 21  # of the forced choice, of one participant with one model
ANSWERS = 3  # single ratings of one participant with one model
ANSWER_SD = 8.0  # of single ratings, around what a participant feels
Draw = Callable[[np.random.Generator, tuple[int, int], float], Floats]


def _ratings(person: Floats, difference: Floats) -> Floats:
    """Ratings (k, n, 2) of the reference and of the other model, the difference apart."""
    return np.stack([person, person + difference], axis=-1)


def _people(rng: np.random.Generator, shape: tuple[int, int]) -> Floats:
    return rng.normal(MIDDLE, PERSON_SD, shape)


def _normal(rng: np.random.Generator, shape: tuple[int, int], truth: float) -> Floats:
    return _ratings(_people(rng, shape), rng.normal(truth, DIFFERENCE_SD, shape))


def _skewed(rng: np.random.Generator, shape: tuple[int, int], truth: float) -> Floats:
    """Exponential differences: skewness 2."""
    spread = rng.exponential(1.0, shape) - 1.0
    return _ratings(_people(rng, shape), truth + DIFFERENCE_SD * spread)


def _heavy_tails(rng: np.random.Generator, shape: tuple[int, int], truth: float) -> Floats:
    """Differences of Student's t with 3 degrees of freedom, whose SD is √3."""
    spread = rng.standard_t(3, shape) / sqrt(3)
    return _ratings(_people(rng, shape), truth + DIFFERENCE_SD * spread)


def _ceiling(rng: np.random.Generator, shape: tuple[int, int], truth: float) -> Floats:
    """Latent ratings that end at 100, where `AT_END` of the reference's lie."""
    noise_sd = DIFFERENCE_SD / sqrt(2)
    middle = mean_at_the_end(AT_END, sd=float(np.hypot(PERSON_SD, noise_sd)))
    latent = rng.normal(middle, PERSON_SD, shape)[..., None] + rng.normal(0, noise_sd, (*shape, 2))
    return ended(latent + np.array([0.0, truth]))


def _careless(rng: np.random.Generator, shape: tuple[int, int], truth: float) -> Floats:
    """Some participants answer at random, uniformly over the scale."""
    ratings = _normal(rng, shape, truth)
    random = rng.random(shape) < CARELESS
    ratings[random] = at_random(rng, (*shape, 2))[random]
    return ratings


def _aborted(rng: np.random.Generator, shape: tuple[int, int], truth: float) -> Floats:
    """Participants who do not finish have no complete cells, independently of their ratings."""
    ratings = _normal(rng, shape, truth)
    ratings[rng.random(shape) < ABORTED] = np.nan
    return ratings


def rates_of_people(
    rng: np.random.Generator, shape: tuple[int, int], truth: float, *, concentration: float = 5.0
) -> Floats:
    """Shares of right answers (k, n) of people whose abilities follow a beta distribution."""
    ability = rng.beta(concentration * truth, concentration * (1 - truth), shape)
    return rng.binomial(TRIALS, ability) / TRIALS


def _careless_rates(rng: np.random.Generator, shape: tuple[int, int], truth: float) -> Floats:
    guessed = rng.binomial(TRIALS, 1 / N_TEXTURES, shape) / TRIALS
    return np.where(rng.random(shape) < CARELESS, guessed, rates_of_people(rng, shape, truth))


def _aborted_rates(rng: np.random.Generator, shape: tuple[int, int], truth: float) -> Floats:
    return np.where(rng.random(shape) < ABORTED, np.nan, rates_of_people(rng, shape, truth))


RATING_WORLDS: Mapping[str, Draw] = {
    "normal": _normal,
    "skewed": _skewed,
    "heavy tails": _heavy_tails,
    "ceiling": _ceiling,
    "careless raters": _careless,
    "aborted sessions": _aborted,
}
RATE_WORLDS: Mapping[str, Draw] = {
    "normal": rates_of_people,
    "careless raters": _careless_rates,
    "aborted sessions": _aborted_rates,
}


def confusions(
    rng: np.random.Generator, shape: tuple[int, int], truth: float, *, concentration: float = 5.0
) -> Floats:
    """Counts (k, n, 7, 7) of people whose abilities follow a beta distribution.

    `truth` is their mean share of right answers; wrong ones fall on all others alike.
    """
    ability = rng.beta(concentration * truth, concentration * (1 - truth), shape)
    right = np.eye(N_TEXTURES)
    wrong = (1 - right) / (N_TEXTURES - 1)
    shares = ability[..., None, None] * right + (1 - ability)[..., None, None] * wrong
    return rng.multinomial(TRIALS // N_TEXTURES, shares).astype(float)


def single_ratings(
    rng: np.random.Generator, shape: tuple[int, int], truth: float, *, sd: float = DIFFERENCE_SD
) -> Floats:
    """Single ratings (k, n, 2, 3) of people whose differences vary by `sd`."""
    felt = _ratings(_people(rng, shape), rng.normal(truth, sd, shape))
    return felt[..., None] + rng.normal(0, ANSWER_SD, (*shape, 2, ANSWERS))


def equal_slopes(rng: np.random.Generator, shape: tuple[int, int], truth: float) -> Floats:
    return single_ratings(rng, shape, truth, sd=0.0)


def single_choices(rng: np.random.Generator, shape: tuple[int, int], truth: float) -> Floats:
    """Right and wrong answers (k, n, 2, 21); abilities with either model vary independently."""
    ability = rng.beta(5 * truth, 5 * (1 - truth), (*shape, 2))
    return (rng.random((*shape, 2, TRIALS)) < ability[..., None]).astype(float)
