"""Small studies on disk, run by the program itself, for the tests of their verification."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from datetime import timedelta
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tactileq.experiments.observers.experimenter import SimulatedExperimenter
from tactileq.experiments.sessions.bids.export import export_all, export_session
from tactileq.experiments.sessions.kept import log
from tactileq.experiments.sessions.kept.files import SessionFiles
from tactileq.experiments.sessions.kept.stored_sessions import held_session
from tactileq.experiments.sessions.loop.people import Choice, Intake, Rating, SessionAborted
from tactileq.experiments.sessions.loop.running import Circumstances, run_session
from tactileq.experiments.sessions.loop.surfaces import Surfaces
from tactileq.experiments.sessions.loop.trial_loop import People, SessionResult
from tactileq.experiments.sessions.store.withdrawing import drop_out, withdraw
from tactileq.experiments.study.models import ModelSets
from tactileq.experiments.study.questions import Question
from tactileq.experiments.study.study import Study
from tactileq.experiments.study.task_plan import TaskPlan
from tactileq.experiments.tasks import task_named
from tactileq.modeling import Simplification, Threshold, simplify
from tactileq.rig.desk.twin import SimulatedRig
from tactileq.stimuli.planted.textures import planted_texture
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

    def _stroke(self, surfaces: Surfaces) -> None:
        """For a moment; the twin's hand moves on with each reading."""
        time.sleep(self.thinking_s * self._rng.random())
        for _ in range(int(self._rng.integers(1, 6))):
            surfaces.follow_rig_button()

    def rate(self, trial: Any, surfaces: Surfaces) -> Rating:
        surfaces.start()
        for _ in range(1 + int(self._rng.integers(3))):
            self._stroke(surfaces)
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
            self._stroke(surfaces)
            surfaces.present_virtual(button)
        assert surfaces.last is not None
        surfaces.choose(surfaces.last)
        self.answered += 1
        taken_s = round(float(self._rng.uniform(0.1, 0.9)), 3)
        return Choice(button=surfaces.last, response_time_s=taken_s)


def simplified_texture(texture: str) -> Simplification:
    """What the paper's rule leaves of a planted texture."""
    threshold = Threshold.shipped("codec")
    return simplify(planted_texture(texture), threshold, criterion="paper-fft", margin_db=15.0)


def small_models(textures: tuple[str, ...]) -> ModelSets:
    """Planted textures, and what the paper's rule leaves of them."""
    full = {texture: planted_texture(texture) for texture in textures}
    simplified = {texture: simplified_texture(texture).model for texture in textures}
    return ModelSets(sets={"full": full, "simplified": simplified})


def small_study(textures: tuple[str, ...], *, participants: int = 2) -> Study:
    """Three tasks, one question."""
    plan = TaskPlan(participants=participants, schedule="interleaved", training_trials=1)
    return Study(
        name="Small",
        seed=11,
        textures=textures,
        trays=dict(zip(textures, "CABDEFG", strict=False)),
        questions=(Question(name="age", least=18, most=99),),
        tasks={
            "absolute": plan,
            "relative": plan,
            "threshold": replace(plan, training_trials=0),
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
    **circumstances: Any,
) -> None:
    """Two people, absolute and relative."""
    for task in ("absolute", "relative"):
        for subject in (1, 2):
            run_one(root, study, models, task=task, subject=subject, **circumstances)


class Stopping(Person):
    """Stops before an answer."""

    def __init__(self, seed: int, after: int) -> None:
        super().__init__(seed)
        self._after = after

    def rate(self, trial: Any, surfaces: Surfaces) -> Rating:
        if self.answered == self._after:
            raise SessionAborted("tired")
        return super().rate(trial, surfaces)


def killed(at_s: float, session: Callable[[], object]) -> None:
    """Run a session in a process of its own that the kernel kills at a moment."""
    child = os.fork()
    if child == 0:
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        signal.setitimer(signal.ITIMER_REAL, at_s)
        try:
            session()
        finally:
            os._exit(0)
    os.waitpid(child, 0)


def eventful_study(root: Path, models: ModelSets, *, seed: int) -> list[str]:
    """A study in which much happens, and nothing is tampered with; returns what happened."""
    rng = np.random.default_rng(seed)
    study = small_study(("canvas", "PVC"))
    told = []
    pilot, simulated = rng.random() < 0.1, rng.random() < 0.3

    def person(subject: int) -> Person:
        one = Person(seed + subject)
        one.simulated = simulated
        return one

    session = partial(run_one, root, study, models, pilot=pilot)
    left: set[int] = set()
    for task, subject in ((task, n) for task in ("absolute", "relative") for n in (1, 2)):
        if subject in left:
            continue
        what = str(rng.choice(["whole", "whole", "killed", "stopped", "another day"]))
        told.append(what)
        began = {"task": task, "subject": subject}
        if what == "killed":
            at_s = float(rng.uniform(0.001, 0.08))
            killed(at_s, partial(session, **began, respondent=person(subject)))
        if what == "stopped" and task == "absolute":
            tired = Stopping(seed, after=int(rng.integers(4)))
            tired.simulated = simulated
            session(**began, respondent=tired)
        there = any(root.glob(f"sourcedata/sub-0{subject}/*/*_task-{task}_manifest.json"))
        if there and _complete(root, **began):
            continue  # the kernel came too late
        if there and rng.random() < 0.3:
            told.append("left so")  # a session that nobody takes up again
            continue
        later = timedelta(days=1, hours=2) if what == "another day" else timedelta()
        with at_another_time(later):
            session(**began, respondent=person(subject), resume=there, override="a test")
        if rng.random() < 0.15:
            gone = str(rng.choice(["withdrawn", "dropped out"]))
            told.append(gone)
            (withdraw if gone == "withdrawn" else drop_out)(root, subject)
            left.add(subject)
    export_all(root)
    return told


def _complete(root: Path, *, task: str, subject: int) -> bool:
    held = held_session(SessionFiles(root=root, task=task, subject=subject, session=1))
    return held.state.status == "complete"


@contextmanager
def at_another_time(later: timedelta) -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        now = log.now_utc
        patch.setattr(log, "now_utc", lambda: now() + later)
        yield
