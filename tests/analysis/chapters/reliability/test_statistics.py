"""Reliability: published correlations, planted spreads, and who is named as careless."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactileq.analysis.chapters.reliability.statistics import (
    AGREEMENT_COLUMNS,
    RATER_COLUMNS,
    SIGN_COLUMNS,
    agreement,
    answers_at_chance,
    fast_answers,
    rater_table,
    same_ratings,
    within_participant_sd,
)
from tactileq.modeling.files.columns import names

pytestmark = pytest.mark.filterwarnings("error")
SCALE = "magnitude_similarity"
# Shrout and Fleiss 1979, Psychological Bulletin 86, 420, table 2: six targets, four judges.
SHROUT_FLEISS = np.array(
    [[9, 2, 5, 8], [6, 1, 3, 2], [8, 4, 6, 8], [7, 1, 2, 6], [10, 5, 6, 9], [6, 2, 4, 7]]
)


def ratings_of(values: np.ndarray) -> pd.DataFrame:
    """Ratings of (cells, people), two cells to a texture; NaN is not answered."""
    rows = []
    for (cell, person), value in np.ndenumerate(np.asarray(values, dtype=float)):
        texture, model = f"t{cell // 2}", ("full", "simplified")[cell % 2]
        rows.append((f"sub-{person + 1:02d}", texture, model, value))
    return pd.DataFrame(rows, columns=["participant_id", "texture", "model", SCALE])


def rates_of(*right: int, of: int) -> pd.DataFrame:
    """Right answers of each participant."""
    rows = [(f"sub-{n:02d}", float(i < r)) for n, r in enumerate(right, 1) for i in range(of)]
    return pd.DataFrame(rows, columns=["participant_id", "correct"])


def test_published_intraclass_correlations():
    found = agreement(ratings_of(SHROUT_FLEISS), SCALE)
    assert list(found) == names(AGREEMENT_COLUMNS)
    by_kind = found.set_index("kind")
    # Their table 4: ICC(2,1), ICC(2,k), ICC(3,1), ICC(3,k), two decimals.
    assert by_kind["icc"].round(2).to_dict() == {
        "agreement, one rating": 0.29,
        "agreement, mean of all": 0.62,
        "consistency, one rating": 0.71,
        "consistency, mean of all": 0.91,
    }
    assert by_kind["ratings"].tolist() == [1, 4, 1, 4]
    assert (found[["participants", "cells"]] == [4, 6]).all(axis=None)
    assert (found["ci_low"] < found["icc"]).all()
    assert (found["ci_high"] > found["icc"]).all()
    assert (found[["excluded", "note"]] == "").all(axis=None)


@settings(max_examples=15)
@given(seed=st.integers(0, 999), shift=st.floats(-20, 20))
def test_consistency_does_not_change_with_a_participants_own_mean(seed, shift):
    rng = np.random.default_rng(seed)
    values = 50 + 10 * rng.standard_normal((8, 1)) + 5 * rng.standard_normal((8, 5))
    moved = values + np.array([shift, 0, 0, 0, 0])
    before, after = (agreement(ratings_of(v), SCALE).set_index("kind") for v in (values, moved))
    of_one = "consistency, one rating"
    assert after.loc[of_one, "icc"] == pytest.approx(before.loc[of_one, "icc"], abs=1e-9)


def test_planted_shares_of_variance_are_found():
    rng = np.random.default_rng(4)
    cells, people, noise = (rng.standard_normal(n) for n in ((200, 1), (1, 60), (200, 60)))
    found = agreement(ratings_of(50 + 2 * cells + 1 * people + 1 * noise), SCALE)
    icc = found.set_index("kind")["icc"]
    # Variances 4, 1 and 1; the standard error over 200 cells and 60 people is below 0.04.
    assert icc["consistency, one rating"] == pytest.approx(4 / 5, abs=0.08)
    assert icc["agreement, one rating"] == pytest.approx(4 / 6, abs=0.12)


def test_participants_with_a_missing_cell_are_named_and_left_out():
    with_missing = np.column_stack([SHROUT_FLEISS, [5, np.nan, 5, 6, 7, 8]])
    found = agreement(ratings_of(with_missing), SCALE)
    assert (found["excluded"] == "sub-05").all()
    complete = agreement(ratings_of(SHROUT_FLEISS), SCALE)
    np.testing.assert_allclose(found["icc"], complete["icc"])


def test_somebody_without_any_rating_is_named_too():
    nobody = np.column_stack([SHROUT_FLEISS, np.full(6, np.nan)])
    assert (agreement(ratings_of(nobody), SCALE)["excluded"] == "sub-05").all()


@pytest.mark.parametrize(
    ("values", "why"),
    [
        (np.full((4, 3), 7.0), "all ratings are the same"),
        (np.arange(4.0)[:, None] + [0.1, 0.2, 0.3], "only in their mean"),
        (SHROUT_FLEISS[:, :1], "1 participant"),
        (SHROUT_FLEISS[:1], "1 cell"),
        (np.full((3, 3), np.nan), "0 participant"),
    ],
)
def test_where_there_is_no_correlation_the_table_says_why(values, why):
    found = agreement(ratings_of(values), SCALE)
    assert found[["icc", "ci_low", "ci_high"]].isna().all(axis=None)
    assert found["note"].str.contains(why, regex=False).all()
    assert len(found) == 4


def test_spread_between_repeats_in_closed_form():
    table = pd.concat([ratings_of([[10, 50], [20, 60]]), ratings_of([[14, 50], [20, 62]])])
    table = pd.concat([table, ratings_of([[12, np.nan]])])
    found = rater_table(table, SCALE).set_index("participant_id")
    # 10, 14, 12 (variance 4, 2 df) and 20, 20 (0, 1 df); 50, 50 (0) and 60, 62 (2).
    assert found.loc["sub-01", "within_sd"] == pytest.approx(np.sqrt(8 / 3))
    assert found.loc["sub-02", "within_sd"] == pytest.approx(1.0)
    assert found["repeated_cells"].tolist() == [2, 2]
    assert found["ratings"].tolist() == [5, 4]
    pooled = within_participant_sd(found)
    assert pooled == pytest.approx(np.sqrt((8 / 3 + 1) / 2))


def test_without_repeats_there_is_no_spread_between_them():
    found = rater_table(ratings_of(SHROUT_FLEISS), SCALE)
    assert list(found) == names(RATER_COLUMNS)
    assert found["within_sd"].isna().all()
    assert np.isnan(within_participant_sd(found))


def test_shares_at_the_ends():
    found = rater_table(ratings_of([[0, 100], [100, 99.99], [50, np.nan]]), SCALE)
    assert found["share_at_ends"].tolist() == pytest.approx([2 / 3, 1 / 2])
    assert found["mean"].tolist() == pytest.approx([50, 199.99 / 2])


def test_nobody_has_no_row():
    none = ratings_of(SHROUT_FLEISS).iloc[:0]
    assert rater_table(none, SCALE).empty
    assert same_ratings(none, SCALE).empty


def test_who_rates_all_the_same_is_named_once_there_are_enough_ratings():
    values = np.array([[70, 70, np.nan], [70, 71, np.nan], [70, 70, 9], [70, 70, 9], [70, 70, 9]])
    found = same_ratings(ratings_of(values), SCALE)
    assert list(found) == names(SIGN_COLUMNS)
    assert found.to_numpy().tolist() == [["sub-01", "all ratings the same", "5 ratings of 70"]]


def test_who_answers_all_within_the_limit_is_named():
    times = {"sub-01": [0.5] * 5, "sub-02": [0.5] * 4 + [2.0], "sub-03": [0.5] * 4}
    table = pd.DataFrame(
        [(person, t) for person, own in times.items() for t in own],
        columns=["participant_id", "response_time_s"],
    )
    found = fast_answers(table, limit_s=2.0)
    assert found["participant_id"].tolist() == ["sub-01"]
    assert found["sign"].tolist() == ["every answer within 2 s"]
    assert found["detail"].tolist() == ["5 answers, slowest 0.5 s"]


def test_who_guesses_while_the_group_does_not_is_named(rng):
    found = answers_at_chance(rates_of(30, 28, 6, 29, 31, 27, of=42), chance=1 / 7, rng=rng)
    assert found["participant_id"].tolist() == ["sub-03"]
    assert found["detail"].tolist() == ["6 of 42 right (14%; chance 14%, the others 69%)"]


@pytest.mark.parametrize(
    "table",
    [
        rates_of(6, 5, 7, 6, 8, 4, of=42),  # the group guesses
        rates_of(42, 42, 42, 42, 42, 42, of=42),  # all right
        rates_of(3, 4, 2, 3, 4, 3, 4, 3, of=5),  # 2 of 5 may be luck
        rates_of(1, 5, 5, 5, 5, 5, of=4),  # too few to tell
        rates_of(2, of=42),  # no group
        rates_of(of=42),
    ],
)
def test_nobody_is_named_where_nothing_stands_out(table, rng):
    assert answers_at_chance(table, chance=1 / 7, rng=rng).empty


def test_all_but_one_right_leaves_the_guesser_named(rng):
    found = answers_at_chance(rates_of(*[42] * 6, 6, of=42), chance=1 / 7, rng=rng)
    assert found["participant_id"].tolist() == ["sub-07"]


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(1)
