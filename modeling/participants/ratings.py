"""How a participant comes to a rating: the one definition for simulation, planning and verdicts.

docs/method/participants.md#ratings
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tactileq.modeling.arrays import Bools, Floats
from tactileq.modeling.files.answer_tables import ENDS

LOWEST, HIGHEST = ENDS
AT_END = 0.02  # chance that a lapsed rating lies at the lower end, and at the upper one
WITHIN = (1 - 2 * AT_END) / (HIGHEST - LOWEST)  # density of a lapsed rating between the ends


@dataclass(frozen=True, kw_only=True)
class RatingPriors:
    """Priors of the participants' ratings, in points of the scale.

    docs/method/participants.md#priors

    Parameters
    ----------
    mean_sd : float
        SD of the mean effect of the other model, about 0.
    people_sd, interaction_sd : float
        Scales of the half-normal priors of the SD of people's effects, and of that of their
        deviations on single textures.
    level : (float, float)
        Mean and SD of the mean level of ratings.
    person_sd, cell_sd, anchor_sd : float
        Typical SD of people's levels, of a person's own level for a texture, and of people's
        ratings of an anchor; variances are inverse gamma with shape 2 and mean sd².
    texture_sd, texture_effect_sd : float
        SD of the textures' levels, and of the textures' deviations from the mean effect.
    anchor : (float, float)
        Mean and SD of the difference of an anchor's rating from a person's level.
    trend_sd : float
        SD of the effect of a day, and of the change from the first to the last trial.
    rating_sd : float
        Typical SD of a person's ratings; the square has a gamma prior of shape 2 with mean sd².
    rating_df : float
        How alike people are in it: degrees of freedom of the inverse χ² of their variances.
    careless_scale : float
        Of the inverse gamma (shape 1) of the variance of a careless person's ratings, points².
    lapses, careless : (float, float)
        Beta priors of the share of lapsed trials and of careless people.
    """

    mean_sd: float = 25.0
    people_sd: float = 10.0
    interaction_sd: float = 10.0
    level: tuple[float, float] = (60.0, 20.0)
    person_sd: float = 10.0
    cell_sd: float = 5.0
    anchor_sd: float = 12.0
    texture_sd: float = 15.0
    texture_effect_sd: float = 20.0
    anchor: tuple[float, float] = (-25.0, 20.0)
    trend_sd: float = 15.0
    rating_sd: float = 9.0
    rating_df: float = 10.0
    careless_scale: float = 60.0
    lapses: tuple[float, float] = (1.0, 19.0)
    careless: tuple[float, float] = (1.0, 14.0)

    def doubled(self) -> RatingPriors:
        """The same with every SD of a prior twice as large, and careless people twice as likely."""
        wide = replace(
            self,
            level=(self.level[0], 2 * self.level[1]),
            anchor=(self.anchor[0], 2 * self.anchor[1]),
            lapses=(self.lapses[0], self.lapses[1] / 2),
            careless=(self.careless[0], self.careless[1] / 2),
        )
        names = [name for name in vars(self) if name.endswith("_sd")]
        return replace(wide, **{name: 2 * getattr(self, name) for name in names})


def censored(latent: Floats) -> Floats:
    """Ratings of latent judgements: nothing beyond an end of the scale can be given.

    Parameters
    ----------
    latent : ndarray
        Points; any.
    """
    return np.clip(latent, LOWEST, HIGHEST)


def lapsed_ratings(rng: np.random.Generator, shape: tuple[int, ...]) -> Floats:
    """Ratings of lapsed trials: anywhere on the scale, whatever was presented."""
    return censored(rng.uniform(LOWEST - AT_END / WITHIN, HIGHEST + AT_END / WITHIN, shape))


def careless_sds(
    priors: RatingPriors, shape: tuple[int, ...], *, rng: np.random.Generator
) -> Floats:
    """SDs of the ratings of careless people, who rate near a level of their own.

    The variance is inverse gamma, of shape 1 and scale `careless_scale`: some move the slider
    hardly at all, some over the whole scale.
    """
    return np.sqrt(priors.careless_scale / rng.standard_gamma(1.0, shape))


@dataclass(frozen=True, eq=False, kw_only=True)
class RatingStudies:
    """Ratings of B studies with n people, T textures, two models, R repeats and A anchors.

    Parameters
    ----------
    values : (B, n, T, 2, R) ndarray
        0 … 100, the reference first; NaN where nothing was rated.
    anchors : (B, n, A) ndarray
        Ratings of anchors, likewise.
    trends : (C, B, n, T, 2, R) ndarray
        What changes in the course of a study: session and place of the trial in it, −½ … ½ each;
        0 where it does not vary.
    """

    values: Floats
    anchors: Floats
    trends: Floats


@dataclass(frozen=True, eq=False, kw_only=True)
class DrawnRatings:
    """Studies drawn from the priors, and what they were drawn from.

    Parameters
    ----------
    mean, people_sd, interaction_sd : (B,) ndarray
        Mean effect; SDs of people's effects and of their deviations on single textures.
    effects, texture_effects : (B, n) and (B, T) ndarray
        Of each person, if they attend; of each texture beyond the mean effect.
    careless : (B, n) ndarray of bool
    lapses, rating_sd : (B,) ndarray
        Share of lapsed trials; typical SD of a person's ratings.
    """

    studies: RatingStudies
    mean: Floats
    people_sd: Floats
    interaction_sd: Floats
    effects: Floats
    texture_effects: Floats
    careless: Bools
    lapses: Floats
    rating_sd: Floats


def centred(values: Floats) -> Floats:
    """Values without their mean over the last axis."""
    found: Floats = values - values.mean(axis=-1, keepdims=True)
    return found


def drawn_ratings(
    priors: RatingPriors,
    *,
    trends: Floats,
    anchors: int,
    rng: np.random.Generator,
) -> DrawnRatings:
    """Studies whose parameters are drawn from the priors: what simulation-based calibration needs.

    Parameters
    ----------
    trends : (C, B, n, T, 2, R) ndarray
        The design.
    anchors : int
        A ≥ 0.
    """
    studies, people, textures, _, repeats = trends.shape[1:]
    few, each = (studies, people), (studies, people, textures)

    def sd(typical: float) -> Floats:
        return np.asarray(np.sqrt(typical**2 / rng.standard_gamma(2.0, studies)))

    mean = np.asarray(rng.normal(0.0, priors.mean_sd, studies), dtype=float)
    of_people = np.abs(rng.normal(0.0, priors.people_sd, studies))
    of_deviations = np.abs(rng.normal(0.0, priors.interaction_sd * (repeats > 1), studies))
    person = np.asarray(rng.normal(*priors.level, studies))[:, None]
    person = person + sd(priors.person_sd)[:, None] * rng.standard_normal(few)
    texture = priors.texture_sd * centred(rng.standard_normal((studies, textures)))
    own = priors.texture_effect_sd * centred(rng.standard_normal((studies, textures)))
    cell = sd(priors.cell_sd)[:, None, None] * rng.standard_normal(each)
    slopes = rng.normal(0.0, priors.trend_sd, (len(trends), studies))
    anchor = rng.normal(*priors.anchor, (studies, 1, anchors))
    anchor = anchor + sd(priors.anchor_sd)[:, None, None] * rng.standard_normal((*few, anchors))
    careless = rng.random(few) < np.asarray(rng.beta(*priors.careless, studies))[:, None]
    lapses = np.asarray(rng.beta(*priors.lapses, studies), dtype=float)
    typical = priors.rating_sd * np.sqrt(rng.standard_gamma(2.0, studies) / 2)
    half = priors.rating_df / 2
    variance = half * typical[:, None] ** 2 / rng.standard_gamma(half, few)
    rating_sd = np.where(careless, careless_sds(priors, few, rng=rng), np.sqrt(variance))
    attends = ~careless
    effects = mean[:, None] + of_people[:, None] * rng.standard_normal(few)
    deviations = of_deviations[:, None, None] * rng.standard_normal(each)
    effect = effects[..., None] + own[:, None] + deviations
    felt = person[..., None] + cell + attends[..., None] * texture[:, None]
    halves = np.array([-0.5, 0.5])
    middle = (felt[..., None] + halves * (attends[..., None] * effect)[..., None])[
        ..., None
    ] + np.einsum("cb,cb...->b...", slopes, trends)
    latent = middle + rating_sd[..., None, None, None] * rng.standard_normal(middle.shape)
    of_anchors = person[..., None] + attends[..., None] * anchor
    of_anchors = of_anchors + rating_sd[..., None] * rng.standard_normal(of_anchors.shape)
    answered = []
    for one in (latent, of_anchors):
        lapsed = rng.random(one.shape) < lapses.reshape(-1, *(1,) * (one.ndim - 1))
        answered.append(np.where(lapsed, lapsed_ratings(rng, one.shape), censored(one)))
    return DrawnRatings(
        studies=RatingStudies(values=answered[0], anchors=answered[1], trends=trends),
        mean=mean,
        people_sd=of_people,
        interaction_sd=of_deviations,
        effects=effects,
        texture_effects=own,
        careless=careless,
        lapses=lapses,
        rating_sd=typical,
    )
