"""What ratings tell about people: draws from the posterior, and whether they suffice.

docs/method/participants.md#sampler
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tactileq.analysis.statistics.participants.design import changed
from tactileq.analysis.statistics.participants.ratings import RatingSampler
from tactileq.modeling.arrays import Bools, Floats
from tactileq.modeling.files.answer_tables import ENDS
from tactileq.modeling.participants.ratings import RatingPriors, RatingStudies

HIGHEST_R_HAT, FEWEST_EFFECTIVE = 1.05, 400.0
MOST_APART = 0.2  # of the people, by which chains may differ in how many attend
VERDICT = ("mean", "textures")  # what verdicts rest on
PRINTED = (*VERDICT, "people_sd", "effects", "careless")


@dataclass(frozen=True, kw_only=True)
class Effort:
    """How long posteriors are sampled.

    Parameters
    ----------
    chains, warm_up, steps, every : int
        Chains; steps before, and after, which draws count; every so many of these one is kept.
    """

    chains: int = 8
    warm_up: int = 200
    steps: int = 400
    every: int = 2


LONGER = Effort(warm_up=800, steps=2400, every=6)  # where `Effort()` does not suffice
LONGEST = Effort(warm_up=2400, steps=9600, every=24)  # where no verdict could rest on that either


@dataclass(frozen=True, eq=False, kw_only=True)
class Draws:
    """Draws from the posterior of one study; all of shape (chains, S) and more.

    Parameters
    ----------
    mean : (chains, S) ndarray
        Mean effect of people who attend, in points.
    textures : (chains, S, T) ndarray
        The same on each texture.
    people_sd : (chains, S) ndarray
        SD of people's effects.
    effects : (chains, S, n) ndarray
        Of each participant, if they attend.
    attends : (chains, S, n) ndarray of bool
    careless, lapses : (chains, S) ndarray
        Shares of careless people and of lapsed trials.
    at_ends, spread, repeated : (chains, S) and (chains, S, n) ndarray
        Of ratings as the same people could give them (posterior predictive): `Described`.
    """

    mean: Floats
    textures: Floats
    people_sd: Floats
    effects: Floats
    attends: Bools
    careless: Floats
    lapses: Floats
    at_ends: Floats
    spread: Floats
    repeated: Floats

    @property
    def converged(self) -> bool:
        """Whether verdicts may rest on it: `VERDICT`, and chains that agree how many attend."""
        attending = self.attends.mean(axis=(1, 2))
        return self.suffices(*VERDICT) and bool(np.ptp(attending) <= MOST_APART)

    def suffices(self, *names: str) -> bool:
        """Whether these quantities are sampled well enough to be printed."""
        return all(well_sampled(getattr(self, name)).all() for name in names)


@dataclass(frozen=True, eq=False, kw_only=True)
class Described:
    """What a posterior predictive check compares, of B studies of ratings.

    Parameters
    ----------
    at_ends : (B,) ndarray
        Share of ratings at an end of the scale.
    spread : (B, n) ndarray
        SD of each person's ratings; NaN below two ratings.
    repeated : (B,) ndarray
        Root mean square of the SD of repeats of one texture and model; NaN without repeats.
    """

    at_ends: Floats
    spread: Floats
    repeated: Floats


def described(values: Floats) -> Described:
    """Of (B, n, T, 2, R) ratings, NaN where none was given."""
    given = np.isfinite(values)
    at_ends = (given & np.isin(values, ENDS)).sum(axis=(1, 2, 3, 4)) / given.sum(axis=(1, 2, 3, 4))
    _, of_people = _variance(values.reshape(*values.shape[:2], -1))
    freedom, of_cells = _variance(values)
    freedom = np.where(freedom > 0, freedom, 0)
    weighted = (freedom * np.where(freedom > 0, of_cells, 0.0)).sum(axis=(1, 2, 3))
    count = freedom.sum(axis=(1, 2, 3))
    return Described(
        at_ends=at_ends,
        spread=np.sqrt(of_people),
        repeated=np.sqrt(np.where(count > 0, weighted / np.maximum(count, 1), np.nan)),
    )


def _variance(values: Floats) -> tuple[Floats, Floats]:
    """Degrees of freedom and variance over the last axis, of what is not NaN."""
    given = np.isfinite(values)
    count, filled = given.sum(axis=-1), np.where(given, values, 0.0)
    mean = filled.sum(axis=-1) / np.maximum(count, 1)
    squares = np.where(given, (values - mean[..., None]) ** 2, 0.0).sum(axis=-1)
    return count - 1, np.where(count > 1, squares / np.maximum(count - 1, 1), np.nan)


def rating_draws(
    studies: RatingStudies,
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
    """
    effort, count = effort or Effort(), len(studies.values)
    chains = changed(studies, lambda one, axis: np.repeat(one, effort.chains, axis=axis))
    sampler = RatingSampler(chains, priors or RatingPriors(), rng=rng)
    for step in range(effort.warm_up):
        sampler.step(all_attend=step < effort.warm_up // 2)
    kept: list[Mapping[str, Any]] = []
    for step in range(effort.steps):
        sampler.step()
        if step % effort.every == 0:
            kept.append(_observed(sampler))
    found = {name: np.stack([one[name] for one in kept], axis=1) for name in kept[0]}
    parts = {name: np.split(one, count) for name, one in found.items()}
    return [Draws(**{name: part[k] for name, part in parts.items()}) for k in range(count)]


def sufficient_draws(
    studies: RatingStudies, *, rng: np.random.Generator, priors: RatingPriors | None = None
) -> list[Draws]:
    """As `rating_draws`, with `LONGER` or `LONGEST` effort of those studies that need it."""
    found = rating_draws(studies, rng=rng, priors=priors)
    for effort, wanted in ((LONGER, PRINTED), (LONGEST, VERDICT)):
        short = [
            place
            for place, draws in enumerate(found)
            if not (draws.converged and draws.suffices(*wanted))
        ]
        if not short:
            break
        again = rating_draws(_some(studies, short), rng=rng, priors=priors, effort=effort)
        for place, draws in zip(short, again, strict=True):
            found[place] = draws
    return found


def _some(studies: RatingStudies, places: Sequence[int]) -> RatingStudies:
    return changed(studies, lambda one, axis: np.take(one, places, axis=axis))


def _observed(sampler: RatingSampler) -> Mapping[str, Any]:
    mean = sampler.population.mean
    return {
        "mean": mean,
        "textures": mean[:, None] + sampler.texture_effects,
        "people_sd": sampler.population.sd,
        "effects": sampler.effects,
        "attends": sampler.attends,
        "careless": sampler.careless,
        "lapses": sampler.lapses,
        **vars(described(sampler.replicated())),
    }


def r_hat(draws: Floats) -> Floats:
    """Split R̂ of (chains, S, …) draws: about 1 where the halves of all chains agree.

    Gelman et al. (2013), *Bayesian Data Analysis*, 3rd ed., section 11.4; 1 where nothing varies.
    """
    parts = _halves(draws)
    length = parts.shape[1]
    within, between = parts.var(axis=1, ddof=1).mean(axis=0), parts.mean(axis=1).var(axis=0, ddof=1)
    varies = within > 0
    ratio = np.where(varies, between / np.where(varies, within, 1.0), np.inf)
    return np.where(between > 0, np.sqrt((length - 1) / length + ratio), 1.0)


def effective_draws(draws: Floats) -> Floats:
    """How many independent draws tell as much about the mean of (chains, S, …) draws.

    Gelman et al. (2013), section 11.5, with the pairs of autocorrelations summed while they are
    positive and fall (Geyer 1992); all where nothing varies.
    """
    parts = _halves(draws)
    chains, length = parts.shape[:2]
    away = parts - parts.mean(axis=1, keepdims=True)
    spectrum = np.abs(np.fft.rfft(away, n=2 * length, axis=1)) ** 2
    lagged = np.fft.irfft(spectrum, axis=1)[:, :length].mean(axis=0) / length
    within = lagged[0] * length / (length - 1)
    total = lagged[0] + parts.mean(axis=1).var(axis=0, ddof=1)
    safe = np.where(total > 0, total, 1.0)
    correlations = np.where(total > 0, 1 - (within - lagged) / safe, 0.0)
    even = length - length % 2
    pairs = correlations[0:even:2] + correlations[1:even:2]
    pairs = np.minimum.accumulate(np.where(np.minimum.accumulate(pairs) > 0, pairs, 0.0), axis=0)
    count = chains * length
    found: Floats = np.where(total > 0, count / np.maximum(2 * pairs.sum(axis=0) - 1, 0.2), count)
    return found


def _halves(draws: Floats) -> Floats:
    half = draws.shape[1] // 2
    return np.concatenate([draws[:, :half], draws[:, half : 2 * half]])


def well_sampled(draws: Floats | Bools) -> Bools:
    """Which quantities of (chains, S, …) draws may be printed: `HIGHEST_R_HAT`, `FEWEST_…`."""
    values = draws.astype(float)
    enough = (r_hat(values) <= HIGHEST_R_HAT) & (effective_draws(values) >= FEWEST_EFFECTIVE)
    return np.asarray(enough)
