"""The plan and what was done instead, in sentences; and the methods, as a paper tells them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from analysis.answers.plan import EQUIVALENCE, Claim
from analysis.answers.responses import Responses
from analysis.columns import shortened_hash
from analysis.labels import MEASURES, TASKS
from analysis.statistics.verdicts import ClaimFound, chance_of, has_rates, incomplete

MOST_NAMED = 12


def deviations(responses: Responses, found: Sequence[ClaimFound]) -> list[str]:
    """What was planned, who and what was left out, and where the study went another way."""
    return [
        _plan(responses),
        *(f"Planned exclusion: {sentence}" for sentence in responses.plan.exclusions),
        *_changed_plans(responses),
        *_not_planned(found),
        *_left_out(found),
        *(f"On reading the answers: {warning}" for warning in responses.warnings),
    ]


def methods_paragraph(responses: Responses, found: Sequence[ClaimFound]) -> str:
    """The statistical methods of this report, to be put into a paper."""
    claims = [one.claim for one in found]
    sentences = [_who(responses, claims)]
    sentences.append(
        "Each participant's answers were averaged per texture and model; a cell counts where all "
        "planned repeats were answered. Two models were compared by paired t-tests over "
        "participants, first on the mean over the textures whose models differ, each texture "
        "counting once, then for each texture with Holm's correction over the textures."
    )
    sentences += _bounds(found)
    sentences.append(
        "Effect sizes are d_z with intervals from the noncentral t distribution (Steiger & "
        "Fouladi, 1997); Bayes factors are those of Rouder et al. (2009; r = 0.707). Wilcoxon's "
        "signed-rank test and a permutation test that flips signs stand beside; the latter takes "
        "the place of t where differences do not vary between participants."
    )
    if any(_has_tested_rates(responses, claim.task) for claim in claims):
        sentences.append(
            "Correct rates were compared with chance by one-sample t-tests over participants; "
            "their intervals are bias-corrected and accelerated bootstraps over participants."
        )
    return " ".join(sentences)


def _has_tested_rates(responses: Responses, task: str) -> bool:
    return has_rates(task) and not np.isnan(chance_of(task, responses.answers[task]))


def _plan(responses: Responses) -> str:
    plan = responses.plan
    registered = [claim for claim in plan.claims if claim.planned]
    if not registered:
        return (
            "No claim was registered before the first answer: everything here is exploratory, and "
            "nothing can be called equivalent without bounds that were fixed before."
        )
    pages = ", ".join(shortened_hash(sha256) for sha256 in plan.sha256[:1])
    where = f" (page to preregister: {pages})" if pages else ""
    return f"Claims fixed before the first answer: {len(registered)}{where}."


def _changed_plans(responses: Responses) -> list[str]:
    others = responses.plan.sha256[1:]
    if not others:
        return []
    pages = ", ".join(shortened_hash(sha256) for sha256 in others)
    return [
        f"The study was changed after the first session; others ran under {pages}. The claims "
        "tested here are those of the first."
    ]


def _not_planned(found: Sequence[ClaimFound]) -> list[str]:
    names = [one.claim.name for one in found if not one.claim.planned]
    return [f"Exploratory, since not in the plan: {'; '.join(names)}."] * bool(names)


def _left_out(found: Sequence[ClaimFound]) -> list[str]:
    """Of each claim the participants who lack answers, and to which textures."""
    told = []
    for one in found:
        lacking: dict[str, list[str]] = {}
        for participant, texture in incomplete(one):
            lacking.setdefault(participant, []).append(texture)
        if lacking:
            named = [f"{who} ({', '.join(what)})" for who, what in lacking.items()][:MOST_NAMED]
            more = len(lacking) - len(named)
            rest = f" and {more} more" if more else ""
            told.append(
                f"Left out of {one.claim.name} over all textures, and of the textures named, for "
                f"want of complete answers: {'; '.join(named)}{rest}."
            )
    return told


def _who(responses: Responses, claims: Sequence[Claim]) -> str:
    tasks = dict.fromkeys(claim.task for claim in claims)
    kind = "simulated participants" if responses.simulated_participants else "participants"
    rig = " at a simulated rig" if responses.simulated_rig else ""
    parts = [
        f"{responses.done(task).participants} {kind}{rig} took part in the {TASKS[task]} of "
        f"{responses.answers[task]['texture'].nunique()} textures"
        for task in tasks
    ]
    told = "; ".join(parts)
    return f"{told[:1].upper()}{told[1:]}."


def _bounds(found: Sequence[ClaimFound]) -> list[str]:
    """The smallest effects of interest, where some were fixed, and where equality could be said."""
    bounded = [one.claim for one in found if one.claim.bounds is not None]
    if not bounded:
        return []
    listed = "; ".join(
        f"{MEASURES[claim.measure]} {claim.bounds[0]:+g} to {claim.bounds[1]:+g}".replace("-", "−")
        for claim in bounded
        if claim.bounds is not None
    )
    planned = all(claim.planned and claim.test == EQUIVALENCE for claim in bounded)
    when = "fixed before the first answer" if planned else "some of them fixed after the data"
    return [
        "Equivalence was tested by two one-sided t-tests (TOST; Schuirmann, 1987) at a level of "
        f"5% with bounds {when} ({listed}), with Holm's correction of its own. A claim is called "
        "equivalent where only the test of equivalence is significant, different where only that "
        "of a difference is, different but within bounds where both are, and inconclusive where "
        f"neither is. {_sensitivity(found)}"
    ]


def _sensitivity(found: Sequence[ClaimFound]) -> str:
    """Whether people were shown to tell surfaces apart, claim by claim."""
    states = "; ".join(
        f"{one.claim.name}: {one.standing.sensitivity}"
        for one in found
        if one.claim.bounds is not None and not one.standing.unfinished
    )
    return (
        "Words of equality were withheld where the data do not show that participants told "
        "different surfaces apart (ratings: anchors rated lower than the textures' own models; "
        "forced choice: the reference recognised above chance) or where too many ratings lie at an "
        f"end of the scale{f' (sensitivity: {states})' if states else ''}."
    )
