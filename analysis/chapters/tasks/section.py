"""The chapter on tasks whose answers no other chapter is about: how much of them was completed.

docs/own-protocol.md
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from tactileq.analysis.answers.responses import Responses
from tactileq.analysis.chapters.chapter import Answered, who_took_part
from tactileq.analysis.labels import TASK_TITLES, sentence_case
from tactileq.analysis.page.page import Table
from tactileq.analysis.page.sections import Section
from tactileq.analysis.statistics.compared_answers import is_oddity
from tactileq.modeling.files.answer_tables import ANSWER_TABLES, AnswerTable
from tactileq.modeling.files.columns import Column, names

ASKED_COLUMNS = (
    Column("what", " ", is_name=True),
    Column("done", format=".0f"),
    Column("planned", format=".0f"),
)


def applies(table: AnswerTable) -> bool:
    """Whether there are neither ratings nor shares of right answers by model, nor d′."""
    return not (table.scales or table.has_rates or is_oddity(table))


def sections(answered: Answered) -> list[Section]:
    """A section for each of these tasks, finished or not."""
    found = []
    for task in answered.tasks:
        if applies(ANSWER_TABLES[task]):
            done, tile = who_took_part(answered.responses, task)
            found.append(
                Section(
                    f"task-{task}",
                    sentence_case(TASK_TITLES[task]),
                    (_asked_table(answered.responses, task),),
                    done=(done,),
                    tiles=(tile,),
                )
            )
    return found


def _asked_table(responses: Responses, task: str) -> Table:
    done, planned = responses.done(task), responses.planned.get(task)
    counts = {
        "participants": (done.participants, planned and planned.participants),
        "sessions": (done.sessions, planned and planned.sessions),
        "trials (without training)": (responses.trials_done(task), planned and planned.trials),
    }
    rows = [(what, there, wanted or np.nan) for what, (there, wanted) in counts.items()]
    return Table(
        f"asked_{task}",
        f"The {TASK_TITLES[task]}: completed and planned",
        "Without participants who dropped out. n/a: not stated in the data.",
        pd.DataFrame(rows, columns=names(ASKED_COLUMNS)),
        ASKED_COLUMNS,
        responses.simulated,
    )
