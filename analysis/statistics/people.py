"""Whether people differ, and how many of them feel a difference, where a design can tell.

docs/method/statistics.md#people
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from tactileq.analysis.statistics.crossover import mean_differences
from tactileq.analysis.statistics.equivalence import ALPHA, Bounds
from tactileq.analysis.statistics.paired import holm
from tactileq.modeling.arrays import Bools, Floats, Integers

POWER = 0.8  # to find a person whose effect is twice the bound
MOST_REPEATS = 1000


@dataclass(frozen=True, kw_only=True)
class PeopleCount:
    """How many participants differ by more than the bounds, if a design can tell.

    Parameters
    ----------
    repeats, needed : int
        Answers to each texture with each model; the fewest that find somebody whose effect is twice
        the bound.
    by_day : bool
        Whether the models were on different days, so that nobody can tell people from days.
    beyond, people : int
        Participants beyond the bounds after Holm's correction, of how many; 0 where nothing is
        told.
    """

    repeats: int
    needed: int
    by_day: bool = False
    beyond: int = 0
    people: int = 0


@dataclass(frozen=True, kw_only=True)
class FTest:
    """People against person × texture, of differences between two models (two-way, one value each).

    Parameters
    ----------
    f, p : float
        NaN where there are fewer than two people or textures, or no variation within people.
    df_people, df_rest : int
    """

    f: float
    df_people: int
    df_rest: int
    p: float


def people_test(differences: Floats, contrasts: Floats | None = None) -> FTest:
    """Whether people's mean differences differ by more than their differences on single textures.

    Parameters
    ----------
    differences : (n, T) ndarray
        Other − reference of each person on each texture; people with a NaN are left out.
    contrasts : (n, c) ndarray, optional
        Days, apart from which people differ (`crossover.day_contrasts`).
    """
    known = np.isfinite(differences).all(axis=1)
    complete = differences[known]
    n, textures = complete.shape
    days = None if contrasts is None else contrasts[known]
    means = mean_differences(complete.mean(axis=1)[None, :], days)
    df_people, df_rest = max(means.df, 0), max(n - 1, 0) * max(textures - 1, 0)
    nothing = FTest(f=float("nan"), df_people=df_people, df_rest=df_rest, p=float("nan"))
    if not (df_rest and df_people) or means.confounded:
        return nothing
    of_people = complete.mean(axis=1, keepdims=True)
    rest = complete - of_people - complete.mean(axis=0) + complete.mean()
    within = float((rest**2).sum()) / df_rest
    if within < 1e-18:
        return nothing
    f = textures * means.size * float(means.error[0]) ** 2 / within
    p = float(stats.f.sf(f, df_people, df_rest))
    return FTest(f=f, df_people=df_people, df_rest=df_rest, p=p)


def beyond_bounds_by_ratings(ratings: Floats, bounds: Bounds) -> Floats:
    """(n,) p of each person's effect lying inside the bounds, by their own repeats alone.

    A t-test of the mean over textures, with the scatter of repeats of one texture and model.

    Parameters
    ----------
    ratings : (n, T, 2, R) ndarray
        The reference first; NaN where nothing was rated. Who lacks a texture with a model, or has
        no repeat, has a p of NaN.
    bounds : (float, float)
    """
    given = np.isfinite(ratings)
    count = given.sum(axis=-1)
    means = np.where(given, ratings, 0.0).sum(axis=-1) / np.maximum(count, 1)
    squares = np.where(given, (ratings - means[..., None]) ** 2, 0.0).sum(axis=(1, 2, 3))
    df = (count - 1).sum(axis=(1, 2))
    effects = (means[..., 1] - means[..., 0]).mean(axis=1)
    known: Bools = (count > 0).all(axis=(1, 2)) & (df > 0)
    variance = squares / np.maximum(df, 1)
    weight = (1 / np.maximum(count, 1)).sum(axis=(1, 2)) / ratings.shape[1] ** 2
    error = np.sqrt(np.maximum(variance * weight, 1e-18))
    outside = np.maximum(effects - bounds[1], bounds[0] - effects) / error
    # Where the effect lies at a bound, an estimate beyond the other one counts as well.
    farther = outside + (bounds[1] - bounds[0]) / error
    df = np.maximum(df, 1)
    p = np.asarray(stats.t.sf(outside, df) + stats.t.sf(farther, df))
    return np.where(known, np.minimum(p, 1.0), np.nan)


def beyond_share(right: Floats, asked: Floats, share: float) -> Floats:
    """(n,) exact binomial p of being right in no more than this share of trials.

    Parameters
    ----------
    right, asked : (n,) ndarray
        Right answers, of how many; whoever was asked nothing has a p of 1.
    """
    return np.asarray(stats.binom.sf(right - 1, asked, share))


def counted_people(p: Floats) -> tuple[int, int]:
    """How many people are beyond, by Holm's correction over those whose p is known; of how many."""
    return int((holm(p) < ALPHA).sum()), int(np.isfinite(p).sum())


def repeats_for_ratings(bounds: Bounds, *, people: int, textures: int, rating_sd: float) -> int:
    """Repeats of each texture and model that find a person whose effect is twice the bound.

    With a probability of 0.8 at the level of Holm's first step, by the noncentral t.

    Parameters
    ----------
    rating_sd : float
        SD of a person's ratings of one surface, in points.

    Returns
    -------
    int
        ≥ 2; `MOST_REPEATS` where that many do not suffice.
    """
    bound = min(abs(one) for one in bounds)
    repeats = np.arange(2, MOST_REPEATS, dtype=np.intp)
    df = 2 * textures * (repeats - 1)
    shift = bound / (rating_sd * np.sqrt(2 / (textures * repeats)))
    power = stats.nct.sf(stats.t.isf(ALPHA / people, df), df, shift)
    return _first(repeats, power)


def repeats_for_shares(bounds: Bounds, *, chance: float, people: int, textures: int) -> int:
    """The same of right answers to trials that hold both models, by the binomial distribution."""
    within, felt = chance + bounds[1], min(chance + 2 * bounds[1], 1.0)
    repeats = np.arange(1, MOST_REPEATS, dtype=np.intp)
    trials = textures * repeats
    needed = stats.binom.isf(ALPHA / people, trials, within)  # fewer are no evidence
    return _first(repeats, stats.binom.sf(needed, trials, felt))


def _first(repeats: Integers, power: ArrayLike) -> int:
    power = np.asarray(power)
    enough = repeats[power >= POWER]
    return int(enough[0]) if len(enough) else MOST_REPEATS
