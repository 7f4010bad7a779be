"""The rule that turns a posterior into a verdict, and what may be said where there is doubt."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactileq.analysis.statistics.caveats import EQUALITY, SHOWN, WITHHELD, Caveats
from tactileq.analysis.statistics.equivalence import (
    ALL_BUT,
    AVERAGE_FELT,
    DIFFERENT,
    EQUAL_ON_AVERAGE,
    EQUIVALENT,
    FELT,
    INCONCLUSIVE,
)
from tactileq.analysis.statistics.participants.posterior import Draws, r_hat
from tactileq.analysis.statistics.participants.verdict import PeopleSummary, summary_of

BOUNDS = (-7.5, 7.5)
FEW = 0.15
# Mean near 0 and well inside; nobody outside, at most 9 %.
EQUAL = PeopleSummary(
    mean=0.5,
    mean_low=-2.0,
    mean_high=3.0,
    mean90_low=-1.6,
    mean90_high=2.6,
    share=0.02,
    share_low=0.0,
    share_high=0.11,
    share_most=0.09,
    somebody=0.2,
    r_hat=1.0,
)
WIDE = {"mean_low": -9.0, "mean_high": 10.0, "mean90_low": -8.0, "mean90_high": 9.0}
ABOVE = {"mean": 9.0, "mean_low": 5.0, "mean_high": 13.0, "mean90_low": 5.6, "mean90_high": 12.4}


@pytest.mark.parametrize(
    ("changes", "word"),
    [
        ({}, EQUIVALENT),
        ({"mean_low": 0.4, "mean90_low": 0.5}, EQUIVALENT),  # differs from 0, inside, and few
        ({"share_most": 0.16}, INCONCLUSIVE),  # inside, but people cannot be counted
        ({"somebody": 0.96}, ALL_BUT),
        ({"somebody": 0.96, "share_most": 0.4}, AVERAGE_FELT),
        ({"somebody": 1.0, "share_most": 1.0}, AVERAGE_FELT),  # split opinions
        (WIDE, INCONCLUSIVE),
        ({**WIDE, "somebody": 0.99, "share_most": 0.9}, FELT),
        (ABOVE, DIFFERENT),
        ({**ABOVE, "somebody": 1.0, "share_most": 0.95}, DIFFERENT),
        ({**ABOVE, "somebody": 1.0, "share_most": 0.3}, FELT),  # a minority that moves the mean
    ],
)
def test_each_word_has_its_place(changes, word):
    assert replace(EQUAL, **changes).verdict(BOUNDS, few=FEW) == word


shares = st.floats(0.0, 1.0)
points = st.floats(-50.0, 50.0)


@given(st.tuples(points, points, points, points, points), shares, shares, shares)
def test_equality_of_all_rests_on_mean_and_people_both(means, most, somebody, few):
    low, low90, middle, high90, high = sorted(means)
    one = PeopleSummary(
        mean=middle,
        mean_low=low,
        mean_high=high,
        mean90_low=low90,
        mean90_high=high90,
        share=most / 2,
        share_low=0.0,
        share_high=most,
        share_most=most,
        somebody=somebody,
        r_hat=1.0,
    )
    word = one.verdict(BOUNDS, few=few)
    if word == EQUIVALENT:
        assert one.inside(BOUNDS)
        assert most < few
    if word in (AVERAGE_FELT, ALL_BUT, FELT):
        assert somebody >= 0.95
    if word == AVERAGE_FELT:
        assert one.inside(BOUNDS)
    if word == DIFFERENT:
        assert not one.inside(BOUNDS)
        assert low > 0 or high < 0
    refused = Caveats().allowed(word)
    assert refused not in EQUALITY  # without proof of sensitivity nothing is called equal
    assert Caveats(sensitivity=SHOWN).allowed(word) == word


def test_what_remains_of_each_word_without_proof_of_sensitivity():
    doubted = Caveats()
    assert [doubted.allowed(word) for word in (EQUIVALENT, EQUAL_ON_AVERAGE)] == [WITHHELD] * 2
    # That somebody feels it was shown, whatever else was not.
    assert [doubted.allowed(word) for word in (AVERAGE_FELT, ALL_BUT)] == [FELT] * 2
    assert [doubted.allowed(word) for word in (DIFFERENT, FELT)] == [DIFFERENT, FELT]


def test_a_summary_is_made_of_quantiles():
    draws = np.linspace(-10, 10, 2001)[None]
    shares = np.linspace(0, 1, 2001)[None]
    one = summary_of(
        Draws(
            mean=draws,
            textures=draws[..., None],
            effects=draws[..., None],
            attends=np.ones((1, 2001, 1), dtype=bool),
            outside=(np.abs(draws) > 7.5).astype(float),
            share=shares,
            lapses=shares,
        )
    )
    assert (one.mean_low, one.mean_high) == pytest.approx((-9.5, 9.5))
    assert (one.mean90_low, one.mean90_high) == pytest.approx((-9.0, 9.0))
    assert (one.share_low, one.share_most, one.share_high) == pytest.approx((0.025, 0.95, 0.975))
    assert one.somebody == pytest.approx(0.25, abs=0.001)


def test_r_hat_of_chains_that_agree_and_of_chains_that_do_not():
    rng = np.random.default_rng(1)
    together = rng.normal(size=(4, 2000))
    assert r_hat(together) == pytest.approx(1.0, abs=0.005)
    # Two pairs of chains 2 SD apart: between-chain variance 4/3 times 1, over within 1.
    apart = together + np.array([-1, -1, 1, 1])[:, None]
    expected = np.sqrt(1 + 8 / 7)  # eight halves, four at each end
    assert r_hat(apart) == pytest.approx(expected, rel=0.02)
    assert r_hat(np.zeros((2, 10))) == 1.0
