"""tactileq bench chart: what it writes, and what it says of bad input."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import pandas as pd
import pytest

from tactileq.stimuli.planted.drawn import draw_surface

METHODS = ("--method", "AR(6)", "--method", "joint, 1 layer", "--method", "white noise")
CONTENTS = {
    "rows.tsv",
    "summary.tsv",
    "fronts.tsv",
    "comparisons.tsv",
    "chart.html",
    "chart_recorded.png",
    "provenance.json",
}


@pytest.fixture
def oak(tmp_path: Path) -> Path:
    """Recordings of two drawn surfaces at 3 × 3 conditions, and one of them at 2 × 2."""
    grid = ([50.0, 150.0, 350.0], [0.5, 1.5, 3.5])
    for number, name in enumerate(("oak", "elm")):
        draw_surface(number).record(*grid, seed=number).save(tmp_path / name)
    draw_surface(7).record([50.0, 150.0], [0.5, 1.5]).save(tmp_path / "few")
    return tmp_path / "oak"


@pytest.fixture(scope="module")
def scheduler() -> Iterator[str]:
    """The address of a Dask scheduler with two workers."""
    from distributed import LocalCluster  # late: collecting the tests needs no Dask

    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        yield cluster.scheduler_address


def test_bench_chart_of_recordings_writes_tables_pictures_and_a_page(
    main, oak: Path, tmp_path: Path
) -> None:
    arguments = ("bench", "chart", "--recordings", oak, *METHODS, "--out", "chart")
    done = main(*arguments)
    assert done.returncode == 0, done.stderr
    out = tmp_path / "chart"
    assert {path.name for path in out.iterdir()} == CONTENTS
    assert done.stdout.strip().splitlines()[-1] == str(out / "chart.html")
    assert (out / "chart_recorded.png").read_bytes().startswith(b"\x89PNG")
    rows = pd.read_csv(out / "rows.tsv", sep="\t")
    assert set(rows["method"]) == {"AR(6)", "joint, 1 layer", "white noise"}
    assert (rows["kind"] == "recorded").all()
    assert rows["simulated"].all()  # the recordings are marked so
    assert rows["operations"].gt(0).all()
    assert rows["between_distance_db"].gt(0).all()
    provenance = json.loads((out / "provenance.json").read_text())
    assert provenance["command"] == "tactileq bench chart"
    assert provenance["settings"]["surfaces"] == ["recorded: drawn 0"]

    again = main(*arguments)
    assert again.returncode == 0, again.stderr
    assert {path.name for path in out.iterdir()} == CONTENTS


@pytest.mark.long("Dask with real workers")
def test_dask_workers_do_the_same(main, oak: Path, tmp_path: Path, scheduler: str) -> None:
    folders = ("--recordings", oak, "--recordings", oak.with_name("elm"))
    for name, where in (("here", ("--jobs", 1)), ("there", ("--dask", scheduler))):
        done = main("bench", "chart", *folders, *METHODS[:2], *where, "--out", name)
        assert done.returncode == 0, done.stderr
    here, there = (
        pd.read_csv(tmp_path / name / "rows.tsv", sep="\t").drop(columns="fit_ms")
        for name in ("here", "there")
    )
    assert set(here["surface"]) == {"drawn 0", "drawn 1"}
    pd.testing.assert_frame_equal(here, there)


BAD_INPUT = [
    (("--method", "AR(7)"), "error: expected methods among joint; joint, 1 layer; "),
    (("--recordings", "few"), "error: drawn 7: expected recordings at 3 speeds × 3 forces or more"),
    (("--recordings", "nowhere"), "error: expected "),
    (("--models", "models"), "error: expected --recordings for the models that --models names"),
    (("--recordings", "oak", "--models", "oak"), "error: expected model files in oak, got none"),
    (("--toolkit", "Models_none.xml"), "error: expected "),
    (("--out", "oak"), "error: expected a new folder or earlier results of tactileq bench chart"),
    (
        ("--recordings", "oak", "--dask", "tcp://127.0.0.1:1"),
        "error: expected a Dask scheduler at 'tcp://127.0.0.1:1', got no answer",
    ),
]


@pytest.mark.parametrize(("arguments", "sentence"), BAD_INPUT)
def test_bad_input_is_one_sentence(
    main,
    oak: Path,
    tmp_path: Path,
    arguments: tuple[str, ...],
    sentence: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("tactileq.workers.ANSWER_S", 0.2)
    done = main("bench", "chart", *arguments)
    assert done.returncode == 1
    assert done.stderr.startswith(sentence)
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "bench-chart").exists()
