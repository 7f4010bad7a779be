"""Intervals of probabilities against published tables."""

from __future__ import annotations

import pytest

from tactileq.analysis.statistics.rates import clopper_pearson


@pytest.mark.parametrize(
    ("hits", "of", "low", "high"), [(0, 10, 0.0, 0.3085), (5, 10, 0.1871, 0.8129)]
)
def test_binomial_intervals_are_those_of_the_tables(hits: int, of: int, low: float, high: float):
    """Published exact limits, such as in Agresti and Coull (1998)."""
    assert clopper_pearson(hits, of) == pytest.approx((low, high), abs=5e-5)
