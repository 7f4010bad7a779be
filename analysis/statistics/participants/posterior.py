"""What answers tell about people: the mean effect, and the share of people who feel it.

docs/method/participants.md
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

import numpy as np

from tactileq.analysis.statistics.participants.choices import ChoiceSampler
from tactileq.analysis.statistics.participants.design import axis_of_studies
from tactileq.analysis.statistics.participants.ratings import RatingSampler
from tactileq.modeling.arrays import Bools, Floats
from tactileq.modeling.participants.choices import ChoicePriors, ChoiceStudies, DecisionModel
from tactileq.modeling.participants.ratings import RatingPriors, RatingStudies

UNSEEN = 0.5  # of the Jeffreys prior of a share of people
Bounds = tuple[float, float]
Studies = TypeVar("Studies", RatingStudies, ChoiceStudies)


@dataclass(frozen=True, kw_only=True)
class Effort:
    """How long posteriors are sampled.

    Parameters
    ----------
    chains, warm_up, steps, every : int
        Chains; steps before, and after, which draws count; every so many of these one is kept.
    """

    chains: int = 8
    warm_up: int = 300
    steps: int = 600
    every: int = 4


@dataclass(frozen=True, eq=False, kw_only=True)
class Draws:
    """Draws from the posterior of one study.

    Parameters
    ----------
    mean : (chains, S) ndarray
        Mean effect of people who attend.
    textures : (chains, S, T) ndarray
        The same on each texture.
    effects : (chains, S, n) ndarray
        Of each participant.
    attends : (chains, S, n) ndarray of bool
    outside : (chains, S) ndarray of int
        Attending participants whose effect lies outside the bounds.
    share : (chains, S) ndarray
        Share of people like these, attending, whose effect does.
    lapses : (chains, S) ndarray
        Share of lapsed trials.
    """

    mean: Floats
    textures: Floats
    effects: Floats
    attends: Bools
    outside: Floats
    share: Floats
    lapses: Floats


class _Sampler(Protocol):
    people: Bools
    attends: Bools
    lapses: Floats

    def step(self) -> None: ...

    def settle(self) -> None: ...

    def person_effects(self) -> Floats: ...

    def mean_effects(self) -> tuple[Floats, Floats]: ...


def rating_draws(
    studies: RatingStudies,
    bounds: Bounds,
    *,
    rng: np.random.Generator,
    priors: RatingPriors | None = None,
    effort: Effort | None = None,
) -> list[Draws]:
    """The posterior of each of S studies of ratings; all are sampled side by side.

    Parameters
    ----------
    studies : RatingStudies
        Smaller studies filled up with missing answers.
    bounds : (float, float)
        In points.
    """
    effort = effort or Effort()
    tiled = _tiled(studies, effort.chains)
    sampler = RatingSampler(tiled, priors or RatingPriors(), rng=rng)
    return _drawn(sampler, bounds, effort, studies=len(studies.values), rng=rng)


def choice_draws(
    studies: ChoiceStudies,
    model: DecisionModel,
    bounds: Bounds,
    *,
    rng: np.random.Generator,
    priors: ChoicePriors | None = None,
    effort: Effort | None = None,
) -> list[Draws]:
    """The posterior of each of S studies of right answers, as `rating_draws`.

    Bounds and effects are shares of right answers; `model` is that of the task.
    """
    effort = effort or Effort()
    tiled = _tiled(studies, effort.chains)
    sampler = ChoiceSampler(tiled, model, priors or ChoicePriors.of(model), rng=rng)
    return _drawn(sampler, bounds, effort, studies=len(studies.right), rng=rng)


def _tiled(studies: Studies, chains: int) -> Studies:
    """Each study once for every chain, chains of a study beside each other."""
    repeated = {
        name: np.repeat(values, chains, axis=axis_of_studies(name))
        for name, values in vars(studies).items()
    }
    return type(studies)(**repeated)


def _drawn(
    sampler: _Sampler,
    bounds: Bounds,
    effort: Effort,
    *,
    studies: int,
    rng: np.random.Generator,
) -> list[Draws]:
    for _ in range(effort.warm_up):
        sampler.step()
    sampler.settle()
    kept: list[dict[str, Any]] = []
    for step in range(effort.steps):
        sampler.step()
        if step % effort.every == 0:
            kept.append(_observed(sampler, bounds, rng))
    found = {name: np.stack([one[name] for one in kept], axis=1) for name in kept[0]}
    parts = {name: np.split(one, studies) for name, one in found.items()}
    return [Draws(**{name: part[k] for name, part in parts.items()}) for k in range(studies)]


def _observed(sampler: _Sampler, bounds: Bounds, rng: np.random.Generator) -> dict[str, Any]:
    mean, textures = sampler.mean_effects()
    effects, who = sampler.person_effects(), sampler.attends & sampler.people
    outside = (((effects < bounds[0]) | (effects > bounds[1])) & who).sum(axis=1)
    return {
        "mean": mean,
        "textures": textures,
        "effects": effects,
        "attends": sampler.attends,
        "outside": outside,
        "share": rng.beta(outside + UNSEEN, who.sum(axis=1) - outside + UNSEEN),
        "lapses": sampler.lapses,
    }


def r_hat(draws: Floats) -> float:
    """Split R̂ of (chains, S) draws: about 1 where the halves of all chains agree.

    Gelman et al. (2013), *Bayesian Data Analysis*, 3rd ed., section 11.4; 1 where nothing varies.
    """
    half = draws.shape[1] // 2
    parts = np.concatenate([draws[:, :half], draws[:, half : 2 * half]]).astype(float)
    within, between = parts.var(axis=1, ddof=1).mean(), parts.mean(axis=1).var(ddof=1)
    if within == 0:
        return 1.0 if between == 0 else float("inf")
    return float(np.sqrt((half - 1) / half + between / within))
