"""The appendix on the procedures: all rows, and those that do not hold what they promise."""

from __future__ import annotations

import pandas as pd

from tactileq.analysis.page.page import Fold, Table
from tactileq.benches.validation.model import MODEL_COLUMNS
from tactileq.benches.validation.procedures import cells, simulate_cell, validation_table
from tactileq.benches.validation.ranks import RANK_COLUMNS
from tactileq.benches.validation.section import validation_section

# What the model of the participants said, and its ranks: two rows, one of which misses an aim.
OF_MODEL = pd.DataFrame(
    [["none, SD 2", ""], ["base 95", "coverage"]], columns=["world", "missed"]
).reindex(columns=[column.name for column in MODEL_COLUMNS])
RANKS = pd.DataFrame(columns=[column.name for column in RANK_COLUMNS])


def test_what_does_not_hold_stands_on_top_and_everything_below():
    rows = [
        simulate_cell(one, simulations=200, seed=2)
        for one in cells(["TOST, no guard on ends"], sizes=[20, 36])
    ]
    table = validation_table(rows)
    section = validation_section(table, OF_MODEL, RANKS)
    apart, fold, model, ranks = section.items
    assert model.frame is OF_MODEL
    assert ranks.frame is RANKS
    assert "1 of 2 rows" in section.done[0]
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
    apart, *_ = validation_section(table, OF_MODEL, RANKS).items
    assert apart.frame.empty
