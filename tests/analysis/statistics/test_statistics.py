"""Statistics against published numbers, closed forms and invariants."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pingouin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy import stats

from tactileq.analysis.labels import ALL_TEXTURES
from tactileq.analysis.statistics.confusion import confusion_matrices
from tactileq.analysis.statistics.paired import (
    d_z_interval,
    holm,
    paired_test,
    sign_flips_p,
    standard_error,
    wilcoxon,
)
from tactileq.analysis.statistics.rates import correct_rates
from tactileq.modeling import InputError
from tests.refusals import refused

# Student (1908): extra hours of sleep with two drugs, ten patients. The expected values are those
# that R prints for t.test(paired = TRUE) on its data set `sleep`.
MODELS = ("full", "simplified")
DRUG_1 = [0.7, -1.6, -0.2, -1.2, -0.1, 3.4, 3.7, 0.8, 0.0, 2.0]
DRUG_2 = [1.9, 0.8, 1.1, 0.1, -0.1, 4.4, 5.5, 1.6, 4.6, 3.4]


def rng() -> np.random.Generator:
    return np.random.default_rng(0)


def test_paired_t_agrees_with_students_published_example():
    result = paired_test(DRUG_2, DRUG_1, rng=rng())
    assert (result.n, result.df) == (10, 9)
    assert_allclose(result.t, -4.0621, atol=5e-5)
    assert_allclose(result.p, 0.002833, atol=5e-7)
    assert_allclose([result.ci_low, result.ci_high], [-2.4598858, -0.7001142], atol=5e-8)
    assert_allclose(result.mean_difference, -1.58)
    # All nine differences that are not 0 have one sign: p = 2/2⁹.
    assert_allclose([result.wilcoxon_w, result.wilcoxon_p], [0.0, 2 / 2**9])
    # The effect size and its interval as the R package effectsize documents them for these data.
    assert_allclose([result.d_z, result.d_z_low, result.d_z_high], [-1.28, -2.12, -0.41], atol=5e-3)
    assert result.note == ""


def test_paired_t_by_hand():
    # Differences 1…5: mean 3, variance 5/2, so t = 3/√(5/2/5) = 3√2 and d_z = 3/√(5/2).
    result = paired_test([10, 20, 30, 40, 50], [11, 22, 33, 44, 55], rng=rng())
    assert_allclose(result.t, 3 * np.sqrt(2))
    assert_allclose(result.d_z, 3 / np.sqrt(2.5))
    assert_allclose(result.se_reference, np.sqrt(250 / 5))
    assert_allclose([result.mean_reference, result.mean_other], [30, 33])


@settings(deadline=None)  # with ties the signed-rank test counts permutations
@given(st.lists(st.tuples(st.integers(0, 1000), st.integers(0, 1000)), min_size=2, max_size=8))
def test_d_z_is_t_over_root_n_and_signs_turn_with_the_order(pairs):
    full, simplified = np.array(pairs, dtype=float).T
    result = paired_test(full, simplified, rng=rng())
    turned = paired_test(simplified, full, rng=rng())
    assert_allclose(result.mean_difference, -turned.mean_difference)
    if np.ptp(simplified - full) == 0:
        assert np.isnan(result.t)
        assert result.note
        return
    assert_allclose(result.d_z, result.t / np.sqrt(len(pairs)))
    assert_allclose(result.t, -turned.t)
    assert_allclose(result.p, turned.p)
    assert_allclose(result.ci_low, -turned.ci_high)
    assert result.d_z_low <= result.d_z <= result.d_z_high
    assert (result.p < 0.05) == (result.ci_low > 0 or result.ci_high < 0)


def test_the_packages_cohen_d_is_not_d_z():
    packaged = pingouin.ttest(DRUG_2, DRUG_1, paired=True)["cohen_d"].iloc[0]
    assert abs(packaged) < 0.9
    assert abs(paired_test(DRUG_2, DRUG_1, rng=rng()).d_z) > 1.28


@pytest.mark.parametrize("n", [2, 8, 20, 40])
@pytest.mark.parametrize("t", [-9.0, -1.0, 0.0, 0.3, 4.0])
def test_the_limits_of_d_z_put_t_at_the_tails(t, n):
    low, high = np.array(d_z_interval(t, n)) * np.sqrt(n)
    # By symmetry P(T < t | ncp) = 1 − P(T < −t | −ncp); the positive side is computed exactly.
    sign = 1 if t >= 0 else -1
    tails = stats.nct.cdf(abs(t), n - 1, [sign * low, sign * high])
    assert_allclose(sorted(tails), [0.025, 0.975], atol=1e-6)


def test_holm_by_hand():
    assert_allclose(holm([0.01, 0.04, 0.03, 0.005]), [0.03, 0.06, 0.06, 0.02])
    assert_allclose(holm([0.6, 0.7]), [1.0, 1.0])


def test_holm_leaves_undefined_tests_out_of_the_family():
    assert_allclose(holm([0.01, np.nan, 0.04]), [0.02, np.nan, 0.04])
    assert np.isnan(holm([np.nan, np.nan])).all()


@given(st.lists(st.floats(0, 1), min_size=1, max_size=12))
def test_holm_is_between_p_and_bonferroni_and_keeps_the_order(p):
    adjusted = holm(p)
    assert (adjusted >= np.array(p) - 1e-12).all()
    assert (adjusted <= np.minimum(1, len(p) * np.array(p)) + 1e-12).all()
    order = np.argsort(p, kind="stable")
    assert (np.diff(adjusted[order]) >= -1e-12).all()


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    ("full", "simplified"),
    [
        ([], []),
        ([4.0], [5.0]),
        ([1.0, 2.0, 3.0], [1.0, 2.0, 3.0]),
        ([1 / 3, 2 / 3], [2 / 3, 1.0]),  # equal but for rounding
        ([10.0] * 5, [7.0] * 5),
    ],
)
def test_an_undefined_t_is_nan_with_a_reason(full, simplified):
    result = paired_test(full, simplified, rng=rng())
    for value in (result.t, result.ci_low, result.d_z, result.d_z_low):
        assert np.isnan(value)
    assert result.note.startswith("t undefined")
    assert result.n == len(full)


def test_unequal_lengths_and_missing_values_are_refused():
    with refused(InputError, expected="length", got=["(2,)", "(3,)"]):
        paired_test([1, 2], [1, 2, 3], rng=rng())
    with refused(InputError, expected="finite", got="NaN"):
        paired_test([1, np.nan], [1, 2], rng=rng())


def test_who_does_not_vary_is_tested_by_flipping_signs():
    # Ten people, each 3 points lower: of 2¹⁰ flips only the two without exceptions are as far.
    same = paired_test([10.0] * 10, [7.0] * 10, rng=rng())
    assert np.isnan(same.t)
    assert_allclose([same.p, same.sign_flips_p], 2 / 2**10)
    assert_allclose(sign_flips_p(np.full(10, 3.0), rng=rng(), alternative="greater"), 1 / 2**10)
    assert sign_flips_p(np.full(10, 3.0), rng=rng(), alternative="less") == 1
    assert paired_test([5.0] * 4, [5.0] * 4, rng=rng()).p == 1
    assert np.isnan(paired_test([], [], rng=rng()).p)


@given(st.lists(st.integers(-6, 6), min_size=2, max_size=9))
def test_tied_ranks_are_permuted_as_scipy_does(differences):
    values = np.array(differences, dtype=float)
    moved = values[values != 0]
    if moved.size < 2:
        assert np.isnan(wilcoxon(values, rng=rng())[0]) == (not moved.size)
        return
    every = stats.PermutationMethod(n_resamples=np.inf)
    expected = stats.wilcoxon(moved, method=every)
    found = wilcoxon(values, rng=rng())
    assert_allclose(found, (expected.statistic, expected.pvalue))


def test_nobody_is_compared_with_chance():
    nobody = pd.DataFrame(columns=["participant_id", "texture", "model", "correct"]).astype(
        {"correct": float}
    )
    with refused(InputError, expected="answers", got="none"):
        correct_rates(nobody, ["full"], rng=rng())


@pytest.mark.filterwarnings("error")
def test_correct_rates_against_simple_counts(choices):
    choices = choices.assign(
        correct=choices["correct"].where(choices["texture"] != "wall paper", 1.0)
    )
    rates = correct_rates(choices, MODELS, rng=rng())
    assert len(rates) == 16
    for row in rates.to_dict("records"):
        cell = choices[choices["model"] == row["model"]]
        if row["texture"] != ALL_TEXTURES:
            cell = cell[cell["texture"] == row["texture"]]
        per_person = cell.groupby("participant_id")["correct"].mean().to_numpy()
        assert row["trials"] == len(cell)
        assert_allclose(row["mean"], cell["correct"].mean())
        assert_allclose(row["se"], standard_error(per_person))
        if row["texture"] == "wall paper":
            # Everybody is right: no t, but all signs are alike (16 people, 9999 draws).
            assert np.isnan(row["t"])
            assert row["p"] <= 1e-3
            assert row["note"].startswith("t undefined")
        else:
            expected = stats.ttest_1samp(per_person, 1 / 7)
            assert_allclose([row["t"], row["p"]], [expected.statistic, expected.pvalue])
            assert 0 <= row["ci_low"] < row["mean"] < row["ci_high"] <= 1
    for model in ("full", "simplified"):
        family = rates[(rates["model"] == model) & (rates["texture"] != ALL_TEXTURES)]
        assert_allclose(family["p_holm"], holm(family["p"]))


def test_the_same_seed_gives_the_same_intervals(choices):
    first, second = (correct_rates(choices, MODELS, rng=np.random.default_rng(9)) for _ in range(2))
    pd.testing.assert_frame_equal(first, second)


def test_rows_over_textures_weigh_textures_equally_and_need_all_of_them(choices):
    many = choices[choices["texture"] == "canvas"].assign(correct=0.0)
    gone = (choices["participant_id"] == "sub-03") & (choices["texture"] == "PVC")
    table = pd.concat([choices[~gone], many, many], ignore_index=True)
    row = correct_rates(table, ["full"], rng=rng()).set_index("texture").loc[ALL_TEXTURES]
    assert row["participants"] == 15
    of_full = table[(table["model"] == "full") & (table["participant_id"] != "sub-03")]
    by_texture = of_full.groupby(["texture", "participant_id"])["correct"].mean()
    assert_allclose(row["mean"], by_texture.groupby("texture").mean().mean())
    assert row["trials"] == len(of_full)


NAMES = ("a", "b", "c", "d")
ANSWERS = st.lists(
    st.tuples(
        st.sampled_from(NAMES), st.sampled_from(NAMES), st.sampled_from(["full", "simplified"])
    ),
    min_size=1,
    max_size=60,
)


@given(ANSWERS)
def test_confusion_matrices_count_every_answer_once(answers):
    table = pd.DataFrame(answers, columns=["texture", "answer", "model"]).assign(layout="a|b|c|d")
    matrices = confusion_matrices(table)
    assert set(matrices) == {"full", "simplified"}
    for model, matrix in matrices.items():
        mine = [(real, virtual) for real, virtual, which in answers if which == model]
        assert matrix.textures == NAMES
        assert matrix.counts.sum() == len(mine)
        for i, real in enumerate(NAMES):
            presented = sum(r == real for r, _ in mine)
            assert matrix.counts[i].sum() == presented
            for j, virtual in enumerate(NAMES):
                assert matrix.counts[i, j] == mine.count((real, virtual))
            if presented:
                assert_allclose(matrix.row_shares[i].sum(), 1.0)
            else:
                assert np.isnan(matrix.row_shares[i]).all()


def test_rows_are_presented_and_columns_are_answered():
    table = pd.DataFrame(
        {
            "texture": ["canvas"] * 3,
            "answer": ["PVC", "PVC", None],
            "model": "full",
            "layout": "canvas|PVC",
        }
    )
    matrix = confusion_matrices(table)["full"]
    assert matrix.textures == ("canvas", "PVC")
    assert matrix.counts.tolist() == [[0, 2], [0, 0]]
