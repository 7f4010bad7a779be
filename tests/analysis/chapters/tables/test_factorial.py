"""Repeated-measures analysis of variance: closed forms, another library, what is missing."""

from __future__ import annotations

from itertools import product

import numpy as np
import pandas as pd
import pytest

from tactileq.analysis.chapters.tables.factorial import (
    _few_factors,
    _many_factors,
    cell_means,
    complete_cells,
    pairwise_tests,
    participant_cells,
    repeated_measures_anova,
)
from tactileq.modeling import InputError
from tests.refusals import refused


def cells_of(values: np.ndarray) -> pd.DataFrame:
    """One answer per participant and cell of (n, levels …) values; factors A, B, …"""
    rows = []
    for who, *levels in product(*map(range, values.shape)):
        named = dict(zip("ABC", map(str, levels), strict=False))
        value = {"count": 1, "value": values[(who, *levels)]}
        rows.append({"participant_id": f"P{who}", **named, **value})
    return participant_cells(pd.DataFrame(rows), "value", factors=list("ABC"[: values.ndim - 1]))


def test_two_levels_are_a_paired_t_test() -> None:
    values = np.random.default_rng(1).normal(size=(9, 2))
    complete = complete_cells(cells_of(values), ["A"])
    row = repeated_measures_anova(complete).iloc[0]
    pair = pairwise_tests(complete, rng=np.random.default_rng(0)).iloc[0]
    assert row["F"] == pytest.approx(pair["t"] ** 2)
    assert row["p"] == row["p_corrected"] == pytest.approx(pair["p"]) == pair["p_holm"]
    assert (row["df_effect"], row["df_error"], row["epsilon"]) == (1, 8, 1.0)


def test_the_two_libraries_and_the_contrasts_agree() -> None:
    values = np.random.default_rng(2).normal(size=(8, 3, 4))
    complete = complete_cells(cells_of(values), ["A", "B"])
    few, many = _few_factors(complete.long, ["A", "B"]), _many_factors(complete)
    assert list(few["effect"]) == list(many["effect"]) == ["A", "B", "A × B"]
    pd.testing.assert_frame_equal(few, many, check_dtype=False, rtol=1e-8)


def test_three_factors() -> None:
    values = np.random.default_rng(3).normal(size=(7, 2, 3, 2))
    values[:, 1] += 5
    table = repeated_measures_anova(complete_cells(cells_of(values), list("ABC")))
    assert list(table["effect"]) == ["A", "B", "C", "A × B", "A × C", "B × C", "A × B × C"]
    assert list(table["df_effect"]) == [1, 2, 1, 2, 1, 2, 2]
    assert table["p_corrected"][0] < 1e-4
    assert table["generalized_eta_squared"].between(0, 1).all()


def test_all_right_has_no_f_and_one_participant_no_interval() -> None:
    table = repeated_measures_anova(complete_cells(cells_of(np.ones((5, 3))), ["A"]))
    assert table[["F", "p", "p_corrected"]].isna().all(axis=None)
    alone = cells_of(np.ones((1, 3)))
    assert cell_means(alone, ["A"])["ci_low"].isna().all()
    with refused(InputError, expected="two participants", got=1):
        repeated_measures_anova(complete_cells(alone, ["A"]))


def test_incomplete_participants_are_named() -> None:
    cells = cells_of(np.random.default_rng(4).normal(size=(4, 3)))
    complete = complete_cells(cells.drop(index=1), ["A"])
    assert complete.excluded == ("P0",)
    assert complete.means.shape == (3, 3)


def test_factors_that_cannot_be_tested_are_refused() -> None:
    cells = cells_of(np.ones((4, 2)))
    with refused(InputError, expected=["two", "A"], got=1):
        complete_cells(cells[cells["A"] == "1"], ["A"])
    group = cells.assign(A=np.repeat(["old", "young"], 4))
    with refused(InputError, expected=["A", "participants"], got="one"):
        complete_cells(group, ["A"])


def test_unequal_totals_weigh_trials_within_and_not_between_people() -> None:
    answers = pd.DataFrame(
        {"participant_id": list("aab"), "correct": [1.0, 0.0, 1.0], "count": [9, 1, 2]}
    )
    cells = participant_cells(answers, "correct", factors=[])
    assert list(cells["mean"]) == [0.9, 1.0]
    assert list(cells["trials"]) == [10, 2]
    # Wilson's interval of 9 in 10: Brown, Cai and DasGupta, Statistical Science 16 (2001).
    assert cells.loc[0, ["ci_low", "ci_high"]].astype(float).round(4).tolist() == [0.5958, 0.9821]
    assert cell_means(cells, [])["mean"].tolist() == [pytest.approx(0.95)]
