"""Accuracy against chance, and d′: another library, closed forms, what has none."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from tactileq.analysis.chapters.tables.chance import against_chance
from tactileq.analysis.chapters.tables.factorial import participant_cells

RNG = np.random.default_rng(0)


def rows_of(right: Mapping[str, int], *, classes: str, trials: int, wrong: str = "") -> list[dict]:
    """Each participant's number of right answers to each class; wrong ones name the next class."""
    return [
        {"participant_id": who, "presented": name, "answered": said, "count": count}
        | {"correct": float(name == said)}
        for who, hits in right.items()
        for place, name in enumerate(classes)
        for said, count in ((name, hits), (wrong or classes[place - 1], trials - hits))
        if count
    ]


def table_of(rows: Sequence[dict], *, presented: str, factors: Sequence[str] = ()) -> pd.DataFrame:
    answers = pd.DataFrame(rows)
    cells = participant_cells(answers, "correct", factors=factors)
    return against_chance(answers, cells, factors=factors, presented=tuple(presented), rng=RNG)


def test_the_test_is_scipys_and_holm_is_over_conditions() -> None:
    own = {"P1": 6, "P2": 5, "P3": 8, "P4": 3}
    rows = [row | {"A": "low"} for row in rows_of(own, classes="abcd", trials=10)]
    less = {who: hits - 2 - (who == "P1") for who, hits in own.items()}
    rows += [row | {"A": "high"} for row in rows_of(less, classes="abcd", trials=10)]
    found = table_of(rows, presented="abcd", factors=["A"]).set_index("condition")
    for level, hits in (("low", own), ("high", less)):
        known = stats.ttest_1samp([value / 10 for value in hits.values()], 0.25)
        row = found.loc[level]
        assert (row["t"], row["p"]) == (pytest.approx(known[0]), pytest.approx(known[1]))
        assert row["df"] == 3
        interval = known.confidence_interval(0.95)
        assert [row["ci_low"], row["ci_high"]] == pytest.approx(list(interval))
    assert found.loc["low", "p_holm"] == pytest.approx(2 * found.loc["low", "p"])


@pytest.mark.parametrize(("alternatives", "hits"), [(3, 634), (4, 552)])
def test_d_prime_of_one_as_in_the_published_table(alternatives: int, hits: int) -> None:
    # Hacker and Ratcliff (1979): shares of 0.634 of three and 0.552 of four are d′ = 1.00.
    right = {"P1": hits - 30, "P2": hits + 30}
    classes = "abcd"[:alternatives]
    row = table_of(rows_of(right, classes=classes, trials=1000), presented=classes).iloc[0]
    assert row["d_prime"] == pytest.approx(1.0, abs=0.005)


def test_two_classes_have_hits_and_false_alarms_corrected_loglinearly() -> None:
    # H = 10.5/11 and F = 0.5/11 of all right, H = 8.5/11 and F = 2.5/11 of 8 in 10 each.
    rows = rows_of({"P1": 10, "P2": 8}, classes="ab", trials=10)
    row = table_of(rows, presented="ab").iloc[0]
    known = 2 * stats.norm.ppf([10.5 / 11, 8.5 / 11])
    assert row["d_prime"] == pytest.approx(known.mean())
    # One who always says a has no sensitivity, but half of the answers right.
    rows = [
        {"participant_id": "P1", "presented": name, "answered": "a", "count": 10}
        | {"correct": float(name == "a")}
        for name in "ab"
    ]
    row = table_of(rows, presented="ab").iloc[0]
    assert (row["mean"], row["d_prime"]) == (0.5, 0.0)


@pytest.mark.parametrize("classes", ["ab", "abc", "abcd"])
def test_all_right_is_tested_by_sign_flips_and_nothing_is_infinite(classes: str) -> None:
    right = dict.fromkeys(["P1", "P2", "P3", "P4", "P5"], 4)
    row = table_of(rows_of(right, classes=classes, trials=4), presented=classes).iloc[0]
    assert row["p"] == 2 / 2**5
    assert not np.isinf(
        row[["d_prime", "d_prime_low", "d_prime_high", "ci_low"]].astype(float)
    ).any()
    assert np.isnan(row["d_prime"]) == (len(classes) > 2)


def test_what_cannot_be_said_is_left_out_and_noted() -> None:
    alone = table_of(rows_of({"P1": 5}, classes="abc", trials=9), presented="abc").iloc[0]
    assert np.isnan([alone["t"], alone["p"], alone["p_holm"]]).all()
    assert "1 participant" in alone["note"]
    two = rows_of({"P1": 5, "P2": 7}, classes="abc", trials=9)
    some = table_of([row for row in two if row["presented"] != "c"], presented="abc").iloc[0]
    assert "2 of 3 classes" in some["note"]
    assert np.isnan(some["d_prime"])
    unsure = rows_of({"P1": 5, "P2": 7}, classes="ab", trials=9, wrong="don't know")
    other = table_of(unsure, presented="ab").iloc[0]
    assert "two classes" in other["note"]
    assert np.isnan(other["d_prime"])
