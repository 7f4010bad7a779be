"""The section on models of single answers: a mixed model of ratings, GEE of ratings and choices.

docs/method/mixed-models.md
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from tactileq.analysis.answers.responses import Responses
from tactileq.analysis.chapters.chapter import Answered
from tactileq.analysis.chapters.single_answers.gee import GEE, GEE_COLUMNS, gee_effects
from tactileq.analysis.labels import SCALES
from tactileq.analysis.page.outcomes import Outcome, Weight
from tactileq.analysis.page.page import Table
from tactileq.analysis.page.sections import Section
from tactileq.analysis.statistics.compared_answers import answers_about
from tactileq.analysis.statistics.draws import generators
from tactileq.analysis.statistics.equivalence import ALPHA
from tactileq.analysis.statistics.mixed import MIXED_COLUMNS, mixed_effects
from tactileq.analysis.statistics.verdicts import ClaimFound
from tactileq.modeling.files.answer_tables import ANSWER_TABLES, ENDS
from tactileq.modeling.files.columns import Column, names, p_value

CLAIM = Column("claim", is_name=True)
CLAIM_MIXED_COLUMNS = (CLAIM, *MIXED_COLUMNS)
CLAIM_GEE_COLUMNS = (CLAIM, *GEE_COLUMNS)


_MIXED = (
    "Ratings by a mixed model",
    "Texture × model, session and order, with a random intercept and slope of the model per "
    "participant, in points; the degrees of freedom of t are the number of participants minus 1. "
    "For balanced answers this is the paired t-test. Not corrected for the number of tests; "
    "verdicts rest on the paired tests.",
)
_GEE = (
    "Ratings and right answers by generalized estimating equations",
    "Binomial with logit link, clustered by participant, bias-reduced covariance; ratings as "
    "shares of 100. Texture × model, session and order over all textures, with equal weight for "
    "each. Where all answers to a texture with a model lie at one end, odds are infinite and p is "
    "from the participants' sign flips. Not corrected for the number of tests; verdicts rest on "
    "the paired tests.",
)


class EffectInWords(NamedTuple):
    """The result of a model of single answers: direction of a significant effect, p, wording."""

    sign: int
    p: float
    sentence: str


def sections(answered: Answered) -> list[Section]:
    """A section, where a claim is about two models that are answered about in different trials."""
    section = mixed_section(answered.responses, answered.judged, rng=answered.rng)
    return [section] if section is not None else []


def mixed_section(
    responses: Responses, found: Sequence[ClaimFound], *, rng: np.random.Generator
) -> Section | None:
    """Every claim on two models, by models of single answers; None where there is no such claim.

    Parameters
    ----------
    found : sequence of ClaimFound
        With tests, of any tasks. Claims about tasks whose trials contain both models are skipped.
    rng : Generator
        Draws sign flips.
    """
    mixed, odds, outcomes = [], [], []
    draws = generators(rng)
    for one in found:
        claim = one.claim
        if ANSWER_TABLES[claim.task].both_models:
            continue
        answers = answers_about(responses, claim)
        answers = answers[~answers["texture"].isin(list(one.caveats.identical))]
        if answers["model"].nunique() < 2:
            continue
        said, own = [], draws[claim.task]
        if claim.measure in SCALES:
            of_claim = mixed_effects(answers, claim.measure, models=claim.models, rng=own)
            mixed.append(of_claim.assign(claim=claim.name))
            said.append(_mixed_said(of_claim.to_dict("records")[0]))
        largest = ENDS[1] if claim.measure in SCALES else 1.0
        of_claim = gee_effects(
            answers, claim.measure, models=claim.models, largest=largest, rng=own
        )
        odds.append(of_claim.assign(claim=claim.name))
        said.append(_gee_said(of_claim.to_dict("records")[0]))
        if all(np.isfinite(each.p) for each in said):
            outcomes.append(Outcome(Weight.SECONDARY, _beside_the_paired_test(one, said)))
    tables = [
        Table(name, *caption, pd.concat(frames)[names(columns)], columns, responses.simulated)
        for name, caption, frames, columns in (
            ("mixed_effects", _MIXED, mixed, CLAIM_MIXED_COLUMNS),
            ("gee_effects", _GEE, odds, CLAIM_GEE_COLUMNS),
        )
        if frames
    ]
    if not tables:
        return None
    return Section("mixed", "Models of single answers", tuple(tables), outcomes=tuple(outcomes))


def _mixed_said(row: Mapping[Hashable, Any]) -> EffectInWords:
    effect = _with_interval([f"{row[name]:+.1f}" for name in ("estimate", "ci_low", "ci_high")])
    text = f"{row['method']} {effect} points, p = {p_value(row['p'])}"
    return EffectInWords(_sign(row["estimate"], row["p"]), row["p"], text)


def _gee_said(row: Mapping[Hashable, Any]) -> EffectInWords:
    sign = _sign(row["share_other"] - row["share_reference"], row["p"])
    text = f"{row['method']} p = {p_value(row['p'])}"
    if row["method"] == GEE:
        ratios = [f"{row[name]:.2f}" for name in ("odds_ratio", "ci_low", "ci_high")]
        text = f"{row['method']} odds ratio {_with_interval(ratios)}, p = {p_value(row['p'])}"
    return EffectInWords(sign, row["p"], text)


def _beside_the_paired_test(one: ClaimFound, said: Sequence[EffectInWords]) -> str:
    """Whether models of single answers agree with the paired test over all textures."""
    paired = one.tests.to_dict("records")[0]
    sign = _sign(paired["mean_difference"], paired["p"])
    agree = "in agreement" if all(each.sign == sign for each in said) else "not in agreement"
    text = "; ".join(each.sentence for each in said)
    return (
        f"Single answers, {one.claim.name}: {text}. This is {agree} with the paired test over "
        f"all textures (p = {p_value(paired['p'])})."
    ).replace("= <", "<")


def _sign(effect: float, p: float) -> int:
    """Direction of a significant effect, else 0."""
    return int(np.sign(effect)) if p < ALPHA else 0


def _with_interval(numbers: Sequence[str]) -> str:
    estimate, low, high = (number.replace("-", "−").replace("inf", "∞") for number in numbers)
    return estimate if "nan" in low else f"{estimate} (95% CI {low} to {high})"
