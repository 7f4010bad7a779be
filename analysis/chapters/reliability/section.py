"""The section on reliability: agreement, repeatability, ends of the scale, careless answers.

docs/method/reliability.md
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from typing import Any

import numpy as np
import pandas as pd

from tactileq.analysis.chapters.chapter import Answered
from tactileq.analysis.chapters.reliability.statistics import (
    AGREEMENT_COLUMNS,
    RATER_COLUMNS,
    SIGN_COLUMNS,
    agreement,
    answers_at_chance,
    fast_answers,
    rater_table,
    same_ratings,
    within_participant_sd,
)
from tactileq.analysis.labels import SCALES, TASK_TITLES
from tactileq.analysis.page.outcomes import Outcome, Weight
from tactileq.analysis.page.page import Item, Table
from tactileq.analysis.page.sections import Section
from tactileq.analysis.statistics.compared_answers import chance_of
from tactileq.analysis.statistics.draws import generators
from tactileq.modeling.errors import counted
from tactileq.modeling.files.answer_tables import ANSWER_TABLES
from tactileq.modeling.files.columns import Column, names

# Exploring two or more surfaces takes longer.
FASTEST_S = 2.0
CARELESS_COLUMNS = (Column("task", is_name=True), *SIGN_COLUMNS)


def sections(answered: Answered) -> list[Section]:
    """A section on all answers about surfaces, those to unfinished tasks included."""
    answers = answered.responses.answers
    # Whether somebody answers at chance is tested on the share of right answers: an effect.
    chances = {
        task: chance_of(task, table)
        for task, table in answered.finished.items()
        if "correct" in ANSWER_TABLES[task].measures
    }
    section = reliability_section(
        {task: answers[task] for task in answered.tasks if ANSWER_TABLES[task].of_surfaces},
        chances={task: chance for task, chance in chances.items() if not np.isnan(chance)},
        simulated=answered.responses.simulated,
        rng=answered.rng,
    )
    return [section] if section is not None else []


def reliability_section(
    answers: Mapping[str, pd.DataFrame],
    *,
    chances: Mapping[str, float],
    simulated: bool,
    rng: np.random.Generator,
) -> Section | None:
    """How reliable the answers are; None where there are none.

    Parameters
    ----------
    answers : mapping of task to DataFrame
        `Responses.answers`.
    chances : mapping of task to float
        Rate of a guessing participant in tasks with right answers, 0 … 1; others are not judged
        by it.
    rng : Generator
        Draws sign flips.
    """
    given = {task: table for task, table in answers.items() if not table.empty}
    if not given:
        return None
    rated = [
        (table, scale, _scale_words(task, scale, given))
        for task, table in given.items()
        for scale in SCALES
        if scale in table and table[scale].notna().any()
    ]
    agreed, raters = _agreement(rated)
    careless = careless_signs(given, chances=chances, rng=rng)
    items: list[Item] = _rating_tables(agreed, raters, simulated=simulated) if rated else []
    items.append(_careless_table(careless, simulated=simulated))
    return Section(
        "reliability",
        "Reliability of the answers",
        tuple(items),
        outcomes=tuple(_outcomes(agreed, raters, careless)),
        reliability=tuple(_in_short(agreed, careless)),
    )


def careless_signs(
    answers: Mapping[str, pd.DataFrame], *, chances: Mapping[str, float], rng: np.random.Generator
) -> pd.DataFrame:
    """Participants whose answers look careless, and why, in every task.

    docs/method/reliability.md#careless-answers

    Returns
    -------
    DataFrame
        `CARELESS_COLUMNS`, a row for each participant and sign; often none.
    """
    found = []
    draws = generators(rng)
    for task, table in answers.items():
        for scale in (scale for scale in SCALES if scale in table):
            same = same_ratings(table, scale)
            detail = same["detail"] + f" of {SCALES[scale]}"
            found.append(same.assign(task=task, detail=detail))
        if "response_time_s" in table:
            found.append(fast_answers(table, limit_s=FASTEST_S).assign(task=task))
        if task in chances:
            guessing = answers_at_chance(table, chance=chances[task], rng=draws[task])
            found.append(guessing.assign(task=task))
    every = pd.concat(found, ignore_index=True) if found else pd.DataFrame()
    return every.reindex(columns=names(CARELESS_COLUMNS))


def _scale_words(task: str, scale: str, given: Mapping[str, pd.DataFrame]) -> str:
    """A scale in words, with the task unless it is the first one with this scale."""
    first = next(other for other, table in given.items() if scale in table)
    return SCALES[scale] + f" in the {TASK_TITLES[task]}" * (task != first)


def _agreement(
    rated: list[tuple[pd.DataFrame, str, str]],
) -> tuple[pd.DataFrame, pd.DataFrame]:
    agreed = [agreement(table, scale).assign(scale=words) for table, scale, words in rated]
    raters = [rater_table(table, scale).assign(scale=words) for table, scale, words in rated]
    return (
        pd.concat(agreed, ignore_index=True) if agreed else pd.DataFrame(),
        pd.concat(raters, ignore_index=True) if raters else pd.DataFrame(),
    )


def _rating_tables(agreed: pd.DataFrame, raters: pd.DataFrame, *, simulated: bool) -> list[Item]:
    correlations = Table(
        "agreement",
        "Agreement of the participants' ratings",
        "Two-way intraclass correlations: the rated objects are textures × models, the raters are "
        "the participants. Agreement: of the ratings themselves; consistency: without each "
        "participant's own mean, which paired comparisons remove as well. For one rating, or the "
        "mean of all participants' ratings. Where all surfaces are rated alike, correlations are "
        "low however well participants agree. Intervals: 95%.",
        agreed,
        AGREEMENT_COLUMNS,
        simulated,
    )
    each = Table(
        "raters",
        "How each participant used the scales",
        "Share at ends: of ratings that are 0 or 100. SD between repeats: of ratings of the same "
        "texture with the same model; n/a without repeats.",
        raters,
        RATER_COLUMNS,
        simulated,
    )
    return [correlations, each]


def _careless_table(careless: pd.DataFrame, *, simulated: bool) -> Table:
    return Table(
        "careless",
        "Answers that look careless" if len(careless) else "No answers look careless",
        f"Listed, never excluded: all ratings of a scale equal; every answer within {FASTEST_S:g} "
        "s; right answers not above chance and below the rate of the others, while the group is "
        "above chance. Participants with at least five answers.",
        careless.replace({"task": TASK_TITLES}),
        CARELESS_COLUMNS,
        simulated,
    )


def _outcomes(agreed: pd.DataFrame, raters: pd.DataFrame, careless: pd.DataFrame) -> list[Outcome]:
    sentences = [_agreement_sentence(own, scale) for scale, own in _by_scale(agreed)]
    sentences += [_repeats_sentence(own, scale) for scale, own in _by_scale(raters)]
    people = sorted(set(careless["participant_id"]))
    if people:
        sentences.append(
            f"Answers of {counted(len(people), 'participant')} look careless "
            f"({', '.join(people)}); they are not left out."
        )
    return [Outcome(Weight.DESCRIPTIVE, sentence) for sentence in sentences if sentence]


def _in_short(agreed: pd.DataFrame, careless: pd.DataFrame) -> list[str]:
    """Agreement on each scale and careless answers, for the first page."""
    found = []
    for scale, own in _by_scale(agreed):
        rows = own.set_index("kind")["icc"]
        if np.isfinite(rows["consistency, mean of all"]):
            found.append(f"{scale} {rows['consistency, mean of all']:.2f}".replace("-", "−"))
    people = careless["participant_id"].nunique()
    said = [
        f"Consistency of the participants' mean ratings (intraclass correlation): "
        f"{', '.join(found)}; low where all surfaces are rated alike."
    ] * bool(found)
    whose = counted(people, "participant") if people else "no participant"
    return [*said, f"Answers of {whose} look careless."]


def _by_scale(table: pd.DataFrame) -> list[tuple[str, pd.DataFrame]]:
    return [(str(s), own) for s, own in table.groupby("scale", sort=False)] if len(table) else []


def _agreement_sentence(own: pd.DataFrame, scale: str) -> str:
    by_kind = {row["kind"]: row for row in own.to_dict("records")}
    one, all_ = by_kind["consistency, one rating"], by_kind["consistency, mean of all"]
    if np.isnan(one["icc"]):
        return ""
    return (
        f"Agreement on {scale}: one participant's ratings have an intraclass correlation "
        f"(consistency) of {_with_interval(one)}, the mean of {one['participants']} participants' "
        f"{_with_interval(all_)}."
    )


def _with_interval(row: Mapping[Hashable, Any]) -> str:
    value, low, high = (f"{row[n]:.2f}".replace("-", "−") for n in ("icc", "ci_low", "ci_high"))
    return f"{value} (95% CI {low} to {high})"


def _repeats_sentence(own: pd.DataFrame, scale: str) -> str:
    spread = within_participant_sd(own)
    if np.isnan(spread):
        return ""
    return (
        f"Ratings of {scale} that a participant repeated have a standard deviation of "
        f"{spread:.1f} points."
    )
