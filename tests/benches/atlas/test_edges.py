"""Edges by bisection, on cases whose edges are known: to the bisection's own resolution."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from tactileq.benches.atlas.case import DEGRADES, FAILS, HOLDS, Axis, Case, Measure
from tactileq.benches.atlas.edges import BISECTIONS, CELLS, SEARCHED, Examined, examine

LOGARITHMIC = Axis(name="speed", unit="Hz", mild=1.0, severe=1000.0, default=2.0)
BACKWARDS = Axis(name="width", unit="Hz", mild=1000.0, severe=1.0, default=500.0)
LINEAR = Axis(name="level", unit="dB", mild=-20.0, severe=20.0, default=0.0, logarithmic=False)
STEP = {full: 1 / (SEARCHED[full] - 1) / 2 ** BISECTIONS[full] for full in (False, True)}


def measure_of(figure: Callable[[float], float]) -> Measure:
    return lambda value, column, *, full: figure(value)


def case_of(figure: Callable[[float], float], axis: Axis = LOGARITHMIC) -> Case:
    return Case(
        family="made up",
        method="by decree",
        ours=True,
        axis=axis,
        figure="error",
        unit="dB",
        holds=10.0,
        degrades=100.0,
        measure=measure_of(figure),
    )


def found_in(figure: Callable[[float], float], *, full: bool = False, **more: Axis) -> Examined:
    return examine(case_of(figure, **more), "", full=full)


def share_of(axis: Axis, value: float) -> float:
    if axis.logarithmic:
        return math.log(value / axis.mild) / math.log(axis.severe / axis.mild)
    return (value - axis.mild) / (axis.severe - axis.mild)


@pytest.mark.parametrize("full", [False, True])
@pytest.mark.parametrize(
    ("axis", "figure", "holds_to", "fails_from"),
    [
        (LOGARITHMIC, lambda value: value, 10.0, 100.0),
        (BACKWARDS, lambda value: 1000 / value, 100.0, 10.0),
        (LINEAR, lambda value: 30 + 6 * value, -10 / 3, 35 / 3),
    ],
)
def test_edges_of_a_figure_that_only_grows_are_found(
    full: bool,
    axis: Axis,
    figure: Callable[[float], float],
    holds_to: float,
    fails_from: float,
) -> None:
    found = found_in(figure, full=full, axis=axis)
    for measured, edge, side in ((found.holds_to, holds_to, -1), (found.fails_from, fails_from, 1)):
        off = (share_of(axis, measured) - share_of(axis, edge)) * side
        assert -1e-9 <= off <= STEP[full] + 1e-9
    assert not found.returns
    assert not found.holds_throughout
    assert [cell.value for cell in found.cells] == pytest.approx(
        [axis.at(i / (CELLS[full] - 1)) for i in range(CELLS[full])]
    )


def test_what_always_holds_has_no_edge_and_costs_no_bisection() -> None:
    found = found_in(lambda value: 0.0)
    assert found.holds_throughout
    assert found.holds_to == LOGARITHMIC.severe
    assert math.isnan(found.fails_from)
    assert found.runs == CELLS[False] + 1  # the default
    assert found.at_default is not None
    assert (found.at_default.value, found.at_default.verdict) == (2.0, HOLDS)


def test_what_never_holds_has_no_edge_either() -> None:
    for figure, fails_from in ((50.0, math.nan), (1e3, LOGARITHMIC.mild)):
        found = found_in(lambda value, figure=figure: figure)
        assert math.isnan(found.holds_to)
        assert found.fails_from == pytest.approx(fails_from, nan_ok=True)
        assert found.runs == CELLS[False] + 1


def test_what_is_no_number_or_infinite_has_failed() -> None:
    verdicts = [case_of(lambda value: 0.0).verdict(x) for x in (math.nan, math.inf, 100, 10, -1e9)]
    assert verdicts == [FAILS, FAILS, DEGRADES, HOLDS, HOLDS]
    found = found_in(lambda value: math.nan if value > 50 else 0.0)
    assert 50 / 1000 ** STEP[False] <= found.holds_to <= 50
    assert 50 <= found.fails_from <= 50 * 1000 ** STEP[False]


def test_the_mildest_edge_counts_where_a_method_holds_again_farther_on() -> None:
    """A resonance at the middle cell: 10 to 100 fail, before and after it holds."""
    found = found_in(lambda value: 1e3 if 10 < value < 100 else 0.0)
    assert found.returns
    assert found.holds_to == pytest.approx(10, rel=0.6)
    assert found.holds_to <= 10
    assert [cell.verdict for cell in found.cells] == [HOLDS, FAILS, HOLDS]


def test_a_lucky_run_beyond_a_failure_between_cells_is_no_edge() -> None:
    """Held at every cell but the last, but not from 3 to 5, between the first and the second."""
    found = found_in(lambda value: 50.0 if 3 < value < 5 or value > 700 else 0.0, full=True)
    assert found.holds_to == pytest.approx(3, rel=0.03)
    assert found.holds_to <= 3
    assert found.returns


def test_no_run_is_done_twice_and_the_effort_is_passed_on() -> None:
    asked: list[tuple[float, float, bool]] = []

    def measure(value: float, column: float, *, full: bool) -> float:
        asked.append((value, column, full))
        return value

    case = Case(
        family="made up",
        method="by decree",
        ours=False,
        axis=Axis(name="speed", unit="Hz", mild=1.0, severe=1000.0),
        figure="error",
        unit="dB",
        holds=10.0,
        degrades=100.0,
        measure=measure,
        columns={"one": 1.0, "two": 2.0},
    )
    found = examine(case, "two", full=True)
    assert found.runs == len(asked) == len({value for value, _, _ in asked})
    assert {(column, full) for _, column, full in asked} == {(2.0, True)}
    assert found.at_default is None


@pytest.mark.parametrize(
    ("axis", "edge", "margin"),
    [
        (LOGARITHMIC, 20.0, 10.0),
        (BACKWARDS, 50.0, 10.0),
        (LINEAR, 20.0, 10.0),
        (LOGARITHMIC, math.nan, math.nan),
        (Axis(name="none", unit="", mild=1.0, severe=2.0), 2.0, math.nan),
    ],
)
def test_margin_is_the_factor_by_which_the_edge_is_harder(
    axis: Axis, edge: float, margin: float
) -> None:
    assert axis.margin(edge) == pytest.approx(margin, nan_ok=True)


def test_values_along_an_axis() -> None:
    assert [LINEAR.at(s) for s in (0, 0.25, 1)] == [-20, -10, 20]
    assert [BACKWARDS.at(s) for s in (0, 1 / 3, 1)] == pytest.approx([1000, 100, 1])
    assert np.isnan(case_of(lambda value: 0.0).columns[""])
