"""The verdict of the model of the participants on a claim about ratings, and what it rests on.

docs/method/participants.md#verdict
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.special import ndtr

from tactileq.analysis.columns import TEXTURE
from tactileq.analysis.statistics.caveats import NOT_CONVERGED
from tactileq.analysis.statistics.equivalence import ALPHA, Bounds, combined
from tactileq.analysis.statistics.participants.design import PeopleData, first_people, side_by_side
from tactileq.analysis.statistics.participants.posterior import (
    Described,
    Draws,
    Effort,
    described,
    rating_draws,
    sufficient_draws,
    well_sampled,
)
from tactileq.modeling.arrays import Floats
from tactileq.modeling.files.columns import Column, names
from tactileq.modeling.participants.ratings import RatingPriors

FEWEST = 8  # participants
LIKELY = 0.5  # probability above which somebody is said not to attend
SHORT = Effort(chains=4, warm_up=150, steps=200)  # where verdicts of studies are counted

PEOPLE_COLUMNS = (
    Column("claim", is_name=True),
    Column("participant_id", "participant", is_name=True),
    Column("effect"),
    Column("ci_low", "95% CI from"),
    Column("ci_high", "to"),
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
    """What a posterior says of people, in points; NaN of what was not sampled well enough.

    Parameters
    ----------
    mean, mean_low, mean_high : float
        Mean effect among people who attend: median and 95 % interval.
    mean90_low, mean90_high : float
        Its 90 % interval.
    sd, sd_low, sd_high : float
        SD of people's effects, of people and days together where models were on different days:
        median and 95 % interval.
    careless, careless_low, careless_high : float
        Share of people who do not attend, likewise.
    lapses : float
        Share of lapsed trials (posterior mean).
    converged : bool
        Whether the mean and the textures were sampled well enough for verdicts.
    """

    mean: float
    mean_low: float
    mean_high: float
    mean90_low: float
    mean90_high: float
    sd: float
    sd_low: float
    sd_high: float
    careless: float
    careless_low: float
    careless_high: float
    lapses: float
    converged: bool

    def inside(self, bounds: Bounds) -> bool:
        """Whether the 90 % interval of the mean lies inside the bounds: at 95 % for each."""
        return bounds[0] < self.mean90_low and self.mean90_high < bounds[1]

    def verdict(self, bounds: Bounds) -> str:
        """The verdict on all textures, whatever casts doubt on equality."""
        if not self.converged:
            return NOT_CONVERGED
        differs = self.mean_low > 0 or self.mean_high < 0
        return combined(differs=differs, equals=self.inside(bounds))


@dataclass(frozen=True, eq=False, kw_only=True)
class PeopleJudged:
    """What the verdicts on one claim rest on: all textures, and each.

    Parameters
    ----------
    textures : DataFrame
        `TEXTURE_COLUMNS`; p values are those of a normal posterior of this mean and SD, in place of
        draws beyond 0 or a bound, of which there are too few to count.
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
    given : Described
        What people rated, (1,) and (1, n).
    replicated : Described
        What the same people could have rated, (S,) and (S, n) of S draws.
    """

    doubled: PeopleSummary
    people: pd.DataFrame
    given: Described
    replicated: Described


def people_found(data: PeopleData, bounds: Bounds, *, rng: np.random.Generator) -> PeopleFound:
    """The posterior of one study, in short."""
    (draws,) = sufficient_draws(data.studies, rng=rng)
    (doubled,) = sufficient_draws(data.studies, rng=rng, priors=RatingPriors().doubled())
    return PeopleFound(
        **vars(_judged(draws, bounds, textures=data.textures)),
        doubled=summary_of(doubled),
        people=_people_table(draws, people=data.people),
        given=described(data.studies.values),
        replicated=Described(
            at_ends=draws.at_ends.ravel(),
            spread=draws.spread.reshape(-1, len(data.people)),
            repeated=draws.repeated.ravel(),
        ),
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
        Of each claim; all of the same shape.
    bounds : (float, float)
        Of all of them.
    effort : Effort, optional
        `SHORT` without it.

    Returns
    -------
    list of list of PeopleJudged
        Of each claim, by size; called converged, since so few draws cannot tell.
    """
    parts = side_by_side([first_people(one.studies, sizes) for one in data])
    draws = iter(rating_draws(parts, rng=rng, effort=effort or SHORT))
    return [
        [_judged(next(draws), bounds, textures=one.textures, converged=True) for _ in sizes]
        for one in data
    ]


def _judged(
    draws: Draws, bounds: Bounds, *, textures: Sequence[str], converged: bool | None = None
) -> PeopleJudged:
    table = texture_table(draws, bounds, textures=textures)
    return PeopleJudged(summary=summary_of(draws, converged=converged), textures=table)


def summary_of(draws: Draws, *, converged: bool | None = None) -> PeopleSummary:
    """A posterior in short; `converged` in place of what its draws say."""
    middle = (0.5, 0.025, 0.975)
    if converged is None:
        converged = draws.converged
    mean = np.quantile(draws.mean, [*middle, ALPHA, 1 - ALPHA]) if converged else np.full(5, np.nan)
    sd, careless = (
        np.quantile(getattr(draws, name), middle) if draws.suffices(name) else np.full(3, np.nan)
        for name in ("people_sd", "careless")
    )
    fields = (
        *("mean", "mean_low", "mean_high", "mean90_low", "mean90_high"),
        *("sd", "sd_low", "sd_high", "careless", "careless_low", "careless_high"),
    )
    values = map(float, (*mean, *sd, *careless))
    return PeopleSummary(
        **dict(zip(fields, values, strict=True)),
        lapses=float(draws.lapses.mean()) if draws.suffices("lapses") else float("nan"),
        converged=converged,
    )


def _people_table(draws: Draws, *, people: Sequence[str]) -> pd.DataFrame:
    effects = draws.effects.reshape(-1, len(people))
    middle, low, high = np.quantile(effects, [0.5, 0.025, 0.975], axis=0)
    known, told = well_sampled(draws.effects), well_sampled(draws.attends)
    careless = 1 - draws.attends.reshape(-1, len(people)).mean(axis=0)
    return pd.DataFrame(
        {
            "participant_id": list(people),
            "effect": np.where(known, middle, np.nan),
            "ci_low": np.where(known, low, np.nan),
            "ci_high": np.where(known, high, np.nan),
            "careless": np.where(told, careless, np.nan),
        }
    )


def texture_table(draws: Draws, bounds: Bounds, *, textures: Sequence[str]) -> pd.DataFrame:
    """`TEXTURE_COLUMNS` of a posterior."""
    means = draws.textures.reshape(-1, len(textures))
    low, high = np.quantile(means, [0.025, 0.975], axis=0)
    mean, sd = means.mean(axis=0), means.std(axis=0)
    beyond: Floats = np.maximum(ndtr((bounds[0] - mean) / sd), ndtr((mean - bounds[1]) / sd))
    return pd.DataFrame(
        {
            "texture": list(textures),
            "mean": np.median(means, axis=0),
            "ci_low": low,
            "ci_high": high,
            "p_difference": 2 * ndtr(-np.abs(mean) / sd),
            "p_equivalence": beyond,
        },
        columns=names(TEXTURE_COLUMNS),
    )
