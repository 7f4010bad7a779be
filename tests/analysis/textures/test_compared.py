"""Full, simplified and driven models of one texture against the same recordings and draws."""

from __future__ import annotations

import numpy as np
import pandas as pd

from tactileq.analysis.textures.compared import comparisons


def backwards(work, items):
    """As other processes may: not in the order of the items, and with all at hand at once."""
    done = [work(item) for item in reversed(items)]
    return reversed(done)


def test_both_tables_of_a_texture_rest_on_the_same_draws(results):
    for compared in comparisons(results, np.random.default_rng(1).spawn(len(results))):
        full, grid = compared.gfc.iloc[0], compared.driven.iloc[0]
        assert (full["model"], grid["driven_by"]) == ("full", "grid")
        shared = [name for name in compared.driven if name in compared.gfc]
        assert {"gfc30_mean", "gfc30_expected", "gfc5_expected"} <= set(shared)
        pd.testing.assert_series_equal(full[shared], grid[shared], check_names=False)


def test_a_texture_has_draws_of_its_own_however_the_work_is_divided(results):
    in_turn = list(comparisons(results, np.random.default_rng(1).spawn(len(results))))
    divided = list(
        comparisons(results, np.random.default_rng(1).spawn(len(results)), mapped=backwards)
    )
    alone = next(iter(comparisons(results[:1], np.random.default_rng(1).spawn(1))))
    for first, second in zip(in_turn, divided, strict=True):
        pd.testing.assert_frame_equal(first.gfc, second.gfc, check_exact=True)
        pd.testing.assert_frame_equal(first.driven, second.driven, check_exact=True)
    pd.testing.assert_frame_equal(in_turn[0].gfc, alone.gfc, check_exact=True)
    expected = {
        one.gfc["gfc30_expected"][0]
        for one in comparisons([results[0]] * 2, np.random.default_rng(1).spawn(2))
    }
    assert len(expected) == 2
