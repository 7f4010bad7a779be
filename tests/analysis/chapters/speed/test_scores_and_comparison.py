"""Speed and accuracy against closed forms, planted effects, and what may not break them."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy import stats

from tactileq.analysis.chapters.speed.comparison import (
    RIGHT_WRONG_COLUMNS,
    SPEED_COMPARISON_COLUMNS,
    SPEED_MEASURES,
    TIME_RATIO_COLUMNS,
    compare_models,
    right_and_wrong,
    time_ratios,
)
from tactileq.analysis.chapters.speed.scores import (
    CONDITIONAL_COLUMNS,
    MEAN_COLUMNS,
    SCORE_COLUMNS,
    TEXTURE_TIME_COLUMNS,
    conditional_accuracy,
    lisas,
    participant_scores,
    score_means,
    speed_and_accuracy,
)
from tactileq.analysis.chapters.speed.section import trade_off_sentence
from tactileq.analysis.statistics.mixed import MIXED_MODEL, PAIRED
from tactileq.modeling import InputError
from tactileq.modeling.files.columns import names
from tests.refusals import refused

MODELS = ("full", "simplified")
COLUMNS = ["participant_id", "texture", "model", "response_time_s", "correct"]
pytestmark = pytest.mark.filterwarnings("error")


def rng() -> np.random.Generator:
    return np.random.default_rng(4)


def table(*rows: tuple[str, str, str, float, float]) -> pd.DataFrame:
    return pd.DataFrame(rows, columns=COLUMNS)


def planted(
    *,
    people: int = 24,
    ratio: float = 1.0,
    change: float = 0.0,
    slope_sd: float = 0.15,
    repeats: int = 6,
    seed: int = 1,
) -> pd.DataFrame:
    """Log-normal times; with the other model `ratio` as long and `change` more often right."""
    draws = np.random.default_rng(seed)
    rows = []
    for person in range(people):
        own, slope = draws.normal(2.0, 0.3), draws.normal(math.log(ratio), slope_sd)
        for number, texture in enumerate("abc"):
            for other, model in enumerate(MODELS):
                for _ in range(repeats):
                    log_s = own + 0.2 * number + slope * other + draws.normal(0, 0.25)
                    right = float(draws.random() < 0.7 + change * other)
                    rows.append((f"sub-{person:02d}", texture, model, math.exp(log_s), right))
    return table(*rows)


SMALL = table(
    ("sub-1", "a", "full", 1.0, 1),
    ("sub-1", "a", "full", 3.0, 0),
    ("sub-1", "a", "full", 8.0, 1),
    ("sub-1", "a", "simplified", 2.0, 1),
    ("sub-1", "b", "full", 9.0, 0),
)


def test_cells_have_medians_and_shares():
    cells = speed_and_accuracy(SMALL, models=MODELS)
    assert list(cells) == names(TEXTURE_TIME_COLUMNS)
    expected = [
        ["sub-1", "a", "full", 3, 3.0, 2 / 3, 4.5, 3.0],
        ["sub-1", "a", "simplified", 1, 2.0, 1.0, 2.0, np.nan],
        ["sub-1", "b", "full", 1, 9.0, 0.0, np.nan, 9.0],
    ]
    pd.testing.assert_frame_equal(cells, pd.DataFrame(expected, columns=list(cells)))


def test_scores_are_of_textures_judged_with_both_models():
    scores = participant_scores(SMALL, models=MODELS).set_index("model")
    assert list(scores.reset_index()[names(SCORE_COLUMNS)]) == names(SCORE_COLUMNS)
    assert_allclose(scores["time_s"], [24 ** (1 / 3), 2.0])
    assert_allclose(scores["share_correct"], [2 / 3, 1.0])
    assert scores["trials"].tolist() == [3, 1]
    # Right: 1, 8 and 2 s; errors 0, 1, 0, 0.
    weight = np.std([1, 8, 2], ddof=1) / np.std([0, 1, 0, 0], ddof=1)
    assert_allclose(scores["lisas_s"], [4.5 + weight / 3, 2.0])


def test_textures_count_once_however_many_trials_they_have():
    rows = [("sub-1", "a", m, 2.0, 1) for m in MODELS for _ in range(9)]
    rows += [("sub-1", "b", m, 8.0, 0) for m in MODELS]
    scores = participant_scores(table(*rows), models=MODELS)
    assert_allclose(scores["time_s"], 4.0)
    assert_allclose(scores["share_correct"], 0.5)


def test_lisas_of_nobody_wrong_nobody_right_and_one_right():
    times = pd.DataFrame({"model": ["x", "x", "y", "y"], "response_time_s": [1.0, 3.0, 5.0, 9.0]})
    assert lisas(times.assign(correct=1.0)).to_dict() == {"x": 2.0, "y": 7.0}
    assert lisas(times.assign(correct=0.0)).isna().all()
    never = lisas(times.assign(correct=[1.0, 1.0, 0.0, 0.0]))
    assert never["x"] == 2.0
    assert math.isnan(never["y"])
    alike = lisas(times.assign(response_time_s=4.0, correct=[1.0, 0.0, 1.0, 1.0]))
    assert alike.to_dict() == {"x": 4.0, "y": 4.0}  # S_RT is 0


@settings(max_examples=40)
@given(
    st.lists(st.tuples(st.floats(0.1, 60), st.booleans()), min_size=4, max_size=20),
    st.floats(0.1, 10),
)
def test_lisas_scales_with_time_and_is_never_below_the_mean_time(trials, factor):
    one = pd.DataFrame(trials, columns=["response_time_s", "correct"]).astype(float)
    one["model"] = ["x", "y"] * (len(one) // 2) + ["x"] * (len(one) % 2)
    right = one[one["correct"] == 1].groupby("model")["response_time_s"].mean()
    score = lisas(one)
    scaled = lisas(one.assign(response_time_s=one["response_time_s"] * factor))
    assert_allclose(scaled, score * factor, rtol=1e-9)
    for model, mean in right.items():
        assert score[model] >= mean or (math.isnan(score[model]) and len(right) < 2)


def test_trials_without_answer_or_time_are_left_out():
    lacking = table(
        ("sub-1", "a", "full", np.nan, 1),
        ("sub-1", "a", "full", 0.0, 1),
        ("sub-1", "a", "full", np.inf, 1),
        ("sub-1", "a", "full", 2.0, np.nan),
        ("sub-1", "a", "other", 2.0, 1),
        ("sub-1", "a", "full", 7.0, 0),
    )
    (row,) = speed_and_accuracy(lacking, models=MODELS).to_dict("records")
    assert (row["trials"], row["median_s"], row["share_correct"]) == (1, 7.0, 0.0)


def test_a_table_without_right_answers_is_refused():
    with refused(InputError, expected="correct", got=["none", "correct"]):
        speed_and_accuracy(SMALL.drop(columns="correct"), models=MODELS)


def test_conditional_accuracy_of_answers_that_are_right_when_slow():
    rows = []
    for person in ("sub-1", "sub-2"):
        for model in MODELS:
            rows += [(person, "a", model, float(2**k), float(k >= 4)) for k in range(8)]
    found = conditional_accuracy(table(*rows), models=MODELS, bins=4)
    assert list(found) == names(CONDITIONAL_COLUMNS)
    assert found["model"].tolist() == ["full"] * 4 + ["simplified"] * 4
    assert found["quantile"].tolist() == [1, 2, 3, 4] * 2
    assert_allclose(found["share_correct"], [0, 0, 1, 1] * 2)
    assert_allclose(found["time_s"], [2**0.5, 2**2.5, 2**4.5, 2**6.5] * 2)
    assert found["ci_low"].isna().all()  # nobody varies


def test_conditional_accuracy_has_the_interval_of_t_over_participants():
    answers = planted(people=9)
    found = conditional_accuracy(answers, models=MODELS, bins=2).iloc[0]
    own = answers[answers["model"] == "full"].sort_values("response_time_s")
    shares = own.groupby("participant_id")["correct"].apply(lambda c: c.iloc[:9].mean())
    low, high = stats.t.interval(0.95, 8, shares.mean(), stats.sem(shares))
    assert_allclose(
        found[["share_correct", "ci_low", "ci_high"]].astype(float), [shares.mean(), low, high]
    )
    assert found["n"] == 9


def test_who_has_too_few_answers_for_the_quantiles_is_left_out():
    few = planted(people=3)
    few = pd.concat([few, SMALL.assign(participant_id="sub-99")])
    assert set(conditional_accuracy(few, models=MODELS, bins=6)["n"]) == {3}
    assert conditional_accuracy(SMALL, models=MODELS).empty
    with refused(InputError, expected="two", got=1):
        conditional_accuracy(few, models=MODELS, bins=1)


@settings(max_examples=30)
@given(st.integers(2, 12), st.integers(2, 7))
def test_quantiles_differ_by_one_answer_at_most(trials, bins):
    rows = [("sub-1", "a", "full", 1.0 + k % 3, 1.0) for k in range(trials)]
    found = conditional_accuracy(table(*rows), models=["full"], bins=bins)
    assert len(found) == (bins if trials >= bins else 0)


def test_comparison_is_the_paired_test_of_log_times_and_shares():
    answers = planted(ratio=0.8, change=-0.1)
    found = compare_models(answers, models=MODELS, rng=rng())
    assert list(found) == names(SPEED_COMPARISON_COLUMNS)
    assert found["measure"].tolist() == list(SPEED_MEASURES)
    logs = answers.assign(response_time_s=np.log(answers["response_time_s"]))
    means = logs.pivot_table(
        index="participant_id", columns="model", values=["response_time_s", "correct"]
    )
    time, share = found.iloc[0], found.iloc[1]
    test = stats.ttest_rel(*(means["response_time_s"][m] for m in reversed(MODELS)))
    assert_allclose([time["t"], time["p"]], [test.statistic, test.pvalue])
    interval = np.exp([test.confidence_interval().low, test.confidence_interval().high])
    assert_allclose(time[["ci_low", "ci_high"]].astype(float), interval)
    apart = (means["response_time_s"]["simplified"] - means["response_time_s"]["full"]).mean()
    assert_allclose(time["estimate"], math.exp(apart))
    assert_allclose(time["mean_other"] / time["mean_reference"], time["estimate"])
    assert_allclose(
        share["estimate"], (means["correct"]["simplified"] - means["correct"]["full"]).mean()
    )
    # Planted: within four standard errors.
    assert abs(math.log(time["estimate"] / 0.8)) < 4 * 0.15 / math.sqrt(24) + 0.05
    assert share["estimate"] == pytest.approx(-0.1, abs=4 * math.sqrt(2 * 0.24 / (18 * 24)))


def test_who_has_no_score_with_one_model_is_named():
    answers = planted(people=5)
    never = (answers["participant_id"] == "sub-03") & (answers["model"] == "full")
    answers.loc[never, "correct"] = 0.0
    found = compare_models(answers, models=MODELS, rng=rng()).set_index("measure")
    assert found["n"].to_dict() == {"time_s": 5, "share_correct": 5, "lisas_s": 4}
    assert found["excluded"].to_dict() == {"time_s": "", "share_correct": "", "lisas_s": "sub-03"}


def test_the_models_change_places():
    answers = planted(ratio=0.8)
    one = compare_models(answers, models=MODELS, rng=rng())["estimate"]
    turned = compare_models(answers, models=("simplified", "full"), rng=rng())["estimate"]
    assert_allclose(turned, [1 / one[0], -one[1], -one[2]])


def test_means_have_the_interval_of_t():
    scores = participant_scores(planted(people=7), models=MODELS)
    means = score_means(scores)
    assert list(means) == names(MEAN_COLUMNS)
    own = np.log(scores.loc[scores["model"] == "full", "time_s"])
    low, high = np.exp(stats.t.interval(0.95, 6, own.mean(), stats.sem(own)))
    assert_allclose(
        means.iloc[0][["time_s", "time_low", "time_high"]].astype(float),
        [*np.exp([own.mean()]), low, high],
    )


def test_right_and_wrong_answers():
    answers = planted(people=10)
    slow = answers["correct"] == 0
    answers.loc[slow, "response_time_s"] *= 2
    found = right_and_wrong(answers, models=MODELS, rng=rng())
    assert list(found) == names(RIGHT_WRONG_COLUMNS)
    assert_allclose(found["wrong_s"] / found["right_s"], found["ratio"])
    assert ((found["ci_low"] < 2) & (found["ci_high"] > 2) & (found["p"] < 0.001)).all()
    always = right_and_wrong(answers.assign(correct=1.0), models=MODELS, rng=rng())
    assert always["n"].tolist() == [0, 0]
    assert always["ratio"].isna().all()


def shuffled(answers: pd.DataFrame) -> pd.DataFrame:
    """Each participant's trials in an order of their own."""
    mixed = answers.sample(frac=1, random_state=9)
    return mixed.sort_values("participant_id", kind="stable", ignore_index=True)


def test_a_planted_ratio_of_times_with_practice():
    """Times fall by a fifth over the session, whatever the model."""
    answers = shuffled(planted(ratio=0.8, slope_sd=0.3))
    place = answers.groupby("participant_id").cumcount() / 35
    answers["response_time_s"] *= 0.8**place
    table = time_ratios(answers, models=MODELS, rng=rng())
    assert list(table) == names(TIME_RATIO_COLUMNS)
    found, order = (row for _, row in table.iterrows())
    assert (found["method"], found["note"], found["n"], found["df"]) == (MIXED_MODEL, "", 24, 23)
    assert found["answers"] == len(answers)
    assert found["ci_low"] < 0.8 < found["ci_high"]
    assert found["ci_high"] / found["ci_low"] < 1.4
    assert order["ratio"] == pytest.approx(0.8, rel=0.1)
    paired = compare_models(answers, models=MODELS, rng=rng()).iloc[0]
    assert_allclose(found["ratio"], paired["estimate"], rtol=0.02)


def test_the_mixed_model_uses_trials_that_are_missing_unevenly():
    answers = shuffled(planted(ratio=0.8, slope_sd=0.3))
    kept = rng().random(len(answers)) < 0.7
    found = time_ratios(answers[kept], models=MODELS, rng=rng()).iloc[0]
    assert found["method"] == MIXED_MODEL
    assert found["ci_low"] < 0.8 < found["ci_high"]
    # Textures that somebody has left with one of the models only are not compared.
    counted = participant_scores(answers[kept], models=MODELS)["trials"].sum()
    assert found["answers"] == counted < kept.sum() < len(answers)


def test_times_without_noise_are_tested_without_a_mixed_model():
    answers = planted(ratio=0.8, slope_sd=0.0, people=6, repeats=2)
    exact = answers.assign(response_time_s=answers["model"].map({"full": 4.0, "simplified": 3.0}))
    found = time_ratios(shuffled(exact), models=MODELS, rng=rng()).iloc[0]
    assert found["method"] == PAIRED
    assert found["note"].startswith("no mixed model: ")
    assert "no variation between participants" in found["note"]
    assert_allclose(found["ratio"], 0.75)
    assert math.isnan(found["ci_low"])


def test_one_participant_and_nobody():
    one = planted(people=1)
    alone = time_ratios(one, models=MODELS, rng=rng()).iloc[0]
    assert (alone["n"], alone["method"]) == (1, PAIRED)
    assert alone["note"].startswith("no mixed model: 1 participant")
    told = trade_off_sentence(compare_models(one, models=MODELS, rng=rng()), models=MODELS)
    assert told.endswith("not compared, because 1 participant answered with both.")
    nobody = one.iloc[:0]
    assert speed_and_accuracy(nobody, models=MODELS).empty
    assert participant_scores(nobody, models=MODELS).empty
    assert conditional_accuracy(nobody, models=MODELS).empty
    assert compare_models(nobody, models=MODELS, rng=rng())["n"].tolist() == [0, 0, 0]
    assert time_ratios(nobody, models=MODELS, rng=rng())["n"].tolist() == [0]


def comparison(ratio: float, change: float, *, p: tuple[float, float]) -> pd.DataFrame:
    row = {"n": 20, "ci_low": 0.7, "ci_high": 0.9}
    return pd.DataFrame(
        [
            {"measure": "time_s", "estimate": ratio, "p": p[0], **row},
            {"measure": "share_correct", "estimate": change, "p": p[1], **row},
        ]
    )


@pytest.mark.parametrize(
    ("ratio", "change", "p", "words"),
    [
        (0.8, -0.1, (0.01, 0.01), "faster and less accurate: a speed–accuracy trade-off"),
        (1.2, 0.1, (0.01, 0.01), "slower and more accurate: a speed–accuracy trade-off"),
        (0.8, 0.1, (0.01, 0.01), "faster and more accurate: no speed–accuracy trade-off"),
        (1.2, -0.1, (0.01, 0.01), "slower and less accurate: no speed–accuracy trade-off"),
        (0.8, -0.1, (0.01, 0.2), "faster; a difference in accuracy was not shown, so a speed"),
        (1.2, -0.1, (0.2, 0.01), "less accurate; a difference in time was not shown, so a speed"),
        (1.2, -0.1, (0.2, 0.2), "no difference in time or accuracy was shown"),
    ],
)
def test_faster_and_less_accurate_is_never_called_better(ratio, change, p, words):
    told = trade_off_sentence(comparison(ratio, change, p=p), models=MODELS)
    assert f"simplified compared with full models: {words}" in told
    assert not {"better", "worse", "advantage", "superior"} & set(told.split())


def test_a_planted_trade_off_is_told_with_its_numbers():
    answers = planted(ratio=0.7, change=-0.25)
    told = trade_off_sentence(compare_models(answers, models=MODELS, rng=rng()), models=MODELS)
    assert "faster and less accurate: a speed–accuracy trade-off (times as long: 0." in told
    assert "percentage points, 95% CI −" in told
