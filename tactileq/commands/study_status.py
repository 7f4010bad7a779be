"""tactileq study status: who was here, what was answered, what comes next."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from tactileq.options import Data, StudyFile

if TYPE_CHECKING:
    from rich.table import Table

    from experiments.sessions.status import PersonProgress, StudyProgress


def study_status(data: Data = Path("data"), study: StudyFile = None) -> None:
    """Show each participant's sessions and the next one due; no names of conditions.

    What BIDS shows of sessions that were killed is written on the way.

    Example: tactileq study status --data data
    """
    from rich.console import Console

    from experiments.sessions.bids import export_all
    from experiments.sessions.status import study_progress
    from experiments.study.study import Study

    progress = study_progress(data, None if study is None else Study.load(study))
    written = export_all(data)
    Console().print(table_of(progress))
    for task in progress.tasks:
        print(f"{task.task}: {task.complete} of {task.planned} planned sessions complete")
    for name in written:
        print(f"written from the log: {name}")


def table_of(progress: StudyProgress) -> Table:
    """One row for each person; each task of the study has a column."""
    from rich.table import Table
    from rich.text import Text

    table = Table("Subject", "Code", "Slot", *(t.task for t in progress.tasks), "Next")
    for person in progress.people:
        cells = [_sessions(person, task.task) for task in progress.tasks]
        due = {"": person.due, "dropped": "dropped out", "withdrawn": "withdrawn, data deleted"}
        texts = (str(person.subject), person.code, str(person.slot), *cells, due[person.left])
        table.add_row(*map(Text, texts))
    return table


def _sessions(person: PersonProgress, task: str) -> str:
    """One line for each session, such as "1: aborted, 5 of 14"."""
    return "\n".join(
        f"{one.session}: {one.status}, {one.answered} of {one.planned}"
        for one in person.sessions
        if one.task == task
    )
