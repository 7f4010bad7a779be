"""Several imports into one set at the same time."""

from __future__ import annotations

import multiprocessing
from pathlib import Path

import numpy as np

from tactileq.commands.recording.imports import add_to_set
from tactileq.modeling import Recording, RecordingSet
from tactileq.results import CommandRun
from tactileq.rig.recording.importing.files import Imported


def test_six_imports_at_once_all_arrive(tmp_path: Path) -> None:
    fork = multiprocessing.get_context("fork")
    ready, out = fork.Barrier(6), tmp_path / "set"
    samples = np.random.default_rng(1).normal(0, 0.1, 500)

    def add(number: int) -> None:
        new = [Imported(Recording(samples, 5000.0, 100.0 + number, 1.0, "oak"))]
        ready.wait()
        add_to_set(out, new, CommandRun("import csv"), settings={})

    processes = [fork.Process(target=add, args=(number,)) for number in range(6)]
    for process in processes:
        process.start()
    for process in processes:
        process.join(500)
    assert [process.exitcode for process in processes] == [0] * 6
    found = RecordingSet.load(out)
    assert sorted(recording.speed_mm_s for recording in found) == [100.0 + n for n in range(6)]
    assert [path.name for path in tmp_path.iterdir()] == ["set"]
