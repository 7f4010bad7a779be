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

from analysis.labels import ALL_TEXTURES, IDENTICAL
from analysis.statistics.confusion import confusion_matrices
from analysis.statistics.paired import (
    d_z_interval,
    holm,
    paired_test,
    rating_tests,
    standard_error,
)
from analysis.statistics.rates import correct_rates, rate_tests
from modeling import InputError

# Student (1908): extra hours of sleep with two drugs, ten patients. The expected values are those
# that R prints for t.test(paired = TRUE) on its data set `sleep`.
DRUG_1 = [0.7, -1.6, -0.2, -1.2, -0.1, 3.4, 3.7, 0.8, 0.0, 2.0]
DRUG_2 = [1.9, 0.8, 1.1, 0.1, -0.1, 4.4, 5.5, 1.6, 4.6, 3.4]


def test_paired_t_agrees_with_students_published_example():
    result = paired_test(DRUG_2, DRUG_1)
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
    result = paired_test([10, 20, 30, 40, 50], [11, 22, 33, 44, 55])
    assert_allclose(result.t, 3 * np.sqrt(2))
    assert_allclose(result.d_z, 3 / np.sqrt(2.5))
    assert_allclose(result.se_full, np.sqrt(250 / 5))
    assert_allclose([result.mean_full, result.mean_simplified], [30, 33])


@settings(deadline=None)  # with ties the signed-rank test counts permutations
@given(st.lists(st.tuples(st.integers(0, 1000), st.integers(0, 1000)), min_size=2, max_size=8))
def test_d_z_is_t_over_root_n_and_signs_turn_with_the_order(pairs):
    full, simplified = np.array(pairs, dtype=float).T
    result, turned = paired_test(full, simplified), paired_test(simplified, full)
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
    assert abs(paired_test(DRUG_2, DRUG_1).d_z) > 1.28


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
    result = paired_test(full, simplified)
    for value in (result.t, result.p, result.ci_low, result.d_z, result.d_z_low):
        assert np.isnan(value)
    assert result.note.startswith("t undefined")
    assert result.n == len(full)


def test_unequal_lengths_and_missing_values_are_refused():
    with pytest.raises(InputError, match="one length"):
        paired_test([1, 2], [1, 2, 3])
    with pytest.raises(InputError, match="finite"):
        paired_test([1, np.nan], [1, 2])


def test_rating_tests_cover_every_scale_and_texture(ratings):
    tests = rating_tests(ratings)
    assert len(tests) == 14
    assert tests.groupby("scale").size().to_dict() == {
        "vibration magnitude": 7,
        "frequency pattern": 7,
    }
    for _, family in tests.groupby("scale"):
        assert_allclose(family["p_holm"], holm(family["p"]))
    wide = ratings.pivot_table(
        index="participant_id", columns=["texture", "model"], values="frequency_similarity"
    )
    expected = stats.ttest_rel(wide["PVC"]["simplified"], wide["PVC"]["full"])
    row = tests[(tests["scale"] == "frequency pattern") & (tests["texture"] == "PVC")].iloc[0]
    assert_allclose([row["t"], row["p"]], [expected.statistic, expected.pvalue])
    assert row["p_holm"] < 0.001


def test_identical_models_are_described_but_not_tested(ratings, choices):
    plain = rating_tests(ratings)
    marked = rating_tests(ratings, identical={"canvas", "MDF"})
    same = marked["texture"].isin(["canvas", "MDF"])
    assert (marked[same]["note"] == IDENTICAL).all()
    assert marked[same][["t", "p", "p_holm", "d_z", "wilcoxon_p"]].isna().all(axis=None)
    for name in ("n", "mean_full", "mean_simplified", "mean_difference", "ci_low"):
        assert_allclose(marked[name], plain[name])
    for _, family in marked[~same].groupby("scale"):
        assert len(family) == 5
        assert_allclose(family["p_holm"], holm(family["p"]))
    rates = rate_tests(choices, identical={"canvas"}).set_index("texture")
    assert rates.loc["canvas", "note"] == IDENTICAL
    assert np.isnan(rates.loc["canvas", "p"])
    others = rate_tests(choices).set_index("texture").drop("canvas")
    assert_allclose(rates.drop("canvas")["p"], others["p"])


def test_a_participant_without_one_rating_is_named_and_left_out_of_that_pair_only(ratings):
    gap = (ratings["participant_id"] == "sub-03") & (ratings["texture"] == "canvas")
    gap &= ratings["model"] == "simplified"
    tests = rating_tests(
        ratings.assign(magnitude_similarity=ratings["magnitude_similarity"].where(~gap))
    )
    hit = (tests["scale"] == "vibration magnitude") & (tests["texture"] == "canvas")
    assert tests[hit]["excluded"].tolist() == ["sub-03"]
    assert tests[hit]["n"].tolist() == [15]
    assert (tests[~hit]["excluded"] == "").all()
    assert (tests[~hit]["n"] == 16).all()


def test_a_participant_without_a_day_is_named_everywhere(choices):
    gone = (choices["participant_id"] == "sub-05") & (choices["model"] == "full")
    tests = rate_tests(choices[~gone])
    assert (tests["excluded"] == "sub-05").all()
    assert (tests["n"] == 15).all()


def test_no_answers_are_refused(choices, ratings):
    for analyse, table in ((rating_tests, ratings), (rate_tests, choices)):
        with pytest.raises(InputError, match="got none"):
            analyse(table.iloc[:0])
    with pytest.raises(InputError, match="got none"):
        correct_rates(choices.iloc[:0], rng=np.random.default_rng(0))


def test_rate_tests_keep_the_overall_row_out_of_the_family(choices):
    tests = rate_tests(choices)
    assert tests["texture"].tolist()[-1] == ALL_TEXTURES
    assert np.isnan(tests["p_holm"].iloc[-1])
    assert_allclose(tests["p_holm"].iloc[:-1], holm(tests["p"].iloc[:-1]))
    by = ["participant_id", "texture", "model"]
    means = choices.groupby(by)["correct"].mean().groupby(["texture", "model"]).mean()
    assert_allclose(
        tests.set_index("texture")["mean_full"].drop(ALL_TEXTURES),
        [means[texture, "full"] for texture in tests["texture"][:-1]],
    )


@pytest.mark.filterwarnings("error")
def test_correct_rates_against_simple_counts(choices):
    choices = choices.assign(
        correct=choices["correct"].where(choices["texture"] != "wall paper", 1.0)
    )
    rates = correct_rates(choices, rng=np.random.default_rng(0))
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
            assert np.isnan(row["p"])
            assert row["note"].startswith("t undefined")
        else:
            expected = stats.ttest_1samp(per_person, 1 / 7)
            assert_allclose([row["t"], row["p"]], [expected.statistic, expected.pvalue])
            assert 0 <= row["ci_low"] < row["mean"] < row["ci_high"] <= 1
    for model in ("full", "simplified"):
        family = rates[(rates["model"] == model) & (rates["texture"] != ALL_TEXTURES)]
        assert_allclose(family["p_holm"], holm(family["p"]))


def test_the_same_seed_gives_the_same_intervals(choices):
    first, second = (correct_rates(choices, rng=np.random.default_rng(9)) for _ in range(2))
    pd.testing.assert_frame_equal(first, second)


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
