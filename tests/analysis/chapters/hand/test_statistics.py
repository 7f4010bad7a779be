"""The hand with either model: planted differences, and who is in a comparison."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from tactileq.analysis.answers.hand import HAND_MEASURES
from tactileq.analysis.chapters.hand.statistics import (
    HAND_PARTICIPANT_COLUMNS,
    HAND_TEST_COLUMNS,
    hand_by_participant,
    hand_means,
    hand_tests,
)
from tactileq.modeling.files.columns import names

pytestmark = pytest.mark.filterwarnings("error")
PAIR = ("full", "other")


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(5)


def hand_of(
    rng: np.random.Generator, *, people: int = 12, faster: float = 0.0, task: str = "absolute"
) -> pd.DataFrame:
    """People who stroke at about 120 mm/s and 1.5 N, with the other model faster."""
    rows = []
    for person in range(1, people + 1):
        own = 120 + 20 * rng.standard_normal()
        for texture in ("oak", "slate", "felt"):
            for model in PAIR:
                rows.append(
                    {
                        "task": task,
                        "participant_id": f"sub-{person:02d}",
                        "texture": texture,
                        "model": model,
                        "trials": 1,
                        "speed_mm_s": own + faster * (model == "other") + rng.standard_normal(),
                        "force_n": 1.5 + 0.1 * rng.standard_normal(),
                        "contact_s": 10 + rng.standard_normal(),
                        "presentations": float(rng.integers(2, 6)),
                    }
                )
    return pd.DataFrame(rows)


def test_planted_speed_is_found_and_nothing_else(rng):
    tests = hand_tests(hand_of(rng, faster=15.0), models=PAIR, rng=rng).set_index("measure")
    assert tests.loc["speed_mm_s", "mean_difference"] == pytest.approx(15.0, abs=1.5)
    assert tests.loc["speed_mm_s", "ci_low"] < 15.0 < tests.loc["speed_mm_s", "ci_high"]
    assert tests.loc["speed_mm_s", "p"] < 1e-6
    assert tests.loc["force_n", "p"] > 0.05
    assert (tests["n"] == 12).all()
    assert (tests["excluded"] == "").all()


def test_it_is_the_paired_t_test_of_the_participants_means(rng):
    hand = hand_of(rng)
    tests = hand_tests(hand, models=PAIR, rng=rng)
    assert list(tests) == names(HAND_TEST_COLUMNS)
    assert tests["measure"].tolist() == list(HAND_MEASURES)
    for measure in HAND_MEASURES:
        means = hand.pivot_table(index="participant_id", columns="model", values=measure)
        expected = stats.ttest_rel(means["other"], means["full"])
        found = tests.set_index("measure").loc[measure]
        assert found["t"] == pytest.approx(expected.statistic)
        assert found["p"] == pytest.approx(expected.pvalue)


def test_a_texture_counts_only_where_it_has_both_models(rng):
    hand = hand_of(rng)
    lone = (hand["participant_id"] == "sub-01") & (hand["texture"] == "oak")
    hand.loc[lone & (hand["model"] == "full"), "speed_mm_s"] = np.nan
    hand.loc[lone & (hand["model"] == "other"), "speed_mm_s"] = 9999.0
    means = hand_means(hand, models=PAIR).set_index(["measure", "participant_id"])
    rest = hand[(hand["participant_id"] == "sub-01") & (hand["texture"] != "oak")]
    expected = rest.groupby("model")["speed_mm_s"].mean()
    found = means.loc[("speed_mm_s", "sub-01")]
    assert found["reference"] == pytest.approx(expected["full"])
    assert found["other"] == pytest.approx(expected["other"])


def test_each_participant_has_a_row_with_every_measure(rng):
    means = hand_means(hand_of(rng), models=PAIR)
    wide = hand_by_participant(means)
    assert list(wide) == names(HAND_PARTICIPANT_COLUMNS)
    assert len(wide) == 12
    for measure in HAND_MEASURES:
        own = means[means["measure"] == measure].sort_values("participant_id")
        for which in ("reference", "other"):
            assert wide[f"{measure}_{which}"].tolist() == own[which].tolist()


def test_who_has_no_pair_is_named(rng):
    hand = hand_of(rng)
    hand.loc[hand["participant_id"] == "sub-03", ["speed_mm_s", "force_n"]] = np.nan
    hand = hand[~((hand["participant_id"] == "sub-07") & (hand["model"] == "other"))]
    tests = hand_tests(hand, models=PAIR, rng=rng).set_index("measure")
    assert tests.loc["speed_mm_s", "excluded"] == "sub-03, sub-07"
    assert tests.loc["contact_s", "excluded"] == "sub-07"
    assert tests["n"].tolist() == [10, 10, 11, 11]


def test_tasks_are_compared_apart_and_other_models_left_out(rng):
    hand = pd.concat([hand_of(rng), hand_of(rng, faster=30.0, task="relative")])
    third = hand.assign(model="third", speed_mm_s=999.0)[hand["model"] == "full"]
    tests = hand_tests(pd.concat([hand, third]), models=PAIR, rng=rng)
    speeds = tests[tests["measure"] == "speed_mm_s"].set_index("task")
    assert speeds["mean_difference"].to_dict() == pytest.approx(
        {"absolute": 0.0, "relative": 30.0}, abs=2.0
    )


def test_one_participant_and_an_absent_model_are_told_not_tested(rng):
    one = hand_tests(hand_of(rng, people=1), models=PAIR, rng=rng)
    assert one["t"].isna().all()
    assert (one["note"] == "t undefined: 1 participant").all()
    absent = hand_tests(hand_of(rng), models=("full", "elsewhere"), rng=rng)
    assert (absent["n"] == 0).all()
    assert absent["p"].isna().all()
    assert absent["excluded"].str.count("sub-").tolist() == [12] * 4
