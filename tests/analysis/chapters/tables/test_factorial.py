"""Repeated-measures analysis of variance: closed forms, another library, what is missing."""

from __future__ import annotations

import warnings
from itertools import product

import numpy as np
import pandas as pd
import pytest
from pingouin import rm_anova

from tactileq.analysis.chapters.tables.factorial import (
    CompleteCells,
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


def test_another_library_agrees() -> None:
    values = np.random.default_rng(2).normal(size=(8, 3, 4))
    complete = complete_cells(cells_of(values), ["A", "B"])
    table = repeated_measures_anova(complete)
    long = pd.DataFrame(
        [(who, a, b, values[who, a, b]) for who, a, b in product(*map(range, values.shape))],
        columns=["who", "A", "B", "mean"],
    )
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "The inplace keyword", module="pingouin")
        found = rm_anova(long, "mean", ["A", "B"], "who", correction=True, effsize="ng2")
    assert list(table["effect"]) == ["A", "B", "A × B"]
    for own, other in {
        "F": "F",
        "df_effect": "ddof1",
        "df_error": "ddof2",
        "p": "p_unc",
        "epsilon": "eps",
        "p_corrected": "p_GG_corr",
        "generalized_eta_squared": "ng2",
    }.items():
        np.testing.assert_allclose(table[own], found[other], rtol=1e-8)


@pytest.mark.parametrize(
    ("effect", "df", "f", "p", "epsilon", "p_corrected"),
    [
        # R 4: anova(lm(y ~ 1), M = …, X = …, idata = …, test = "Spherical"); of one degree of
        # freedom summary(aov(y ~ A * B * C * D + Error(s / (A * B * C * D)))).
        ("C", (1, 5), 17.092, 0.009047, 1, 0.009047),
        ("A × C", (1, 5), 8.6628, 0.03214, 1, 0.03214),
        ("B × D", (4, 20), 0.58515, 0.677044, 0.5359, 0.584957),
        ("A × B × C × D", (4, 20), 0.58631, 0.676251, 0.4986, 0.574007),
    ],
)
def test_four_factors_as_in_r(effect, df, f, p, epsilon, p_corrected) -> None:
    means = np.random.default_rng(3).normal(size=(6, 2, 3, 2, 3)).round(2)
    levels = {name: tuple("012"[:k]) for name, k in zip("ABCD", means.shape[1:], strict=True)}
    table = repeated_measures_anova(CompleteCells(tuple("abcdef"), levels, means, ()))
    row = table.set_index("effect").loc[effect]
    assert (row["df_effect"], row["df_error"]) == df
    corrected = ["df_effect_corrected", "df_error_corrected"]
    assert row[corrected].tolist() == [pytest.approx(epsilon * value, rel=1e-4) for value in df]
    found = row[["F", "p", "epsilon", "p_corrected"]].tolist()
    assert found == pytest.approx([f, p, epsilon, p_corrected], rel=1e-3)


@pytest.mark.parametrize("unit", [1e-13, 1.0, 1e6])
def test_a_constant_difference_has_no_f_in_any_unit(unit: float) -> None:
    values = unit * (np.linspace(0, 1, 8)[:, None] + [0.3, 0.4])
    complete = complete_cells(cells_of(values), ["A"])
    assert np.isnan(repeated_measures_anova(complete).loc[0, "F"])
    pair = pairwise_tests(complete, rng=np.random.default_rng(0)).iloc[0]
    assert pair["mean_difference"] == pytest.approx(0.1 * unit)
    # All 8 signs alike: 2 of 2⁸ patterns.
    assert (pair["p"], pair["note"] != "") == (2 / 2**8, True)
    assert np.isnan(pair["t"])


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
