"""Simulated people show what was planted in them: closed forms, and moments over thousands."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from math import exp, sqrt

import numpy as np
import pytest
from scipy import stats

from tactileq.benches.validation.people import held_out
from tactileq.benches.validation.people.choices import strongest_shares, triangular_share
from tactileq.benches.validation.people.held_out import HELD_OUT
from tactileq.benches.validation.people.situations import (
    CHOICE_KIND,
    ODDITY_KIND,
    RATING_KIND,
    SITUATIONS,
    DrawnStudies,
)
from tactileq.modeling.arrays import Floats

ALL = {**SITUATIONS, **{f"{name} (held out)": one for name, one in HELD_OUT.items()}}
STUDIES, PEOPLE = 100, 50
ERRORS = 4.0  # standard errors within which a mean is recovered
NOBODY = [name for name in SITUATIONS if name.startswith("ratings: everybody")]
WITH_RATINGS = [name for name, one in SITUATIONS.items() if one.kind == RATING_KIND]

# Mean of the simple difference of those who attend, where no end of a scale hides any of it.
LAPSED = 0.9
SHOWN = {
    "ratings: normal": 7.5,
    "ratings: 20 % random people": 7.5,
    "ratings: 20 % at a favourite place": 7.5,
    "ratings: 10 % lapsed trials": LAPSED * 7.5,
    "ratings: heaping": 7.5,
    "ratings: nothing planted, SD 6": 0.0,
    "ratings: nobody": 0.0,
    "ratings: split ± 10": 0.0,
    "ratings: 1 person in 4 by 10": 2.5,
    "ratings: skewed": 7.5,
    "ratings: heavy tails": 7.5,
    "oddity: nobody feels it": 0.0,
    "oddity: 1 person in 10": 0.1 * (0.95 - 1 / 3),
    "oddity: 1 person in 4": 0.25 * (0.95 - 1 / 3),
    "oddity: everybody a little": 0.42 - 1 / 3,
    "oddity: half a little": (0.42 - 1 / 3) / 2,
    "oddity: at the bound": 0.1,
    "oddity: 20 % careless": 0.1,
    "oddity: 10 % lapsed trials": LAPSED * 0.1,
    "choice: at the bound": -0.1,
    "choice: at the bound, 20 % careless": -0.1,
    "choice: at the bound near the ceiling": -0.1,
    "choice: nothing planted": 0.0,
    "choice: split": 0.0,
    "choice: 10 % lapsed": -LAPSED * 0.1,
    "ratings: adaptation (held out)": -7.5,
    # A share of 0.4 stops, as the square of 1, 3 … 29 of 29 grows in 15 of 30 trials.
    "ratings: giving up (held out)": 7.5 * (1 - 0.4 * (15 * 29 * 31 / 3) / 29**2 / 30),
    "oddity: strategies (held out)": 0.1,
    "choice: perseveration (held out)": -0.1,
}
CARELESS = {
    "ratings: 20 % random people": 0.2,
    "ratings: 20 % at a favourite place": 0.2,
    "oddity: 20 % careless": 0.2,
    "choice: at the bound, 20 % careless": 0.2,
    "ratings: giving up (held out)": 0.1,
    "oddity: strategies (held out)": 0.15,
    "choice: perseveration (held out)": 0.15,
    **dict.fromkeys(NOBODY, 1.0),
}


@cache
def drawn(name: str) -> DrawnStudies:
    """5000 people of a situation."""
    return ALL[name](np.random.default_rng(5), (STUDIES, PEOPLE))


def attending(name: str) -> np.ndarray:
    return np.isfinite(drawn(name).effects)


def simple_effects(name: str) -> Floats:
    """Other − reference, or share right − 1/3, of each person; (k, n)."""
    means = drawn(name).values.mean(axis=(2, 4))
    return means[..., 0] - 1 / 3 if ALL[name].kind == ODDITY_KIND else means[..., 1] - means[..., 0]


def within_errors(sample: Floats, expected: float) -> bool:
    return abs(sample.mean() - expected) <= ERRORS * sample.std() / sqrt(sample.size) + 1e-9


def share_is(hits: np.ndarray, expected: float) -> bool:
    """Whether a count lies within the errors of a binomial with the expected share."""
    error = sqrt(expected * (1 - expected) / hits.size)
    return abs(hits.mean() - expected) <= ERRORS * error + 1e-9


@pytest.mark.parametrize("name", ALL)
def test_batches_have_the_layout_of_their_kind(name: str):
    batch, kind = drawn(name), ALL[name].kind
    models = 1 if kind == ODDITY_KIND else 2
    cells = batch.values.shape
    assert cells[:4] == (STUDIES, PEOPLE, 7, models)
    assert batch.days.shape == batch.orders.shape == cells
    assert batch.checks.shape[:2] == batch.effects.shape == (STUDIES, PEOPLE)
    no_checks = kind == CHOICE_KIND or name.endswith("no anchors")
    assert batch.checks.shape[2] == (0 if no_checks else {RATING_KIND: 2, ODDITY_KIND: 6}[kind])
    for answers in (batch.values, batch.checks):
        assert np.isfinite(answers).all()
        if kind == RATING_KIND:
            assert ((answers >= 0) & (answers <= 100)).all()
            assert np.allclose(answers * 100, np.round(answers * 100), atol=1e-6)
        else:
            assert np.isin(answers, (0.0, 1.0)).all()
    assert ALL[name].bounds == ((-7.5, 7.5) if kind == RATING_KIND else (-0.1, 0.1))


@pytest.mark.parametrize("name", ALL)
def test_each_trial_has_a_place_of_its_own_in_its_session(name: str):
    batch = drawn(name)
    sessions = 2 if ALL[name].kind == CHOICE_KIND else 1
    answers = batch.values[0, 0].size + batch.checks.shape[2]
    last = answers // sessions - 1
    places = np.sort((batch.days + batch.orders / 2).reshape(STUDIES, PEOPLE, -1), axis=-1)
    assert (np.diff(places, axis=-1) >= 0.5 / last - 1e-9).all()
    assert (batch.orders.min(), batch.orders.max()) == (0.0, 1.0)
    assert within_errors(batch.orders[..., -1, -1, -1], 0.5)
    if ALL[name].kind == CHOICE_KIND:
        first = batch.days[0, :, 0, 0, 0]
        assert (batch.days == batch.days[:1, :, :1, :, :1]).all()
        assert (batch.days[..., 1, :] == 1 - batch.days[..., 0, :]).all()
        assert first.sum() * 2 == PEOPLE
    else:
        assert not batch.days.any()


@pytest.mark.parametrize("name", [name for name in ALL if name not in NOBODY])
def test_people_have_the_planted_mean_and_share_outside(name: str):
    batch = drawn(name)
    low, high = ALL[name].bounds
    effects = batch.effects[attending(name)]
    assert within_errors(effects, batch.mean)
    assert share_is((effects < low) | (effects > high), batch.outside)


@pytest.mark.parametrize(("name", "expected"), SHOWN.items())
def test_answers_show_the_planted_mean(name: str, expected: float):
    assert within_errors(simple_effects(name)[attending(name)], expected)


@pytest.mark.parametrize("name", ALL)
def test_as_many_people_attend_as_said(name: str):
    assert share_is(~attending(name), CARELESS.get(name, 0.0))


@pytest.mark.parametrize("name", NOBODY)
def test_without_attention_there_is_no_truth(name: str):
    batch = drawn(name)
    assert np.isnan([batch.mean, batch.outside]).all()
    assert within_errors(simple_effects(name), 0.0)


def test_every_mean_lies_where_the_name_says():
    at_bound = ["at the bound", "normal", "20 %", "10 % lapsed", "base", "heaping", "skewed"]
    for name, one in SITUATIONS.items():
        kind, situation = name.split(": ")
        assert kind == one.kind
        if any(situation.startswith(start) for start in [*at_bound, "heavy"]):
            bound = 7.5 if kind == RATING_KIND else 0.1
            assert abs(drawn(name).mean) == pytest.approx(bound, abs=1e-12), name
    for name in HELD_OUT:
        bound = 7.5 if name.startswith(RATING_KIND) else 0.1
        assert abs(drawn(f"{name} (held out)").mean) == pytest.approx(bound, abs=1e-12)


def test_shares_outside_are_those_of_the_distributions():
    outside: Mapping[str, float] = {
        "normal": 0.5 + stats.norm.cdf(-15 / 4),
        "nothing planted, SD 4": 2 * stats.norm.cdf(-7.5 / 4),
        "nobody": 0.0,
        "split ± 10": 1.0,
        "1 person in 4": 0.25,
        "1 person in 4 by 10": 0.25,
        "1 person in 10": 0.1,
        "skewed": exp(-1),
        "heavy tails": 0.5 + stats.t.cdf(-15 / 5 * sqrt(3), 3),
    }
    for name, share in outside.items():
        assert drawn(f"ratings: {name}").outside == pytest.approx(share, abs=1e-12), name
    assert drawn("oddity: 1 person in 10").outside == pytest.approx(0.1)
    assert drawn("oddity: half a little").outside == 0.0
    assert drawn("oddity: strategies (held out)").outside == pytest.approx(
        stats.beta.sf(1 / 3, 2, 4)
    )
    assert drawn("choice: perseveration (held out)").outside == pytest.approx(
        stats.beta.sf(0.4, 2, 3)
    )


@pytest.mark.parametrize(
    ("name", "base", "other"),
    [("base 85", 85.0, 92.5), ("base 90", 90.0, 97.5), ("base 90, other lower", 90.0, 82.5)],
)
def test_the_upper_end_hides_what_a_censored_normal_loses(name: str, base: float, other: float):
    """E min(X, 100) of normal ratings: people 8, textures 6, cells 4, a trend, effects 4, noise."""
    noise = 9 * np.exp(0.2 * stats.norm.ppf((np.arange(500) + 0.5) / 500))

    def censored(mean: float, effect_sd: float) -> float:
        sd = np.sqrt(8**2 + 6**2 + 4**2 + effect_sd**2 + noise**2 + (1**2 + 2**2) * 17 / 180)
        above = (100 - mean) / sd
        lost = sd * (stats.norm.pdf(above) - above * stats.norm.sf(above))
        return float(np.mean(mean - lost))

    expected = censored(other, 4.0) - censored(base, 0.0)
    assert abs(expected) < 6.5
    assert within_errors(simple_effects(f"ratings: {name}").mean(axis=1), expected)


@pytest.mark.parametrize("name", WITH_RATINGS)
def test_anchors_are_rated_lower_by_who_attends(name: str):
    batch = drawn(name)
    lower = (batch.checks < batch.values.mean(axis=(2, 3, 4))[..., None] - 10).all(axis=-1)
    if name == "ratings: 10 % lapsed trials":  # 0.9² at the anchors, and some by chance
        assert 0.81 < lower.mean() < 0.9
    elif attending(name).any():
        assert lower[attending(name)].mean() > 0.97
    if batch.checks.shape[2] and not attending(name).all():
        assert lower[~attending(name)].mean() < 0.25


def test_random_people_rate_uniformly_and_others_near_a_place():
    """Mean of two uniform anchors > 60: 0.8² / 2; SD of uniform ratings 100 / √12."""
    batch = drawn("ratings: 20 % random people")
    high = batch.checks.mean(axis=-1) > 60
    assert share_is(high[~attending("ratings: 20 % random people")], 0.32)
    assert high[attending("ratings: 20 % random people")].mean() < 0.001
    random = batch.values[~attending("ratings: 20 % random people")].reshape(-1, 14)
    assert within_errors(random.var(axis=1, ddof=1), 100**2 / 12)
    batch = drawn("ratings: 20 % at a favourite place")
    placed = batch.values[~attending("ratings: 20 % at a favourite place")].reshape(-1, 14)
    inside = (placed.mean(axis=1) > 25) & (placed.mean(axis=1) < 75)
    assert within_errors(placed[inside].var(axis=1, ddof=1), 5.0**2)


def test_who_heaps_rounds_every_rating():
    values = drawn("ratings: heaping").values.reshape(-1, 14)
    assert share_is((values % 5 == 0).all(axis=1), 0.85)
    assert share_is((values % 10 == 0).all(axis=1), 0.25)
    plain = drawn("ratings: normal").values
    assert (plain[(plain > 0) & (plain < 100)] % 5 == 0).mean() < 0.01


def test_noise_differs_between_people():
    """The variance of a difference: effects apart, twice that of trials, 9² exp(2 · 0.2²)."""
    values = drawn("ratings: nobody").values[..., 0]
    by_texture = values[..., 1] - values[..., 0]
    # A trend adds (1² + 2²) · 17/90, the variance of a difference of two of 16 positions.
    expected = 2 * 9**2 * exp(2 * 0.2**2) + 5 * 17 / 90 * 16 / 15
    inside = (values.mean(axis=(2, 3)) > 40) & (values.mean(axis=(2, 3)) < 70)
    assert within_errors(by_texture[inside].var(axis=1, ddof=1), expected)


def test_who_attends_passes_catch_trials():
    checks = drawn("oddity: 20 % careless").checks
    attend = attending("oddity: 20 % careless")
    assert share_is(checks[attend], 0.97)
    assert share_is(checks[~attend], 1 / 3)
    assert share_is(drawn("oddity: nobody feels it").checks, 0.97)
    assert share_is(drawn("oddity: 10 % lapsed trials").checks, 0.9 * 0.97 + 0.1 / 3)
    held = drawn("oddity: strategies (held out)").checks
    assert share_is(held[attending("oddity: strategies (held out)")], 0.96)


def test_careless_people_are_at_chance():
    for name, chance in (
        ("oddity: 20 % careless", 1 / 3),
        ("oddity: strategies (held out)", 1 / 3),
        ("choice: at the bound, 20 % careless", 1 / 7),
        ("choice: perseveration (held out)", 1 / 7),
    ):
        shares = drawn(name).values[~attending(name)].mean(axis=(1, 2, 3))
        assert within_errors(shares, chance), name


def test_who_feels_a_plain_difference_is_right_in_nineteen_of_twenty_trials():
    batch = drawn("oddity: 1 person in 10")
    assert share_is(batch.values[batch.effects > 0], 0.95)
    assert share_is(batch.values[batch.effects == 0], 1 / 3)


def test_some_textures_are_harder():
    by_texture = drawn("oddity: at the bound").values.mean(axis=(0, 1, 3, 4))
    assert list(np.argsort(by_texture)[[0, -1]]) == [3, 0]  # factors 0.6 and 1.4
    assert by_texture[0] - by_texture[3] > 0.1


def test_the_triangular_share_is_that_of_the_noncentral_f():
    """(x₃ − mean of x₁, x₂)² · 2/3 over (x₁ − x₂)² / 2 is F(1, 1, 2 d′² / 3); odd where > 3."""
    d_prime = np.array([0.0, 0.5, 1.0, 2.0, 4.0])
    expected = stats.ncf.sf(3, 1, 1, 2 * d_prime**2 / 3 + 1e-12)
    assert triangular_share(d_prime) == pytest.approx(expected, abs=1e-6)


def test_the_strongest_evidence_is_at_chance_without_any_and_right_with_much():
    shares = strongest_shares(np.array([0.0, 2.0, 40.0]))
    assert shares[0] == pytest.approx(np.full(7, 1 / 7), abs=1e-9)
    assert shares[2] == pytest.approx(np.ones(7), abs=1e-9)
    assert shares[1, 0] > shares[1, 1] > shares[1, 3]  # those amid have more that are similar
    assert shares[1] == pytest.approx(shares[1, ::-1], abs=1e-12)


@pytest.mark.parametrize(
    ("name", "share"),
    [
        ("at the bound", 0.6),
        ("at the bound near the ceiling", 0.92),
        ("10 % lapsed", 0.9 * 0.6 + 0.1 / 7),
        ("split", 0.56),
    ],
)
def test_the_reference_is_recognised_as_often_as_said(name: str, share: float):
    reference = drawn(f"choice: {name}").values[..., 0, :].mean(axis=(2, 3))
    assert within_errors(reference, share)


def test_the_second_day_is_better_and_alike_for_both_models():
    batch = drawn("choice: nothing planted")
    shares = batch.values.mean(axis=(2, 4))
    first = batch.days[:, :, 0, :, 0] == 0
    gained = shares[~first].reshape(first.shape[:2]) - shares[first].reshape(first.shape[:2])
    assert 0.01 < gained.mean() < 0.05
    assert not within_errors(gained, 0.0)


def test_signs_of_a_split_are_seen_in_single_people():
    effects, seen = drawn("choice: split").effects, simple_effects("choice: split")
    assert np.allclose(np.abs(effects), 0.25, atol=1e-6)
    assert within_errors(seen[effects > 0], 0.25)
    assert within_errors(seen[effects < 0], -0.25)


def test_a_seed_gives_the_same_studies():
    for name, one in ALL.items():
        first, again, other = (one(np.random.default_rng(seed), (2, 4)) for seed in (1, 1, 2))
        for field in ("values", "checks", "days", "orders", "effects"):
            assert np.array_equal(getattr(first, field), getattr(again, field), equal_nan=True)
        assert not np.array_equal(first.values, other.values), name
        assert (first.mean, first.outside) == pytest.approx(
            (other.mean, other.outside), abs=0, nan_ok=True
        )


def test_the_mean_response_of_adapting_people_is_that_over_random_orders():
    """Ratings without noise of people whose other model is felt stronger by 1, anchors apart."""
    rng = np.random.default_rng(8)
    orders = held_out.shuffled(rng, (2000, 1, 16))
    other = (orders < 7).astype(float)
    gain, assimilation = np.full((2000, 1), 1.3), np.full((2000, 1), 0.3)
    ratings = held_out.adapted(other, gain, assimilation)
    reference = (orders >= 7) & (orders < 14)
    seen = (ratings * other).sum(axis=-1) / 7 - (ratings * reference).sum(axis=-1) / 7
    response = held_out.mean_response(gain, assimilation, 16)
    assert within_errors(seen, float(response[0, 0]))
    alone = held_out.mean_response(np.ones((1, 1)), np.zeros((1, 1)), 10**4)
    assert alone[0, 0] == pytest.approx(1.0, abs=1e-3)


def test_wrong_answers_stay_mostly_within_the_cluster():
    shares = held_out.confusions()
    assert shares.sum(axis=1) == pytest.approx(np.ones(7))
    assert not np.diag(shares).any()
    assert shares[0, 1:3].sum() == shares[3, 4] == pytest.approx(0.75)


def test_ratings_are_given_up_late():
    """In the last trial six in ten still attend; the others move by 3 √2 points, 18 squared."""
    batch = drawn("ratings: giving up (held out)")
    values, orders = (each.reshape(-1, 28) for each in (batch.values, batch.orders))
    in_time = np.take_along_axis(values, np.argsort(orders, axis=1), axis=1)
    attend = attending("ratings: giving up (held out)").ravel()
    steps = np.diff(in_time, axis=1) ** 2
    early = steps[attend, :12].mean()
    assert within_errors(steps[attend, -1], 0.6 * early + 0.4 * 18)
    places = in_time.mean(axis=1)
    inside = ~attend & (places > 20) & (places < 80)
    assert within_errors(steps[inside].mean(axis=1), 18.0)


def test_perseveration_takes_a_tenth_of_what_is_identified_and_guesses_a_seventh():
    """20 000 people: shares of the reference 0.9 · 0.65 + 0.1 / 7, of the other model 0.1 less."""
    batch = HELD_OUT["choice: perseveration"](np.random.default_rng(9), (400, 50))
    shares = batch.values.mean(axis=(2, 4))[np.isfinite(batch.effects)]
    assert within_errors(shares[:, 0], 0.9 * 0.65 + 0.1 / 7)
    assert within_errors(shares[:, 1] - shares[:, 0], -0.1)
