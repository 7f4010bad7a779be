"""Gibbs steps for the mixture of people's effects, many studies at once.

docs/method/participants.md#effects
"""

from __future__ import annotations

import numpy as np

from tactileq.modeling.arrays import Bools, Floats, Integers
from tactileq.modeling.participants.effects import (
    COMPONENTS,
    EffectMixture,
    EffectPriors,
    drawn_mixture,
    drawn_places,
    drawn_weights,
)

_SPREADS = 24  # places on the grid of the SD within a component
_NOTHING = 1e-300
_HIGHEST_SPREAD = 4.0  # the grid ends there, in scales of the prior


class MixtureOfEffects:
    """The mixture of each study, its components' people, and their effects.

    Effects are integrated out while components, weights, spread and means are drawn, so that
    chains do not stick where the spread is small.

    Parameters
    ----------
    studies : int
        B.
    """

    def __init__(self, priors: EffectPriors, studies: int, *, rng: np.random.Generator) -> None:
        self._priors, self._rng = priors, rng
        start = drawn_mixture(priors, studies, rng=rng)
        self.weights, self.means = start.weights, start.means
        places = (np.arange(_SPREADS) + 0.5) / _SPREADS
        self._grid = priors.spread * _HIGHEST_SPREAD * places**2
        # Prior density times the width of a cell of the grid, whose root is uniform.
        self._log_prior = -0.5 * (self._grid / priors.spread) ** 2 + np.log(places)
        self._index = np.full(studies, _SPREADS // 2)
        self.places: Integers = np.zeros((studies, 1), dtype=np.intp)

    def draw(self, estimates: Floats, variances: Floats, who: Bools) -> Floats:
        """One step, given what each person's answers alone tell about their effect.

        Parameters
        ----------
        estimates, variances : (B, n) ndarray
            Normal likelihood of each person's effect.
        who : (B, n) ndarray of bool
            People whose answers tell about effects; the others' are drawn from the mixture.

        Returns
        -------
        (B, n) ndarray
            Effects.
        """
        rng, own = self._rng, variances + self.spread[:, None] ** 2
        distance = (estimates[..., None] - self.means[:, None]) ** 2 / own[..., None]
        log = -0.5 * (distance - distance.min(axis=-1, keepdims=True))
        likely = np.where(who[..., None], np.exp(log), 1.0)
        places = drawn_places(likely * self.weights[:, None], rng)
        members = (places[..., None] == np.arange(COMPONENTS)) & who[..., None]
        self.weights = drawn_weights(self._priors.weight + members.sum(axis=1), rng)
        # The others have no part in the new weights, and so are placed by these, not the old ones.
        anew = np.broadcast_to(self.weights[:, None], members.shape)
        self.places = places = np.where(who, places, drawn_places(anew, rng))
        at = np.take_along_axis(self.means, places, axis=1)
        self._index = self._drawn_spread((estimates - at) ** 2, variances, who)
        own = variances + self.spread[:, None] ** 2
        precision = np.where(members, 1 / own[..., None], 0.0)
        total = 1 / self._priors.mean_sd**2 + precision.sum(axis=1)
        middle = (precision * estimates[..., None]).sum(axis=1) / total
        self.means = middle + rng.standard_normal(middle.shape) / np.sqrt(total)
        at = np.take_along_axis(self.means, places, axis=1)
        kept = np.where(who, self.spread[:, None] ** 2 / own, 0.0)
        sd = self.spread[:, None] * np.sqrt(1 - kept)
        effects: Floats = at + kept * (estimates - at) + sd * rng.standard_normal(at.shape)
        return effects

    @property
    def spread(self) -> Floats:
        """(B,) SD of the effects within a component."""
        return np.asarray(self._grid[self._index])

    def _drawn_spread(self, squares: Floats, variances: Floats, who: Bools) -> Integers:
        own = variances[..., None] + self._grid**2
        each = np.log(own) + squares[..., None] / own
        log = self._log_prior - 0.5 * np.einsum("bng,bn->bg", each, who.astype(float))
        log -= log.max(axis=1, keepdims=True)
        return drawn_places(np.exp(log), self._rng)

    def rescaled(self, effects: Floats) -> tuple[Floats, Integers, Floats]:
        """A proposal: another spread, with the effects moved along.

        Returns
        -------
        (B, n) ndarray, (B,) ndarray of int, (B,) ndarray
            Effects, the spread's place, and the log ratio of prior densities.
        """
        steps = self._rng.integers(1, 5, self._index.shape)
        steps *= self._rng.choice((-1, 1), self._index.shape)
        new = self._index + steps
        inside = (new >= 0) & (new < _SPREADS)
        new = np.where(inside, new, self._index)
        at = np.take_along_axis(self.means, self.places, axis=1)
        ratio = (self._grid[new] / self.spread)[:, None]
        log = np.where(inside, self._log_prior[new] - self._log_prior[self._index], -np.inf)
        return at + ratio * (effects - at), new, log

    def take_spread(self, accepted: Bools, places: Integers) -> None:
        """Keep proposed spreads where they were accepted."""
        self._index = np.where(accepted, places, self._index)

    @property
    def mixture(self) -> EffectMixture:
        """As it is now."""
        return EffectMixture(weights=self.weights, means=self.means, spread=self.spread)


def vague_mean(
    estimates: Floats, variances: Floats, who: Bools, *, widest: float, rng: np.random.Generator
) -> Floats:
    """(B,) draws of the mean effect of a normal population with flat priors of mean and SD.

    Beside the mixture, whose prior, informative about people, would narrow the interval of the
    mean (docs/method/participants.md#mean).

    Parameters
    ----------
    estimates, variances : (B, n) ndarray
        As in `MixtureOfEffects.draw`.
    who : (B, n) ndarray of bool
    widest : float
        The SD of people is flat between 0 and this.
    """
    places = (np.arange(_SPREADS) + 0.5) / _SPREADS
    grid = widest * places**2
    weights = who[..., None] / (variances[..., None] + grid**2)
    total = weights.sum(axis=1) + _NOTHING
    middle = (weights * estimates[..., None]).sum(axis=1) / total
    rest = (weights * (estimates[..., None] - middle[:, None]) ** 2).sum(axis=1)
    log = np.where(who[..., None], np.log(weights + _NOTHING), 0.0).sum(axis=1)
    log = np.log(places) + 0.5 * (log - np.log(total) - rest)
    at = drawn_places(np.exp(log - log.max(axis=1, keepdims=True)), rng)[:, None]
    mean, precision = (np.take_along_axis(one, at, axis=1)[:, 0] for one in (middle, total))
    found: Floats = mean + rng.standard_normal(mean.shape) / np.sqrt(precision)
    return found
