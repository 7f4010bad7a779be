"""Whether people differ, and how many: an analysis of variance, single t-tests, binomial tests."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
import statsmodels.api as sm
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy import stats
from statsmodels.formula.api import ols

from tactileq.analysis.statistics.equivalence import ALPHA
from tactileq.analysis.statistics.people import (
    MOST_REPEATS,
    POWER,
    beyond_bounds_by_ratings,
    beyond_share,
    counted_people,
    people_test,
    repeats_for_ratings,
    repeats_for_shares,
)
from tactileq.modeling.arrays import Floats

BOUNDS = (-7.5, 7.5)
UNEVEN = (-4.0, 9.0)


def rng(seed: int = 3) -> np.random.Generator:
    return np.random.default_rng(seed)


def rejected_as_often_as(p: Floats, level: float) -> bool:
    """Whether so many p values are below .05 as of a test of this level."""
    return bool(stats.binomtest(int((p < ALPHA).sum()), p.size, level).pvalue > 1e-3)


# --- Whether people differ --------------------------------------------------------------------


@given(st.integers(2, 8), st.integers(2, 6), st.integers(0, 1000))
def test_people_are_compared_by_a_two_way_analysis_of_variance(
    n: int, textures: int, seed: int
) -> None:
    d = rng(seed).normal(0, 5, (n, textures)) + rng(seed + 1).normal(0, 4, (n, 1))
    found = people_test(np.vstack([d, [np.nan] * textures, [np.nan, *[90.0] * (textures - 1)]]))
    person, texture = np.indices(d.shape)
    table = pd.DataFrame({"d": d.ravel(), "who": person.ravel(), "what": texture.ravel()})
    known = sm.stats.anova_lm(ols("d ~ C(who) + C(what)", table).fit())
    assert_allclose([found.f, found.p], known.loc["C(who)", ["F", "PR(>F)"]].astype(float))
    assert [found.df_people, found.df_rest] == known.loc[["C(who)", "Residual"], "df"].tolist()


def test_equal_people_are_told_apart_in_one_study_of_twenty() -> None:
    """Whatever the textures do to all of them, and however people deviate on single textures."""
    d = rng().normal(0, 11, (800, 12, 7)) + rng(4).normal(0, 20, (800, 1, 7))
    assert rejected_as_often_as(np.array([people_test(one).p for one in d]), ALPHA)
    unequal = d + rng(5).normal(0, 11, (800, 12, 1))
    assert np.mean([people_test(one).p < ALPHA for one in unequal[:100]]) > 0.95


@pytest.mark.parametrize(
    "differences",
    [
        np.empty((0, 7)),
        np.ones((1, 7)),
        np.array([[1.0], [5.0], [2.0]]),
        np.array([[1.0, 2.0], [3.0, np.nan], [np.nan, 1.0]]),
        np.arange(4.0)[:, None] + np.arange(3.0),
    ],
    ids=["nobody", "one person", "one texture", "one complete person", "no variation within"],
)
def test_nothing_is_tested_without_people_textures_or_variation(differences: Floats) -> None:
    found = people_test(differences)
    assert np.isnan([found.f, found.p]).all()
    assert min(found.df_people, found.df_rest) >= 0


# --- Who is beyond the bounds, by ratings -----------------------------------------------------


def rated(effects: Floats, *, textures: int = 4, repeats: int = 3, seed: int = 1) -> Floats:
    """Ratings of people with these effects whose repeats scatter by 9 points.

    Textures have levels and effects of their own, without a mean.
    """
    own = rng(seed + 1).normal(0, 10, (effects.size, textures, 2, 1))
    effect = own[:, :, 1] - own[:, :, 0]
    own[:, :, 1] -= effect.mean(axis=1, keepdims=True)
    values = 50 + own + rng(seed).normal(0, 9, (effects.size, textures, 2, repeats))
    values[:, :, 1] += effects[:, None, None]
    return np.asarray(values)


def by_hand(ratings: Floats, bounds: tuple[float, float]) -> float:
    """One person's p, cell by cell."""
    squares, df, weight, effect = 0.0, 0, 0.0, 0.0
    for of_texture in ratings:
        for sign, cell in zip((-1, 1), of_texture, strict=True):
            known = cell[~np.isnan(cell)]
            squares += known.var() * known.size
            df += known.size - 1
            weight += 1 / known.size
            effect += sign * known.mean()
    error = np.sqrt(squares / df * weight) / len(ratings)
    middle, half = np.mean(bounds), (bounds[1] - bounds[0]) / 2
    away = abs(effect / len(ratings) - middle)
    return float(stats.t.sf((away - half) / error, df) + stats.t.sf((away + half) / error, df))


@pytest.mark.parametrize("bounds", [BOUNDS, UNEVEN])
def test_p_of_a_person_by_hand(bounds: tuple[float, float]) -> None:
    whole = rated(np.array([-30.0, -8.0, -3.0, 2.5, 8.0, 12.0, 25.0]))
    ragged = whole.copy()
    ragged[:, 1, 0, 2] = ragged[2:, 3, 1, :2] = ragged[:, 0, 1, 1] = np.nan
    for values in (whole, ragged):
        known = [min(by_hand(one, bounds), 1.0) for one in values]
        assert_allclose(beyond_bounds_by_ratings(values, bounds), known)
    balanced = whole[5].mean(axis=-1)
    error = np.sqrt(whole[5].var(axis=-1, ddof=1).mean() * 2 / 12)
    t = (np.diff(balanced).mean() - bounds[1]) / error
    p = beyond_bounds_by_ratings(whole, bounds)[5]
    assert p == pytest.approx(stats.t.sf(t, 16), abs=1e-4)  # the other bound is far


@pytest.mark.parametrize("bounds", [BOUNDS, UNEVEN, (-0.5, 0.5)])
@pytest.mark.parametrize("ragged", [False, True])
def test_who_is_at_a_bound_is_beyond_it_in_one_case_of_twenty(
    bounds: tuple[float, float], ragged: bool
) -> None:
    for bound in bounds:
        values = rated(np.full(3000, bound))
        if ragged:
            values[:, :2, 0, 1:] = np.nan
        assert rejected_as_often_as(beyond_bounds_by_ratings(values, bounds), ALPHA)


def test_the_farther_beyond_the_more_often_it_is_found() -> None:
    shares = [
        [
            (beyond_bounds_by_ratings(rated(np.full(1000, sign * one)), BOUNDS) < ALPHA).mean()
            for one in (0.0, 5.0, 7.5, 12.0, 18.0, 30.0)
        ]
        for sign in (-1, 1)
    ]
    assert (np.diff(shares) >= 0).all()
    assert np.max(shares, axis=0)[0] < 0.01
    assert np.min(shares, axis=0)[-1] > 0.99


def test_nothing_is_said_of_who_lacks_a_texture_or_has_no_repeat() -> None:
    values = rated(np.full(4, 30.0))
    values[1, 2, 0] = np.nan
    values[2, :, :, 1:] = np.nan
    values[3, :, :, 1:] = np.nan
    values[3, 0, 0, 1] = 50.0  # one repeat, one degree of freedom
    assert_array_equal(
        np.isnan(beyond_bounds_by_ratings(values, BOUNDS)), [False, True, True, False]
    )
    single = rated(np.full(5, 30.0), repeats=1)
    assert np.isnan(beyond_bounds_by_ratings(single, BOUNDS)).all()


def test_who_always_rates_alike_is_beyond_where_the_effect_is() -> None:
    values = np.full((3, 4, 2, 2), 50.0)
    values[1, :, 1] += 7.0
    values[2, :, 1] -= 8.0
    assert_allclose(beyond_bounds_by_ratings(values, BOUNDS), [1.0, 1.0, 0.0], atol=1e-6)


# --- Who is beyond the bounds, by right answers -----------------------------------------------


@given(st.integers(1, 60), st.floats(0.0, 1.0), st.floats(0.05, 0.95))
def test_right_answers_are_tested_by_the_binomial_test(
    asked: int, part: float, share: float
) -> None:
    right = round(part * asked)
    known = stats.binomtest(right, asked, share, alternative="greater").pvalue
    found = beyond_share(np.array([right, 0.0]), np.array([asked, 0.0]), share)
    assert_allclose(found, [known, 1.0], atol=1e-12)


@given(st.lists(st.floats(0.0, 0.2) | st.just(np.nan), max_size=9))
def test_people_are_counted_by_holms_steps(values: list[float]) -> None:
    known = sorted(value for value in values if not np.isnan(value))
    count = 0
    while count < len(known) and known[count] * (len(known) - count) < ALPHA:
        count += 1
    assert counted_people(np.array(values)) == (count, len(known))


# --- How many repeats it takes ----------------------------------------------------------------


@pytest.mark.parametrize(
    ("bounds", "people", "textures", "sd"), [(BOUNDS, 20, 7, 9.0), (UNEVEN, 8, 2, 4.0)]
)
def test_repeats_of_ratings_find_twice_the_bound_in_eight_of_ten_cases(
    bounds: tuple[float, float], people: int, textures: int, sd: float
) -> None:
    needed = repeats_for_ratings(bounds, people=people, textures=textures, rating_sd=sd)
    assert needed > 2
    nearer = min(bounds, key=abs)
    symmetric = (-abs(nearer), abs(nearer))
    for repeats, at_least in ((needed, True), (needed - 1, False)):
        values = rng().normal(50, sd, (8000, textures, 2, repeats))
        values[:, :, 1] += 2 * nearer
        found = int((beyond_bounds_by_ratings(values, symmetric) < ALPHA / people).sum())
        wrong = "less" if at_least else "greater"
        assert stats.binomtest(found, 8000, POWER, alternative=wrong).pvalue > 1e-3
    assert repeats_for_ratings(symmetric, people=people, textures=textures, rating_sd=sd) == needed


@pytest.mark.parametrize(
    ("bound", "chance", "people", "textures"), [(0.1, 1 / 3, 20, 7), (0.2, 0.5, 8, 3)]
)
def test_repeats_of_choices_find_twice_the_bound_in_eight_of_ten_cases(
    bound: float, chance: float, people: int, textures: int
) -> None:
    size = {"people": people, "textures": textures}
    needed = repeats_for_shares((-bound, bound), chance=chance, **size)
    for repeats, at_least in ((needed, True), (needed - 1, False)):
        asked = textures * repeats
        right = rng().binomial(asked, chance + 2 * bound, 20_000)
        p = beyond_share(right, np.full(20_000, asked), chance + bound)
        found = int((p < ALPHA / people).sum())
        wrong = "less" if at_least else "greater"
        assert stats.binomtest(found, 20_000, POWER, alternative=wrong).pvalue > 1e-3


@given(st.floats(2.0, 15.0), st.floats(1.0, 2.0), st.integers(2, 40), st.integers(1, 9))
def test_wider_bounds_and_more_textures_need_fewer_repeats_and_more_people_more(
    bound: float, wider: float, people: int, textures: int
) -> None:
    def needed(bound: float, people: int, textures: int) -> int:
        size = {"people": people, "textures": textures}
        return repeats_for_ratings((-bound, bound), rating_sd=9.0, **size)

    one = needed(bound, people, textures)
    assert needed(bound * wider, people, textures) <= one
    assert needed(bound, people, textures + 1) <= one <= needed(bound, people + 5, textures)
    assert one >= 2


def test_wider_bounds_of_shares_need_fewer_repeats() -> None:
    bounds = np.array([0.02, 0.05, 0.1, 0.2, 0.3])
    needed = [
        repeats_for_shares((-one, one), chance=1 / 3, people=20, textures=7) for one in bounds
    ]
    assert (np.diff(needed) < 0).all()


def test_bounds_that_no_number_of_repeats_can_tell() -> None:
    size = {"people": 20, "textures": 7}
    assert repeats_for_ratings((-0.1, 0.1), rating_sd=9.0, **size) == MOST_REPEATS
    assert repeats_for_shares((-0.001, 0.001), chance=1 / 3, **size) == MOST_REPEATS
    assert repeats_for_shares((-0.5, 0.5), chance=0.5, **size) == MOST_REPEATS  # beyond is nothing


def test_people_differ_apart_from_what_a_day_adds_to_all() -> None:
    """Nobody differs; half of the people gain six points from day to day, the others lose them."""
    rng = np.random.default_rng(12)
    order = np.where(np.arange(20) < 10, -1.0, 1.0)
    shown = {"plain": 0, "apart": 0}
    studies = 400
    for _ in range(studies):
        differences = 6.0 * order[:, None] + rng.normal(0.0, 9.0, (20, 7))
        apart = people_test(differences, order[:, None])
        assert (apart.df_people, apart.df_rest) == (18, 114)
        shown["apart"] += apart.p < 0.05
        shown["plain"] += people_test(differences).p < 0.05
    assert shown["plain"] > 0.9 * studies
    low, high = stats.binomtest(shown["apart"], studies).proportion_ci(0.999)
    assert low < 0.05 < high
