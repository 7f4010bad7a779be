"""From answers to verdicts: the values of each claim, and doubts about its verdict.

docs/method/statistics.md#verdicts
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import pandas as pd
from scipy import stats

from tactileq.analysis.answers.plan import MODEL_RULE, AnalysisPlan, Claim
from tactileq.analysis.answers.responses import Responses
from tactileq.analysis.labels import ALL_TEXTURES, SCALES
from tactileq.analysis.page.sections import Mapped
from tactileq.analysis.statistics.caveats import NOT_TESTED, SHOWN, Caveats
from tactileq.analysis.statistics.claims import claim_tests, with_people
from tactileq.analysis.statistics.compared_answers import (
    all_claims,
    answers_about,
    chance_of,
    claim_values,
    decision_model,
)
from tactileq.analysis.statistics.draws import generators
from tactileq.analysis.statistics.equivalence import ALPHA
from tactileq.analysis.statistics.paired import (
    sign_flips_p,
    why_undefined,
    without_rounding_noise,
)
from tactileq.analysis.statistics.participants.design import (
    PeopleData,
    choice_studies,
    rating_studies,
    textures_of,
)
from tactileq.analysis.statistics.participants.verdict import FEWEST, PeopleFound, people_found
from tactileq.modeling.arrays import Floats
from tactileq.modeling.files.answer_tables import ANSWER_TABLES
from tactileq.modeling.seeds import number_of

Row = Mapping[Hashable, Any]


@dataclass(frozen=True, eq=False, kw_only=True)
class ClaimFound:
    """One claim with its tests and their data.

    Parameters
    ----------
    tests : DataFrame
        `tactileq.analysis.statistics.claims.claim_tests`; without rows where nobody answered.
    values : DataFrame
        texture, participant_id, reference, other.
    people : PeopleFound, optional
        Where the model of the participants decides.
    few : float
        Share of people outside the bounds below which they do not count, of the plan.
    """

    claim: Claim
    tests: pd.DataFrame
    values: pd.DataFrame
    caveats: Caveats
    people: PeopleFound | None = None
    few: float = AnalysisPlan.few


def overall_row(found: ClaimFound) -> Row | None:
    """The row over all textures; None where all models are identical."""
    rows = found.tests[found.tests["texture"] == ALL_TEXTURES].to_dict("records")
    return rows[0] if rows else None


def claims_found(responses: Responses, *, rng: np.random.Generator) -> list[ClaimFound]:
    """Every claim of the plan, then an exploratory one of each measure that no claim is about.

    Parameters
    ----------
    rng : Generator
        Draws sign flips, and seeds the draws from the posterior.

    Returns
    -------
    list of ClaimFound
        Without those about tasks that nobody has begun.
    """
    return ClaimsBegun.of(responses, rng=rng).found()


@dataclass(frozen=True, eq=False)
class ClaimsBegun:
    """Claims whose samplers other processes may run, while this one does something else.

    Parameters
    ----------
    sampled : iterator of PeopleFound
        Of the claims that the model decides, in order.
    """

    responses: Responses
    claims: Sequence[Claim]
    by_model: Sequence[bool]
    sampled: Iterator[PeopleFound]
    own: Mapping[str, np.random.Generator]

    @classmethod
    def of(
        cls, responses: Responses, *, rng: np.random.Generator, mapped: Mapped = map
    ) -> ClaimsBegun:
        """Of `claims_found`; `mapped` runs the samplers, and changes no result."""
        own = generators(rng)
        claims = all_claims(responses)
        samplers = [_sampler_of(responses, claim, rng=rng) for claim in claims]
        sampled = mapped(_called, [sampler for sampler in samplers if sampler is not None])
        by_model = [sampler is not None for sampler in samplers]
        return cls(responses, claims, by_model, iter(sampled), own)

    def found(self) -> list[ClaimFound]:
        """The claims with their tests and, where the model decides, what it says of people."""
        return [
            self._found(claim, by_model)
            for claim, by_model in zip(self.claims, self.by_model, strict=True)
        ]

    def _found(self, claim: Claim, by_model: bool) -> ClaimFound:
        responses, rng, few = self.responses, self.own[claim.task], self.responses.plan.few
        values = claim_values(responses, claim)
        caveats = claim_caveats(responses, claim, rng=rng)
        tests = claim_tests(claim, values, caveats=caveats, rng=rng)
        people = next(self.sampled) if by_model else None
        if people is not None:
            tests = with_people(tests, people, claim, caveats=caveats, few=few)
        return ClaimFound(
            claim=claim,
            tests=tests,
            values=values.table,
            caveats=caveats,
            people=people,
            few=few,
        )


def _sampler_of(
    responses: Responses, claim: Claim, *, rng: np.random.Generator
) -> Callable[[], PeopleFound] | None:
    """What draws from the posterior of a claim; None where the model does not decide it."""
    if claim.task in responses.unfinished:
        return None
    data = people_data(responses, claim)
    if data is None or claim.bounds is None:
        return None
    own = np.random.default_rng([int(rng.integers(2**32)), number_of(claim.name)])
    return partial(
        people_found,
        data.studies,
        claim.bounds,
        model=data.model,
        people=data.people,
        textures=data.textures,
        rng=own,
    )


def _called(sampler: Callable[[], PeopleFound]) -> PeopleFound:
    """What it draws; by name, so that another process can be sent it."""
    return sampler()


def people_data(responses: Responses, claim: Claim) -> PeopleData | None:
    """Every answer about a claim, complete or not; None where the plan's rule is not the model's.

    Nor is there any of a task whose decision model is unknown, of claims without bounds, of fewer
    than eight people, or where all models are identical.
    """
    if responses.plan.rule != MODEL_RULE or not claim.planned or claim.bounds is None:
        return None
    same = list(responses.identical(claim.models))
    answers = answers_about(responses, claim)
    answers = answers[~answers["texture"].isin(same) & answers[claim.measure].notna()]
    people = sorted(answers["participant_id"].unique())
    checks = responses.anchors.get(claim.task, answers[:0])
    checks = checks[checks["participant_id"].isin(people)]
    if len(people) < FEWEST:
        return None
    textures = textures_of(answers)
    if claim.measure in SCALES:
        ratings = rating_studies(answers, checks, claim.measure, models=claim.models, people=people)
        return PeopleData(studies=ratings, model=None, people=people, textures=textures)
    model = decision_model(claim.task, answers)
    if model is None:
        return None
    compared = claim.models[1:] if model.both_models else claim.models
    choices = choice_studies(answers, checks, models=compared, people=people)
    return PeopleData(studies=choices, model=model, people=people, textures=textures)


def claim_caveats(responses: Responses, claim: Claim, *, rng: np.random.Generator) -> Caveats:
    """Doubts about a verdict on a claim.

    docs/method/statistics.md#withheld
    """
    return Caveats(
        identical=responses.identical(claim.models),
        highest_share_at_ends=responses.plan.highest_share_at_ends,
        sensitivity=_sensitivity(responses, claim, rng=rng),
        unfinished=claim.task in responses.unfinished,
    )


def _sensitivity(responses: Responses, claim: Claim, *, rng: np.random.Generator) -> str:
    """Whether participants told different surfaces apart, as `Caveats.sensitivity` states it.

    Ratings show it by anchors, right answers to trials of one model by the reference's share above
    chance, those to trials of both models by catch trials.
    """
    task, table = claim.task, ANSWER_TABLES[claim.task]
    apart = responses.anchors.get(task, pd.DataFrame())
    if claim.measure in table.scales and len(apart):
        own = answers_about(responses, claim)
        own = own[own["texture"].isin(apart["texture"])]
        means = [each.groupby("participant_id")[claim.measure].mean() for each in (own, apart)]
        above = means[0] - means[1]
        failed = "anchors were not rated lower than the textures' own models"
    elif claim.measure == "correct" and table.has_rates and table.has_chance:
        values = claim_values(responses, claim).table.groupby("participant_id")["reference"].mean()
        above = values - chance_of(task, responses.answers[task])
        failed = f"answers on {claim.models[0]} models were not above chance"
    elif table.both_models and len(apart):
        above = apart.groupby("participant_id")["correct"].mean() - chance_of(task, apart)
        failed = "catch trials were not answered above chance"
    else:
        return NOT_TESTED
    return SHOWN if _one_sided_p(above.dropna(), rng=rng) < ALPHA else failed


def _one_sided_p(values: pd.Series, *, rng: np.random.Generator) -> float:
    """One-sided p of a mean above 0; 1 where there is no value."""
    numbers: Floats = without_rounding_noise(values.to_numpy(dtype=float))
    if not numbers.size:
        return 1.0
    if why_undefined(numbers):
        return sign_flips_p(numbers, rng=rng, alternative="greater")
    return float(stats.ttest_1samp(numbers, 0.0, alternative="greater").pvalue)
