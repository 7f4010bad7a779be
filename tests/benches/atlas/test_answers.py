"""The tests of answers in the atlas: against what is exact in theory."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from tactileq.analysis.statistics.paired import (
    t_test,
    t_tests,
)
from tactileq.analysis.statistics.rates import bootstrap_intervals
from tactileq.benches.atlas import answers
from tactileq.benches.atlas.answers import BOOTSTRAP, CASES, D_Z, RANKS, RATERS, T
from tactileq.benches.atlas.case import FAILS, HOLDS, Case
from tactileq.benches.atlas.edges import examine
from tactileq.benches.raters import paired_power

NEVER = [case for case in CASES if case.theory is answers.never]


def case_of(axis: str, method: str, figure: str = "") -> Case:
    return next(
        c
        for c in CASES
        if (c.axis.name, c.method) == (axis, method) and c.figure.startswith(figure)
    )


@pytest.mark.parametrize("case", CASES, ids=[f"{c.method}, {c.axis.name}" for c in CASES])
def test_all_hold_where_it_is_easy_and_fail_where_theory_has_an_edge(case: Case) -> None:
    for column in case.columns.values():
        mild, severe = (
            case.verdict(case.measure(end, column, full=False))
            for end in (case.axis.mild, case.axis.severe)
        )
        assert mild == HOLDS
        assert severe == (HOLDS if case in NEVER else FAILS)


def test_exact_tests_keep_their_level_with_three_raters() -> None:
    assert len(NEVER) == 3
    alarms = case_of("raters", T, "differences found").measure(3.0, 0.0, full=True)
    # Six thousand studies: three standard deviations of a share of 5 % are 0.0084.
    assert alarms == pytest.approx(0.05, abs=0.0085)
    missed = case_of("raters", D_Z).measure(3.0, np.nan, full=True)
    assert missed == pytest.approx(0.05, abs=0.017)


def test_five_signs_alike_are_not_significant_and_six_are() -> None:
    case = case_of("raters", RANKS, "clear")
    assert case.measure(5.0, np.nan, full=False) == 1.0
    # All six must point one way.
    alike = stats.norm.cdf(answers.CLEAR_EFFECT / answers.DIFFERENCE_SD) ** 6
    assert case.measure(6.0, np.nan, full=True) == pytest.approx(1 - alike, abs=0.02)
    assert 5 < answers.fewest_for_ranks(np.nan) < 6


def test_power_is_that_of_the_noncentral_t() -> None:
    power = paired_power(answers.EFFECT / answers.DIFFERENCE_SD, RATERS)
    assert power == pytest.approx(0.9, abs=0.005)
    full, simplified = answers.ratings(6000, RATERS, mean=60.0, effect=answers.EFFECT)
    found = (answers.t_p(simplified - full) < 0.05).mean()
    assert found == pytest.approx(power, abs=0.012)
    for count in (3, 4, 6):
        missed = case_of("raters", T, "clear").measure(float(count), np.nan, full=True)
        expected = 1 - paired_power(answers.CLEAR_EFFECT / answers.DIFFERENCE_SD, count)
        assert missed == pytest.approx(expected, abs=0.02)


def test_the_end_of_the_scale_takes_what_censoring_takes() -> None:
    case = case_of("ratings at the end of the scale", "difference of means")
    edge = answers.end_of_the_scale(np.nan)
    assert case.measure(edge, np.nan, full=True) == pytest.approx(answers.UNDERSTATED, abs=0.005)
    full, _ = answers.ratings(6000, RATERS, mean=answers._mean_near_the_end(0.3), effect=0.0)
    assert (full > answers.HIGHEST).mean() == pytest.approx(0.3, abs=0.01)


def test_careless_raters_cost_power_where_theory_says() -> None:
    case = case_of("careless raters", T)
    edge = answers.careless_share(np.nan)
    assert 0.005 < edge < case.axis.default  # type: ignore[operator]
    assert case.exception
    found = examine(case, "", full=True)
    assert 0.6 * edge < found.holds_to < 1.7 * edge
    ranks = case_of("careless raters", RANKS)
    assert ranks.measure(0.1, np.nan, full=False) < case.measure(0.1, np.nan, full=False)
    who, anywhere = answers.careless((500, 20), 0.2)
    assert who.mean() == pytest.approx(0.2, abs=0.02)
    assert (anywhere[0] - anywhere[1]).var() == pytest.approx(100**2 / 6, rel=0.05)


def test_where_nobody_errs_there_is_no_interval() -> None:
    rate = answers.rate_of_no_interval(np.nan)
    assert (1 - rate) ** (24 * 3) == pytest.approx(answers.MISSED)
    case = case_of("wrong answers", BOOTSTRAP)
    # Nearly all studies without an error: what is missed is that share at least.
    severe = case.measure(0.002, np.nan, full=True)
    assert severe == pytest.approx((1 - 0.002) ** 72, abs=0.07)


def test_resampled_means_of_few_vary_too_little() -> None:
    edge = answers.fewest_for_the_bootstrap(np.nan)
    assert edge == pytest.approx(9.28, abs=0.01)
    case = case_of("participants", BOOTSTRAP)
    assert case.measure(5.0, np.nan, full=True) > answers.MISSED
    assert case.measure(24.0, np.nan, full=True) < answers.MISSED


def test_rows_are_tested_as_one_by_one() -> None:
    rng = np.random.default_rng(3)
    rows = rng.normal(1.0, 3.0, (40, 16))  # permutations are slow to count below 14
    rows[::3, :2] = 0.0
    single = np.array([t_test(row) for row in rows]).T
    assert np.array(t_tests(rows)) == pytest.approx(single)
    silent = np.vstack((rows, np.zeros((1, 16))))
    by_scipy = [stats.wilcoxon(row).pvalue for row in rows]
    assert answers.wilcoxon_p(rows) == pytest.approx(by_scipy)
    assert np.isnan(answers.wilcoxon_p(silent)[-1])
    rates = np.round(rng.random((6, 10)) * 3) / 3
    low, high = bootstrap_intervals(rates, np.random.default_rng(1))
    assert (low < rates.mean(axis=1)).all()
    assert (rates.mean(axis=1) < high).all()
    # As wide as a normal interval of the resampled mean, nearly.
    normal = 2 * 1.96 * rates.std(axis=1) / np.sqrt(10)
    assert high - low == pytest.approx(normal, rel=0.25)


def test_an_undefined_test_finds_nothing() -> None:
    same = np.full((2, 5), 3.0)
    assert np.isnan(answers.t_p(same)).all()
    assert answers._found(answers.t_p, np.zeros((2, 5)), same) == 0.0
