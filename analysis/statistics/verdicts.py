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

from tactileq.analysis.answers.plan import MODEL_RULE, TESTS_RULE, Claim
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
    repeats_of,
)
from tactileq.analysis.statistics.crossover import balanced, day_contrasts
from tactileq.analysis.statistics.draws import generators
from tactileq.analysis.statistics.equivalence import ALPHA
from tactileq.analysis.statistics.paired import (
    sign_flips_p,
    why_undefined,
    without_rounding_noise,
)
from tactileq.analysis.statistics.participants.design import (
    PeopleData,
    rating_studies,
    textures_of,
)
from tactileq.analysis.statistics.participants.verdict import (
    FEWEST,
    PeopleFound,
    PeopleSummary,
    people_found,
)
from tactileq.analysis.statistics.people import (
    PeopleCount,
    beyond_bounds_by_ratings,
    beyond_share,
    counted_people,
    repeats_for_ratings,
    repeats_for_shares,
)
from tactileq.modeling.arrays import Floats
from tactileq.modeling.files.answer_tables import ANSWER_TABLES
from tactileq.modeling.participants.ratings import RatingPriors
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
        What the model of the participants says, where it decides or stands beside the tests.
    by_model : bool
        Whether it decides.
    by_day : bool
        Whether the two models were on different days.
    people_count : PeopleCount, optional
        Of ratings, and of right answers to trials that hold both models.
    """

    claim: Claim
    tests: pd.DataFrame
    values: pd.DataFrame
    caveats: Caveats
    people: PeopleFound | None = None
    by_model: bool = False
    by_day: bool = False
    people_count: PeopleCount | None = None


def word_of(found: ClaimFound, summary: PeopleSummary, row: Row) -> str:
    """What a posterior says over all textures, without equality where there is doubt.

    Parameters
    ----------
    row : Row
        Over all textures.
    """
    assert found.claim.bounds is not None
    word = summary.verdict(found.claim.bounds)
    return found.caveats.allowed(word, share_at_ends=row["share_at_ends"])


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
    data : sequence of PeopleData or None
        Of each claim what the model of the participants takes, where it is asked.
    sampled : iterator of PeopleFound
        Of these claims, in order.
    """

    responses: Responses
    claims: Sequence[Claim]
    data: Sequence[PeopleData | None]
    sampled: Iterator[PeopleFound]
    own: Mapping[str, np.random.Generator]

    @classmethod
    def of(
        cls, responses: Responses, *, rng: np.random.Generator, mapped: Mapped = map
    ) -> ClaimsBegun:
        """Of `claims_found`; `mapped` runs the samplers, and changes no result."""
        own = generators(rng)
        claims = all_claims(responses)
        data = [
            None if claim.task in responses.unfinished else people_data(responses, claim)
            for claim in claims
        ]
        samplers = [
            _sampler_of(one, claim, rng=rng)
            for claim, one in zip(claims, data, strict=True)
            if one is not None
        ]
        return cls(responses, claims, data, iter(mapped(_called, samplers)), own)

    def found(self) -> list[ClaimFound]:
        """The claims with their tests and, where it is asked, what the model says of people."""
        return [
            self._found(claim, data) for claim, data in zip(self.claims, self.data, strict=True)
        ]

    def _found(self, claim: Claim, data: PeopleData | None) -> ClaimFound:
        responses, rng = self.responses, self.own[claim.task]
        values = claim_values(responses, claim)
        caveats = claim_caveats(responses, claim, rng=rng)
        tests = claim_tests(claim, values, caveats=caveats, rng=rng)
        people = next(self.sampled) if data is not None else None
        decides = data is not None and data.decides
        by_day = bool(values.contrasts.shape[1])
        if people is not None:
            tests = with_people(tests, people, claim, caveats=caveats, decides=decides)
        return ClaimFound(
            claim=claim,
            tests=tests,
            values=values.table,
            caveats=caveats,
            people=people,
            by_model=decides,
            by_day=by_day,
            people_count=_people_count(responses, claim, by_day=by_day),
        )


def _sampler_of(
    data: PeopleData, claim: Claim, *, rng: np.random.Generator
) -> Callable[[], PeopleFound]:
    """What draws from the posterior of a claim."""
    assert claim.bounds is not None
    own = np.random.default_rng([int(rng.integers(2**32)), number_of(claim.name)])
    return partial(people_found, data, claim.bounds, rng=own)


def _called(sampler: Callable[[], PeopleFound]) -> PeopleFound:
    """What it draws; by name, so that another process can be sent it."""
    return sampler()


def people_data(responses: Responses, claim: Claim) -> PeopleData | None:
    """Every rating about a claim, complete or not; None where the plan's rule is that of tests.

    Nor is there any of claims about right answers or without bounds, of fewer than eight people,
    or where all models are identical.
    """
    if responses.plan.rule == TESTS_RULE or not claim.planned or claim.bounds is None:
        return None
    if claim.measure not in SCALES:
        return None
    answers = _compared(responses, claim)
    both = answers.groupby("texture")["model"].transform("nunique") == len(claim.models)
    answers = answers[both]  # of a texture that nobody rated with a model nothing is known
    people = sorted(answers["participant_id"].unique())
    checks = responses.anchors.get(claim.task, answers[:0])
    checks = checks[checks["participant_id"].isin(people)]
    if len(people) < FEWEST:
        return None
    asked = responses.answers[claim.task]
    contrasts = day_contrasts(asked[asked[claim.measure].notna()], claim.models)
    even = balanced(contrasts[contrasts.index.isin(people)])
    return PeopleData(
        studies=rating_studies(answers, checks, claim.measure, models=claim.models, people=people),
        people=people,
        textures=textures_of(answers),
        decides=even and responses.plan.rule == MODEL_RULE,
    )


def _compared(responses: Responses, claim: Claim) -> pd.DataFrame:
    """The answers about a claim on textures whose models differ, without missing ones."""
    answers = answers_about(responses, claim)
    same = answers["texture"].isin(list(responses.identical(claim.models)))
    return answers[~same & answers[claim.measure].notna()]


def _people_count(responses: Responses, claim: Claim, *, by_day: bool) -> PeopleCount | None:
    """How many participants differ by more than the bounds of a claim; None where it has none.

    docs/method/statistics.md#people
    """
    both = ANSWER_TABLES[claim.task].both_models
    if claim.bounds is None or claim.task in responses.unfinished:
        return None
    if not (both or claim.measure in SCALES):
        return None
    answers = _compared(responses, claim)
    people = sorted(answers["participant_id"].unique())
    if not people:
        return None
    repeats = repeats_of(responses, claim.task)
    size = {"people": len(people), "textures": int(answers["texture"].nunique())}
    if both:
        chance = chance_of(claim.task, answers)
        if np.isnan(chance):
            return None
        needed = repeats_for_shares(claim.bounds, chance=chance, **size)
        counts = answers.groupby("participant_id")["correct"].agg(["sum", "count"])
        right, asked = counts.to_numpy(dtype=float).T
        p = beyond_share(right, asked, chance + claim.bounds[1])
        beyond, of = counted_people(p) if repeats >= needed else (0, 0)
        return PeopleCount(repeats=repeats, needed=needed, beyond=beyond, people=of)
    needed = repeats_for_ratings(claim.bounds, rating_sd=RatingPriors().rating_sd, **size)
    beyond, of = 0, 0
    if repeats >= needed and not by_day:
        nobody = answers[:0]
        own = rating_studies(answers, nobody, claim.measure, models=claim.models, people=people)
        beyond, of = counted_people(beyond_bounds_by_ratings(own.values[0], claim.bounds))
    return PeopleCount(repeats=repeats, needed=needed, by_day=by_day, beyond=beyond, people=of)


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
