"""Tables on paper: nothing cut, words whole, beginnings with their tables."""

from __future__ import annotations

import re

import pandas as pd

from analysis.columns import Column
from analysis.report.page import LONGEST_WORD_KEPT_WHOLE, STYLE, Table, table_html


def classes(frame: pd.DataFrame, *columns: Column) -> list[list[str]]:
    """Of the cells of the first row."""
    html = table_html(Table("x", "X", "", frame, columns, simulated=False))
    body = html[html.index("<tbody>") :]
    row = body[: body.index("</tr>")]
    return [found.split() for found in re.findall(r'<td (?:class="([^"]*)")?', row)]


def test_only_words_that_no_line_can_hold_are_broken():
    whole, longer = "w" * LONGEST_WORD_KEPT_WHOLE, "w" * (LONGEST_WORD_KEPT_WHOLE + 1)
    frame = pd.DataFrame({"a": ["x", whole], "b": ["x", longer], "c": [f"{whole} x", "y"]})
    assert classes(frame, *map(Column, "abc")) == [[], ["long"], []]
    named = (Column("a", is_name=True), Column("b", is_name=True))
    assert classes(frame, *named) == [["name"], ["name", "long"]]
    assert classes(frame.assign(a=[1.5, 2.5]), Column("a")) == [["number"]]


def test_a_hash_counts_as_it_is_shown():
    frame = pd.DataFrame({"a": ["0" * 64]})
    assert classes(frame, Column("a", is_hash=True)) == [[]]
    assert classes(frame, Column("a")) == [["long"]]


def test_a_table_of_nobody_has_its_head():
    html = table_html(
        Table("x", "X", "", pd.DataFrame(columns=["a"]), (Column("a"),), simulated=False)
    )
    assert "<th >a</th>" in html
    assert "<td" not in html


def test_paper_keeps_captions_heads_and_rows_together():
    on_paper = STYLE[STYLE.index("@media print") :]
    together = re.search(r"\n  ([^\n]*)\{ break-inside: avoid; \}", on_paper)
    assert together
    assert {"caption", "tr", ".short", "figure"} <= set(re.split(r"[, ]+", together[1]))
    assert "tbody tr:nth-child(-n + 3), tbody tr:nth-last-child(-n + 2) { break-before" in on_paper
    assert "td.long { overflow-wrap: anywhere; }" in on_paper
    assert on_paper.count("overflow-wrap") == 1
