"""From answers to verdicts: what each claim is about, and what stands against its verdict.

docs/method/statistics.md#verdicts
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy import stats

from analysis.answers.loading import Responses
from analysis.answers.plan import DIFFERENCE, Claim
from analysis.labels import MEASURES, MODELS, SCALES
from analysis.statistics.claims import Standing, Values, claim_tests, complete_means, share_at_ends
from analysis.statistics.equivalence import ALPHA
from analysis.statistics.paired import sign_flips_p, why_undefined, without_rounding_noise
from modeling.arrays import Floats

ENDS = (0.0, 100.0)  # of the rating scales
ODDITY_CHANCE = 1 / 3


@dataclass(frozen=True, eq=False, kw_only=True)
class ClaimFound:
    """One claim with its tests and what they rest on.

    Parameters
    ----------
    claim : Claim
    tests : DataFrame
        `analysis.statistics.claims.claim_tests`; without rows where nobody answered.
    values : DataFrame
        texture, participant_id, reference, other.
    standing : Standing
    """

    claim: Claim
    tests: pd.DataFrame
    values: pd.DataFrame
    standing: Standing


def claims_found(responses: Responses, *, rng: np.random.Generator) -> list[ClaimFound]:
    """Every claim of the plan, then an exploratory one of each measure that no claim is about.

    Parameters
    ----------
    responses : Responses
    rng : Generator
        Draws sign flips.

    Returns
    -------
    list of ClaimFound
        Without those about tasks that nobody has begun.
    """
    found = []
    for claim in all_claims(responses):
        values = claim_values(responses, claim)
        standing = claim_standing(responses, claim, rng=rng)
        tests = claim_tests(claim, values, standing=standing, rng=rng)
        found.append(ClaimFound(claim=claim, tests=tests, values=values.table, standing=standing))
    return found


def all_claims(responses: Responses) -> tuple[Claim, ...]:
    """The claims of the plan about tasks with answers, and exploratory ones beside them."""
    begun = [task for task, answers in responses.answers.items() if not answers.empty]
    planned = [claim for claim in responses.plan.claims if claim.task in begun]
    known = {(claim.task, claim.measure, claim.models) for claim in planned}
    others = [
        Claim(
            name=" ".join([MEASURES[measure], *pair[1:] * (pair != MODELS)]),
            task=task,
            measure=measure,
            models=pair,
            bounds=None,
            test=DIFFERENCE,
            planned=False,
        )
        for task in begun
        for measure in measures_of(task)
        for pair in pairs_of(responses, task)
        if (task, measure, pair) not in known
    ]
    return (*planned, *others)


def measures_of(task: str) -> tuple[str, ...]:
    """Columns that claims about a task can be about; none of one that compares no models."""
    if task == "absolute":
        return tuple(SCALES)
    return () if task == "threshold" else ("correct",)


def pairs_of(responses: Responses, task: str) -> list[tuple[str, str]]:
    """The reference with each other set of models that a task compares."""
    planned = responses.planned.get(task)
    asked = set(responses.answers[task]["model"].dropna())
    sets = planned.models if planned else MODELS if asked <= set(MODELS) else tuple(sorted(asked))
    return [(sets[0], other) for other in sets[1:]]


def claim_values(responses: Responses, claim: Claim) -> Values:
    """What every participant gave for each texture, with either model; complete cells only.

    In the oddity task, whose trials hold both models, the reference is chance.
    """
    answers = answers_about(responses, claim)
    repeats = repeats_of(responses, claim.task)
    if claim.task == "oddity":
        both = answers.assign(model=claim.models[1])
        table = complete_means(both, claim.measure, models=claim.models, repeats=repeats)
        return Values(table=table.assign(reference=ODDITY_CHANCE))
    table = complete_means(answers, claim.measure, models=claim.models, repeats=repeats)
    if claim.task != "absolute":
        return Values(table=table)
    same = responses.identical(claim.models)
    return Values(
        table=table,
        share_at_ends=share_at_ends(answers, claim.measure, identical=same, ends=ENDS),
    )


def answers_about(responses: Responses, claim: Claim) -> pd.DataFrame:
    """The main trials in which one of the claim's models was presented; in the oddity task both."""
    answers = responses.answers[claim.task]
    if claim.task == "oddity":
        return answers[[set(held.split("|")) == set(claim.models) for held in answers["layout"]]]
    return answers[answers["model"].isin(claim.models)]


def repeats_of(responses: Responses, task: str) -> int:
    """Answers that make a cell of a texture and a model complete: as planned, else the usual."""
    if task in responses.planned:
        return responses.planned[task].repeats
    answers = responses.answers[task]
    cells = ["participant_id", "texture"] + ["model"] * (task != "oddity")
    return int(answers.groupby(cells).size().mode().max())


def claim_standing(responses: Responses, claim: Claim, *, rng: np.random.Generator) -> Standing:
    """What stands against a verdict on a claim.

    docs/method/statistics.md#withheld
    """
    return Standing(
        identical=responses.identical(claim.models),
        highest_share_at_ends=responses.plan.highest_share_at_ends,
        insensitive=_insensitive(responses, claim, rng=rng),
        unfinished=claim.task in responses.unfinished,
    )


def _insensitive(responses: Responses, claim: Claim, *, rng: np.random.Generator) -> str:
    """Why people may not have felt a difference had there been one; empty where they would have."""
    if claim.task == "absolute" and claim.task in responses.anchors:
        anchors = responses.anchors[claim.task]
        own = answers_about(responses, claim)
        own = own[own["texture"].isin(anchors["texture"])]
        means = [table.groupby("participant_id")[claim.measure].mean() for table in (own, anchors)]
        if len(anchors) and _one_sided_p((means[0] - means[1]).dropna(), rng=rng) >= ALPHA:
            return "anchors were not rated lower than the textures' own models"
    if claim.task == "relative":
        values = claim_values(responses, claim).table.groupby("participant_id")["reference"].mean()
        chance = chance_of(responses.relative)
        if _one_sided_p((values - chance).dropna(), rng=rng) >= ALPHA:
            return f"answers on {claim.models[0]} models were not above chance"
    return ""


def chance_of(relative: pd.DataFrame) -> float:
    """Share of right answers of who guesses: one of all that lay on the buttons."""
    return 1 / max(len(layout.split("|")) for layout in relative["layout"].dropna())


def _one_sided_p(values: pd.Series, *, rng: np.random.Generator) -> float:
    """p of the claim that a mean is above 0; 1 where nobody has a value."""
    numbers: Floats = without_rounding_noise(values.to_numpy(dtype=float))
    if not numbers.size:
        return 1.0
    if why_undefined(numbers):
        return sign_flips_p(numbers, rng=rng, alternative="greater")
    return float(stats.ttest_1samp(numbers, 0.0, alternative="greater").pvalue)


def incomplete(found: ClaimFound) -> Iterator[tuple[str, str]]:
    """Participant and texture of each pair that lacks an answer, identical ones left out."""
    values = found.values
    lacking = values[["reference", "other"]].isna().any(axis=1)
    lacking &= ~values["texture"].isin(list(found.standing.identical))
    for row in values[lacking].to_dict("records"):
        yield str(row["participant_id"]), str(row["texture"])
