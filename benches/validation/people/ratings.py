"""Simulated ratings of people whose effects are known.

Latent ratings with a person's level, trend and noise are ended at 0 and 100 and stored in steps
of the slider; some people do not attend, or round.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import atan, exp, nan, pi, sqrt
from statistics import NormalDist

import numpy as np

from tactileq.benches.validation.people.drawn import (
    BOUNDS,
    N_TEXTURES,
    RATING_KIND,
    DrawnStudies,
    Shape,
    Situation,
    on_slider,
    shuffled,
)
from tactileq.modeling.arrays import Floats

BASE = 60.0  # mean latent rating of the reference
PERSON_SD, TEXTURE_SD, CELL_SD = 8.0, 6.0, 4.0  # of people, textures and people × textures
NOISE_SD, NOISE_SPREAD = 9.0, 0.2  # of trials: median over people, and SD of its logarithm
EFFECT_SD = 4.0  # of people's effects
TREND, TREND_SD = 1.0, 2.0  # points from the first to the last trial, and SD between people
ANCHORS, ANCHOR, ANCHOR_SD = 2, 20.0, 6.0  # how many, mean latent rating, SD between people
PLACE_SD = 5.0  # of ratings at a favourite place
STEP = 0.01  # of the slider
AT_BOUND = BOUNDS[RATING_KIND][1]
ONE_IN_FIVE, LAPSES = 0.2, 0.1  # shares of people, and of trials


@dataclass(frozen=True)
class Effects:
    """People's effects on ratings: how they are drawn, their mean, and the share outside."""

    draw: Callable[[np.random.Generator, Shape], Floats]
    mean: float
    outside: float


def _normal(mean: float, sd: float) -> Effects:
    low, high = BOUNDS[RATING_KIND]
    outside = float(not low <= mean <= high)
    if sd > 0:
        people = NormalDist(mean, sd)
        outside = people.cdf(low) + 1 - people.cdf(high)
    return Effects(lambda rng, shape: rng.normal(mean, sd, shape), mean, outside)


def _some(share: float, effect: float, *, others: float = 0.0) -> Effects:
    """An effect of a share of people, and another of all others; which ones is by chance."""
    low, high = BOUNDS[RATING_KIND]
    outside = sum(
        part for part, one in ((share, effect), (1 - share, others)) if not low <= one <= high
    )
    mean = share * effect + (1 - share) * others
    return Effects(
        lambda rng, shape: np.where(rng.random(shape) < share, effect, others), mean, outside
    )


def _skewed(mean: float, sd: float) -> Effects:
    """Exponential effects, whose upper share outside is exp(−distance); for mean − SD > low."""
    outside = exp(-((BOUNDS[RATING_KIND][1] - mean) / sd + 1))
    return Effects(lambda rng, shape: mean + sd * (rng.exponential(1.0, shape) - 1), mean, outside)


def _heavy_tails(mean: float, sd: float) -> Effects:
    """Student's t with 3 degrees of freedom, whose SD is √3; its distribution is closed."""

    def below(bound: float) -> float:
        ratio = (bound - mean) / sd  # t / √3
        return 0.5 + (ratio / (1 + ratio**2) + atan(ratio)) / pi

    low, high = BOUNDS[RATING_KIND]
    return Effects(
        lambda rng, shape: mean + sd / sqrt(3) * rng.standard_t(3, shape),
        mean,
        below(low) + 1 - below(high),
    )


@dataclass(frozen=True)
class _Ratings:
    """People who rate each texture with each model once, in one session, and anchors."""

    effects: Effects
    base: float = BASE
    careless: float = 0.0  # share of people who do not attend
    at_place: bool = False  # these rate near a place of their own, not all over the scale
    lapses: float = 0.0  # share of trials, of everybody
    heaping: bool = False
    anchors: int = ANCHORS

    def __call__(self, rng: np.random.Generator, shape: Shape) -> DrawnStudies:
        trials = 2 * N_TEXTURES + self.anchors
        effects = self.effects.draw(rng, shape)
        orders = shuffled(rng, (*shape, trials)) / (trials - 1)
        ratings = self._felt(rng, effects) + _trends_and_noise(rng, orders)
        careless = rng.random(shape) < self.careless
        ratings[careless] = self._unfelt(rng, ratings.shape)[careless]
        lapsed = rng.random(ratings.shape) < self.lapses
        ratings[lapsed] = rng.uniform(0, 100, ratings.shape)[lapsed]
        kept = on_slider(_heaped(rng, ratings) if self.heaping else ratings)
        cells = (*shape, N_TEXTURES, 2, 1)
        nobody = self.careless >= 1
        return DrawnStudies(
            values=kept[..., : 2 * N_TEXTURES].reshape(cells),
            checks=kept[..., 2 * N_TEXTURES :],
            days=np.zeros(cells, dtype=np.intp),
            orders=orders[..., : 2 * N_TEXTURES].reshape(cells),
            effects=np.where(careless, nan, effects),
            mean=nan if nobody else self.effects.mean,
            outside=nan if nobody else self.effects.outside,
        )

    def _felt(self, rng: np.random.Generator, effects: Floats) -> Floats:
        """Latent ratings (k, n, 14 + anchors): textures by models, then anchors."""
        k, n = effects.shape
        person = rng.normal(0, PERSON_SD, (k, n, 1))
        level = self.base + person + rng.normal(0, TEXTURE_SD, (k, 1, N_TEXTURES))
        level = level + rng.normal(0, CELL_SD, (k, n, N_TEXTURES))
        pairs = level[..., None] + effects[..., None, None] * np.array([0.0, 1.0])
        anchors = ANCHOR + person / 2 + rng.normal(0, ANCHOR_SD, (k, n, self.anchors))
        return np.concatenate([pairs.reshape(k, n, -1), anchors], axis=-1)

    def _unfelt(self, rng: np.random.Generator, shape: tuple[int, ...]) -> Floats:
        if not self.at_place:
            return rng.uniform(0, 100, shape)
        return rng.uniform(0, 100, (*shape[:2], 1)) + rng.normal(0, PLACE_SD, shape)


def _trends_and_noise(rng: np.random.Generator, orders: Floats) -> Floats:
    """What a person's trend and the noise of single trials add."""
    each = (*orders.shape[:2], 1)
    noise_sd = NOISE_SD * np.exp(rng.normal(0, NOISE_SPREAD, each))
    trends = rng.normal(TREND, TREND_SD, each)
    added: Floats = trends * (orders - 0.5) + noise_sd * rng.standard_normal(orders.shape)
    return added


def _heaped(rng: np.random.Generator, ratings: Floats) -> Floats:
    """60 % of people round to 5, 25 % to 10."""
    habits = rng.choice([5.0, 10.0, STEP], p=[0.6, 0.25, 0.15], size=(*ratings.shape[:2], 1))
    return np.asarray(np.round(ratings / habits) * habits)


def _rated(line: str, ratings: _Ratings) -> Situation:
    return Situation(RATING_KIND, line, ratings)


_NORMAL = _normal(AT_BOUND, EFFECT_SD)
_NONE = _normal(0.0, 0.0)

RATING_SITUATIONS: Mapping[str, Situation] = {
    "normal": _rated("mean at the bound, SD 4 between people", _Ratings(_NORMAL)),
    "20 % random people": _rated(
        "at the bound; a fifth of people rate uniformly at random, anchors too",
        _Ratings(_NORMAL, careless=ONE_IN_FIVE),
    ),
    "20 % at a favourite place": _rated(
        "at the bound; a fifth of people rate all, anchors too, near a place of their own",
        _Ratings(_NORMAL, careless=ONE_IN_FIVE, at_place=True),
    ),
    "10 % lapsed trials": _rated(
        "at the bound; a tenth of everybody's trials are rated uniformly at random",
        _Ratings(_NORMAL, lapses=LAPSES),
    ),
    "base 85": _rated("at the bound; the reference at 85", _Ratings(_NORMAL, base=85.0)),
    "base 90": _rated("at the bound; the reference at 90", _Ratings(_NORMAL, base=90.0)),
    "base 90, other lower": _rated(
        "at the lower bound; the reference at 90",
        _Ratings(_normal(-AT_BOUND, EFFECT_SD), base=90.0),
    ),
    "heaping": _rated(
        "at the bound; 60 % of people round to 5, 25 % to 10", _Ratings(_NORMAL, heaping=True)
    ),
    "nothing planted, SD 2": _rated("mean 0, SD 2 between people", _Ratings(_normal(0.0, 2.0))),
    "nothing planted, SD 4": _rated("mean 0, SD 4 between people", _Ratings(_normal(0.0, 4.0))),
    "nothing planted, SD 6": _rated("mean 0, SD 6 between people", _Ratings(_normal(0.0, 6.0))),
    "nobody": _rated("no effect in anybody", _Ratings(_NONE)),
    "split ± 10": _rated(
        "+10 or −10 in each person, with equal chance", _Ratings(_some(0.5, 10.0, others=-10.0))
    ),
    "1 person in 4": _rated("+20 in a quarter of people", _Ratings(_some(0.25, 20.0))),
    "1 person in 4 by 10": _rated("+10 in a quarter of people", _Ratings(_some(0.25, 10.0))),
    "1 person in 10": _rated("+20 in a tenth of people", _Ratings(_some(0.1, 20.0))),
    "everybody at a favourite place, no anchors": _rated(
        "nobody attends: each rates near a place of their own",
        _Ratings(_NONE, careless=1.0, at_place=True, anchors=0),
    ),
    "everybody at random, no anchors": _rated(
        "nobody attends: ratings are uniform", _Ratings(_NONE, careless=1.0, anchors=0)
    ),
    "everybody at a favourite place, with anchors": _rated(
        "nobody attends: each rates near a place of their own, anchors too",
        _Ratings(_NONE, careless=1.0, at_place=True),
    ),
    "everybody at random, with anchors": _rated(
        "nobody attends: ratings are uniform, anchors too", _Ratings(_NONE, careless=1.0)
    ),
    "skewed": _rated(
        "at the bound; exponential effects, SD 5 between people", _Ratings(_skewed(AT_BOUND, 5.0))
    ),
    "heavy tails": _rated(
        "at the bound; effects of Student's t with 3 degrees of freedom, SD 5 between people",
        _Ratings(_heavy_tails(AT_BOUND, 5.0)),
    ),
}
