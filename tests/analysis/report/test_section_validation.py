"""The appendix on the procedures: all rows, and those that do not hold what they promise."""

from __future__ import annotations

from analysis.report.page import Fold, Table
from analysis.report.section_validation import validation_section
from analysis.statistics.validation import cells, simulate_cell, validation_table


def test_what_does_not_hold_stands_on_top_and_everything_below():
    rows = [
        simulate_cell(one, simulations=200, seed=2)
        for one in cells(["TOST, no guard on ends"], sizes=[20, 36])
    ]
    table = validation_table(rows)
    section = validation_section(table)
    apart, fold = section.items
    assert isinstance(apart, Table)
    assert isinstance(fold, Fold)
    assert apart.frame.to_dict("records") == [
        {
            "procedure": "TOST, no guard on ends",
            "quantity": "type I error",
            "situation": "ceiling",
            "meaning": "errs too often",
            "n": "20, 36",
        }
    ]
    assert [column.name for column in apart.columns] == [
        *("procedure", "quantity", "situation", "n", "meaning")
    ]
    (whole,) = fold.items
    assert whole.frame is table
    assert apart.simulated
    assert whole.simulated
    assert "2 of 4 rows contain" in section.done[0]
    assert "200 simulations" in section.done[0]


def test_a_table_in_which_all_hold_is_no_error():
    rows = [simulate_cell(one, simulations=1, seed=2) for one in cells(["TOST"], sizes=[8])]
    table = validation_table(rows).assign(within="yes", meaning="")
    apart, _ = validation_section(table).items
    assert apart.frame.empty
