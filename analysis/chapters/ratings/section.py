"""The chapter on ratings of similarity on a scale (PAPER VIII-A)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tactileq.analysis.chapters.chapter import Answered, Stream, named_by, who_took_part
from tactileq.analysis.chapters.ratings.figure import figure_ratings
from tactileq.analysis.labels import MEASURES, TASK_TITLES, sentence_case
from tactileq.analysis.page.page import Picture
from tactileq.analysis.page.sections import Section, of_task
from tactileq.analysis.statistics.verdicts import ClaimFound, overall_row
from tactileq.modeling.files.answer_tables import ANSWER_TABLES, AnswerTable


def applies(table: AnswerTable) -> bool:
    """Whether people rate on a scale."""
    return bool(table.scales)


def sections(answered: Answered) -> list[Section]:
    """A section for each task with ratings and a verdict on them."""
    found = [_section(answered, stream) for stream in answered.streams("ratings", applies)]
    return [section for section in found if section.items]


def _means_in_words(found: Sequence[ClaimFound]) -> str:
    """Mean ratings with either model over the textures that differ, claim by claim."""
    said = []
    for one in found:
        row = overall_row(one)
        if row is not None and np.isfinite(row["mean_other"]):
            reference, other = one.claim.models
            said.append(
                f"{MEASURES[one.claim.measure]} {row['mean_reference']:.0f} ({reference}) and "
                f"{row['mean_other']:.0f} ({other})"
            )
    textures = "Means over participants and the textures whose models differ, of 100 points"
    return f"{textures}: {'; '.join(said)}." if said else ""


def _section(answered: Answered, stream: Stream) -> Section:
    task, simulated = stream.task, answered.responses.simulated
    scales = ANSWER_TABLES[task].scales
    found = [one for one in answered.judged_in(task) if one.claim.measure in scales]
    done, tile = who_took_part(answered.responses, task)
    pairs = dict.fromkeys(one.claim.models for one in found)
    pictures = [
        Picture(
            named_by("ratings", pair),
            f"Rated similarity of virtual and real surface, {pair[0]} and {pair[1]} models",
            "Bars: means over participants with 95% confidence intervals; points: participants. "
            "Compare figure 9 of the paper, whose bars are standard errors.",
            figure_ratings([one for one in found if one.claim.models == pair], simulated=simulated),
            simulated,
        )
        for pair in pairs
    ]
    section = Section(
        "ratings",
        f"{sentence_case(TASK_TITLES[task])}: ratings",
        tuple(pictures),
        answer=_means_in_words(found),
        done=(done,),
        tiles=(tile,),
    )
    return of_task(section, stream.ending)
