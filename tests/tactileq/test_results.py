"""What a command may replace: what an earlier run of it made, and nothing beside."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tactileq.modeling.files.provenance import PROVENANCE_NAME
from tactileq.results import check_own_results


@pytest.fixture
def results(tmp_path: Path) -> Path:
    """A folder as tactileq analyze leaves it: a report, and a table in a folder below."""
    folder = tmp_path / "results"
    (folder / "tables").mkdir(parents=True)
    for name in ("report.html", "tables/rates.tsv"):
        (folder / name).write_text("ours")
    note = {"command": "tactileq analyze", "files": ["report.html", "tables/rates.tsv"]}
    (folder / PROVENANCE_NAME).write_text(json.dumps(note))
    return folder


def test_own_results_may_be_replaced(results: Path) -> None:
    own = {"report.html", "tables", "tables/rates.tsv", PROVENANCE_NAME}
    assert set(check_own_results(results, "analyze")) == own


def test_a_foreign_folder_behind_a_link_is_not_our_own(results: Path, tmp_path: Path) -> None:
    """It has the name of one of our folders, and what is in it bears the names of our files."""
    (results / "tables").rename(tmp_path / "somebody's")
    (results / "tables").symlink_to(tmp_path / "somebody's")
    with pytest.raises(ValueError, match=r"other files in it \(tables/\)"):
        check_own_results(results, "analyze")


@pytest.mark.parametrize("foreign", ["notes.txt", "tables/notes.txt", "empty/"])
def test_a_folder_with_anything_else_in_it_is_refused(results: Path, foreign: str) -> None:
    if foreign.endswith("/"):
        (results / foreign).mkdir()
    else:
        (results / foreign).write_text("theirs")
    with pytest.raises(ValueError, match=rf"other files in it \({foreign}\)"):
        check_own_results(results, "analyze")


def test_results_of_another_command_are_refused(results: Path) -> None:
    with pytest.raises(ValueError, match="earlier results of tactileq demo"):
        check_own_results(results, "demo")
