"""The verdict of the model of the participants on a claim, and what it rests on.

docs/method/participants.md#verdict
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import pandas as pd

from tactileq.analysis.columns import TEXTURE
from tactileq.analysis.statistics.equivalence import (
    ALL_BUT,
    ALPHA,
    AVERAGE_FELT,
    DIFFERENT,
    EQUIVALENT,
    FELT,
    INCONCLUSIVE,
    Bounds,
)
from tactileq.analysis.statistics.participants.design import PeopleData, first_people, side_by_side
from tactileq.analysis.statistics.participants.posterior import (
    Draws,
    Effort,
    choice_draws,
    r_hat,
    rating_draws,
)
from tactileq.modeling.arrays import Floats
from tactileq.modeling.files.columns import Column, names
from tactileq.modeling.participants.choices import ChoicePriors, ChoiceStudies, DecisionModel
from tactileq.modeling.participants.ratings import RatingPriors, RatingStudies

FEWEST = 8  # participants
LIKELY = 0.5  # probability above which somebody is said to be outside the bounds, or careless
DOUBLED_CHAINS = 4  # of the posterior with doubled priors
SHORT = Effort(chains=4, warm_up=150, steps=200, every=2)  # where verdicts of studies are counted
MINORITY = 0.5  # a share of people below it feels a difference that the mean may not show

PEOPLE_COLUMNS = (
    Column("claim", is_name=True),
    Column("participant_id", "participant", is_name=True),
    Column("effect"),
    Column("ci_low", "95% CI from"),
    Column("ci_high", "to"),
    Column("outside", "probability of being outside the bounds", format=".2f"),
    Column("careless", "probability of not attending", format=".2f"),
)
TEXTURE_COLUMNS = (
    TEXTURE,
    Column("mean", "mean effect"),
    Column("ci_low", "95% CI from"),
    Column("ci_high", "to"),
    Column("p_difference", is_p_value=True),
    Column("p_equivalence", is_p_value=True),
)


@dataclass(frozen=True, kw_only=True)
class PeopleSummary:
    """What a posterior says of people; effects in the unit of the bounds.

    Parameters
    ----------
    mean, mean_low, mean_high : float
        Mean effect among people who attend: median and 95 % interval.
    mean90_low, mean90_high : float
        Its 90 % interval.
    share, share_low, share_high : float
        Share of attending people like these whose effect lies outside the bounds: median and 95 %
        interval.
    share_most : float
        The share is below it with a probability of 95 %.
    somebody : float
        Probability that the effect of at least one participant lies outside the bounds.
    r_hat : float
        The largest R̂ of mean and share.
    """

    mean: float
    mean_low: float
    mean_high: float
    mean90_low: float
    mean90_high: float
    share: float
    share_low: float
    share_high: float
    share_most: float
    somebody: float
    r_hat: float

    def inside(self, bounds: Bounds) -> bool:
        """Whether the mean effect lies inside the bounds, at 95 % for each of them."""
        return bounds[0] < self.mean90_low and self.mean90_high < bounds[1]

    def verdict(self, bounds: Bounds, *, few: float) -> str:
        """The verdict on all textures, whatever casts doubt on equality.

        docs/method/participants.md#verdict

        Parameters
        ----------
        bounds : (float, float)
        few : float
            Share of people below which those outside the bounds do not count, 0 … 0.5.
        """
        inside, somebody = self.inside(bounds), self.somebody >= 1 - ALPHA
        differs = self.mean_low > 0 or self.mean_high < 0
        if somebody and self.share_most < few:
            return ALL_BUT
        if somebody and inside:
            return AVERAGE_FELT
        if differs and not inside and not (somebody and self.share_most < MINORITY):
            return DIFFERENT
        if somebody:
            return FELT
        return EQUIVALENT if inside and self.share_most < few else INCONCLUSIVE


@dataclass(frozen=True, eq=False, kw_only=True)
class PeopleJudged:
    """What the verdicts on one claim rest on: all textures, and each.

    Parameters
    ----------
    textures : DataFrame
        `TEXTURE_COLUMNS`; p values are posterior probabilities: twice that of the less likely sign,
        and the larger one of lying beyond a bound.
    """

    summary: PeopleSummary
    textures: pd.DataFrame


@dataclass(frozen=True, eq=False, kw_only=True)
class PeopleFound(PeopleJudged):
    """The model of the participants applied to one claim.

    Parameters
    ----------
    summary, textures
        As in `PeopleJudged`.
    doubled : PeopleSummary
        With the SDs of all priors twice as large.
    people : DataFrame
        `PEOPLE_COLUMNS` without the claim.
    lapses : float
        Share of lapsed trials of people who attend (posterior mean).
    """

    doubled: PeopleSummary
    people: pd.DataFrame
    lapses: float


def people_found(
    studies: RatingStudies | ChoiceStudies,
    bounds: Bounds,
    *,
    model: DecisionModel | None,
    people: Sequence[str],
    textures: Sequence[str],
    rng: np.random.Generator,
) -> PeopleFound:
    """The posterior of one study, in short.

    Parameters
    ----------
    studies : RatingStudies or ChoiceStudies
        One study.
    bounds : (float, float)
    model : DecisionModel, optional
        Of choices.
    people, textures : sequence of str
        In the order of the arrays.
    """
    (draws,) = _sampler(studies, bounds, model=model, rng=rng)(effort=Effort())
    wide = _sampler(studies, bounds, model=model, rng=rng, doubled=True)
    (doubled,) = wide(effort=replace(Effort(), chains=DOUBLED_CHAINS))
    return PeopleFound(
        summary=summary_of(draws),
        doubled=summary_of(doubled),
        people=_people_table(draws, bounds, people=people),
        textures=_texture_table(draws, bounds, textures=textures),
        lapses=float(draws.lapses.mean()),
    )


def judged_by_size(
    data: Sequence[PeopleData],
    bounds: Bounds,
    *,
    sizes: Sequence[int],
    rng: np.random.Generator,
    effort: Effort | None = None,
) -> list[list[PeopleJudged]]:
    """What studies of the first people alone would say of several claims, all side by side.

    Parameters
    ----------
    data : sequence of PeopleData
        Of each claim; all of the same shape, with the same decision model.
    bounds : (float, float)
        Of all of them.
    effort : Effort, optional
        `SHORT` without it.

    Returns
    -------
    list of list of PeopleJudged
        Of each claim, by size.
    """
    parts = side_by_side([first_people(one.studies, sizes) for one in data])
    draws = iter(_sampler(parts, bounds, model=data[0].model, rng=rng)(effort=effort or SHORT))
    return [[_judged(next(draws), bounds, textures=one.textures) for _ in sizes] for one in data]


def _judged(draws: Draws, bounds: Bounds, *, textures: Sequence[str]) -> PeopleJudged:
    table = _texture_table(draws, bounds, textures=textures)
    return PeopleJudged(summary=summary_of(draws), textures=table)


def _sampler(
    studies: RatingStudies | ChoiceStudies,
    bounds: Bounds,
    *,
    model: DecisionModel | None,
    rng: np.random.Generator,
    doubled: bool = False,
) -> Callable[..., list[Draws]]:
    if isinstance(studies, RatingStudies):
        own = RatingPriors()
        priors = own.doubled() if doubled else own
        return partial(rating_draws, studies, bounds, rng=rng, priors=priors)
    assert model is not None
    of_choice = ChoicePriors.of(model)
    wide = of_choice.doubled() if doubled else of_choice
    return partial(choice_draws, studies, model, bounds, rng=rng, priors=wide)


def summary_of(draws: Draws) -> PeopleSummary:
    """A posterior in short."""
    mean = np.quantile(draws.mean, [0.5, 0.025, 0.975, ALPHA, 1 - ALPHA])
    share = np.quantile(draws.share, [0.5, 0.025, 0.975, 1 - ALPHA])
    return PeopleSummary(
        **dict(
            zip(
                ("mean", "mean_low", "mean_high", "mean90_low", "mean90_high"),
                map(float, mean),
                strict=True,
            )
        ),
        **dict(
            zip(("share", "share_low", "share_high", "share_most"), map(float, share), strict=True)
        ),
        somebody=float((draws.outside > 0).mean()),
        r_hat=max(r_hat(draws.mean), r_hat(draws.share)),
    )


def _people_table(draws: Draws, bounds: Bounds, *, people: Sequence[str]) -> pd.DataFrame:
    effects = draws.effects.reshape(-1, len(people))
    attends = draws.attends.reshape(-1, len(people)).mean(axis=0)
    low, high = np.quantile(effects, [0.025, 0.975], axis=0)
    outside = ((effects < bounds[0]) | (effects > bounds[1])).mean(axis=0)
    return pd.DataFrame(
        {
            "participant_id": list(people),
            "effect": np.median(effects, axis=0),
            "ci_low": low,
            "ci_high": high,
            "outside": outside,
            "careless": 1 - attends,
        }
    )


def _texture_table(draws: Draws, bounds: Bounds, *, textures: Sequence[str]) -> pd.DataFrame:
    means = draws.textures.reshape(-1, len(textures))
    low, high = np.quantile(means, [0.025, 0.975], axis=0)
    above: Floats = (means > 0).mean(axis=0)
    beyond = np.maximum((means <= bounds[0]).mean(axis=0), (means >= bounds[1]).mean(axis=0))
    return pd.DataFrame(
        {
            "texture": list(textures),
            "mean": np.median(means, axis=0),
            "ci_low": low,
            "ci_high": high,
            "p_difference": 2 * np.minimum(above, 1 - above),
            "p_equivalence": beyond,
        },
        columns=names(TEXTURE_COLUMNS),
    )
