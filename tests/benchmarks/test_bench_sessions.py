"""How long simulated sessions take in memory, and with every answer on disk."""

from __future__ import annotations

from dataclasses import replace
from itertools import count
from pathlib import Path

import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from tactileq.experiments.observers.in_memory import simulate_sessions
from tactileq.experiments.observers.percepts import Perception
from tactileq.experiments.observers.psychometrics import Psychometrics
from tactileq.experiments.observers.whole_study import simulate_study
from tactileq.experiments.study.models import ModelSets
from tactileq.experiments.study.study import Study
from tactileq.modeling import TextureModel, Threshold, simplify
from tactileq.rig.desk.twin import SimulatedRig
from tactileq.stimuli.planted.textures import planted_texture

WAYS = ("in memory", "with every answer on disk")


@pytest.fixture(scope="module")
def paper(timed: bool) -> Study:
    """The paper's tasks: a session with 14 ratings, two with 21 choices, per participant."""
    study = Study.load()
    participants = 4 if timed else 2
    plans = {task: replace(plan, participants=participants) for task, plan in study.tasks.items()}
    return replace(study, tasks=plans, plan=replace(study.plan, rule="tests"))


@pytest.fixture(scope="module")
def truths(paper: Study) -> dict[str, TextureModel]:
    return {texture: planted_texture(texture) for texture in paper.textures}


@pytest.fixture(scope="module")
def models(truths: dict[str, TextureModel]) -> ModelSets:
    threshold = Threshold.shipped("codec")
    simplified = {
        name: simplify(truth, threshold, criterion="paper-fft").model
        for name, truth in truths.items()
    }
    return ModelSets(sets={"full": truths, "simplified": simplified})


@pytest.mark.benchmark(group="12 simulated sessions")
@pytest.mark.parametrize("way", WAYS)
def test_simulated_sessions(
    benchmark: BenchmarkFixture,
    paper: Study,
    truths: dict[str, TextureModel],
    models: ModelSets,
    tmp_path: Path,
    way: str,
) -> None:
    threshold = Threshold.shipped("codec")
    perception = Perception(paper, real=truths, models=models, threshold=threshold)
    folders = (tmp_path / str(number) for number in count())

    def in_memory() -> int:
        parts = {"perception": perception, "psychometrics": Psychometrics(), "seed": 1}
        return sum(map(len, simulate_sessions(paper, models=models, **parts).values()))

    def on_disk() -> int:
        results = simulate_study(
            paper,
            real=truths,
            models=models,
            rig=SimulatedRig(truths),
            data_folder=next(folders),
            seed=1,
            threshold=threshold,
        )
        return sum(result.answered for result in results)

    benchmark.extra_info["what"] = way
    if way == WAYS[1]:
        benchmark.extra_info["rival"] = True
    answered = benchmark.pedantic(in_memory if way == WAYS[0] else on_disk, rounds=3)
    participants = paper.plan_of("absolute").participants
    assert answered == participants * (18 + 2 * 23)
