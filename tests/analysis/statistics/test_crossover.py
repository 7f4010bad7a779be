"""Models on different days: the two-sample t-test of AB/BA designs, least squares, planted days."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np
import pandas as pd
import pytest
import statsmodels.api as sm
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy import integrate, stats

from tactileq.analysis.statistics.crossover import balanced, day_contrasts, mean_differences
from tactileq.analysis.statistics.equivalence import (
    bayes_factor_null,
    equivalence_test,
    one_sided_tests,
    verdict,
)
from tactileq.analysis.statistics.paired import d_z_interval, paired_test, t_tests
from tactileq.modeling.arrays import Floats

MODELS = ("full", "simplified")
BOUNDS = (-7.5, 7.5)
SIZES = st.tuples(st.integers(2, 8), st.integers(2, 8))


def rng() -> np.random.Generator:
    return np.random.default_rng(3)


def of_groups(last: int, first: int) -> Floats:
    """(n, 1) contrasts: +1 of those who had the other model last, −1 of those who had it first."""
    return np.repeat([1.0, -1.0], [last, first])[:, None]


def answers(sessions: dict[str, Sequence[tuple[int, str]]]) -> pd.DataFrame:
    """Two answers in each of these (session, model) of each participant."""
    rows = [(who, day, model) for who, days in sessions.items() for day, model in days]
    columns = ["participant_id", "session", "model"]
    return pd.DataFrame(rows * 2, columns=columns).sample(frac=1.0, random_state=1)


# --- Two days ---------------------------------------------------------------------------------


@given(SIZES, st.integers(0, 1000))
def test_two_days_are_the_t_test_of_two_samples(groups: tuple[int, int], seed: int) -> None:
    """Of the differences of those and minus the differences of these, its mean halved."""
    d = np.random.default_rng(seed).normal(2.0, 5.0, sum(groups))
    known = stats.ttest_ind(d[: groups[0]], -d[groups[0] :])
    low, high = known.confidence_interval(0.95)
    found = paired_test(np.zeros(d.size), d, rng=rng(), contrasts=of_groups(*groups))
    middle = (d[: groups[0]].mean() + d[groups[0] :].mean()) / 2
    assert_allclose([found.t, found.p, found.df], [known.statistic, known.pvalue, known.df])
    seen = [found.mean_difference, found.ci_low, found.ci_high]
    assert_allclose(seen, [middle, low / 2, high / 2], atol=1e-12)
    assert found.n == sum(groups)


@given(SIZES, st.floats(-1e3, 1e3), st.integers(0, 1000))
def test_nothing_that_a_day_adds_is_seen(groups: tuple[int, int], day: float, seed: int) -> None:
    d, contrasts = np.random.default_rng(seed).normal(2.0, 5.0, sum(groups)), of_groups(*groups)
    moved = d + day * contrasts[:, 0]
    one, other = (
        paired_test(np.zeros(d.size), each, rng=rng(), contrasts=contrasts) for each in (d, moved)
    )
    names = ("mean_difference", "ci_low", "ci_high", "t", "p", "d_z", "d_z_low", "d_z_high")
    for name in (*names, "shapiro_p", "wilcoxon_p", "sign_flips_p"):
        assert_allclose(getattr(other, name), getattr(one, name), rtol=1e-6, atol=1e-8)
    tost = [equivalence_test(each, BOUNDS, rng=rng(), contrasts=contrasts) for each in (d, moved)]
    for name in ("ci_low", "ci_high", "t_low", "t_high", "p"):
        first, second = (getattr(each, name) for each in tost)
        assert_allclose(second, first, rtol=1e-6, atol=1e-8)


@given(st.integers(2, 10), st.integers(0, 1000))
def test_the_mean_of_groups_of_one_size_is_the_plain_mean(each: int, seed: int) -> None:
    d = np.random.default_rng(seed).normal(2.0, 5.0, (3, 2 * each))
    assert_allclose(mean_differences(d, of_groups(each, each)).mean, d.mean(axis=1))


def test_of_unequal_groups_only_the_adjusted_mean_is_without_the_day() -> None:
    """13 and 7 people, 6 points more on the second day: a plain mean holds 6 · (13 − 7) / 20."""
    contrasts = of_groups(13, 7)
    d = np.random.default_rng(4).normal(-7.5, 4.0, (4000, 20)) + 6.0 * contrasts[:, 0]
    found = mean_differences(d, contrasts)
    error = 4 * 4.0 / np.sqrt(4000 * found.size)
    assert found.mean.mean() == pytest.approx(-7.5, abs=error)
    assert d.mean() == pytest.approx(-7.5 + 6 * 6 / 20, abs=error)
    # What is called equal at the bound by TOST: at most one in twenty, as is not so without days.
    _, low, _, high = one_sided_tests(found, BOUNDS)
    equal = int((np.maximum(low, high) < 0.05).sum())
    assert stats.binomtest(equal, 4000, 0.05).pvalue > 1e-3
    _, low, _, high = one_sided_tests(d, BOUNDS)
    assert (np.maximum(low, high) < 0.05).mean() > 0.1
    *_, lows, highs = t_tests(found)
    covered = int(((lows <= -7.5) & (highs >= -7.5)).sum())
    assert stats.binomtest(covered, 4000, 0.95).pvalue > 1e-3


def test_variances_of_the_mean_are_those_of_least_squares() -> None:
    found = mean_differences(rng().normal(size=(1, 20)), of_groups(13, 7))
    assert found.size == pytest.approx(4 * 13 * 7 / 20)
    assert found.df == 18
    assert mean_differences(rng().normal(size=(1, 20))).size == pytest.approx(20)


# --- More days --------------------------------------------------------------------------------


def test_three_days_in_all_six_orders_are_a_regression() -> None:
    """Two days of one model and one of the other, in every order."""
    orders = [order for order in product(MODELS, repeat=3) if len(set(order)) == 2] * 3
    sessions = {f"p{k:02}": list(enumerate(order, 1)) for k, order in enumerate(orders)}
    contrasts = day_contrasts(answers(sessions), MODELS)
    assert contrasts.shape == (18, 2)
    assert balanced(contrasts)
    kept = contrasts.iloc[:-5]  # some aborted, so that days and the mean are not independent
    assert not balanced(kept)
    d = rng().normal(2.0, 5.0, len(kept)) + kept.to_numpy() @ [30.0, -80.0]
    known = sm.OLS(d, sm.add_constant(kept.to_numpy())).fit()
    low, high = known.conf_int()[0]
    found = paired_test(np.zeros(d.size), d, rng=rng(), contrasts=kept.to_numpy())
    expected = [known.params[0], low, high, known.tvalues[0], known.pvalues[0], known.df_resid]
    seen = [found.mean_difference, found.ci_low, found.ci_high, found.t, found.p, found.df]
    assert_allclose(seen, expected)
    tost = equivalence_test(d, BOUNDS, rng=rng(), contrasts=kept.to_numpy())
    (low90, high90), *_ = known.conf_int(0.1)
    assert_allclose([tost.ci_low, tost.ci_high], [low90, high90])
    one_sided = known.t_test([1, 0, 0])
    t_high = float(((one_sided.effect - BOUNDS[1]) / one_sided.sd).squeeze())
    assert tost.p_high == pytest.approx(stats.t.cdf(t_high, known.df_resid))


@pytest.mark.parametrize("other_first", [False, True])
def test_of_one_order_alone_nothing_can_be_told(other_first: bool) -> None:
    order = MODELS[::-1] if other_first else MODELS
    sessions = {f"p{k}": list(enumerate(order, 1)) for k in range(12)}
    contrasts = day_contrasts(answers(sessions), MODELS)
    assert not balanced(contrasts)
    d = rng().normal(0.1, 1.0, 12)
    found = paired_test(np.zeros(12), d, rng=rng(), contrasts=contrasts.to_numpy())
    assert found.note
    assert found.note != paired_test(np.zeros(1), d[:1], rng=rng()).note
    names = ("mean_difference", "ci_low", "ci_high", "t", "p", "d_z", "sign_flips_p", "wilcoxon_p")
    assert np.isnan([getattr(found, name) for name in names]).all()
    tost = equivalence_test(d, BOUNDS, rng=rng(), contrasts=contrasts.to_numpy())
    assert np.isnan([tost.p, tost.ci_low, tost.ci_high]).all()
    assert verdict(found.p, tost.p) == ""


def test_without_days_it_is_the_t_test_of_one_sample() -> None:
    d = rng().normal(1.0, 3.0, 9)
    known = stats.ttest_1samp(d, 0.0)
    for contrasts in (None, np.empty((9, 0))):
        found = paired_test(np.zeros(9), d, rng=rng(), contrasts=contrasts)
        low, high = known.confidence_interval(0.95)
        assert_allclose(
            [found.t, found.p, found.df, found.mean_difference, found.ci_low, found.ci_high],
            [known.statistic, known.pvalue, 8, d.mean(), low, high],
        )


def test_too_few_people_for_their_days_have_no_t() -> None:
    one_each = paired_test([0.0, 0.0], [1.0, 3.0], rng=rng(), contrasts=of_groups(1, 1))
    assert one_each.mean_difference == pytest.approx(2.0)
    assert np.isnan([one_each.t, one_each.ci_low, one_each.d_z_low]).all()
    assert one_each.note
    nobody = paired_test([], [], rng=rng(), contrasts=np.empty((0, 1)))
    assert nobody.n == 0
    assert np.isnan([nobody.mean_difference, nobody.t, nobody.p]).all()


# --- Days of answers --------------------------------------------------------------------------


def test_days_are_those_of_the_other_model_less_those_of_the_reference() -> None:
    sessions = {"b": [(1, "simplified"), (2, "full")], "a": [(1, "full"), (2, "simplified")]}
    table = answers(sessions)
    for one in (table, table.iloc[::-1], table.sample(frac=1.0, random_state=9)):
        contrasts = day_contrasts(one, MODELS)
        assert contrasts.shape == (2, 1)
        assert contrasts.loc["a"].item() == -contrasts.loc["b"].item() == -1.0
        assert balanced(contrasts)
    assert day_contrasts(table, MODELS[::-1]).loc["a"].item() == 1.0


def test_days_count_from_each_participants_first_session() -> None:
    """Whoever came on the third and fourth day had the models on a first and a second one."""
    early = {"a": [(1, "full"), (2, "simplified")], "b": [(1, "simplified"), (2, "full")]}
    late = {**early, "b": [(3, "simplified"), (4, "full")]}
    one, other = (day_contrasts(answers(sessions), MODELS) for sessions in (early, late))
    pd.testing.assert_frame_equal(one, other)


def test_where_most_had_both_models_in_a_session_days_do_not_count() -> None:
    mixed = [(1, "full"), (1, "simplified"), (2, "full"), (2, "simplified")]
    apart = [(1, "full"), (2, "simplified")]
    for sessions in ({"a": mixed, "b": mixed}, {"a": mixed, "b": mixed, "c": apart}):
        contrasts = day_contrasts(answers(sessions), MODELS)
        assert contrasts.shape == (len(sessions), 0)
        assert balanced(contrasts)
    # One person with both in a session does not hide the days of the others.
    by_day = day_contrasts(answers({"a": mixed, "b": apart, "c": apart[::-1]}), MODELS)
    assert by_day.shape == (3, 1)
    assert by_day.loc["a"].item() == 0.0
    single = {"a": [(1, "full"), (1, "simplified")]}
    assert day_contrasts(answers(single), MODELS).shape == (1, 0)


def test_who_lacks_a_model_has_no_days() -> None:
    sessions = {
        "a": [(1, "full"), (2, "simplified")],
        "b": [(1, "simplified"), (2, "full")],
        "c": [(1, "full")],
        "d": [(1, "full"), (2, "best")],
    }
    assert list(day_contrasts(answers(sessions), MODELS).index) == ["a", "b"]
    alone = day_contrasts(answers({"c": sessions["c"]}), MODELS)
    assert alone.empty
    assert balanced(alone)


def test_without_sessions_there_are_no_days() -> None:
    table = answers({"a": [(1, "full"), (2, "simplified")], "b": [(1, "full")]})
    contrasts = day_contrasts(table.drop(columns="session"), MODELS)
    assert set(contrasts.index) >= {"a"}
    assert contrasts.shape[1] == 0
    assert balanced(contrasts)


def test_a_model_on_two_days_has_half_of_each() -> None:
    sessions = {"a": [(1, "full"), (2, "full"), (3, "simplified")]}
    assert day_contrasts(answers(sessions), MODELS).to_numpy().tolist() == [[-0.5, -0.5]]


@given(st.integers(1, 9), st.integers(1, 9))
def test_groups_are_balanced_where_they_are_of_one_size(last: int, first: int) -> None:
    assert balanced(pd.DataFrame(of_groups(last, first))) == (last == first)


# --- Bayes factor and effect size -------------------------------------------------------------


def jzs_null(t: float, *, size: float, df: int, width: float) -> float:
    """Rouder et al. (2009), eq. 1, with N and ν of two samples, of d_z with a Cauchy prior."""

    def alternative(g: float) -> float:
        spread = 1 + size * width**2 * g
        likelihood = spread**-0.5 * (1 + t**2 / (spread * df)) ** (-(df + 1) / 2)
        return float(likelihood * stats.invgamma.pdf(g, 0.5, scale=0.5))

    area, _ = integrate.quad(alternative, 0.0, np.inf)
    return float((1 + t**2 / df) ** (-(df + 1) / 2) / area)


@pytest.mark.parametrize("groups", [(10, 10), (13, 7), (2, 5)])
@pytest.mark.parametrize("t", [0.0, -1.3, 3.0])
def test_the_bayes_factor_of_two_days_is_that_of_d_z(groups: tuple[int, int], t: float) -> None:
    """Its prior is as wide as that of a single session; N and ν are those of two groups."""
    n = sum(groups)
    expected = jzs_null(t, size=4 * groups[0] * groups[1] / n, df=n - 2, width=0.707)
    assert bayes_factor_null(t, n, groups=groups) == pytest.approx(expected, rel=2e-3)
    plain = jzs_null(t, size=n, df=n - 1, width=0.707)
    assert bayes_factor_null(t, n) == pytest.approx(plain, rel=2e-3)


@pytest.mark.parametrize("t", [-2.0, 0.0, 1.5])
def test_limits_of_d_z_put_t_at_the_tails_with_the_degrees_of_freedom_of_the_days(t: float) -> None:
    size, df = 4 * 13 * 7 / 20, 18
    low, high = d_z_interval(t, size, df=df)
    assert stats.nct.sf(t, df, low * np.sqrt(size)) == pytest.approx(0.025, abs=1e-6)
    assert stats.nct.cdf(t, df, high * np.sqrt(size)) == pytest.approx(0.025, abs=1e-6)


def test_limits_of_d_z_cover_what_is_planted_beside_a_day() -> None:
    contrasts = of_groups(13, 7)
    d = np.random.default_rng(6).normal(3.0, 5.0, (400, 20)) + 9.0 * contrasts[:, 0]
    found = mean_differences(d, contrasts)
    t = t_tests(found)[0]
    limits = np.array([d_z_interval(float(one), found.size, df=found.df) for one in t])
    covered = int(((limits[:, 0] <= 0.6) & (limits[:, 1] >= 0.6)).sum())
    assert stats.binomtest(covered, 400, 0.95).pvalue > 1e-3
    tested = paired_test(np.zeros(20), d[0], rng=rng(), contrasts=contrasts)
    assert_allclose([tested.d_z_low, tested.d_z_high], limits[0])
    assert tested.d_z == pytest.approx(found.mean[0] / (found.error[0] * np.sqrt(found.size)))


def test_three_models_in_a_latin_square_have_three_days() -> None:
    """The third model is not compared, and yet its day lies between those of the others."""
    names = (*MODELS, "best")
    orders = [names[k:] + names[:k] for k in range(3)] * 4
    sessions = {f"p{k:02}": list(enumerate(order, 1)) for k, order in enumerate(orders)}
    contrasts = day_contrasts(answers(sessions), MODELS)
    assert contrasts.shape == (12, 2)
    assert balanced(contrasts)
    added = np.array([0.0, 6.0, 9.0])
    first, second = ([added[order.index(name)] for order in orders] for name in MODELS)
    differences = np.subtract(second, first)
    found = mean_differences(differences[None], contrasts.to_numpy())
    assert_allclose(found.mean, 0.0, atol=1e-9)
