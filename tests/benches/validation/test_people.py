"""Simulated people show what was planted in them: closed forms, and moments over thousands."""

from __future__ import annotations

from functools import cache
from math import exp, sqrt

import numpy as np
import pytest
from scipy import stats

from tactileq.benches.validation.people.choices import CHOICE_WORLDS
from tactileq.benches.validation.people.drawn import DrawnStudies, on_days
from tactileq.benches.validation.people.held_out import OTHER_WORLDS
from tactileq.benches.validation.people.ratings import RATER_WORLDS
from tactileq.modeling.arrays import Floats

ALL = {**RATER_WORLDS, **OTHER_WORLDS, **CHOICE_WORLDS}
STUDIES, PEOPLE = 100, 50
ERRORS = 4.0  # standard errors within which a mean is recovered
BY_DAY = [name for name in ALL if "day" in name or name in CHOICE_WORLDS]
NOISE = 2 * 9**2 * exp(2 * 0.2**2)  # variance of a difference of two trials, over people

# What the ends of the scale hide is in `test_the_upper_end_hides…`; "snapping" moves it anywhere.
AT_ENDS = {
    "twice the bound",
    "at the bound, deviations 10, 3 repeats",
    "base 95",
    "snapping",
}
# Mean of the simple difference of those who attend, where it is not the planted one.
SHOWN = {
    # A share of 0.4 stops, as the square of 1, 3 … 29 of 29 grows in 15 of 30 trials.
    "giving up": 7.5 * (1 - 0.4 * (15 * 29 * 31 / 3) / 29**2 / 30),
}
CARELESS = {
    "20 % random people": 0.2,
    "30 % at a favourite place": 0.3,
    "giving up": 0.1,
    "stopped short": 0.1,
    "remembered": 0.1,
}


@cache
def drawn(name: str) -> DrawnStudies:
    """5000 people of a world."""
    return ALL[name](np.random.default_rng(5), (STUDIES, PEOPLE))


def on_textures(name: str) -> Floats:
    """(k, n, 7) other − reference of each person on each texture."""
    means = drawn(name).values.mean(axis=-1)
    return np.asarray(means[..., 1] - means[..., 0])


def apart_from_days(differences: Floats, days: np.ndarray) -> list[Floats]:
    """The groups that had the other model last and first, apart; all of a single session."""
    last = days[:, 0, 1, 0] > days[:, 0, 0, 0]
    groups = [differences[:, last], differences[:, ~last]]
    return [group for group in groups if group.size]


def within_errors(sample: Floats, expected: float) -> bool:
    return abs(sample.mean() - expected) <= ERRORS * sample.std() / sqrt(sample.size) + 1e-9


def share_is(hits: np.ndarray, expected: float) -> bool:
    """Whether a count lies within the errors of a binomial with the expected share."""
    error = sqrt(expected * (1 - expected) / hits.size)
    return abs(hits.mean() - expected) <= ERRORS * error + 1e-9


# --- Layout -----------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ALL)
def test_batches_have_the_layout_of_their_world(name: str):
    batch, rated = drawn(name), ALL[name].rated
    cells = batch.values.shape
    assert cells[:4] == (STUDIES, PEOPLE, 7, 2)
    assert batch.orders.shape == cells
    assert batch.days.shape == cells[1:]
    assert batch.attends.shape == (STUDIES, PEOPLE)
    assert batch.anchors.shape == (STUDIES, PEOPLE, 2 if rated else 0)
    assert batch.planted.shape == (7,)
    assert rated == (name not in CHOICE_WORLDS)
    assert ALL[name].bounds == ((-7.5, 7.5) if rated else (-0.1, 0.1))
    if not rated:
        assert np.isin(batch.values, (0.0, 1.0)).all()
        return
    for answers in (batch.values, batch.anchors):
        assert ((answers >= 0) & (answers <= 100)).all()
        assert np.allclose(answers * 100, np.round(answers * 100), atol=1e-6)


@pytest.mark.parametrize("name", ALL)
def test_each_trial_has_a_place_of_its_own_in_its_session(name: str):
    batch = drawn(name)
    days = np.broadcast_to(batch.days, batch.values.shape)
    places = np.sort((2 * days + batch.orders).reshape(STUDIES, PEOPLE, -1), axis=-1)
    assert (np.diff(places, axis=-1) > 1e-6).all()
    assert (batch.orders.min(), batch.orders.max()) == (0.0, 1.0)
    assert within_errors(batch.orders[..., -1, -1, -1], 0.5)


@pytest.mark.parametrize("name", ALL)
def test_models_are_on_two_days_or_in_one_session(name: str):
    days = drawn(name).days
    assert (days == days[:, :1, :, :1]).all()
    if name not in BY_DAY:
        assert not days.any()
        return
    assert (days[..., 1, :] == 1 - days[..., 0, :]).all()
    begin = int((days[:, 0, 0, 0] == 0).sum())  # with the reference
    assert begin == (PEOPLE * 13 // 20 if "13 and 7" in name else PEOPLE // 2)


@pytest.mark.parametrize(("first", "sizes"), [(10, (2, 8, 20, 36)), (13, (20, 40))])
def test_so_many_of_twenty_begin_with_the_reference_and_the_first_alone_too(
    first: int, sizes: tuple[int, ...]
):
    for people in sizes:
        days = on_days(people, first=first)
        assert (days.sum(axis=1) == 1).all()
        begin = days[:, 0] == 0
        assert begin.sum() * 20 == people * first
        share = np.cumsum(begin) - np.arange(1, people + 1) * first / 20
        assert (np.abs(share) < 1).all()


@pytest.mark.parametrize("name", ALL)
def test_as_many_people_attend_as_said(name: str):
    assert share_is(~drawn(name).attends, CARELESS.get(name, 0.0))


# --- What is planted --------------------------------------------------------------------------


@pytest.mark.parametrize("name", [name for name in ALL if name not in AT_ENDS])
def test_answers_show_the_planted_mean_apart_from_days(name: str):
    batch = drawn(name)
    expected = SHOWN.get(name, float(batch.planted.mean()))
    effects = np.where(batch.attends, on_textures(name).mean(axis=-1), np.nan)
    groups = [one[np.isfinite(one)] for one in apart_from_days(effects, batch.days)]
    mean = np.mean([one.mean() for one in groups])
    error = sqrt(sum(one.var() / one.size for one in groups)) / len(groups)
    assert abs(mean - expected) <= ERRORS * error
    assert len(groups) == (2 if name in BY_DAY else 1)


@pytest.mark.parametrize(
    "name", [name for name in RATER_WORLDS if not {name} & {*AT_ENDS, *SHOWN, *BY_DAY}]
)
def test_ratings_show_the_planted_mean_on_each_texture(name: str):
    batch = drawn(name)
    for texture, planted in enumerate(batch.planted):
        assert within_errors(on_textures(name)[..., texture][batch.attends], planted)


def test_every_mean_lies_where_the_line_says():
    for name, one in ALL.items():
        planted, bound = drawn(name).planted.mean(), one.bounds[1]
        line = one.line
        if "at the bound" in line:
            assert planted == pytest.approx(bound), name
        elif "at the lower bound" in line or "a tenth fewer" in line:
            assert planted == pytest.approx(-bound), name
        elif "no effect" in line or "no mean effect" in line:
            assert planted == 0.0, name


@pytest.mark.parametrize(
    ("name", "base", "effect", "sd"),
    [
        ("base 95", 95.0, -7.5, 4.0),
        ("twice the bound", 60.0, 15.0, 4.0),
        ("at the bound, deviations 10, 3 repeats", 60.0, 7.5, sqrt(4**2 + 10**2)),
        ("at the bound", 60.0, 7.5, 4.0),
    ],
)
def test_the_upper_end_hides_what_a_censored_normal_loses(
    name: str, base: float, effect: float, sd: float
):
    """E min(X, 100) of normal ratings: people 8, textures 6, cells 4, a trend, effects, noise."""
    noise = 9 * np.exp(0.2 * stats.norm.ppf((np.arange(500) + 0.5) / 500))

    def censored(mean: float, effect_sd: float) -> float:
        sd = np.sqrt(8**2 + 6**2 + 4**2 + effect_sd**2 + noise**2 + (1**2 + 2**2) * 17 / 180)
        above = (100 - mean) / sd
        lost = sd * (stats.norm.pdf(above) - above * stats.norm.sf(above))
        return float(np.mean(mean - lost))

    expected = censored(base + effect, sd) - censored(base, 0.0)
    assert abs(expected) < abs(effect)
    assert within_errors(on_textures(name).mean(axis=(1, 2)), expected)


# Variance of the effects of people, of which the scale hides next to nothing.
PEOPLE_VARIANCE = {
    "none, SD 2": 2.0**2,
    "none, SD 6": 6.0**2,
    "at the bound": 4.0**2,
    "none, deviations 10": 10**2 / 7,
    "one texture": 0.5**2,
    "exponential": 5.0**2,
    "gains": (7.5**2 + 4**2) * exp(0.4**2) - 7.5**2,
}


@pytest.mark.parametrize(("name", "variance"), PEOPLE_VARIANCE.items())
def test_people_differ_as_much_as_planted(name: str, variance: float):
    """Of mean differences over seven textures; a trend adds (1² + 2²) · 17/90 to one of two."""
    batch = drawn(name)
    repeats = batch.values.shape[-1]
    trials = 14 * repeats + 2
    trend = (1 + 2**2) * (trials + 1) / (6 * (trials - 1))
    noise = (NOISE + trend) / (7 * repeats)
    away = on_textures(name).mean(axis=-1) - batch.planted.mean()
    assert within_errors(away**2, variance + noise)
    if not np.isnan(batch.people_sd):
        assert batch.people_sd**2 == variance


def test_an_sd_of_people_is_planted_where_their_effects_are_normal():
    other = {"one texture", "heavy tails", "exponential", "gains"}
    for name in RATER_WORLDS:
        normal = not ({name} & other or "deviations" in name or name in BY_DAY)
        assert np.isnan(drawn(name).people_sd) != normal, name


def test_effects_have_the_shapes_that_are_said():
    """Skewness of mean differences: that of the effects, as far as these make up the variance."""
    for name, skewness, share in (
        ("exponential", 2.0, 25 / (25 + NOISE / 7)),
        ("none, SD 6", 0.0, 1.0),
    ):
        of_people = on_textures(name).mean(axis=-1).ravel()
        assert stats.skew(of_people) == pytest.approx(skewness * share**1.5, abs=0.15)
    tails = on_textures("heavy tails").mean(axis=-1).ravel()
    assert stats.kurtosis(tails) > 1.0
    assert abs(stats.kurtosis(on_textures("none, SD 6").mean(axis=-1).ravel())) < 0.3


@pytest.mark.parametrize(("name", "sd"), [("none, deviations 10", 10), ("none, SD 2", 0)])
def test_effects_on_single_textures_deviate_within_people(name: str, sd: float):
    """The variance of a difference, effects of people apart: twice that of trials, and theirs."""
    values = drawn(name).values[..., 0]
    by_texture = values[..., 1] - values[..., 0]
    # A trend adds (1² + 2²) · 17/90, the variance of a difference of two of 16 positions.
    expected = sd**2 + NOISE + 5 * 17 / 90 * 16 / 15
    inside = (values.mean(axis=(2, 3)) > 40) & (values.mean(axis=(2, 3)) < 70)
    assert within_errors(by_texture[inside].var(axis=1, ddof=1), expected)


@pytest.mark.parametrize("name", RATER_WORLDS)
def test_anchors_are_rated_lower_by_who_attends(name: str):
    batch = drawn(name)
    below = batch.values.mean(axis=(2, 3, 4)) - 10
    lower = (batch.anchors < below[..., None]).all(axis=-1)
    assert (batch.anchors.mean(axis=-1) < below)[batch.attends].mean() > 0.97
    if not batch.attends.all():
        assert lower[~batch.attends].mean() < 0.25


def test_random_people_rate_uniformly_and_others_near_a_place():
    """Mean of two uniform anchors > 60: 0.8² / 2; SD of uniform ratings 100 / √12."""
    batch = drawn("20 % random people")
    high = batch.anchors.mean(axis=-1) > 60
    assert share_is(high[~batch.attends], 0.32)
    assert high[batch.attends].mean() < 0.001
    random = batch.values[~batch.attends].reshape(-1, 14)
    assert within_errors(random.var(axis=1, ddof=1), 100**2 / 12)
    batch = drawn("30 % at a favourite place")
    placed = batch.values[~batch.attends].reshape(-1, 14)
    inside = (placed.mean(axis=1) > 25) & (placed.mean(axis=1) < 75)
    assert within_errors(placed[inside].var(axis=1, ddof=1), 5.0**2)


def test_who_heaps_rounds_every_rating():
    values = drawn("heaping").values.reshape(-1, 14)
    assert share_is((values % 5 == 0).all(axis=1), 0.85)
    assert share_is((values % 10 == 0).all(axis=1), 0.25)
    plain = drawn("none, SD 6").values
    assert (plain[(plain > 0) & (plain < 100)] % 5 == 0).mean() < 0.01


def test_half_of_what_is_near_an_end_snaps_to_it():
    """Of the reference at 75: what lies beyond 85 by a normal distribution of all ratings."""
    reference = drawn("snapping").values[:, :, :, 0]
    noise = 9 * np.exp(0.2 * stats.norm.ppf((np.arange(500) + 0.5) / 500))
    sd = np.sqrt(8**2 + 6**2 + 4**2 + noise**2 + (1**2 + 2**2) * 17 / 180)
    beyond, at_end = (stats.norm.sf(place, 75, sd).mean() for place in (85, 100))
    half = (beyond - at_end) / 2
    by_study = reference.reshape(STUDIES, -1)
    assert within_errors(((by_study > 85) & (by_study < 100)).mean(axis=1), half)
    assert within_errors((by_study == 100).mean(axis=1), half + at_end)


@pytest.mark.parametrize(("name", "day"), [("by day, none", 5.0), ("by day, 13 and 7", 6.0)])
def test_days_add_what_is_said_and_differ_between_people(name: str, day: float):
    """Of who had the other model last, less of who had it first: twice what a day adds."""
    batch = drawn(name)
    last, first = apart_from_days(on_textures(name).mean(axis=-1), batch.days)
    error = sqrt(last.var() / last.size + first.var() / first.size)
    assert abs(last.mean() - first.mean() - 2 * day) < ERRORS * error
    noise = (NOISE + 5 * 17 / 90) / 7
    assert within_errors((last - last.mean()) ** 2, 2 * 6**2 + 2**2 + noise)


# --- Choices ----------------------------------------------------------------------------------


def test_the_second_day_is_better_and_alike_for_both_models():
    name = "choices, days .25"
    last, first = apart_from_days(on_textures(name).mean(axis=-1), drawn(name).days)
    assert last.mean() > 0 > first.mean()
    error = sqrt(last.var() / last.size + first.var() / first.size)
    assert abs(last.mean() + first.mean()) < ERRORS * error
    assert last.mean() - first.mean() > ERRORS * error


def test_days_differ_more_where_it_is_said():
    few, many = (on_textures(f"choices, days {sd}").mean(axis=-1).var() for sd in (".25", ".4"))
    assert many > 1.3 * few


def test_right_answers_are_those_of_the_strongest_of_seven_percepts():
    """The mean share of right answers, by the integral over abilities; reference, no days' SD."""
    shares = drawn("choices, days .25").values[..., 0, :].mean(axis=(1, 3))
    rng = np.random.default_rng(3)
    log = np.log(1.8) + rng.normal(0, sqrt(0.3**2 + 0.25**2), 4000)
    log += 0.15 * rng.choice([-0.5, 0.5], 4000)
    x = np.linspace(-8, 14, 400)
    by_texture = []
    for factor in (1.3, 0.8, 1.1, 0.7, 1.2, 0.9, 1.0):
        d_prime = np.exp(log)[:, None] * factor
        share = (stats.norm.pdf(x - d_prime) * stats.norm.cdf(x) ** 6).sum(axis=1) * (x[1] - x[0])
        by_texture.append(share.mean())
    assert shares.mean(axis=0) == pytest.approx(by_texture, abs=0.012)
    assert list(np.argsort(shares.mean(axis=0))) == [3, 1, 5, 6, 2, 4, 0]


# --- Other worlds -----------------------------------------------------------------------------


def test_a_seed_gives_the_same_studies():
    for name, one in ALL.items():
        first, again, other = (one(np.random.default_rng(seed), (2, 4)) for seed in (1, 1, 2))
        for field in ("values", "anchors", "days", "orders", "attends", "planted"):
            assert np.array_equal(getattr(first, field), getattr(again, field))
        assert not np.array_equal(first.values, other.values), name
        assert np.array_equal(first.planted, other.planted)


def test_ratings_are_given_up_late():
    """In the last trial six in ten still attend; the others move by 3 √2 points, 18 squared."""
    batch = drawn("giving up")
    values, orders = (each.reshape(-1, 28) for each in (batch.values, batch.orders))
    in_time = np.take_along_axis(values, np.argsort(orders, axis=1), axis=1)
    attend = batch.attends.ravel()
    steps = np.diff(in_time, axis=1) ** 2
    early = steps[attend, :12].mean()
    assert within_errors(steps[attend, -1], 0.6 * early + 0.4 * 18)
    places = in_time.mean(axis=1)
    inside = ~attend & (places > 20) & (places < 80)
    assert within_errors(steps[inside].mean(axis=1), 18.0)


def test_who_only_nudges_a_slider_leaves_it_near_an_end():
    """By a gamma distribution of shape 2 and mean 15, from either end as often."""
    batch = drawn("stopped short")
    nudged = batch.values[~batch.attends]
    moved = stats.gamma(2, scale=7.5)
    assert share_is(np.minimum(nudged, 100 - nudged) < 30, moved.cdf(30) + moved.sf(70))
    assert share_is(nudged > 50, 0.5)


def test_a_slider_that_is_nearly_right_is_not_moved():
    """Some trials have the very rating of the trial before; where sliders are free, hardly any."""
    shares = []
    for name in ("remembered", "none, SD 6"):
        batch = drawn(name)
        values, orders = (each.reshape(-1, 14) for each in (batch.values, batch.orders))
        in_time = np.take_along_axis(values, np.argsort(orders, axis=1), axis=1)
        beside = np.diff(np.sort(orders, axis=1), axis=1) < 1.5 / 15  # no anchor between
        inside = (in_time[:, 1:] > 0) & (in_time[:, 1:] < 100)
        same = np.diff(in_time, axis=1) == 0
        shares.append(same[beside & inside & batch.attends.reshape(-1, 1)].mean())
    assert shares[0] > 0.05
    assert shares[1] < 0.01
