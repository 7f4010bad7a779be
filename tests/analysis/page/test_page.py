"""Tables and pictures on paper: nothing cut, words whole, beginnings with their tables."""

from __future__ import annotations

import re

import pandas as pd
from matplotlib.figure import Figure

from tactileq.analysis.page.page import (
    LONGEST_WORD_KEPT_WHOLE,
    MOST_ROWS,
    PIXELS_PER_INCH,
    ROWS_OF_LONGER,
    STYLE,
    Picture,
    Table,
    picture_html,
    table_html,
)
from tactileq.modeling.files.columns import Column


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


def test_of_a_very_long_table_the_beginning_is_shown():
    columns = (Column("a"),)
    long = pd.DataFrame({"a": [f"row {number}" for number in range(1, MOST_ROWS + 2)]})
    whole = table_html(Table("x", "X", "Told.", long[:-1], columns, simulated=False))
    assert f"row {MOST_ROWS}<" in whole
    assert "tables/x.tsv" not in whole
    cut = table_html(Table("x", "X", "Told.", long, columns, simulated=False))
    assert f"row {ROWS_OF_LONGER}<" in cut
    assert f"row {ROWS_OF_LONGER + 1}<" not in cut
    assert f"Told. Rows 1 to {ROWS_OF_LONGER} of {MOST_ROWS + 1}; all are in tables/x.tsv." in cut


def test_a_picture_that_is_taller_than_wide_has_an_upright_page():
    assert "@page upright { size: A4 portrait" in STYLE
    assert "figure.tall, h2:has(+ figure.tall) { page: upright; }" in STYLE
    for size, tall in (((4, 6), True), ((6, 4), False), ((5, 5), False)):
        figure = Figure(figsize=size)
        html = picture_html(Picture("x", "X", "", figure, simulated=False), b"")
        assert ('class="tall"' in html) == tall
        assert f'width="{round(size[0] * PIXELS_PER_INCH)}"' in html
