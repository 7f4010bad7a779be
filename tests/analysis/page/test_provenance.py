"""Where a report comes from, as people read it and as the file keeps it."""

from __future__ import annotations

from tactileq.analysis.page.page import table_html
from tactileq.analysis.page.provenance import provenance_table, unfolded

HASH = "0123456789abcdef" * 4


def test_what_is_nested_is_unfolded():
    facts = {
        "command": "tactileq demo",
        "seed": 1,
        "settings": {
            "hold_above": True,
            "study": {"textures": ["木材", "canvas"], "tasks": {"absolute": {"participants": 20}}},
            "models": [{"label": "full"}, {"label": "simplified"}],
        },
        "inputs_sha256": {},
        "left_out": None,
    }
    assert unfolded(facts) == [
        ("command", "tactileq demo"),
        ("seed", "1"),
        ("settings › hold_above", "yes"),
        ("settings › study › textures", "木材, canvas"),
        ("settings › study › tasks › absolute › participants", "20"),
        ("settings › models › 1 › label", "full"),
        ("settings › models › 2 › label", "simplified"),
        ("inputs_sha256", "none"),
        ("left_out", "none"),
    ]


def test_hashes_are_short_on_the_page_and_whole_in_the_file():
    table = provenance_table({"inputs_sha256": {"data": HASH}, "command": "tactileq analyze"})
    assert table.frame["value"].tolist() == [HASH, "tactileq analyze"]
    html = table_html(table)
    assert f'<td  title="{HASH}">0123456789ab…</td>' in html
    assert html.count(HASH) == 1
    assert html.count("title=") == 1
    assert "{" not in html
