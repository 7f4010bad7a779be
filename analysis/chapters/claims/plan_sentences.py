"""The plan and deviations from it in sentences, and the methods as a paper reports them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tactileq.analysis.answers.plan import Claim
from tactileq.analysis.answers.responses import Responses
from tactileq.analysis.chapters.claims.model_sentences import decided_by_tests, model_methods
from tactileq.analysis.labels import MEASURES, SCALES, TASK_TITLES
from tactileq.analysis.statistics.compared_answers import chance_of
from tactileq.analysis.statistics.described_verdicts import incomplete
from tactileq.analysis.statistics.verdicts import ClaimFound
from tactileq.modeling.errors import counted
from tactileq.modeling.files.answer_tables import ANSWER_TABLES
from tactileq.modeling.files.columns import shortened_hash

MOST_NAMED = 12


def deviations(responses: Responses, found: Sequence[ClaimFound]) -> list[str]:
    """What was planned, what and who was left out, and how the study deviated from the plan."""
    return [
        _plan(responses),
        *(f"Planned exclusion: {sentence}" for sentence in responses.plan.exclusions),
        *_changed_plans(responses),
        *_not_planned(found),
        *decided_by_tests(responses, found),
        *_left_out(found),
        *(f"On reading the answers: {warning}" for warning in responses.warnings),
    ]


def methods_paragraph(responses: Responses, found: Sequence[ClaimFound]) -> str:
    """The statistical methods of this report, worded for a paper."""
    claims = [one.claim for one in found]
    sentences = [_who(responses, claims), *model_methods(found)]
    sentences.append(
        "Each participant's answers were averaged per texture and model; a cell counts only where "
        "all planned repeats were answered. Two models were compared by paired t-tests over "
        "participants, first on the mean over the textures whose models differ, with equal weight "
        "for each texture, then for each texture with Holm's correction over the textures."
    )
    if any(one.by_day for one in found):
        sentences.append(
            "Where the two models were presented on different days, the mean difference was "
            "estimated apart from days by least squares (AB/BA crossover; Hills & Armitage, 1979)."
        )
    if any(one.claim.measure in SCALES for one in found):
        sentences.append(
            "Whether people differ was tested by the F test of participants against participant × "
            "texture, of the differences between the two models."
        )
    sentences += _bounds(found)
    sentences.append(
        "Effect sizes are d_z with intervals from the noncentral t distribution (Steiger & "
        "Fouladi, 1997); Bayes factors are those of Rouder et al. (2009; r = 0.707). Wilcoxon's "
        "signed-rank test and a permutation test that flips signs are reported as well; the latter "
        "replaces the t-test where differences do not vary between participants."
    )
    if any(_has_tested_rates(responses, claim.task) for claim in claims):
        sentences.append(
            "Correct rates were compared with chance by one-sample t-tests over participants; "
            "their confidence intervals are bias-corrected and accelerated bootstrap intervals "
            "over participants."
        )
    return " ".join(sentences)


def _has_tested_rates(responses: Responses, task: str) -> bool:
    return ANSWER_TABLES[task].has_rates and not np.isnan(chance_of(task, responses.answers[task]))


def _plan(responses: Responses) -> str:
    plan = responses.plan
    registered = [claim for claim in plan.claims if claim.planned]
    if not registered:
        return (
            "No claim was registered before the first answer: everything here is exploratory, and "
            "nothing can be called equivalent without bounds that were fixed beforehand."
        )
    pages = ", ".join(shortened_hash(sha256) for sha256 in plan.sha256[:1])
    where = f" (preregistration page: {pages})" if pages else ""
    return f"Claims fixed before the first answer: {len(registered)}{where}."


def _changed_plans(responses: Responses) -> list[str]:
    others = responses.plan.sha256[1:]
    if not others:
        return []
    pages = ", ".join(shortened_hash(sha256) for sha256 in others)
    return [
        f"The study was changed after the first session; other sessions ran under {pages}. The "
        "claims tested here are those of the first session."
    ]


def _not_planned(found: Sequence[ClaimFound]) -> list[str]:
    names = [one.claim.name for one in found if not one.claim.planned]
    return [f"Exploratory, since not in the plan: {'; '.join(names)}."] * bool(names)


def _left_out(found: Sequence[ClaimFound]) -> list[str]:
    """The participants whose answers are incomplete for each claim, with the textures."""
    sentences = []
    for one in found:
        lacking: dict[str, list[str]] = {}
        for participant, texture in incomplete(one):
            lacking.setdefault(participant, []).append(texture)
        if lacking:
            named = [f"{who} ({', '.join(what)})" for who, what in lacking.items()][:MOST_NAMED]
            more = len(lacking) - len(named)
            rest = f" and {more} more" if more else ""
            sentences.append(
                f"Left out of {'the tests of ' * one.by_model}{one.claim.name} over all textures, "
                f"and for the textures named, "
                f"because answers are incomplete: {'; '.join(named)}{rest}."
            )
    return sentences


def _who(responses: Responses, claims: Sequence[Claim]) -> str:
    tasks = dict.fromkeys(claim.task for claim in claims)
    kind = "simulated participant" if responses.simulated_participants else "participant"
    rig = " at a simulated rig" if responses.simulated_rig else ""
    parts = [
        f"{counted(responses.done(task).participants, kind)}{rig} took part in the "
        f"{TASK_TITLES[task]} with "
        f"{counted(responses.answers[task]['texture'].nunique(), 'texture')}"
        for task in tasks
    ]
    text = "; ".join(parts)
    return f"{text[:1].upper()}{text[1:]}."


def _bounds(found: Sequence[ClaimFound]) -> list[str]:
    """The smallest effects of interest, where fixed, and where equivalence could be concluded."""
    bounded = [one.claim for one in found if one.claim.bounds is not None]
    if not bounded:
        return []
    listed = "; ".join(
        f"{MEASURES[claim.measure]} {claim.bounds[0]:+g} to {claim.bounds[1]:+g}".replace("-", "−")
        for claim in bounded
        if claim.bounds is not None
    )
    planned = all(claim.planned for claim in bounded)
    when = "fixed before the first answer" if planned else "some of them fixed after the data"
    return [
        "Equivalence was tested by two one-sided t-tests (TOST; Schuirmann, 1987) at a level of 5% "
        f"with bounds {when} ({listed}), with a separate Holm correction. By these tests a claim "
        "is called equivalent where only the test of equivalence is significant, different where "
        "only the test of a difference is, different but within bounds where both are, and "
        f"inconclusive where neither is. {_sensitivity(found)}"
    ]


def _sensitivity(found: Sequence[ClaimFound]) -> str:
    """Whether participants were shown to tell surfaces apart, claim by claim."""
    states = "; ".join(
        f"{one.claim.name}: {one.caveats.sensitivity}"
        for one in found
        if one.claim.bounds is not None and not one.caveats.unfinished
    )
    return (
        "Equivalence was not concluded where the data do not show that participants could tell "
        "different surfaces apart (ratings: anchors rated lower than the textures' own models; "
        "forced choice: the reference recognised above chance; odd one out: catch trials answered "
        "above chance) or where too many ratings lie at an "
        f"end of the scale{f' (sensitivity: {states})' if states else ''}."
    )
