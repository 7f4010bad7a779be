"""What benches simulate alike: closed forms, another program's power, and all intervals."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pingouin import power_ttest
from scipy import stats

from tactileq.benches.raters import (
    HIGHEST,
    LOWEST,
    at_random,
    bootstrap_covers,
    covered,
    ended,
    mean_at_the_end,
    paired_power,
)


@pytest.mark.parametrize("d_z", [0.0, 0.3, 0.8])
@pytest.mark.parametrize("count", [3, 20, 36])
def test_power_is_that_of_pingouin(d_z: float, count: int) -> None:
    expected = power_ttest(d=d_z, n=count, contrast="paired", alpha=0.05)
    assert paired_power(d_z, count) == pytest.approx(expected, abs=1e-9)


@given(st.floats(0.01, 0.99), st.floats(0.5, 40.0))
def test_as_many_ratings_lie_beyond_the_end_as_were_asked_for(share: float, sd: float) -> None:
    mean = mean_at_the_end(share, sd=sd)
    assert stats.norm.sf(HIGHEST, mean, sd) == pytest.approx(share, abs=1e-9)


def test_a_scale_ends_and_who_does_not_attend_uses_all_of_it() -> None:
    assert ended(np.array([-5.0, 50.0, 105.0])).tolist() == [LOWEST, 50.0, HIGHEST]
    draws = at_random(np.random.default_rng(1), (20_000,))
    assert stats.kstest(draws, stats.uniform(LOWEST, HIGHEST - LOWEST).cdf).pvalue > 0.001


def test_intervals_contain_their_ends_and_none_that_is_undefined_contains_anything() -> None:
    low, high = [0.0, 0.5, np.nan, 0.0], [0.5, 1.0, 1.0, np.nan]
    assert covered(low, 0.5, high).tolist() == [True, True, False, False]


def test_bootstrap_intervals_of_equal_rates_contain_nothing() -> None:
    rates = np.array([[0.5] * 8, [0.4, 0.5, 0.6, 0.5, 0.4, 0.6, 0.5, 0.5]])
    assert bootstrap_covers(rates, 0.5, np.random.default_rng(1)).tolist() == [False, True]
