"""The model of the participants as a paper describes it, with the numbers that were used.

docs/method/participants.md
"""

from __future__ import annotations

from collections.abc import Sequence

from tactileq.analysis.answers.plan import MODEL_RULE
from tactileq.analysis.answers.responses import Responses
from tactileq.analysis.labels import SCALES
from tactileq.analysis.statistics.participants.posterior import (
    FEWEST_EFFECTIVE,
    HIGHEST_R_HAT,
    LONGER,
    Effort,
)
from tactileq.analysis.statistics.participants.verdict import FEWEST
from tactileq.analysis.statistics.verdicts import ClaimFound, overall_row
from tactileq.modeling.files.claims import WITHDRAWN
from tactileq.modeling.participants.ratings import AT_END, RatingPriors

_GAMMA = "inverse-gamma variances of shape 2"


def model_methods(found: Sequence[ClaimFound]) -> list[str]:
    """Sentences on the model and its priors; none where it was asked about no claim.

    Parameters
    ----------
    found : sequence of ClaimFound
        Of finished tasks.
    """
    own = [one for one in found if one.people is not None]
    if not own:
        return []
    decides = [one for one in own if one.by_model]
    names = "; ".join(f"“{one.claim.name}”" for one in decides or own)
    role = "The verdicts on" if decides else "Beside the tests of"
    verb = "come from" if decides else "stands"
    return [
        f"{role} {names} {verb} a hierarchical Bayesian model of the participants; its intervals "
        "are credible intervals.",
        *_rating_sentences(RatingPriors()),
        _sampler(),
        *[_rule()] * bool(decides),
        _beside(decides, found),
    ]


def decided_by_tests(responses: Responses, found: Sequence[ClaimFound]) -> list[str]:
    """Why tests decided planned claims about ratings although a plan names a model, if so."""
    beside = any(one.people is not None for one in found)
    if responses.plan.rule == WITHDRAWN:
        return [
            "The plan registered the rule “model”, which said how many people feel a difference. "
            "These words are not printed any more: one or two ratings of each texture cannot tell "
            "how many do. The verdicts are those of the registered tests"
            + "; the hierarchical model of ratings that took its place stands beside them" * beside
            + "."
        ] * any(one.claim.planned and not one.caveats.unfinished for one in found)
    if responses.plan.rule != MODEL_RULE:
        return []
    own = [one for one in found if one.claim.planned and one.claim.measure in SCALES]
    own = [one for one in own if not one.by_model and _is_judged(one)]
    uneven = [one.claim.name for one in own if one.people is not None]
    few = [one.claim.name for one in own if one.people is None]
    return [
        f"Decided by tests apart from days, although the plan names the hierarchical model, since "
        f"more people began with one of the models: {'; '.join(uneven)}."
    ] * bool(uneven) + [
        f"Decided by tests although the plan names the hierarchical model, since fewer than "
        f"{FEWEST} people answered: {'; '.join(few)}."
    ] * bool(few)


def _is_judged(found: ClaimFound) -> bool:
    row = overall_row(found)
    return row is not None and not found.caveats.unfinished and bool(row["verdict"])


def _rating_sentences(priors: RatingPriors) -> list[str]:
    return [
        "A rating is a latent judgement, normally distributed about the sum of the participant's "
        "level, their deviation for the texture, the texture, the effect of the model and linear "
        "trends over sessions and trials, and censored at the ends of the scale. The effect of the "
        "model on a texture is the participant's own effect, the texture's deviation and, where "
        "textures were rated twice with a model, the participant's deviation on this texture. A "
        f"lapsed trial is rated anywhere on the scale ({AT_END:.0%} at either end). Ratings of a "
        "careless participant depend neither on the model nor on whether a trial is an anchor; "
        "anchors are part of the likelihood.",
        f"Priors, in points: participants' effects normal, with a mean normal (0, "
        f"{priors.mean_sd:g}) and an SD half-normal (scale {priors.people_sd:g}), their deviations "
        f"on textures normal with an SD half-normal (scale {priors.interaction_sd:g}); mean level "
        f"normal ({_pair(priors.level)}); SD of levels {priors.person_sd:g}, of deviations for a "
        f"texture {priors.cell_sd:g} and of the ratings of an anchor {priors.anchor_sd:g} "
        f"({_GAMMA}); anchors below the level normal ({_pair(priors.anchor)}); textures normal (0, "
        f"{priors.texture_sd:g}), their effects normal about the mean effect (SD "
        f"{priors.texture_effect_sd:g}), trends normal (0, {priors.trend_sd:g}); SD of single "
        f"ratings about {priors.rating_sd:g}, alike between participants as by "
        f"{priors.rating_df:g} degrees of freedom, the variance of careless participants inverse "
        f"gamma (1, {priors.careless_scale:g}); share of lapsed trials beta "
        f"({_pair(priors.lapses)}), of careless people beta ({_pair(priors.careless)}).",
    ]


def _pair(values: tuple[float, float]) -> str:
    return f"{values[0]:g}, {values[1]:g}".replace("-", "−")


def _sampler() -> str:
    effort = Effort()
    draws = effort.chains * len(range(0, effort.steps, effort.every))
    return (
        f"The posterior was sampled by Gibbs sampling: {effort.chains} chains of {effort.steps} "
        f"steps after {effort.warm_up} that do not count, thinned to {draws} draws, or of "
        f"{LONGER.steps} steps where these do not suffice; quantities with a split R̂ above "
        f"{HIGHEST_R_HAT:g} or fewer than {FEWEST_EFFECTIVE:.0f} effective draws are not reported. "
        "The verdicts were repeated with the SDs of all priors doubled."
    )


def _rule() -> str:
    return (
        "By the model a difference is shown where the 95% interval of the mean effect excludes 0, "
        "and it lies within the bounds where the 90% interval does: equivalent is the latter, "
        "different the former, different but within bounds both, and inconclusive neither. "
        "Single textures are judged by normal posterior probabilities with Holm's correction."
    )


def _beside(decides: Sequence[ClaimFound], found: Sequence[ClaimFound]) -> str:
    others = len(found) - len(decides)
    decide = f" and decide the other {'claims' if others > 1 else 'claim'}" * bool(
        others and decides
    )
    return f"The following paired tests are reported beside it{decide}."
