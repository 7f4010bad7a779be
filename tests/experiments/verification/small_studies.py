"""Small studies on disk, run by the program itself, for the tests of their verification."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np

from experiments.observers.experimenter import SimulatedExperimenter
from experiments.sessions.bids import export_session
from experiments.sessions.people import Choice, Intake, Rating
from experiments.sessions.running import Circumstances, run_session
from experiments.sessions.surfaces import Surfaces
from experiments.sessions.trial_loop import People, SessionResult
from experiments.study.models import ModelSets
from experiments.study.questions import Question
from experiments.study.study import Study
from experiments.study.task_plan import TaskPlan
from experiments.tasks import task_named
from rig.twin import SimulatedRig
from tests.experiments.scripted import Scripted


class Person(Scripted):
    """Answers at random, but notes the sliders as the console does, and is not marked simulated."""

    simulated = False
    thinking_s = 0.001

    def __init__(self, seed: int) -> None:
        super().__init__()
        self._rng = np.random.default_rng(seed)

    def welcome(self, intake: Intake) -> dict[str, str | int]:
        return {question.name: int(self._rng.integers(18, 80)) for question in intake.questions}

    def rate(self, trial: Any, surfaces: Surfaces) -> Rating:
        surfaces.start()
        for _ in range(1 + int(self._rng.integers(3))):
            time.sleep(self.thinking_s * self._rng.random())
            surfaces.toggle()
        given = {}
        for scale in ("magnitude", "frequency"):
            value = round(float(self._rng.uniform(0, 100)), 2)
            surfaces.note("slider", scale=scale, value=round(value, 1))
            given[f"{scale}_similarity"] = value
        self.answered += 1
        return Rating(response_time_s=round(float(self._rng.uniform(0.1, 0.9)), 3), **given)

    def choose(self, trial: Any, surfaces: Surfaces) -> Choice:
        surfaces.start()
        for button in self._rng.permutation(surfaces.count).tolist():
            time.sleep(self.thinking_s * self._rng.random())
            surfaces.present_virtual(button)
        assert surfaces.last is not None
        surfaces.choose(surfaces.last)
        self.answered += 1
        taken_s = round(float(self._rng.uniform(0.1, 0.9)), 3)
        return Choice(button=surfaces.last, response_time_s=taken_s)


def small_study(textures: tuple[str, ...]) -> Study:
    """Two people, three tasks, one question."""
    rated = TaskPlan(participants=2, schedule="interleaved", training_trials=1)
    return Study(
        name="Small",
        seed=11,
        textures=textures,
        trays=dict(zip(textures, "CABDEFG", strict=False)),
        questions=(Question(name="age", least=18, most=99),),
        tasks={
            "absolute": rated,
            "relative": TaskPlan(participants=2, schedule="interleaved", training_trials=1),
            "threshold": TaskPlan(participants=2, schedule="interleaved"),
        },
    )


def run_one(
    root: Path,
    study: Study,
    models: ModelSets,
    *,
    task: str = "absolute",
    subject: int = 1,
    respondent: Any = None,
    rig: Any = None,
    **circumstances: Any,
) -> tuple[SessionResult, Path]:
    """One session and its tables, as tactileq session does it."""
    result, manifest = run_session(
        task_named(task),
        study,
        subject=subject,
        session=circumstances.pop("session", 1),
        models=models,
        rig=rig or SimulatedRig(models.sets["full"]),
        people=People(
            respondent=respondent or Person(subject), experimenter=SimulatedExperimenter()
        ),
        data_folder=root,
        circumstances=Circumstances(**circumstances),
    )
    export_session(root, manifest)
    return result, manifest


def run_all(
    root: Path,
    study: Study,
    models: ModelSets,
    *,
    tasks: tuple[str, ...] = ("absolute", "relative"),
) -> None:
    """Two people in each task."""
    for task in tasks:
        for subject in (1, 2):
            run_one(root, study, models, task=task, subject=subject)
