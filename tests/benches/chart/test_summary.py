"""Fronts, ratios and who dominates whom, on tables whose answers are plain."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from tactileq.benches.chart.judging import PLACES
from tactileq.benches.chart.measures import SUMMARIES
from tactileq.benches.chart.methods import METHODS
from tactileq.benches.chart.summary import (
    COSTS,
    comparison_table,
    comparisons,
    front_table,
    on_front,
    ratio_over_surfaces,
    summarised,
)

POINTS = st.lists(st.tuples(st.floats(1, 9), st.floats(1, 9)), min_size=1, max_size=30)


@given(POINTS)
def test_the_front_is_what_no_point_beats(points: list[tuple[float, float]]) -> None:
    cost, error = np.array(points).T
    chosen = on_front(cost, error)
    assert chosen.any()
    for n in range(cost.size):
        beats = (cost <= cost[n]) & (error <= error[n]) & ((cost < cost[n]) | (error < error[n]))
        assert chosen[n] == (not beats.any())
        assert beats[chosen].any() or chosen[n]  # what is off the front is beaten from the front


def test_what_is_not_known_is_not_on_the_front() -> None:
    cost, error = np.array([1.0, np.nan, 2.0]), np.array([np.nan, 1.0, 3.0])
    assert on_front(cost, error).tolist() == [False, False, True]


def test_ratios_are_geometric_with_a_t_interval() -> None:
    above, below = np.array([2.0, 4.0, 8.0, 3.0]), np.array([1.0, 1.0, 2.0, 1.0])
    logs = np.log(above / below)
    found = ratio_over_surfaces(above, below)
    half = stats.t.ppf(0.975, 3) * logs.std(ddof=1) / 2
    assert found == pytest.approx(np.exp([logs.mean(), logs.mean() - half, logs.mean() + half]))
    assert found.text() == "3.1 (1.9–5.3)"
    alike = ratio_over_surfaces(2 * below, below)
    assert alike == pytest.approx((2, 2, 2))


def test_of_two_surfaces_there_is_no_interval() -> None:
    found = ratio_over_surfaces(np.array([2.0, 8.0]), np.ones(2))
    assert found.mean == pytest.approx(4)
    assert not found.is_known
    assert found.text() == "4"


def rows_of(
    variants: dict[tuple[str, float], tuple[float, list[float]]], *, kind: str = "drawn"
) -> pd.DataFrame:
    """Rows by (method, update interval): operations, and a distance for each surface."""
    rows = []
    for (method, update_ms), (operations, distances) in variants.items():
        for surface, distance in enumerate(distances):
            row = dict.fromkeys([*COSTS, *(f"{p}_{m}" for p in PLACES for m in SUMMARIES)], 1.0)
            row |= {f"{place}_distance_db": distance for place in PLACES}
            row |= {"operations": operations, "update_ms": update_ms, "single_error_db": np.nan}
            names = {"method": method, "family": METHODS[method].family, "kind": kind}
            fixed = {"blending": "linear", "default_blending": True, "precision": "double"}
            rows.append(row | names | fixed | {"surface": f"{surface}", "simulated": True})
    return pd.DataFrame(rows)


OURS_NEARER = rows_of(
    {
        ("joint", 1.0): (100.0, [0.5, 0.6, 0.4, 0.5]),
        ("joint", 4.0): (60.0, [0.7, 0.8, 0.6, 0.7]),
        ("paper", 1.0): (200.0, [1.1, 1.2, 0.9, 1.0]),
        ("paper-consistent", 1.0): (70.0, [3.0, 3.2, 2.8, 3.0]),
        ("white noise", 1.0): (20.0, [20.0, 21.0, 19.0, 20.0]),
    }
)


BOTH = ["between", "stroking"]


def test_a_rival_that_costs_more_and_is_farther_is_dominated() -> None:
    by_rival = {one.rival: one for one in comparisons(OURS_NEARER)}
    assert list(by_rival) == ["paper", "paper-consistent", "white noise"]
    dear = by_rival["paper"]
    assert dear.ratios["operations"].mean == pytest.approx(2)
    ratio = (1.1 * 1.2 * 0.9 / (0.5 * 0.6 * 0.4 * 0.5)) ** 0.25
    assert dear.ratios["between"].mean == pytest.approx(ratio)
    assert dear.ratios["between"].low > 1
    assert list(dear.dominated_by) == BOTH
    assert dear.dominated_by["stroking"].variant.text() == "joint (linear, every 1 ms)"
    assert dear.dominated_by["stroking"].text() in dear.sentence
    assert dear.ahead == "nothing"


def test_a_cheaper_rival_is_dominated_by_a_variant_that_is_cheaper_still() -> None:
    cheap = next(one for one in comparisons(OURS_NEARER) if one.rival == "paper-consistent")
    assert cheap.ratios["operations"].mean == pytest.approx(0.7)
    assert cheap.dominated_by["stroking"].variant.update_ms == 4
    assert cheap.ahead == "operations (0.7 times)"


def test_a_rival_is_not_dominated_while_one_of_its_variants_is_not() -> None:
    """It is updated less often, too, and is then cheaper than anything of ours."""
    slower = rows_of({("paper-consistent", 16.0): (30.0, [3.0, 3.2, 2.8, 3.0])})
    found = comparisons(pd.concat([OURS_NEARER, slower], ignore_index=True))
    cheap = next(one for one in found if one.rival == "paper-consistent")
    assert cheap.dominated_by == {}
    assert cheap.dominates_by == {}


def test_at_rest_a_slow_update_dominates_what_it_does_not_during_strokes() -> None:
    slow = rows_of({("joint", 16.0): (10.0, [0.5, 0.6, 0.4, 0.5])})
    slow["stroking_distance_db"] = 30.0
    found = comparisons(pd.concat([OURS_NEARER, slow], ignore_index=True))
    floor = next(one for one in found if one.rival == "white noise")
    assert list(floor.dominated_by) == ["between"]
    assert floor.dominated_by["between"].variant.update_ms == 16


def test_the_cheapest_is_dominated_by_none() -> None:
    floor = next(one for one in comparisons(OURS_NEARER) if one.rival == "white noise")
    assert (floor.dominated_by, floor.dominates_by) == ({}, {})
    assert floor.verdict.count("neither dominates the other") == 2


def test_it_is_said_where_a_rival_dominates_ours() -> None:
    rows = rows_of(
        {
            ("joint", 1.0): (100.0, [1.0, 1.1, 0.9]),
            ("paper", 1.0): (100.0, [0.5, 0.6, 0.4]),
        }
    )
    [one] = comparisons(rows)
    assert one.ratios["between"].high < 1
    assert list(one.dominates_by) == BOTH
    assert one.dominates_by["between"].variant.method == "paper"
    assert one.dominates_by["between"].text() in one.sentence
    assert f"{one.ratios['between'].mean:.2g} times" in one.ahead
    assert "0.6 compared with 1.1 dB" in one.ahead


def test_a_rival_that_cannot_keep_up_with_our_slower_updates_does_not_dominate() -> None:
    rows = rows_of(
        {
            ("joint", 1.0): (100.0, [1.0, 1.1, 0.9]),
            ("joint", 4.0): (50.0, [1.0, 1.1, 0.9]),
            ("paper", 1.0): (100.0, [0.5, 0.6, 0.4]),
        }
    )
    [one] = comparisons(rows)
    assert one.dominates_by == {}


def test_nobody_dominates_where_accuracy_is_not_separated() -> None:
    rows = rows_of(
        {("joint", 1.0): (100.0, [1.0, 2.0, 0.5]), ("paper", 1.0): (200.0, [1.1, 1.8, 0.6])}
    )
    [one] = comparisons(rows)
    assert one.ratios["between"].low < 1 < one.ratios["between"].high
    assert (one.dominated_by, one.dominates_by) == ({}, {})
    [few] = comparisons(rows[rows["surface"] != "2"])
    assert few.verdict.startswith("too few surfaces")


def test_two_halves_of_one_surface_are_one_case() -> None:
    twice = pd.concat([OURS_NEARER, OURS_NEARER], ignore_index=True)
    assert comparisons(twice) == comparisons(OURS_NEARER)


def test_summary_and_front_tables() -> None:
    summary = summarised(OURS_NEARER)
    assert len(summary) == 5
    ours = summary[(summary["method"] == "joint") & (summary["update_ms"] == 1)].iloc[0]
    assert ours["between_distance_db"] == pytest.approx(0.5)
    assert ours["between_distance_db_25"] == pytest.approx(0.475)
    assert ours["between_distance_db_75"] == pytest.approx(0.525)
    assert ours["between_distance_db_worst"] == pytest.approx(0.6)
    assert ours["surfaces"] == 4
    assert ours["simulated"]
    fronts = front_table(summary)
    by_place = fronts.groupby("place")["method"].agg(list)
    # All update intervals compete, at rest as well.
    assert by_place["between"] == ["white noise", "joint", "joint"]
    assert by_place["stroking"] == ["white noise", "joint", "joint"]


def test_the_table_of_comparisons_has_the_ratios_and_the_sentence() -> None:
    found = comparisons(OURS_NEARER)
    table = comparison_table(found)
    assert table["sentence"].tolist() == [one.sentence for one in found]
    assert (table["between_low"] < table["between"]).all()
    assert (table["between"] < table["between_high"]).all()
