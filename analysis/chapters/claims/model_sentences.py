"""The model of the participants as a paper describes it, with the numbers that were used.

docs/method/participants.md
"""

from __future__ import annotations

from collections.abc import Sequence

from tactileq.analysis.answers.responses import Responses
from tactileq.analysis.labels import SCALES
from tactileq.analysis.statistics.compared_answers import decision_model
from tactileq.analysis.statistics.participants.posterior import UNSEEN, Effort
from tactileq.analysis.statistics.participants.verdict import DOUBLED_CHAINS, FEWEST
from tactileq.analysis.statistics.verdicts import ClaimFound
from tactileq.modeling.participants.choices import ChoicePriors, DecisionModel
from tactileq.modeling.participants.effects import COMPONENTS, EffectPriors
from tactileq.modeling.participants.ratings import AT_END, RatingPriors

_GAMMA = "inverse-gamma variances of shape 2"


def model_methods(responses: Responses, found: Sequence[ClaimFound]) -> list[str]:
    """Sentences on the model and its priors; none where it decides no claim.

    Parameters
    ----------
    found : sequence of ClaimFound
        Of finished tasks.
    """
    own = [one for one in found if one.people is not None]
    if not own:
        return []
    sentences = [
        f"The verdicts on {_names(own)} come from a hierarchical Bayesian model of the "
        "participants; its intervals are credible intervals."
    ]
    if any(one.claim.measure in SCALES for one in own):
        sentences += _rating_sentences(RatingPriors())
    tasks = dict.fromkeys(one.claim.task for one in own if one.claim.measure not in SCALES)
    models = [decision_model(task, responses.answers[task]) for task in tasks]
    for model in dict.fromkeys(models):
        if model is not None:
            sentences += _choice_sentences(model, ChoicePriors.of(model))
    return [*sentences, _share(), _sampler(own), _rule(responses.plan.few), _beside(own, found)]


def decided_by_tests(responses: Responses, found: Sequence[ClaimFound]) -> list[str]:
    """That tests decided planned claims although the plan names the model, if so.

    Parameters
    ----------
    responses : Responses
        Of a plan whose rule is the model.
    """
    names = [
        one.claim.name
        for one in found
        if one.claim.planned and one.people is None and _is_judged(one)
    ]
    return [
        f"Decided by paired tests although the plan names the model of the participants, since "
        f"fewer than {FEWEST} people answered or no decision model of the task is known: "
        f"{'; '.join(names)}."
    ] * bool(names)


def _is_judged(found: ClaimFound) -> bool:
    return not found.caveats.unfinished and bool(found.tests["t"].notna().any())


def _names(found: Sequence[ClaimFound]) -> str:
    return "; ".join(f"“{one.claim.name}”" for one in found)


def _rating_sentences(priors: RatingPriors) -> list[str]:
    return [
        "A rating is a latent judgement, normally distributed about the sum of the participant's "
        "level, their deviation for the texture, the texture, the effect of the model and linear "
        "trends over sessions and trials, and censored at the ends of the scale. A lapsed trial "
        f"is rated anywhere on the scale ({AT_END:.0%} at either end). Ratings of a careless "
        "participant depend neither on the model nor on whether a trial is an anchor; anchors are "
        "part of the likelihood.",
        f"Priors, in points: effects {_effects(priors.effects)}; mean level normal "
        f"({_pair(priors.level)}); SD of levels {priors.person_sd:g}, of deviations for a texture "
        f"{priors.cell_sd:g} and of the ratings of an anchor {priors.anchor_sd:g} ({_GAMMA}); "
        f"anchors below the level normal ({_pair(priors.anchor)}); textures normal (0, "
        f"{priors.texture_sd:g}), their effects normal about the mean effect (SD "
        f"{priors.texture_effect_sd:g}), trends normal (0, {priors.trend_sd:g}); SD of single "
        f"ratings about {priors.rating_sd:g}, alike between participants as by "
        f"{priors.rating_df:g} degrees of freedom, the variance of careless participants inverse "
        f"gamma (1, {priors.careless_scale:g}); {_shares(priors.lapses, priors.careless)}.",
        "The mean effect of ratings is that of a normal population of attending participants, "
        "with flat priors of its mean and SD.",
    ]


def _choice_sentences(model: DecisionModel, priors: ChoicePriors) -> list[str]:
    if model.both_models:
        what = "d′ between the two models, in the triangular decision of the odd-one-out task,"
        checks = (
            f"; a participant who attends is right in catch trials with a probability of prior "
            f"beta({_pair(priors.catch)})"
        )
        ability = ""
    else:
        what = (
            f"d′ of recognising a texture, in forced choice of {round(1 / model.chance)} "
            "alternatives,"
        )
        checks = ""
        ability = (
            f"mean ability normal ({_pair(priors.ability)}), SD of abilities "
            f"{priors.person_sd:g} ({_GAMMA}); effects of the model on a texture normal about the "
            f"mean effect (SD {priors.texture_effect_sd:g}); "
        )
    return [
        f"Right answers follow from {what} which is the sum of what the participant, the texture, "
        "the model and linear trends over sessions and trials add. In lapsed trials, and by "
        f"careless participants in all trials, an answer is guessed{checks}.",
        f"Priors, in units of d′: effects {_effects(priors.effects)}; {ability}textures normal "
        f"(0, {priors.texture_sd:g}), trends normal (0, {priors.trend_sd:g}); "
        f"{_shares(priors.lapses, priors.careless)}. Effects are reported as differences of the "
        "share of right answers without lapses.",
    ]


def _effects(priors: EffectPriors) -> str:
    return (
        f"of people a mixture of {COMPONENTS} normal groups with means normal (0, "
        f"{priors.mean_sd:g}), a common SD within groups (half-normal, scale {priors.spread:g}) "
        f"and weights of a symmetric Dirichlet distribution (parameter {priors.weight:g})"
    )


def _shares(lapses: tuple[float, float], careless: tuple[float, float]) -> str:
    lapsed, careless_people = (_pair(one) for one in (lapses, careless))
    return f"share of lapsed trials beta({lapsed}), of careless people beta({careless_people})"


def _pair(values: tuple[float, float]) -> str:
    return f"{values[0]:g}, {values[1]:g}".replace("-", "−")


def _share() -> str:
    return (
        "The share of people outside the bounds rests on the attending participants whose own "
        f"effect lies outside, counted in each draw, with the prior beta({UNSEEN:g}, {UNSEEN:g}) "
        "(Jeffreys) of the share."
    )


def _sampler(found: Sequence[ClaimFound]) -> str:
    effort = Effort()
    worst = max(one.people.summary.r_hat for one in found if one.people is not None)
    kinds = [("Gibbs sampling of ratings", True), ("Metropolis–Hastings steps of choices", False)]
    occur = {one.claim.measure in SCALES for one in found}
    how = " and ".join(name for name, of_scale in kinds if of_scale in occur)
    draws = effort.chains * len(range(0, effort.steps, effort.every))
    return (
        f"The posterior was sampled by {how}: {effort.chains} chains of {effort.steps} steps after "
        f"{effort.warm_up} that do not count, thinned to {draws} draws; the largest split R̂ of "
        f"mean and share was {worst:.3f}. The verdicts were repeated with the SDs of all priors "
        f"doubled ({DOUBLED_CHAINS} chains)."
    )


def _rule(few: float) -> str:
    return (
        "A claim is called equivalent where the 90% interval of the mean effect lies within the "
        f"bounds and the share of people outside them is below {few:.0%} with a probability of "
        "95%; equal for all but a few where that share is as small, but somebody's effect lies "
        "outside with that probability; equal on average, felt by some where the mean lies within "
        "the bounds and somebody outside, and the share is not that small; "
        "different where the 95% interval of the mean excludes 0 and its 90% interval is not "
        "within the bounds, unless the people outside are a minority; felt by some where somebody "
        "is outside and nothing else follows; and inconclusive otherwise."
    )


def _beside(own: Sequence[ClaimFound], found: Sequence[ClaimFound]) -> str:
    others = f" and decide the other {'claims' if len(found) - len(own) > 1 else 'claim'}"
    decide = others * (len(own) < len(found))
    return f"The following paired tests are reported beside it{decide}."
