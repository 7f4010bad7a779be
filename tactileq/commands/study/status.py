"""tactileq study status: who took part, what was answered, what is due next."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING

from tactileq.modeling.errors import counted
from tactileq.options import Data, StudyFile

if TYPE_CHECKING:
    from rich.table import Table

    from tactileq.experiments.sessions.bids.export import Exported
    from tactileq.experiments.sessions.store.status import PersonProgress, StudyProgress


def study_status(data: Data = Path("data"), study: StudyFile = None) -> None:
    """Show each participant's sessions and the next one due; no names of conditions.

    Tables that a killed session left incomplete, or that differ from its log, are written again
    from the log. What was written and what is damaged is reported.

    Example: tactileq study status --data data
    """
    from rich.console import Console

    from tactileq.experiments.sessions.bids.export import export_all
    from tactileq.experiments.sessions.store.status import study_progress
    from tactileq.experiments.study.study import Study

    progress = study_progress(data, None if study is None else Study.load(study))
    made = export_all(data)
    Console().print(table_of(progress))
    for task in progress.tasks:
        print(f"{task.task}: {task.complete} of {task.planned} planned sessions complete")
    if progress.declined:
        print(f"declined: {counted(progress.declined, 'person', 'people')} did not consent")
    print_made(made)
    for damage in progress.damaged:
        print(f"damaged: {damage}")


def print_made(made: Exported) -> None:
    """Name each file that held something else, folders with new ones, and what is damaged."""
    for path in made.changed:
        print(f"corrected from the log: {path}")
    for folder, count in sorted(Counter(path.parent for path in made.new).items()):
        print(f"written from the log: {counted(count, 'new file')} in {folder}")
    for damage in made.damaged:
        print(f"damaged: {damage}")


def table_of(progress: StudyProgress) -> Table:
    """One row for each person; each task of the study has a column."""
    from rich.table import Column, Table
    from rich.text import Text

    # Where a terminal is narrow, a word goes on below: cut off, one could not tell how it ends.
    tasks = (Column(t.task, overflow="fold") for t in progress.tasks)
    table = Table("Subject", "Code", "Slot", *tasks, "Next")
    for person in progress.people:
        cells = [_sessions(person, task.task) for task in progress.tasks]
        due = {"": person.due, "dropped": "dropped out", "withdrawn": "withdrawn, data deleted"}
        texts = (str(person.subject), person.code, str(person.slot), *cells, due[person.left])
        table.add_row(*map(Text, texts))
    return table


def _sessions(person: PersonProgress, task: str) -> str:
    """One line for each session, such as "1: aborted, 5 of 14"."""
    return "\n".join(
        f"{one.session}: damaged"
        if one.status == "damaged"
        else f"{one.session}: {one.status}, {one.answered} of {one.planned}"
        for one in person.sessions
        if one.task == task
    )
