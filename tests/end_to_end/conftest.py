"""The command line as a user meets it: a process of its own, without a terminal."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import pytest
import typer

from tactileq import app
from tactileq.experiments.observers.whole_study import simulate_study
from tactileq.experiments.study.models import ModelSets
from tactileq.experiments.study.study import Study
from tactileq.experiments.study.task_plan import TaskPlan
from tactileq.modeling import Threshold, simplify
from tactileq.modeling.files.claims import ClaimSection, PlanSection
from tactileq.rig.desk.twin import SimulatedRig
from tactileq.stimuli.planted.textures import planted_texture

SMALL_STUDY = """
name = "small"
seed = 3
textures = ["canvas", "MDF"]
[absolute]
participants = 2
schedule = "interleaved"
[relative]
participants = 2
schedule = "by-day"
[trays]
canvas = "A"
MDF = "B"
"""
CLAIM = """
[[plan.claims]]
name = "magnitude feels the same"
task = "absolute"
measure = "magnitude_similarity"
models = ["full", "simplified"]
bounds = [-7.5, 7.5]
test = "equivalence"
"""
Run = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture
def small_study() -> str:
    """A study file of two textures and two participants of either task."""
    return SMALL_STUDY


@pytest.fixture
def claimed_study() -> str:
    """The small study with a claim about its ratings."""
    return SMALL_STUDY + CLAIM


@pytest.fixture
def run(tmp_path: Path) -> Run:
    """`run("model", "folder")` runs `tactileq model folder` in an empty folder."""

    def call(*arguments: object) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, "-m", "tactileq", *map(str, arguments)],
            cwd=tmp_path,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=550,  # a hang, no speed
        )

    return call


@cache
def commands() -> Any:
    """All commands with their options, which Typer otherwise reads from the functions each time."""
    return typer.main.get_command(app.app)


@pytest.fixture
def main(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Run:
    """`run` without a process of its own: loading the libraries takes longer than the work."""
    monkeypatch.setattr(app, "app", commands())

    def call(*arguments: object) -> subprocess.CompletedProcess[str]:
        monkeypatch.chdir(tmp_path)
        words = [str(argument) for argument in arguments]
        # Worker processes would outlive the test, in the folder where they began.
        words += ["--jobs", "1"] if words[0] == "model" else []
        monkeypatch.setattr("sys.argv", ["tactileq", *words])
        with pytest.raises(SystemExit) as end:
            app.main()
        told = capsys.readouterr()
        return subprocess.CompletedProcess(words, int(end.value.code or 0), told.out, told.err)

    return call


@pytest.fixture(scope="session")
def simulated(once_per_run: Any) -> Path:
    """The data of a simulated study of three surfaces with one claim."""
    return once_per_run("analyzed-study", _simulated_in)


def _simulated_in(folder: Path) -> Path:
    truths = {texture: planted_texture(texture) for texture in ("leather", "MDF", "PVC")}
    threshold = Threshold.shipped("codec")
    fewer = {
        name: simplify(truth, threshold, criterion="paper-fft").model
        for name, truth in truths.items()
    }
    claim = ClaimSection(
        name="as strong",
        task="absolute",
        measure="magnitude_similarity",
        models=("full", "simplified"),
        bounds=(-7.5, 7.5),
        test="equivalence",
    )
    study = Study(
        name="Three surfaces",
        seed=3,
        textures=tuple(truths),
        trays={"leather": "A", "MDF": "B", "PVC": "C"},
        tasks={
            "absolute": TaskPlan(participants=4, schedule="interleaved", training_trials=1),
            "relative": TaskPlan(participants=2, schedule="by-day", repeats=1, training_trials=1),
        },
        plan=PlanSection(claims=(claim,), exclusions=("Whoever presses nothing.",)),
    )
    simulate_study(
        study,
        real=truths,
        models=ModelSets(sets={"full": truths, "simplified": fewer}),
        rig=SimulatedRig(seed=1),
        data_folder=folder / "data",
        seed=7,
        threshold=threshold,
    )
    return folder / "data"
