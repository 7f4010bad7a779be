"""The three tables of the atlas, on cases whose answers are known."""

from __future__ import annotations

import math
from functools import partial

import numpy as np
import pytest

from tactileq.benches.atlas.case import FAILS, HOLDS, Axis, Case
from tactileq.benches.atlas.edges import examine
from tactileq.benches.atlas.tables import (
    CELL_COLUMNS,
    EDGE_COLUMNS,
    MARGIN_COLUMNS,
    cell_table,
    disagreement,
    edge_table,
    margin_table,
)
from tactileq.modeling.files.columns import names

SPEED = Axis(name="speed", unit="Hz", mild=1.0, severe=10_000.0, default=3.0)
LEVEL = Axis(name="level", unit="dB", mild=-20.0, severe=20.0, logarithmic=False)


def times(value: float, column: float, *, full: bool) -> float:
    return value * column


def made_up(**more: object) -> Case:
    parts: dict[str, object] = {
        "method": "by decree",
        "ours": True,
        "axis": SPEED,
        "measure": times,
        "columns": {"one": 1.0, "ten": 10.0},
        "across": "factor",
    }
    fixed = {"family": "made up", "figure": "error", "unit": "dB", "holds": 100.0}
    return Case(**fixed, degrades=1000.0, **(parts | more))  # type: ignore[arg-type]


def examined(*cases: Case, full: bool = True):
    return [examine(case, column, full=full) for case in cases for column in case.columns]


def test_cells_are_all_runs_of_the_axis_and_those_at_the_default() -> None:
    table = cell_table(examined(made_up(), made_up(method="other", axis=LEVEL)))
    assert list(table.columns) == names(CELL_COLUMNS)
    assert len(table) == 2 * (5 + 1) + 2 * 5
    assert table["simulated"].all()
    default = table[table["is_default"]]
    assert list(default["value"]) == [3.0, 3.0]
    assert list(default["figure"]) == [3.0, 30.0]
    ten = table[(table["method"] == "by decree") & (table["column"] == "ten")]
    assert list(ten["verdict"])[:5] == [HOLDS, HOLDS, "degrades", FAILS, FAILS]


def test_edges_stand_beside_theory_with_their_disagreement() -> None:
    """Theory that is right, that is off by 2, that expects an edge farther on or none."""
    theories = {
        "right": lambda column: 100 / column,
        "twice": lambda column: 200 / column,
        "never": lambda column: math.inf,
        "at once": lambda column: 0.0,
        "unknown": lambda column: math.nan,
    }
    cases = [made_up(method=m, theory=t, source="a book") for m, t in theories.items()]
    table = edge_table(examined(*cases, made_up(method="none")))
    assert list(table.columns) == names(EDGE_COLUMNS)
    one = table[table["column"] == "one"].set_index("method")
    assert one["holds_to"].to_numpy() == pytest.approx(100, rel=0.04)
    assert one["fails_from"].to_numpy() == pytest.approx(1000, rel=0.04)
    off = one["disagreement"]
    assert off["right"] == pytest.approx(1, rel=0.04)
    assert off["twice"] == pytest.approx(0.5, rel=0.04)
    assert (one.loc["never", "theory"], one.loc["at once", "theory"]) == (SPEED.severe, SPEED.mild)
    assert off["never"] == pytest.approx(100 / SPEED.severe, rel=0.04)
    assert off[["unknown", "none"]].isna().all()
    assert list(one["source"]) == ["a book"] * 4 + ["", ""]
    assert table["simulated"].all()


def test_disagreement_on_a_linear_axis_is_a_difference_and_at_the_ends_none() -> None:
    assert disagreement(LEVEL, -5.0, -8.0) == 3.0
    assert disagreement(SPEED, math.nan, SPEED.mild) == 1.0  # holds nowhere, as expected
    assert disagreement(SPEED, SPEED.severe, SPEED.severe) == 1.0


def test_margins_are_those_of_the_nearest_column_of_our_defaults() -> None:
    never = made_up(method="never", measure=partial(constant, figure=1e4), exception="a reason")
    always = made_up(method="always", measure=partial(constant, figure=0.0))
    theirs = made_up(method="theirs", ours=False)
    nowhere = made_up(method="without default", axis=LEVEL)
    other = made_up(method="also ours")
    table = margin_table(examined(made_up(), never, always, theirs, nowhere, other))
    assert list(table.columns) == names(MARGIN_COLUMNS)
    assert list(table["method"]) == ["by decree", "never", "always", "also ours"]
    row = table.set_index("method").loc["by decree"]
    assert row["column"] == "ten"
    assert row["margin"] == pytest.approx(10 / 3, rel=0.04)
    assert row["enough"]
    assert not row["at_least"]
    never_row, always_row = (table.set_index("method").loc[m] for m in ("never", "always"))
    assert (never_row["margin"], never_row["exception"]) == (0.0, "a reason")
    assert not never_row["enough"]
    assert always_row["at_least"]
    assert always_row["margin"] == pytest.approx(SPEED.severe / 3)


def constant(value: float, column: float, *, full: bool, figure: float) -> float:
    return figure


def test_a_default_that_does_not_hold_itself_has_no_margin() -> None:
    """A resonance just at the default, which no cell meets."""
    case = made_up(measure=at_3, columns={"": np.nan})
    (row,) = margin_table(examined(case)).to_dict("records")
    assert row["verdict"] == FAILS
    assert row["margin"] == 1.0
    assert not row["enough"]


def at_3(value: float, column: float, *, full: bool) -> float:
    return 1e6 if value == 3.0 else 0.0


def test_cases_that_measure_different_things_have_rows_of_their_own() -> None:
    """Same family, method and axis, as after the processes that sent them back."""
    first = made_up()
    second = Case(
        family="made up",
        method="by decree",
        ours=True,
        axis=SPEED,
        figure="another error",
        unit="dB",
        holds=1.0,
        degrades=2.0,
        measure=times,
    )
    table = margin_table(examined(first, second))
    assert list(table["measured"]) == ["error", "another error"]
