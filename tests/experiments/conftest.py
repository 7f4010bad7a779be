"""A small study, its truths and models, and a rig that remembers what it presented."""

from __future__ import annotations

import os
from collections.abc import Mapping
from math import inf
from pathlib import Path

import pytest

from tactileq.experiments.sessions.loop.people import Choice, Rating
from tactileq.experiments.sessions.loop.surfaces import Surfaces
from tactileq.experiments.study.models import ModelSets
from tactileq.experiments.study.study import Study
from tactileq.experiments.study.task_plan import TaskPlan
from tactileq.experiments.tasks.absolute import AbsoluteTrial
from tactileq.experiments.tasks.relative import RelativeTrial
from tactileq.modeling import TextureModel, Threshold, simplify
from tactileq.rig.shared.interface import (
    Acceleration,
    Fault,
    HandRows,
    PresentationRecord,
    RigHealth,
    RigReading,
)
from tactileq.stimuli.planted.textures import planted_texture

TEXTURES = ("canvas", "MDF", "PVC")


class NotingRig:
    """Notes what it presents; may be told to fail at presenting, or of faults to tell."""

    simulated = True
    stated: Mapping[str, object] = {}

    def __init__(self) -> None:
        self.notes: list[tuple[str, object]] = []
        self.presses = 0
        self.broken = False
        self.opened = False
        self.faults: list[Fault] = []

    def open(self) -> None:
        self.opened = True

    def close(self) -> None:
        self.opened = False

    highest_exposure_m_s2 = inf

    armed = 0

    def arm(self) -> None:
        self.armed += 1

    def now_s(self) -> float:
        return 0.0

    def health(self) -> RigHealth:
        return RigHealth()

    def present_model(self, model: TextureModel) -> float:
        self._note("virtual", model)
        return 0.0

    def present_real(self, texture: str) -> float:
        self._note("real", texture)
        return 0.0

    def _note(self, what: str, shown: object) -> None:
        if self.broken:
            raise RuntimeError("the vibrator is gone")
        self.notes.append((what, shown))

    def silence(self) -> None:
        self.notes.append(("silence", None))

    def read(self) -> RigReading:
        pressed, self.presses = self.presses > 0, max(self.presses - 1, 0)
        return RigReading(0.0, 0.0, 0.0, pressed, simulated=True)

    def take_faults(self) -> tuple[Fault, ...]:
        taken, self.faults = tuple(self.faults), []
        return taken

    def take_history(self) -> HandRows:
        return HandRows.joined([])

    def take_acceleration(self) -> tuple[Acceleration, ...]:
        return ()

    def take_presentations(self) -> tuple[PresentationRecord, ...]:
        return ()


class Script:
    """A respondent that answers by rote; subclasses misbehave."""

    simulated = True

    def __init__(self) -> None:
        self.heard: list[str] = []
        self.trays: list[str] = []
        self.answered = 0

    def announce(self, title: str, text: str) -> None:
        self.heard.append(title)

    def confirm_mount(self, tray: str) -> None:
        self.trays.append(tray)

    def rate(self, trial: AbsoluteTrial, surfaces: Surfaces) -> Rating:
        surfaces.toggle()
        surfaces.toggle()
        self.answered += 1
        return Rating(magnitude_similarity=70.0, frequency_similarity=30.5, response_time_s=2.5)

    def choose(self, trial: RelativeTrial, surfaces: Surfaces) -> Choice:
        for button in (0, 1, 1):
            surfaces.present_virtual(button)
        surfaces.choose(1)
        self.answered += 1
        return Choice(button=1, response_time_s=3.25)


@pytest.fixture
def study() -> Study:
    return Study(
        name="Three textures",
        seed=11,
        textures=TEXTURES,
        trays={"canvas": "C", "MDF": "A", "PVC": "B"},
        tasks={
            "absolute": TaskPlan(participants=3, schedule="interleaved", training_trials=1),
            "relative": TaskPlan(participants=4, schedule="by-day", repeats=2, training_trials=1),
        },
    )


@pytest.fixture(scope="session")
def threshold() -> Threshold:
    return Threshold.shipped("codec")


@pytest.fixture(scope="session")
def truths() -> dict[str, TextureModel]:
    return {texture: planted_texture(texture) for texture in TEXTURES}


@pytest.fixture(scope="session")
def models(truths: dict[str, TextureModel], threshold: Threshold) -> ModelSets:
    simplified = {
        name: simplify(model, threshold, criterion="paper-fft", margin_db=15.0).model
        for name, model in truths.items()
    }
    return ModelSets(sets={"full": truths, "simplified": simplified})


@pytest.fixture
def rig() -> NotingRig:
    return NotingRig()


@pytest.fixture
def respondent() -> Script:
    return Script()


@pytest.fixture
def misbehaving() -> type[Script]:
    """The class to derive misbehaving respondents from."""
    return Script


@pytest.fixture
def unsynced(monkeypatch: pytest.MonkeyPatch) -> None:
    """No wait for the disk: what a killed process wrote is there, unless the power fails too."""
    monkeypatch.setattr(os, "fsync", lambda handle: None)


@pytest.fixture
def rows() -> object:
    """Reads a table: a list of dictionaries, after checking that every line is whole."""

    def read(path: Path) -> list[dict[str, str]]:
        text = path.read_bytes().decode("utf-8")
        assert text.endswith("\n")
        header, *lines = [line.split("\t") for line in text[:-1].split("\n")]
        return [dict(zip(header, line, strict=True)) for line in lines]

    return read
