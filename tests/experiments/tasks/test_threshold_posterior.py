"""QUEST+ for a person's thresholds: against questplus itself, and against Bayes' rule."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from questplus import QuestPlus

from tactileq.experiments.tasks.threshold_posterior import (
    EXPECTED_DB,
    EXPECTED_SD_DB,
    LAPSE_RATES,
    LEVELS_DB,
    MORE_LAPSES,
    POINT_DB,
    SLOPES,
    THRESHOLDS_DB,
    Answer,
    Estimate,
    answers_of,
    estimate,
    lapse_bayes_factor,
    next_level_db,
    posterior,
)
from tactileq.modeling import InputError
from tactileq.modeling.arrays import Floats
from tests.experiments.tasks.planted_threshold import HIGHEST_DB, asked, rows_of, weibull
from tests.refusals import refused


def answer(level_db: float, correct: bool, *, highest_db: float = HIGHEST_DB) -> Answer:
    return Answer(frequency_hz=250.0, level_db=level_db, correct=correct, highest_db=highest_db)


def level(answers: Sequence[Answer], highest_db: float) -> float:
    return next_level_db(answers, 250.0, highest_db=highest_db)


def found_in(answers: Sequence[Answer]) -> Estimate:
    return estimate(answers, 250.0)


def prior_of_thresholds() -> Floats:
    return np.asarray(np.exp(-(((THRESHOLDS_DB - EXPECTED_DB) / EXPECTED_SD_DB) ** 2) / 2))


@pytest.fixture(scope="module")
def quest_plus() -> QuestPlus:
    return QuestPlus(
        stim_domain={"intensity": LEVELS_DB},
        param_domain={
            "threshold": THRESHOLDS_DB,
            "slope": SLOPES,
            "lower_asymptote": [0.5],
            "lapse_rate": LAPSE_RATES,
        },
        outcome_domain={"response": ["correct", "wrong"]},
        prior={"threshold": prior_of_thresholds()},
        func="weibull",
        stim_scale="dB",
    )


# --- Against questplus, and in closed form --------------------------------------------------


def test_levels_and_posterior_are_those_of_questplus_trial_by_trial(quest_plus: QuestPlus) -> None:
    rng = np.random.default_rng(5)
    correct = weibull(-31.0)
    answers: list[Answer] = []
    for _ in range(12):
        level_db = level(answers, 100.0)
        assert level_db == quest_plus.next_stim["intensity"]
        right = bool(rng.random() < correct(level_db))
        answers.append(answer(level_db, right))
        quest_plus.update(
            stim={"intensity": level_db}, outcome={"response": "correct" if right else "wrong"}
        )
        known = quest_plus.posterior.values
        np.testing.assert_allclose(posterior(answers, 250.0), known, rtol=0, atol=1e-12)
    # The estimate is of the point of 75 %, not of Weibull's scale (82 %).
    weights = posterior(answers, 250.0)
    shapes = [len(SLOPES), 1, len(LAPSE_RATES), THRESHOLDS_DB.size]
    assert sorted(weights.shape) == sorted(shapes)
    mean = quest_plus.param_estimate
    found = found_in(answers)
    assert found.slope == pytest.approx(mean["slope"])
    assert found.lapse_rate == pytest.approx(mean["lapse_rate"])
    lowest, highest = (mean["threshold"] + POINT_DB / slope for slope in (SLOPES[0], SLOPES[-1]))
    assert lowest < found.level_db < highest


def test_the_point_is_where_three_quarters_are_right() -> None:
    for slope in SLOPES:
        share = 1 - 0.5 * np.exp(-(10 ** (slope * (POINT_DB / slope) / 20)))
        assert share == pytest.approx(0.75)


def test_without_answers_the_prior_is_left() -> None:
    weights = posterior([], 250.0)
    axes = tuple(axis for axis, size in enumerate(weights.shape) if size != THRESHOLDS_DB.size)
    expected = prior_of_thresholds() / prior_of_thresholds().sum()
    assert weights.sum(axis=axes) == pytest.approx(expected)


@given(st.lists(st.tuples(st.sampled_from(list(LEVELS_DB)), st.booleans()), max_size=60))
def test_any_answers_give_a_posterior_and_their_order_does_not_matter(
    given_answers: list[tuple[float, bool]],
) -> None:
    answers = [answer(float(level), right) for level, right in given_answers]
    weights = posterior(answers, 250.0)
    assert weights.sum() == pytest.approx(1.0)
    assert np.isfinite(weights).all()
    assert (weights >= 0).all()
    np.testing.assert_allclose(posterior(answers[::-1], 250.0), weights, rtol=0, atol=1e-12)


@settings(max_examples=25)
@given(highest_db=st.floats(-70.0, 40.0), right=st.lists(st.booleans(), max_size=4))
def test_no_level_is_beyond_what_the_rig_may_present(highest_db: float, right: list[bool]) -> None:
    level_db = level([answer(-20.0, one) for one in right], highest_db)
    assert level_db in LEVELS_DB
    assert level_db <= highest_db + 1e-6


def test_a_rig_that_presents_nothing_is_refused() -> None:
    with refused(InputError, expected=["rig", "-70 dB"], got="-70.5 dB"):
        level([], -70.5)


# --- Observers with a known threshold -------------------------------------------------------


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.long("another observer"))])
def test_planted_thresholds_are_recovered_within_2_db_rms(seed: int) -> None:
    rng = np.random.default_rng(seed)
    planted_db = dict(zip((20.0, 80.0, 250.0, 630.0), rng.uniform(-45, -10, 4), strict=True))
    answers: list[Answer] = []
    for _ in range(60):
        for frequency_hz, at in planted_db.items():
            level_db = next_level_db(answers, frequency_hz, highest_db=HIGHEST_DB)
            right = bool(rng.random() < weibull(at)(level_db))
            answers.append(replace(answer(level_db, right), frequency_hz=frequency_hz))
    errors_db = [estimate(answers, f).level_db - at for f, at in planted_db.items()]
    assert np.sqrt(np.mean(np.square(errors_db))) < 2.0


def test_mean_and_deviation_are_those_of_bayes_rule_written_out() -> None:
    """Over thresholds at two frequencies, one slope and one lapse rate."""
    levels_db = (-10, -20, -30, -38, -36, -34, -32, -26)
    here = [answer(db, db > -34 or db == -38) for db in levels_db]
    there = [replace(answer(db, db % 3 == 0 or db > -20), frequency_hz=20.0) for db in levels_db]
    first, second, slope, lapse_rate = np.meshgrid(
        THRESHOLDS_DB, THRESHOLDS_DB, SLOPES, LAPSE_RATES, indexing="ij", sparse=True
    )
    prior = prior_of_thresholds()
    weights = prior[:, None, None, None] * prior[None, :, None, None]
    for answers, threshold in ((here, first), (there, second)):
        for one in answers:
            undetected = np.exp(-(10 ** (slope * (one.level_db - threshold) / 20)))
            right = 1 - lapse_rate - (0.5 - lapse_rate) * undetected
            weights = weights * (right if one.correct else 1 - right)
    weights = weights / weights.sum()
    point_db = first + 20 * np.log10(np.log(2)) / slope
    mean_db = (weights * point_db).sum()
    found = found_in([*there, *here])
    assert found.level_db == pytest.approx(mean_db)
    assert found.sd_db == pytest.approx(np.sqrt((weights * (point_db - mean_db) ** 2).sum()))
    assert found.slope == pytest.approx((weights * slope).sum())
    assert found.lapse_rate == pytest.approx((weights * lapse_rate).sum())
    assert (found.beyond, found.trials) == ("", 8)
    assert found_in(here).slope != pytest.approx(found.slope, abs=0.05)  # the others count


# --- Where it breaks ------------------------------------------------------------------------


def test_a_threshold_above_the_rigs_limit_is_a_bound_and_says_so() -> None:
    found = found_in(asked(weibull(5.0), np.random.default_rng(1), trials=30, highest_db=-11.0))
    assert found.beyond == "above"
    assert found.level_db == -11.0


def test_one_well_below_the_limit_is_none() -> None:
    found = found_in(asked(weibull(-25.0), np.random.default_rng(1), trials=30, highest_db=-11.0))
    assert found.beyond == ""
    assert found.level_db == pytest.approx(-25.0, abs=6.0)


def test_who_guesses_has_a_threshold_above_everything() -> None:
    found = found_in(asked(lambda level_db: 0.5, np.random.default_rng(0), highest_db=0.0))
    assert (found.beyond, found.level_db) == ("above", 0.0)


def test_who_is_always_right_has_one_below_the_lowest_level() -> None:
    answers = asked(lambda level_db: 1.0, np.random.default_rng(0))
    assert min(one.level_db for one in answers) == LEVELS_DB[0]
    found = found_in(answers)
    assert (found.beyond, found.level_db) == ("below", LEVELS_DB[0])


def test_wrong_answers_far_above_the_threshold_are_lapses_up_to_a_point() -> None:
    near = [answer(-30.0, True), answer(-36.0, False)] * 10
    far = [answer(level_db, True) for level_db in (-10.0, 0.0, 10.0) for _ in range(20)]
    careful = found_in(near + far)
    careless = found_in([*near, *far, *(answer(db, False) for db in (-10.0, 0.0, 10.0))])
    assert careful.lapse_rate < 0.02 < 0.035 < careless.lapse_rate
    assert careless.level_db == pytest.approx(careful.level_db, abs=2.0)  # not of the threshold
    # Lapses in a quarter of them are beyond the prior: the deviation tells, the level is wrong.
    lost = found_in([*near, *far, *[answer(10.0, False)] * 20])
    assert lost.sd_db > 2 * careful.sd_db
    assert [found.more_lapses for found in (careful, careless, lost)] == [False, False, True]


# --- More lapses than assumed ---------------------------------------------------------------


def test_the_bayes_factor_is_that_of_likelihoods_written_out() -> None:
    """Averaged over thresholds at two frequencies, one slope and one lapse rate."""
    levels_db = (-10, -20, -30, -38, -36, -34, 0, 10)
    here = [answer(db, db in (-10, -30, 0)) for db in levels_db]
    there = [replace(answer(db, db % 3 == 0 or db > -20), frequency_hz=20.0) for db in levels_db]
    prior = prior_of_thresholds() / prior_of_thresholds().sum()
    evidence = {}
    for rates in (LAPSE_RATES, MORE_LAPSES):
        slope, rate, threshold = np.meshgrid(SLOPES, rates, THRESHOLDS_DB, indexing="ij")
        shares = np.ones((len(SLOPES), len(rates)))
        for answers in (here, there):
            likelihood = np.ones(threshold.shape)
            for one in answers:
                undetected = np.exp(-(10 ** (slope * (one.level_db - threshold) / 20)))
                right = 1 - rate - (0.5 - rate) * undetected
                likelihood = likelihood * (right if one.correct else 1 - right)
            shares = shares * (likelihood @ prior)
        evidence[rates] = shares.mean()
    expected = evidence[MORE_LAPSES] / evidence[LAPSE_RATES]
    assert lapse_bayes_factor([*here, *there]) == pytest.approx(expected)
    assert expected != pytest.approx(lapse_bayes_factor(here), rel=0.05)  # the others count


def test_the_lapses_of_all_frequencies_count_at_each() -> None:
    frequencies_hz = (20.0, 250.0, 1000.0)
    near = [answer(-30.0, True), answer(-36.0, False)] * 10
    far = [answer(db, number > 0) for db in (0.0, 10.0) for number in range(6)]
    of_one = [*near, *far]
    assert not estimate(of_one, 250.0).more_lapses
    answers = [replace(one, frequency_hz=f) for f in frequencies_hz for one in of_one]
    assert [estimate(answers, f).more_lapses for f in frequencies_hz] == [True] * 3


def test_a_bound_is_no_matter_of_lapses() -> None:
    far = [answer(level_db, n % 4 > 0) for level_db in (-10.0, 0.0, 10.0) for n in range(20)]
    unfelt = [
        replace(answer(db, n % 2 > 0), frequency_hz=20.0) for db in (10.0, 14.0) for n in range(40)
    ]
    found = [estimate([*far, *unfelt], f) for f in (20.0, 250.0)]
    assert [(one.beyond, one.more_lapses) for one in found] == [("above", False), ("", True)]


@pytest.mark.long("whole sessions of simulated observers")
def test_observers_who_guess_often_are_noted_and_others_are_not() -> None:
    def share_noted(lapse_rate: float) -> float:
        noted = []
        for seed in range(3):
            rng = np.random.default_rng(seed)
            answers: list[Answer] = []
            correct = weibull(-30.0, lapse_rate=lapse_rate)
            for _ in range(60):
                for frequency_hz in (20.0, 40.0, 80.0, 160.0, 250.0, 400.0, 630.0, 1000.0):
                    level_db = next_level_db(answers, frequency_hz, highest_db=HIGHEST_DB)
                    right = bool(rng.random() < correct(level_db))
                    answers.append(replace(answer(level_db, right), frequency_hz=frequency_hz))
            noted.append(estimate(answers, 250.0).more_lapses)
        return float(np.mean(noted))

    assert share_noted(0.02) == 0.0
    assert share_noted(0.15) > 0.5  # guesses in 30 % of trials


# --- Rows -----------------------------------------------------------------------------------


def test_rows_are_read_as_numbers_or_text_and_only_what_counts() -> None:
    answers = [answer(-30.0, True), answer(-32.0, False)]
    rows = rows_of(answers)
    as_text = [{name: str(value) for name, value in row.items()} for row in rows]
    for given_rows in (rows, as_text):
        found = answers_of(given_rows)
        assert [(a.level_db, a.correct) for a in found] == [(-30.0, True), (-32.0, False)]
        assert [a.highest_db for a in found] == pytest.approx([HIGHEST_DB] * 2)
    assert answers_of([{**rows[0], "phase": "training"}, {**rows[1], "valid": 0}]) == []


@pytest.mark.parametrize(
    ("column", "value", "sentence"),
    [
        ("amplitude_g", "nan", "expected a number above 0 for amplitude_g .* got 'nan'"),
        ("amplitude_g", 0.0, "expected a number above 0 for amplitude_g"),
        ("amplitude_g", 0.035, "in steps of 2 dB re 1 g"),
        ("amplitude_g", 1e3, "in steps of 2 dB re 1 g"),
        ("frequency_hz", "n/a", "expected a number above 0 for frequency_hz"),
        ("highest_g", "inf", "expected a number above 0 for highest_g"),
        ("correct", "n/a", "for correct"),
        ("correct", 2, "got 2 at"),
    ],
)
def test_damaged_rows_are_refused(column: str, value: object, sentence: str) -> None:
    (row,) = rows_of([answer(-30.0, True)])
    with pytest.raises(InputError, match=sentence):
        answers_of([{**row, column: value}])


def test_no_answer_gives_no_estimate() -> None:
    with refused(InputError, expected=["answers", "250 Hz"]):
        estimate([], 250.0)
