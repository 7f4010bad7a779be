"""Write what this version of the program leaves of a tiny study, for the tests of later versions.

    python tools/earlier_version.py NAME    # tests/data/earlier_versions/NAME

Complete sessions of one person, the session of another one that was killed after two answers, and
all texts that describe tables (tests/data/earlier_versions/README.txt).
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from tactileq.experiments.observers.experimenter import SimulatedExperimenter
from tactileq.experiments.sessions.bids import events, people, physio
from tactileq.experiments.sessions.bids.export import export_session
from tactileq.experiments.sessions.loop.people import Choice, Intake, Rating
from tactileq.experiments.sessions.loop.running import Circumstances, run_session
from tactileq.experiments.sessions.loop.surfaces import Note, Surfaces
from tactileq.experiments.sessions.loop.trial_loop import People
from tactileq.experiments.study.models import load_model_sets
from tactileq.experiments.study.study import Study
from tactileq.experiments.tasks import task_named
from tactileq.modeling.files import answer_tables
from tactileq.modeling.files.columns import sidecar
from tactileq.modeling.files.places import LOCK_NAME
from tactileq.rig.desk.twin import SimulatedRig
from tactileq.rig.shared.interface import HandRows

FOLDER = Path(__file__).parents[1] / "tests/data/earlier_versions"
KILLED = 9


class Still(SimulatedRig):
    """A rig that measures no hand."""

    def take_history(self) -> HandRows:
        super().take_history()
        return HandRows.joined([])


class Person:
    """Answers by rote; the process ends before an answer, if one is named."""

    simulated = False

    def __init__(self, subject: int, killed_before: int | None) -> None:
        self._subject, self._killed_before = subject, killed_before
        self._answered = 0

    def hear(self, note: Note, page: Callable[[str], None]) -> None:
        pass

    def welcome(self, intake: Intake) -> dict[str, str | int]:
        return {question.name: 29 + self._subject for question in intake.questions}

    def announce(self, page: str, **values: object) -> None:
        pass

    def wait(self, until: Callable[[], bool]) -> None:
        while not until():
            pass

    def rest(self) -> None:
        pass

    def progress(self, done: int, of: int) -> None:
        pass

    def rate(self, trial: Any, surfaces: Surfaces) -> Rating:
        surfaces.start()
        surfaces.follow_rig_button()
        surfaces.toggle()
        surfaces.follow_rig_button()
        value = 10.0 * self._answered + self._subject + 0.25
        given = {"magnitude": value, "frequency": 100 - value}
        for scale, value in given.items():
            surfaces.note("slider", scale=scale, value=round(value, 1))
        self._count()
        ratings = {f"{scale}_similarity": value for scale, value in given.items()}
        return Rating(**ratings, response_time_s=0.125)

    def choose(self, trial: Any, surfaces: Surfaces) -> Choice:
        surfaces.start()
        for button in range(surfaces.count):
            surfaces.present_virtual(button)
        button = surfaces.count - 1
        surfaces.choose(button)
        self._count()
        return Choice(button=button, response_time_s=0.25)

    def _count(self) -> None:
        if self._answered == self._killed_before:
            os._exit(KILLED)
        self._answered += 1


def run(data: Path, task: str, subject: int, *, killed_before: int | None = None) -> None:
    """One session at the simulated rig, and its tables."""
    study = Study.load(Path("study.toml"))
    _, manifest = run_session(
        task_named(task),
        study,
        subject=subject,
        session=1,
        models=load_model_sets(study, Path()),
        rig=SimulatedRig() if task == "absolute" else Still(),
        people=People(
            respondent=Person(subject, killed_before), experimenter=SimulatedExperimenter()
        ),
        data_folder=data,
        circumstances=Circumstances(sources=study.models),
    )
    export_session(data, manifest)


def texts() -> dict[str, Any]:
    """Every text that describes a table."""
    participants = (answer_tables.PARTICIPANT_ID, *answer_tables.PARTICIPANT_COLUMNS)
    return {
        "events": sidecar(events.EVENT_COLUMNS),
        "event types": events.EVENT_MEANINGS,
        "physio": sidecar(physio.PHYSIO_COLUMNS),
        "physio, commanded force": sidecar(physio.COMMANDED_COLUMNS),
        "sessions": sidecar(people.SESSION_COLUMNS),
        "participants": sidecar(participants),
        **{
            f"answers, {task}": sidecar(table.columns)
            for task, table in answer_tables.ANSWER_TABLES.items()
        },
        "README": people.readme({"Name": "NAME", "Simulated": True}).decode().split("\n\n"),
    }


def main(name: str) -> None:
    """Write the folder of this name."""
    os.chdir(FOLDER)
    data = Path(name, "data")
    for task in ("absolute", "oddity", "threshold"):
        run(data, task, 1)
    child = os.fork()
    if child == 0:
        run(data, "absolute", 2, killed_before=2)
    _, status = os.waitpid(child, 0)
    if os.waitstatus_to_exitcode(status) != KILLED:
        raise SystemExit("expected a session that is killed before its third answer, got its end.")
    for lock in data.rglob(f".*{LOCK_NAME}"):
        lock.unlink()
    Path(name, "texts.json").write_text(json.dumps(texts(), indent=1, ensure_ascii=False) + "\n")


if __name__ == "__main__":
    main(*sys.argv[1:])
