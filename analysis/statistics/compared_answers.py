"""Which answers a claim is about: claims, pairs of models, their values, and chance.

docs/method/statistics.md#verdicts
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from tactileq.analysis.answers.plan import DIFFERENCE, Claim
from tactileq.analysis.answers.responses import Responses
from tactileq.analysis.labels import MEASURES, MODELS, SCALES, TASK_TITLES
from tactileq.analysis.statistics.claims import (
    Values,
    complete_means,
    share_at_ends,
)
from tactileq.analysis.statistics.crossover import day_contrasts
from tactileq.modeling import InputError
from tactileq.modeling.files.answer_tables import ANSWER_TABLES, ENDS, AnswerTable
from tactileq.modeling.participants.choices import ODDITY_CHANCE


def is_oddity(table: AnswerTable) -> bool:
    """Whether a task is to find the odd one of three, by what its table declares."""
    return table.both_models and bool(np.isclose(table.chance, ODDITY_CHANCE))


def all_claims(responses: Responses) -> tuple[Claim, ...]:
    """The claims of the plan about tasks with answers, and exploratory ones beside them."""
    begun = [task for task, answers in responses.answers.items() if not answers.empty]
    planned = [claim for claim in responses.plan.claims if claim.task in begun]
    known = {(claim.task, claim.measure, claim.models) for claim in planned}
    others = [
        Claim(
            name=_exploratory_name(task, measure, pair, begun=begun),
            task=task,
            measure=measure,
            models=pair,
            bounds=None,
            test=DIFFERENCE,
            planned=False,
        )
        for task in begun
        for measure in ANSWER_TABLES[task].measures
        for pair in pairs_of(responses, task)
        if (task, measure, pair) not in known
    ]
    return (*planned, *others)


def _exploratory_name(
    task: str, measure: str, pair: tuple[str, str], *, begun: Sequence[str]
) -> str:
    """The measure, with the model unless it is the usual one, and the task unless it is the first.

    The first of those that have the measure, so that adding a task renames no claim.
    """
    first = next(other for other in begun if measure in ANSWER_TABLES[other].measures)
    words = [MEASURES[measure], *pair[1:] * (pair != MODELS)]
    return " ".join([*words, *[f"of the {TASK_TITLES[task]}"] * (task != first)])


def pairs_of(responses: Responses, task: str) -> list[tuple[str, str]]:
    """The reference with each other set of models that a task compares."""
    reference, *others = models_of(responses, task)
    return [(reference, other) for other in others]


def models_of(responses: Responses, task: str) -> tuple[str, ...]:
    """The sets of models that a task compares, the reference first."""
    planned = responses.planned.get(task)
    asked = set(responses.answers[task]["model"].dropna())
    if planned:
        return planned.models
    return MODELS if asked <= set(MODELS) else tuple(sorted(asked))


def claim_values(responses: Responses, claim: Claim) -> Values:
    """The values of every participant for each texture with each model; complete cells only.

    In a task whose trials hold both models the reference is chance.
    """
    answers = answers_about(responses, claim)
    repeats = repeats_of(responses, claim.task)
    if ANSWER_TABLES[claim.task].both_models:
        both = answers.assign(model=claim.models[1])
        table = complete_means(both, claim.measure, models=claim.models, repeats=repeats)
        return Values(table=table.assign(reference=chance_of(claim.task, answers)))
    return Values(
        table=complete_means(answers, claim.measure, models=claim.models, repeats=repeats),
        share_at_ends=claim_shares(responses, claim),
        contrasts=day_contrasts(responses.answers[claim.task], claim.models),
    )


def claim_shares(responses: Responses, claim: Claim) -> dict[str, float]:
    """`Values.share_at_ends` of a claim: empty of a measure without ends."""
    if claim.measure not in SCALES:
        return {}
    answers, same = answers_about(responses, claim), responses.identical(claim.models)
    return share_at_ends(answers, claim.measure, identical=same, ends=ENDS)


def answers_about(responses: Responses, claim: Claim) -> pd.DataFrame:
    """The main trials in which one of the claim's models was presented; both, where trials do."""
    answers = responses.answers[claim.task]
    if ANSWER_TABLES[claim.task].both_models:
        return holding_both(claim.task, answers, claim.models)
    return answers[answers["model"].isin(claim.models)]


def holding_both(task: str, answers: pd.DataFrame, models: tuple[str, str]) -> pd.DataFrame:
    """Of a task whose trials hold both models: those of this pair, where its table lists them."""
    listed = ANSWER_TABLES[task].models_in
    if not listed:
        return answers
    return answers[[set(str(held).split("|")) == set(models) for held in answers[listed]]]


def repeats_of(responses: Responses, task: str) -> int:
    """Answers that make a cell of a texture and a model complete: as planned, else the usual."""
    if task in responses.planned:
        return responses.planned[task].repeats
    answers = responses.answers[task]
    cells = ["participant_id", "texture"] + ["model"] * (not ANSWER_TABLES[task].both_models)
    return int(answers.groupby(cells).size().mode().max())


def chance_of(task: str, answers: pd.DataFrame) -> float:
    """Proportion correct of a participant who guesses, as the task's table declares it.

    Parameters
    ----------
    answers : DataFrame
        Of the task.

    Returns
    -------
    float
        Between 0 and 1; NaN where it is not declared, or no alternatives are listed.

    Raises
    ------
    InputError
        Where trials differ in the number of alternatives, so that no one chance holds.
    """
    table = ANSWER_TABLES[task]
    if not table.alternatives:
        return table.chance
    numbers = {len(listed.split("|")) for listed in answers[table.alternatives].dropna()}
    if len(numbers) > 1:
        raise InputError(
            f"expected as many alternatives in every trial of the {table.title}, got "
            f"{' and '.join(map(str, sorted(numbers)))}; declare its chance instead."
        )
    return 1 / numbers.pop() if numbers else float("nan")
