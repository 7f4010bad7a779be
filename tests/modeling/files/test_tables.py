"""Tables: what a spreadsheet would take for a formula is text, and read back as it was."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactileq.analysis.columns import tsv_text
from tactileq.experiments.sessions.bids.tables import cell as bids_cell
from tactileq.experiments.sessions.kept.tables import cell as session_cell
from tactileq.modeling.files.columns import Column
from tactileq.modeling.files.tables import guarded, read_table, table_text, unguarded, write_table

FORMULAS = ["=1+1", "+1", "@SUM(A1)", "-A1", "-1+1", "- 1", "'=1", "''@x", '=HYPERLINK("a")']
NUMBERS = ["-1", "-3.2", "-.5", "-1.5e-07", "-2E+3", "-inf"]
PLAIN = ["oak", "'oak'", "'", "'-1", "-", "1=1", "", "wall paper", "a@b", "−1", *NUMBERS]
TEXT = st.text(st.sampled_from("'=+@-a 1"), max_size=6)


@pytest.mark.parametrize("text", FORMULAS)
def test_no_cell_begins_as_a_formula(text: str) -> None:
    assert guarded(text) == f"'{text}"
    for written in (
        table_text([Column("name")], [{"name": text}]).splitlines()[1],
        tsv_text(pd.DataFrame({"name": [text]})).splitlines()[1],
        session_cell(text),
    ):
        assert written.lstrip('"').startswith("'")


@pytest.mark.parametrize("text", [*FORMULAS, *filter(None, PLAIN)])
def test_a_cell_of_bids_is_what_it_holds(text: str, tmp_path: Path) -> None:
    """Validators compare it with the levels in its sidecar."""
    table = tmp_path / "a.tsv"
    table.write_text(f"name\n{bids_cell(text)}\n")
    assert [row["name"] for row in read_table(table, [Column("name")], bids=True)] == [text]
    if '"' not in text:
        assert bids_cell(text) == text


@pytest.mark.parametrize("text", PLAIN)
def test_other_cells_stay_as_they_are(text: str) -> None:
    assert guarded(text) == unguarded(text) == text


@given(TEXT)
def test_every_text_is_read_back_as_it_was(text: str) -> None:
    assert unguarded(guarded(text)) == text
    assert guarded(text)[:1] not in ("=", "+", "@")
    assert guarded(text)[:1] != "-" or text == "-" or float(text) < 0
    if text.strip():
        (row,) = csv.reader(io.StringIO(bids_cell(text)), delimiter="\t")
        assert row[0] == text


def test_a_table_is_read_back_as_it_was(tmp_path: Path) -> None:
    texts = [*FORMULAS, *filter(None, PLAIN)]
    columns = [Column("name"), Column("number")]
    write_table(tmp_path / "a.tsv", columns, [{"name": text, "number": -1.5} for text in texts])
    rows = read_table(tmp_path / "a.tsv", columns)
    assert [row["name"] for row in rows] == texts
    assert {row["number"] for row in rows} == {"-1.5"}
