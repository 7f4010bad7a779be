"""tactileq stability: what it prints and writes, and what it refuses."""

from __future__ import annotations

import json
from pathlib import Path

import pandas as pd

from tactileq.benches.atlas.cases import CASES

CONTENTS = {
    "cells.tsv",
    "edges.tsv",
    "margins.tsv",
    "atlas.png",
    "atlas.svg",
    "atlas.html",
    "provenance.json",
}


def test_stability_prints_and_writes_the_atlas(run, main, tmp_path: Path) -> None:
    done = run("stability", "--reduced", "--only", "blending", "--out", "atlas", "--jobs", "2")
    assert done.returncode == 0, done.stderr
    out = tmp_path / "atlas"
    assert {path.name for path in out.iterdir()} == CONTENTS
    blending = [case for case in CASES if case.family == "blending"]
    columns = [(case.method, next(iter(case.columns))) for case in blending]
    edges = pd.read_csv(out / "edges.tsv", sep="\t", keep_default_na=False, na_values="n/a")
    assert list(zip(edges["method"], edges["column"], strict=True)) == columns
    cells = pd.read_csv(out / "cells.tsv", sep="\t", na_values="n/a")
    assert set(cells["verdict"]) <= {"holds", "degrades", "fails"}
    assert cells["simulated"].all()
    assert edges["simulated"].all()
    margins = pd.read_csv(out / "margins.tsv", sep="\t", na_values="n/a")
    assert ((margins["margin"] >= 2) | margins["exception"].notna()).all()
    assert (margins["margin"] >= 2).any()
    lines = done.stdout.strip().splitlines()
    assert lines[-1] == "simulated: atlas/atlas.html"
    assert sum("PEQ, logarithmic" in line and "× more severe" in line for line in lines) == 1
    assert (out / "atlas.png").read_bytes().startswith(b"\x89PNG")
    assert "SIMULATED" in (out / "atlas.html").read_text(encoding="utf-8")
    provenance = json.loads((out / "provenance.json").read_text())
    assert provenance["command"] == "tactileq stability"
    assert provenance["settings"] == {"reduced": True, "only": ["blending"]}

    made = {path.name: path.read_bytes() for path in out.iterdir()}
    again = main("stability", "--reduced", "--only", "blending", "--out", "atlas", "--jobs", "1")
    assert again.returncode == 0, again.stderr
    assert {path.name: path.read_bytes() for path in out.iterdir()} == made


def test_an_unknown_family_is_refused_by_naming_those_that_there_are(main, tmp_path: Path) -> None:
    done = main("stability", "--only", "filters", "--only", "walls", "--out", "atlas")
    assert done.returncode == 1
    assert done.stderr.startswith("error: expected a family of cases among filters, blending, ")
    assert done.stderr.count("\n") == 1
    assert "got 'walls'; name one of these with --only" in done.stderr
    assert not (tmp_path / "atlas").exists()


def test_a_folder_of_somebody_else_is_not_replaced(main, tmp_path: Path) -> None:
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.txt").write_text("years of work")
    done = main("stability", "--only", "blending", "--out", "mine")
    assert done.returncode == 1
    assert done.stderr.startswith("error: expected a new folder or earlier results")
    assert (tmp_path / "mine" / "thesis.txt").read_text() == "years of work"
