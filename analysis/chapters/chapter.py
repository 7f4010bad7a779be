"""What a chapter of the report is given, and what it gives: sections.

A chapter is a folder: its statistic, its figure, and `section.py` with the function
`sections`. It applies to tasks by what their tables of answers declare, never by their names.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd

from tactileq.analysis.answers.responses import Responses
from tactileq.analysis.labels import MODELS, TASK_TITLES, sentence_case
from tactileq.analysis.page.sections import Section
from tactileq.analysis.statistics.verdicts import ClaimFound
from tactileq.analysis.textures.results import TextureResult
from tactileq.modeling.errors import counted
from tactileq.modeling.files.answer_tables import ANSWER_TABLES, AnswerTable
from tactileq.modeling.files.writing import file_stem
from tactileq.modeling.seeds import generator, number_of

NOBODY_ASKED = "No participant was tested: this report contains models and no answers."
LEAD = "Surfaces recorded, modelled, simplified by detection thresholds, and judged."
Applies = Callable[[AnswerTable], bool]


@dataclass(frozen=True, eq=False, kw_only=True)
class Answered:
    """The answers of a study, with the claims about them.

    Parameters
    ----------
    found : sequence of ClaimFound
        Every claim about a task that was begun.
    rng : Generator
        Drawn from by one chapter after the other, in the order of `report.CHAPTERS`.
    seed : int
        Of the report.
    hand : DataFrame, optional
        How the hand moved with either model (`tactileq.analysis.answers.hand.load_hand`).
    planted : mapping of texture to mapping of measure to points, optional
        Differences that simulated participants were given (`verdicts.planted_verdicts`).
    """

    responses: Responses
    found: Sequence[ClaimFound]
    rng: np.random.Generator
    seed: int
    hand: pd.DataFrame | None = None
    planted: Mapping[str, Mapping[str, float]] | None = None

    @cached_property
    def tasks(self) -> tuple[str, ...]:
        """Tasks with answers."""
        return tuple(task for task, answers in self.responses.answers.items() if len(answers))

    @cached_property
    def finished(self) -> dict[str, pd.DataFrame]:
        """Answers to the tasks that may be analysed: those that lack no planned participant."""
        return {
            task: self.responses.answers[task]
            for task in self.tasks
            if task not in self.responses.unfinished
        }

    @cached_property
    def tested(self) -> tuple[ClaimFound, ...]:
        """The claims with tests, those about unfinished tasks included, which show no effect."""
        return tuple(one for one in self.found if len(one.tests))

    @cached_property
    def judged(self) -> tuple[ClaimFound, ...]:
        """The claims with a verdict."""
        return tuple(one for one in self.tested if not one.caveats.unfinished)

    def judged_in(self, task: str) -> tuple[ClaimFound, ...]:
        """The claims about a task that have a verdict."""
        return tuple(one for one in self.judged if one.claim.task == task)

    @cached_property
    def pairs(self) -> tuple[tuple[str, str], ...]:
        """The pairs of models with a verdict, each with the reference first."""
        judged = (one for task in self.finished for one in self.judged_in(task))
        return tuple(dict.fromkeys(one.claim.models for one in judged))

    def different(self, pair: tuple[str, str], applies: Applies) -> dict[str, pd.DataFrame]:
        """Answers of finished tasks about textures whose two models differ."""
        same = list(self.responses.identical(pair))
        return {
            task: answers[~answers["texture"].isin(same)]
            for task, answers in self.finished.items()
            if applies(ANSWER_TABLES[task])
        }

    def streams(self, chapter: str, applies: Applies) -> Iterator[Stream]:
        """Finished tasks that a chapter applies to, with what tells their results apart.

        Parameters
        ----------
        chapter : str
            Its name.
        applies : callable
            Of the table of answers: whether the chapter is about the task.
        """
        first = first_task(applies)
        for task in self.finished:
            if task == first:
                yield Stream(task, "", self.rng)
            elif applies(ANSWER_TABLES[task]):
                place = list(ANSWER_TABLES).index(task)
                yield Stream(task, f"_{task}", generator(self.seed, number_of(chapter), place))


@dataclass(frozen=True, eq=False)
class Stream:
    """A task in a chapter.

    Parameters
    ----------
    ending : str
        Of the names of its files: empty of the first task that is declared with what the chapter
        is about, so that a name stands for the same in every study.
    rng : Generator
        Of this task alone unless it is the first, so that a further task changes no number of
        another.
    """

    task: str
    ending: str
    rng: np.random.Generator


def first_task(applies: Applies) -> str:
    """The first declared task that a chapter applies to; empty where there is none."""
    return next((task for task, table in ANSWER_TABLES.items() if applies(table)), "")


@dataclass(frozen=True, eq=False, kw_only=True)
class Modelled:
    """The models of a study, compared with their recordings.

    Parameters
    ----------
    textures : sequence of TextureResult
        At least one.
    gfc : DataFrame
        `tactileq.analysis.textures.likeness.gfc_table` of all of them.
    driving : DataFrame
        `tactileq.analysis.textures.regressions.driving_table` of all of them.
    """

    textures: Sequence[TextureResult]
    gfc: pd.DataFrame
    driving: pd.DataFrame

    @property
    def simulated(self) -> bool:
        """Whether any of the recordings is."""
        return any(result.simulated for result in self.textures)


AnswerChapter = Callable[[Answered], Sequence[Section]]
ModelChapter = Callable[[Modelled], Sequence[Section]]
StudyChapter = Callable[[Answered | None, Modelled | None], Sequence[Section]]


def who_took_part(responses: Responses, task: str) -> tuple[str, tuple[str, str]]:
    """The sentence and the tile with the number of participants, out of those planned."""
    where = TASK_TITLES[task]
    done, planned = responses.done(task), responses.planned.get(task)
    people = str(done.participants)
    kind = "simulated participant" if responses.simulated_participants else "participant"
    rig = " with the simulated rig" if responses.simulated_rig else ""
    trials = f"{counted(len(responses.answers[task]), 'trial')} (without training)"
    last, sessions = done.participants, ""
    if planned is not None:
        last, kind = planned.participants, f"planned {kind}"
        people += f" of {last}"
        sessions = f", {done.sessions} of {counted(planned.sessions, 'planned session')}"
    who = f"{kind}{'s' * (last != 1)}{rig}"
    sentence = f"{sentence_case(where)}: {people} {who}{sessions}, {trials}."
    return sentence, (people, f"{who}, {where}")


def named_by(name: str, pair: tuple[str, str]) -> str:
    """The name of a pair's file: the bare one of the usual pair."""
    return name if pair == MODELS else f"{name}_{file_stem('_'.join(pair))}"
