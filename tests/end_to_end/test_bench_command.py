"""tactileq bench render: what it prints and writes."""

from __future__ import annotations

import json
from pathlib import Path

import pandas as pd

CONTENTS = {
    "times.tsv",
    "layers.tsv",
    "operations.tsv",
    "aims.tsv",
    "rendering.png",
    "provenance.json",
}


def test_bench_render_prints_and_writes_its_tables(main, tmp_path: Path) -> None:
    done = main("bench", "render", "--quick", "--plot", "--out", "bench")
    assert done.returncode == 0, done.stderr
    out = tmp_path / "bench"
    assert {path.name for path in out.iterdir()} == CONTENTS
    assert (out / "rendering.png").read_bytes().startswith(b"\x89PNG")
    aims = pd.read_csv(out / "aims.tsv", sep="\t")
    assert list(aims.columns) == ["what", "where", "aim", "measured", "met"]
    told = done.stdout
    assert f"{aims['met'].sum()} of {len(aims)} targets met" in told
    assert told.count("not met") == (~aims["met"]).sum()
    assert "sosfilt" in told
    assert "direct form" in told
    times = pd.read_csv(out / "times.tsv", sep="\t")
    assert (times["ns_per_sample"] > 0).all()
    provenance = json.loads((out / "provenance.json").read_text())
    assert provenance["command"] == "tactileq bench render"
    assert provenance["settings"]["quick"] is True

    again = main("bench", "render", "--quick", "--out", "bench")
    assert again.returncode == 0, again.stderr
    assert {path.name for path in out.iterdir()} == CONTENTS - {"rendering.png"}


def test_bench_render_replaces_nothing_of_others(main, tmp_path: Path) -> None:
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.txt").write_text("years of work")
    done = main("bench", "render", "--quick", "--out", "mine")
    assert done.returncode == 1
    assert done.stderr.startswith("error: expected a new folder or earlier results")
    assert "Traceback" not in done.stderr
    assert (tmp_path / "mine" / "thesis.txt").read_text() == "years of work"
