"""Simulated ratings of people whose effects are known.

Latent ratings with a person's level, trend and noise are ended at 0 and 100 and stored in steps
of the slider; some people do not attend, or round. Nothing here is taken from the model under test.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import nan, sqrt

import numpy as np

from tactileq.benches.validation.people.drawn import (
    N_TEXTURES,
    POINTS,
    DrawnStudies,
    Shape,
    World,
    on_days,
    on_slider,
    shuffled,
)
from tactileq.modeling.arrays import Floats

PERSON_SD, TEXTURE_SD, CELL_SD = 8.0, 6.0, 4.0  # of people, textures and people × textures
NOISE_SD, NOISE_SPREAD = 9.0, 0.2  # of trials: median over people, and SD of its logarithm
TREND, TREND_SD = 1.0, 2.0  # points from the first to the last trial, and SD between people
ANCHORS, ANCHOR, ANCHOR_SD = 2, 20.0, 6.0  # how many, mean latent rating, SD between people
PLACE_SD = 5.0  # of ratings at a favourite place
STEP = 0.01  # of the slider
AT_BOUND = POINTS[1]
Spread = Callable[[np.random.Generator, Shape], Floats]  # of people's effects about their mean


def _normal(rng: np.random.Generator, shape: Shape) -> Floats:
    return rng.standard_normal(shape)


def _exponential(rng: np.random.Generator, shape: Shape) -> Floats:
    return rng.exponential(1.0, shape) - 1.0


def _heavy_tails(rng: np.random.Generator, shape: Shape) -> Floats:
    """Student's t with 3 degrees of freedom, whose SD is √3."""
    return rng.standard_t(3, shape) / sqrt(3)


@dataclass(frozen=True, kw_only=True)
class _Ratings:
    """People who rate each texture with each model some times, and anchors.

    Parameters
    ----------
    mean, sd : float
        Of people's effects.
    spread : callable
        Their distribution, of mean 0 and SD 1.
    only : bool
        The mean effect is that of one texture, sevenfold; the others have none.
    base : float
        Mean latent rating of the reference.
    deviation_sd : float
        SD of the deviations of people's effects on single textures.
    gain_sd : float
        SD of the logarithm of the gain of people's effects.
    careless : float
        Share of people who do not attend.
    at_place : bool
        Who does not attend rates near a place of their own, not all over the scale.
    to_ends : float
        Share of ratings above 85 or below 15 that end up at the end.
    first : int
        Of 20 people, who has the reference on the first of two days; −1 with a single session.
    """

    mean: float = 0.0
    sd: float = 4.0
    spread: Spread = _normal
    only: bool = False
    base: float = 60.0
    repeats: int = 1
    deviation_sd: float = 0.0
    gain_sd: float = 0.0
    careless: float = 0.0
    at_place: bool = False
    heaping: bool = False
    to_ends: float = 0.0
    first: int = -1
    day: float = 0.0
    day_sd: float = 0.0

    def __call__(self, rng: np.random.Generator, shape: Shape) -> DrawnStudies:
        cells = (*shape, N_TEXTURES, 2, self.repeats)
        own = N_TEXTURES * 2 * self.repeats
        trials = own + ANCHORS
        orders = shuffled(rng, (*shape, trials)) / (trials - 1)  # of both days together
        days = np.zeros((shape[1], 2), dtype=np.intp)
        if self.first >= 0:
            days = on_days(shape[1], first=self.first)
        ratings = self._felt(rng, shape, days)
        ratings += _trends_and_noise(rng, orders)
        careless = rng.random(shape) < self.careless
        ratings[careless] = self._unfelt(rng, ratings.shape)[careless]
        kept = on_slider(self._moved(rng, ratings))
        planted = np.full(N_TEXTURES, self.mean)
        if self.only:
            planted = self.mean * N_TEXTURES * (np.arange(N_TEXTURES) == 3)
        plain = self.spread is _normal and not (self.gain_sd or self.only or self.deviation_sd)
        return DrawnStudies(
            values=kept[..., :own].reshape(cells),
            days=np.broadcast_to(days[:, None, :, None], cells[1:]),
            orders=orders[..., :own].reshape(cells),
            anchors=kept[..., own:],
            planted=planted,
            attends=~careless,
            people_sd=self.sd if plain and not self.day_sd else nan,
        )

    def _felt(self, rng: np.random.Generator, shape: Shape, days: np.ndarray) -> Floats:
        """Latent ratings (k, n, trials): textures by models by repeats, then anchors."""
        k, n = shape
        person = rng.normal(0, PERSON_SD, (k, n, 1))
        level = self.base + person + rng.normal(0, TEXTURE_SD, (k, 1, N_TEXTURES))
        level = level + rng.normal(0, CELL_SD, (k, n, N_TEXTURES))
        effects = (self.mean + self.sd * self.spread(rng, shape))[..., None]
        if self.gain_sd:
            effects = effects * np.exp(rng.normal(-(self.gain_sd**2) / 2, self.gain_sd, (k, n, 1)))
        only = N_TEXTURES * (np.arange(N_TEXTURES) == 3)
        on_textures = effects * np.where(self.only, only, 1.0)
        on_textures = on_textures + rng.normal(0, self.deviation_sd, (k, n, N_TEXTURES))
        pairs = level[..., None] + on_textures[..., None] * np.array([0.0, 1.0])
        of_days = (days - 0.5) * self.day + rng.normal(0, self.day_sd, (k, n, 2))
        pairs = np.repeat((pairs + of_days[:, :, None])[..., None], self.repeats, axis=-1)
        anchors = ANCHOR + person / 2 + rng.normal(0, ANCHOR_SD, (k, n, ANCHORS))
        return np.concatenate([pairs.reshape(k, n, -1), anchors], axis=-1)

    def _unfelt(self, rng: np.random.Generator, shape: tuple[int, ...]) -> Floats:
        if not self.at_place:
            return rng.uniform(0, 100, shape)
        return rng.uniform(0, 100, (*shape[:2], 1)) + rng.normal(0, PLACE_SD, shape)

    def _moved(self, rng: np.random.Generator, ratings: Floats) -> Floats:
        """Rounded to 5 by 60 % of people and to 10 by 25 %; drawn to the ends."""
        if self.heaping:
            steps = [5.0, 10.0, STEP]
            habits = rng.choice(steps, p=[0.6, 0.25, 0.15], size=(*ratings.shape[:2], 1))
            ratings = np.round(ratings / habits) * habits
        drawn = (np.abs(ratings - 50) > 35) & (rng.random(ratings.shape) < self.to_ends)
        return np.where(drawn, np.where(ratings > 50, 100.0, 0.0), ratings)


def _trends_and_noise(rng: np.random.Generator, orders: Floats) -> Floats:
    """What a person's trend and the noise of single trials add."""
    each = (*orders.shape[:2], 1)
    noise_sd = NOISE_SD * np.exp(rng.normal(0, NOISE_SPREAD, each))
    trends = rng.normal(TREND, TREND_SD, each)
    added: Floats = trends * (orders - 0.5) + noise_sd * rng.standard_normal(orders.shape)
    return added


_LINES: Mapping[str, tuple[str, _Ratings]] = {
    "none, SD 2": ("no mean effect, SD 2 between people", _Ratings(sd=2.0)),
    "none, SD 6": ("no mean effect, SD 6 between people", _Ratings(sd=6.0)),
    "none, deviations 10": (
        "no effect but of people on single textures, with an SD of 10; a single rating",
        _Ratings(sd=0.0, deviation_sd=10.0),
    ),
    "none, deviations 10, 3 repeats": (
        "the same with 3 repeats",
        _Ratings(sd=0.0, deviation_sd=10.0, repeats=3),
    ),
    "none, deviations 10, 5 repeats": (
        "the same with 5 repeats",
        _Ratings(sd=0.0, deviation_sd=10.0, repeats=5),
    ),
    "twice the bound": ("mean of 15 points, SD 4 between people", _Ratings(mean=2 * AT_BOUND)),
    "one texture": (
        "15 points on one texture, none on the others",
        _Ratings(mean=15 / 7, sd=0.5, only=True),
    ),
    "at the bound": ("mean at the bound, SD 4 between people", _Ratings(mean=AT_BOUND)),
    "at the bound, deviations 10, 3 repeats": (
        "at the bound; effects on single textures deviate with an SD of 10",
        _Ratings(mean=AT_BOUND, deviation_sd=10.0, repeats=3),
    ),
    "20 % random people": (
        "at the bound; a fifth of people rate uniformly at random, anchors too",
        _Ratings(mean=AT_BOUND, careless=0.2),
    ),
    "30 % at a favourite place": (
        "at the bound; 30 % of people rate all, anchors too, near a place of their own",
        _Ratings(mean=AT_BOUND, careless=0.3, at_place=True),
    ),
    "base 95": ("at the lower bound; the reference at 95", _Ratings(mean=-AT_BOUND, base=95.0)),
    "heaping": ("at the bound; most round to 5 or 10", _Ratings(mean=AT_BOUND, heaping=True)),
    "heavy tails": (
        "at the bound; effects of Student's t with 3 degrees of freedom, SD 5",
        _Ratings(mean=AT_BOUND, sd=5.0, spread=_heavy_tails),
    ),
    "exponential": (
        "at the bound; exponential effects, SD 5",
        _Ratings(mean=AT_BOUND, sd=5.0, spread=_exponential),
    ),
    "gains": (
        "at the bound; people's gains differ, SD of the logarithm 0.4",
        _Ratings(mean=AT_BOUND, gain_sd=0.4),
    ),
    "snapping": (
        "at the bound, the reference at 75; half of the ratings beyond 15 and 85 go to the end",
        _Ratings(mean=AT_BOUND, base=75.0, to_ends=0.5),
    ),
    "by day, none": (
        "no effect; models on two days, equal groups, 5 points more on the second, SD 6 of days",
        _Ratings(sd=2.0, first=10, day=5.0, day_sd=6.0),
    ),
    "by day, at the bound": (
        "the same at the bound",
        _Ratings(mean=AT_BOUND, sd=2.0, first=10, day=5.0, day_sd=6.0),
    ),
    "by day, 13 and 7": (
        "at the lower bound; 13 of 20 begin with the reference, 6 points more on the second day",
        _Ratings(mean=-AT_BOUND, sd=2.0, first=13, day=6.0, day_sd=6.0),
    ),
}
RATER_WORLDS: Mapping[str, World] = {
    name: World(line=line, draw=ratings) for name, (line, ratings) in _LINES.items()
}
