"""Simulated answers, right or wrong, of people whose effects are known: oddity and forced choice.

Both follow Thurstone: normal percepts, of which the odd or the strongest one is chosen. Shares of
right answers that are planted are those of attended trials, over all textures, positions and days.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from math import log, nan, pi, sqrt
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from tactileq.benches.validation.people.drawn import (
    BOUNDS,
    CHOICE_KIND,
    N_TEXTURES,
    ODDITY_KIND,
    DrawnStudies,
    Shape,
    Situation,
    counterbalanced,
    guessed,
    normal_quantiles,
    shuffled,
)
from tactileq.modeling.arrays import Floats

CHANCE_OF_THREE, CHANCE_OF_SEVEN = 1 / 3, 1 / N_TEXTURES
CARELESS, LAPSES = 0.2, 0.1  # shares of people, and of trials

ODDITY_REPEATS, CATCHES, CAUGHT = 6, 6, 0.97  # per texture; catch trials; share right in these
DIFFICULTY = np.array([1.4, 0.7, 1.1, 0.6, 1.3, 0.9, 1.0])  # factors of d′ by texture
ODDITY_LEARNING = 0.2  # share of d′ gained from the first to the last trial
ABILITY_SPREAD = 0.4  # SD of log d′ between people
OBVIOUS = 0.95  # share right of those who feel a plain difference
SLIGHT = 0.42  # of those who feel a little

CHOICE_REPEATS = 3
# How much of a texture's evidence the others get, by distance in a row of textures.
SIMILARITY = 0.5 ** np.abs(np.subtract.outer(np.arange(N_TEXTURES), np.arange(N_TEXTURES)))
CHOICE_LEARNING = 0.1  # share of d′ gained within a day, and from one day to the next
CHOICE_SPREAD, CHANGE_SPREAD = 0.25, 0.12  # SD of log d′ and of its change between people
BASE, HIGH_BASE = 0.6, 0.92  # mean share right with the reference
SPLIT, SPLIT_LOW, SPLIT_HIGH = 0.25, 0.42, 0.70  # ± share; range of the reference's share


def triangular_share(d_prime: Floats) -> Floats:
    """Share of right answers of the triangular decision; any shape.

    Notes
    -----
    Of three percepts the one farthest from the mean of the other two is called odd (Ennis, 1993):
    2 ∫₀^∞ [Φ(−z√3 + d′√(2/3)) + Φ(−z√3 − d′√(2/3))] φ(z) dz.
    """
    from scipy.special import ndtr  # late: SciPy takes long to load

    nodes, weights = np.polynomial.legendre.leggauss(80)
    z = 4.5 * (nodes + 1)  # 0 … 9
    density = 4.5 * weights * np.exp(-(z**2) / 2) / sqrt(2 * pi)
    shift = np.asarray(d_prime)[..., None] * sqrt(2 / 3)
    inner = ndtr(-z * sqrt(3) + shift) + ndtr(-z * sqrt(3) - shift)
    return np.asarray(2 * (inner * density).sum(axis=-1))


def _oddity_factors(orders: Floats) -> Floats:
    """Factors of d′ at positions within the session."""
    return np.asarray(1 + ODDITY_LEARNING * (orders - 0.5))


@cache
def _oddity_table() -> tuple[Floats, Floats]:
    """d′ of a person, and their share of right answers over all textures and positions."""
    grid = np.linspace(0, 20, 801)
    positions = np.linspace(0, 1, N_TEXTURES * ODDITY_REPEATS + CATCHES)
    factors = np.outer(DIFFICULTY, _oddity_factors(positions)).ravel()
    single = triangular_share(grid)
    return grid, np.array([np.interp(one * factors, grid, single).mean() for one in grid])


@cache
def _spread_median(excess: float, spread: float) -> float:
    """Median d′ where the mean share of right answers exceeds chance by `excess`."""
    from scipy.optimize import brentq

    steps = np.exp(spread * normal_quantiles(4000))

    def error(median: float) -> float:
        return float(np.interp(median * steps, *_oddity_table()).mean()) - excess - CHANCE_OF_THREE

    return float(brentq(error, 0.0, 6.0))


@dataclass(frozen=True)
class _Oddity:
    """People who say which of three differs, six times for each texture, and in catch trials."""

    excess: float  # mean share right beyond chance, of those who feel it
    feeling: float = 1.0  # share of people who feel it; the others are at chance
    spread: float = 0.0  # SD of log d′ among those who feel it
    stipulated: bool = False  # the share itself rather than the triangular decision
    careless: float = 0.0
    lapses: float = 0.0

    def __call__(self, rng: np.random.Generator, shape: Shape) -> DrawnStudies:
        cells = (*shape, N_TEXTURES, 1, ODDITY_REPEATS)
        own = N_TEXTURES * ODDITY_REPEATS
        positions = shuffled(rng, (*shape, own + CATCHES))[..., :own]
        orders = (positions / (own + CATCHES - 1)).reshape(cells)
        feel = rng.random(shape) < self.feeling
        d_prime = np.where(feel, self._abilities(rng, shape), 0.0)
        right = _triangular(rng, self._by_trial(d_prime, orders))
        effects = np.interp(d_prime, *_oddity_table()) - CHANCE_OF_THREE
        if self.stipulated:
            plain = rng.random(cells) < self.excess + CHANCE_OF_THREE
            right = np.where(feel[..., None, None, None], plain, right)
            effects = np.where(feel, self.excess, 0.0)
        caught = rng.random((*shape, CATCHES)) < CAUGHT
        careless = rng.random(shape) < self.careless
        unsure = careless[..., None], self.lapses, CHANCE_OF_THREE
        return DrawnStudies(
            values=guessed(rng, right.reshape(*shape, own), unsure).reshape(cells),
            checks=guessed(rng, caught, unsure),
            days=np.zeros(cells, dtype=np.intp),
            orders=orders,
            effects=np.where(careless, nan, effects),
            mean=self.feeling * self.excess,
            outside=self.feeling * self._outside(),
        )

    def _abilities(self, rng: np.random.Generator, shape: Shape) -> Floats:
        if self.stipulated or self.excess == 0:
            return np.zeros(shape)
        median = _spread_median(self.excess, self.spread)
        return np.asarray(median * np.exp(rng.normal(0, self.spread, shape)))

    def _by_trial(self, d_prime: Floats, orders: Floats) -> Floats:
        by_texture = d_prime[..., None, None, None] * DIFFICULTY[:, None, None]
        return np.asarray(by_texture * _oddity_factors(orders))

    def _outside(self) -> float:
        """Share of those who feel it; d′ is log-normal, and the share of right grows with it."""
        bound = BOUNDS[ODDITY_KIND][1]
        if self.spread == 0:
            return float(self.excess > bound)
        grid, shares = _oddity_table()
        at_bound = float(np.interp(bound + CHANCE_OF_THREE, shares, grid))
        median = _spread_median(self.excess, self.spread)
        return 1 - NormalDist(log(median), self.spread).cdf(log(at_bound))


def _triangular(rng: np.random.Generator, d_prime: Floats) -> NDArray[np.bool_]:
    """Whether the odd percept, the first of three, is farthest from the mean of the others."""
    percepts = rng.standard_normal((*d_prime.shape, 3))
    percepts[..., 0] += d_prime
    far = np.abs(percepts - percepts.mean(axis=-1, keepdims=True))
    return np.asarray(far.argmax(axis=-1) == 0)


def _choice_factors(orders: Floats, days: Floats | NDArray[np.intp]) -> Floats:
    """Factors of d′ at positions within a day and on days 0 and 1."""
    within = 1 + CHOICE_LEARNING * (orders - 0.5)
    return np.asarray(within * (1 + CHOICE_LEARNING * (days - 0.5)))


def strongest_shares(d_prime: Floats) -> Floats:
    """Share of trials in which a texture's own evidence is the strongest of seven.

    Parameters
    ----------
    d_prime : ndarray, shape (N,)

    Returns
    -------
    ndarray, shape (N, 7)
        By texture: ∫ φ(x − d′) ∏ Φ(x − similarity · d′) dx over the other six.
    """
    from scipy.special import ndtr

    nodes, weights = np.polynomial.legendre.leggauss(80)
    x = 8 * nodes  # −8 … 8 around d′
    density = 8 * weights * np.exp(-(x**2) / 2) / sqrt(2 * pi)
    shares = np.empty((len(d_prime), N_TEXTURES))
    for texture in range(N_TEXTURES):
        others = np.delete(SIMILARITY[texture], texture)
        ahead = np.outer(d_prime, 1 - others)[..., None] + x
        shares[:, texture] = (ndtr(ahead).prod(axis=1) * density).sum(axis=-1)
    return shares


@cache
def _choice_table() -> tuple[Floats, Floats]:
    """d′ of a person, and their share of right answers over textures, positions and days."""
    grid = np.linspace(0, 40, 801)
    positions = np.linspace(0, 1, N_TEXTURES * CHOICE_REPEATS)
    factors = _choice_factors(positions[:, None], np.array([0.0, 1.0])).ravel()
    single = strongest_shares(grid).mean(axis=1)
    return grid, np.array([np.interp(one * factors, grid, single).mean() for one in grid])


def _choice_share(d_prime: Floats) -> Floats:
    return np.asarray(np.interp(d_prime, *_choice_table()))


def _choice_d_prime(share: Floats) -> Floats:
    grid, shares = _choice_table()
    return np.asarray(np.interp(share, shares, grid))


@cache
def _choice_people(base: float, effect: float) -> tuple[float, float, float]:
    """Median d′ with the reference, median factor of the other model, and the share outside.

    Found for a grid of 400 × 400 people, so that mean shares are `base` and `base + effect`.
    """
    from scipy.optimize import brentq

    people = normal_quantiles(400)
    ability = np.exp(CHOICE_SPREAD * people)
    change = np.exp(CHANGE_SPREAD * people)

    def misses(median: float, factor: float, share: float) -> float:
        return float(_choice_share(median * factor * np.outer(ability, change)).mean()) - share

    median = float(brentq(lambda one: _choice_share(one * ability).mean() - base, 0.1, 20.0))
    factor = float(brentq(lambda one: misses(median, one, base + effect), 0.1, 3.0))
    reference = median * ability[:, None]
    effects = _choice_share(reference * factor * change) - _choice_share(reference)
    low, high = BOUNDS[CHOICE_KIND]
    return median, factor, float(((effects < low) | (effects > high)).mean())


@dataclass(frozen=True)
class _Choices:
    """People who say which of seven textures it was, with one model on each of two days."""

    effect: float  # mean share right with the other model − with the reference
    base: float = BASE
    split: bool = False  # + and − `SPLIT` in each person, with equal chance
    careless: float = 0.0
    lapses: float = 0.0

    def __call__(self, rng: np.random.Generator, shape: Shape) -> DrawnStudies:
        trials = N_TEXTURES * CHOICE_REPEATS
        cells = (*shape, N_TEXTURES, 2, CHOICE_REPEATS)
        orders = np.empty(cells)
        for model in (0, 1):
            positions = shuffled(rng, (*shape, trials)) / (trials - 1)
            orders[..., model, :] = positions.reshape(*shape, N_TEXTURES, CHOICE_REPEATS)
        days = counterbalanced(cells)
        d_prime = self._abilities(rng, shape)
        shares = _choice_share(d_prime)
        felt = d_prime[:, :, None, :, None] * _choice_factors(orders, days)
        right = _strongest(rng, felt).reshape(*shape, 2 * trials)
        careless = rng.random(shape) < self.careless
        unsure = careless[..., None], self.lapses, CHANCE_OF_SEVEN
        return DrawnStudies(
            values=guessed(rng, right, unsure).reshape(cells),
            checks=np.empty((*shape, 0)),
            days=days,
            orders=orders,
            effects=np.where(careless, nan, shares[..., 1] - shares[..., 0]),
            mean=self.effect,
            outside=1.0 if self.split else _choice_people(self.base, self.effect)[2],
        )

    def _abilities(self, rng: np.random.Generator, shape: Shape) -> Floats:
        """d′ (k, n, 2) with the reference and with the other model."""
        if self.split:
            reference = rng.uniform(SPLIT_LOW, SPLIT_HIGH, shape)
            signs = np.where(rng.random(shape) < 0.5, 1.0, -1.0)
            return _choice_d_prime(np.stack([reference, reference + signs * SPLIT], axis=-1))
        median, factor, _ = _choice_people(self.base, self.effect)
        ability = median * np.exp(rng.normal(0, CHOICE_SPREAD, shape))
        change = factor * np.exp(rng.normal(0, CHANGE_SPREAD, shape))
        return np.stack([ability, ability * change], axis=-1)


def _strongest(rng: np.random.Generator, d_prime: Floats) -> NDArray[np.bool_]:
    """Whether each texture's own evidence is the strongest; texture by texture, for memory."""
    right = np.empty(d_prime.shape, dtype=bool)
    for texture, similar in enumerate(SIMILARITY):
        felt = d_prime[:, :, texture, ..., None]
        evidence = felt * similar + rng.standard_normal((*felt.shape[:-1], N_TEXTURES))
        right[:, :, texture] = evidence.argmax(axis=-1) == texture
    return right


def _odd(line: str, oddity: _Oddity) -> Situation:
    return Situation(ODDITY_KIND, line, oddity)


def _chosen(line: str, choices: _Choices) -> Situation:
    return Situation(CHOICE_KIND, line, choices)


_PLAIN, _LITTLE = OBVIOUS - CHANCE_OF_THREE, SLIGHT - CHANCE_OF_THREE
_ODD_BOUND, _LOST = BOUNDS[ODDITY_KIND][1], BOUNDS[CHOICE_KIND][0]

ODDITY_SITUATIONS: Mapping[str, Situation] = {
    "nobody feels it": _odd("everybody at chance", _Oddity(0.0)),
    "1 person in 10": _odd(
        "a tenth of people right in 95 % of trials, the others at chance",
        _Oddity(_PLAIN, feeling=0.1, stipulated=True),
    ),
    "1 person in 4": _odd(
        "a quarter of people right in 95 % of trials, the others at chance",
        _Oddity(_PLAIN, feeling=0.25, stipulated=True),
    ),
    "everybody a little": _odd("everybody right in 42 % of trials", _Oddity(_LITTLE)),
    "half a little": _odd(
        "half of people right in 42 % of trials, the others at chance",
        _Oddity(_LITTLE, feeling=0.5),
    ),
    "at the bound": _odd(
        "0.1 above chance on average, SD of log d′ 0.4 between people",
        _Oddity(_ODD_BOUND, spread=ABILITY_SPREAD),
    ),
    "20 % careless": _odd(
        "at the bound; a fifth of people guess, in catch trials too",
        _Oddity(_ODD_BOUND, spread=ABILITY_SPREAD, careless=CARELESS),
    ),
    "10 % lapsed trials": _odd(
        "at the bound; a tenth of everybody's trials are guessed, of catch trials too",
        _Oddity(_ODD_BOUND, spread=ABILITY_SPREAD, lapses=LAPSES),
    ),
}
CHOICE_SITUATIONS: Mapping[str, Situation] = {
    "at the bound": _chosen("0.1 less right on average, from 0.6", _Choices(_LOST)),
    "at the bound, 20 % careless": _chosen(
        "at the bound; a fifth of people guess", _Choices(_LOST, careless=CARELESS)
    ),
    "at the bound near the ceiling": _chosen(
        "0.1 less right on average, from 0.92", _Choices(_LOST, base=HIGH_BASE)
    ),
    "nothing planted": _chosen(
        "equally often right on average; people differ in their effects", _Choices(0.0)
    ),
    "split": _chosen(
        "0.25 more or less in each person, with equal chance", _Choices(0.0, split=True)
    ),
    "10 % lapsed": _chosen(
        "at the bound; a tenth of everybody's trials are guessed", _Choices(_LOST, lapses=LAPSES)
    ),
}
