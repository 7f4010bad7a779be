"""People who do as they are told: a respondent that answers by rote, and an experimenter."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from tactileq.experiments.sessions.loop.people import Choice, Intake, ProgressReport, Rating
from tactileq.experiments.sessions.loop.surfaces import Note, Surfaces


class Scripted:
    """Answers by rote; subclasses misbehave."""

    simulated = True

    def __init__(self) -> None:
        self.heard: list[str] = []
        self.asked: list[Intake] = []
        self.done: list[tuple[int, int]] = []
        self.rests = 0
        self.answered = 0

    def hear(self, note: Note, page: Callable[[str], None]) -> None:
        self.note = note

    def consents(self, version: str) -> bool:
        return True

    def welcome(self, intake: Intake) -> dict[str, str | int]:
        self.asked.append(intake)
        return {question.name: "not said" for question in intake.questions}

    def announce(self, page: str, **values: object) -> None:
        self.heard.append(page)

    def wait(self, until: Callable[[], bool]) -> None:
        while not until():
            pass

    def rest(self) -> None:
        self.rests += 1

    def progress(self, done: int, of: int) -> None:
        self.done.append((done, of))

    def rate(self, trial: Any, surfaces: Surfaces) -> Rating:
        surfaces.start()
        surfaces.toggle()
        surfaces.toggle()
        self.answered += 1
        return Rating(magnitude_similarity=70.0, frequency_similarity=30.5, response_time_s=2.5)

    def choose(self, trial: Any, surfaces: Surfaces) -> Choice:
        surfaces.start()
        for button in range(surfaces.count):
            surfaces.present_virtual(button)
        surfaces.choose(1)
        self.answered += 1
        return Choice(button=1, response_time_s=3.25)


def rated(trial: int, **others: Any) -> dict[str, Any]:
    """A row of the absolute task as the trial loop stores it."""
    row = {
        "trial": trial,
        "phase": "main",
        "texture": "canvas",
        "model": "full",
        "tray": "C",
        "virtual_texture": "canvas",
        "first_surface": "real",
        "magnitude_similarity": 70.0,
        "frequency_similarity": 30.5,
        "toggles": 2,
        "response_time_s": 2.5,
        "run": 1,
        "valid": 1,
        "repeats": None,
        "pilot": False,
        "simulated": False,
    }
    return row | others


class Ready:
    """An experimenter who is always ready; notes what was asked."""

    def __init__(self) -> None:
        self.trays: list[str] = []
        self.called: list[str] = []
        self.told: list[ProgressReport] = []
        self.answers = 0

    def ask_mount(self, tray: str) -> None:
        self.trays.append(tray)

    def call(self, told: str) -> None:
        self.called.append(told)

    def go_on(self) -> None:
        pass

    def ready(self) -> bool:
        return True

    def report(self, progress: ProgressReport) -> None:
        self.told.append(progress)

    def page(self, name: str) -> None:
        pass

    def answered(self) -> None:
        self.answers += 1
