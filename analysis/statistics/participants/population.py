"""Gibbs steps for a normal population of effects and for an SD, many studies at once.

Why a grid: an SD near 0 and the effects that it spreads stick to each other when one is drawn given
the other, so that effects are integrated out while it is drawn.
docs/method/participants.md#effects
"""

from __future__ import annotations

import numpy as np

from tactileq.modeling.arrays import Bools, Floats

_PLACES = 48  # of the grid of an SD
_WINDOW = 12  # neighbouring places that are looked at in one step
_HIGHEST = 4.0  # end of the grid, in scales of the prior
_NONE = 1e-3  # an SD that is none


class GridSd:
    """An SD of each of B studies, half-normal a priori, on a grid whose root is even.

    A step looks at a window of neighbouring places, laid at random around the last one, so that it
    costs a fraction of the whole grid.
    """

    def __init__(self, scale: float, studies: int, *, rng: np.random.Generator) -> None:
        self._rng = rng
        places = (np.arange(_PLACES) + 0.5) / _PLACES
        self._grid = scale * _HIGHEST * places**2
        # The prior density times the width of a place.
        self._log_prior = -0.5 * (self._grid / scale) ** 2 + np.log(places)
        self._at = rng.integers(0, _PLACES, studies)
        self._free: Bools = np.ones(studies, dtype=bool)
        self._near = np.zeros((studies, _WINDOW), dtype=np.intp)

    def hold(self, where: Bools) -> None:
        """No SD in these studies of B, from now on."""
        self._free = ~where

    @property
    def now(self) -> Floats:
        """(B,)."""
        return np.where(self._free, self._grid[self._at], _NONE)

    def window(self) -> Floats:
        """(B, places) values between which the next `choose` chooses."""
        first = self._at - self._rng.integers(0, _WINDOW, self._at.shape)
        self._near = first[:, None] + np.arange(_WINDOW)
        found: Floats = self._grid[np.clip(self._near, 0, _PLACES - 1)]
        return found

    def choose(self, log_likelihood: Floats) -> None:
        """Draw one of the window's values, given their log likelihoods (B, places)."""
        exists = (self._near >= 0) & (self._near < _PLACES)
        log = log_likelihood + self._log_prior[np.clip(self._near, 0, _PLACES - 1)]
        log = np.where(exists, log, -np.inf)
        total = np.cumsum(np.exp(log - log.max(axis=1, keepdims=True)), axis=1)
        at = self._rng.random(len(total)) * total[:, -1]
        place = (total[:, :-1] <= at[:, None]).sum(axis=1)
        self._at = np.take_along_axis(self._near, place[:, None], axis=1)[:, 0]


class NormalPopulation:
    """Mean and SD of a normal population of effects, one for each of B studies.

    Parameters
    ----------
    mean_sd : float
        SD of the normal prior of the mean, about 0.
    sd : float
        Scale of the half-normal prior of the SD.
    """

    def __init__(
        self, mean_sd: float, sd: float, studies: int, *, rng: np.random.Generator
    ) -> None:
        self._rng, self._known = rng, mean_sd**-2
        self._sd = GridSd(sd, studies, rng=rng)
        self.mean: Floats = np.zeros(studies)

    @property
    def sd(self) -> Floats:
        """(B,) SD between people."""
        return self._sd.now

    def draw(self, total: Floats, precision: Floats) -> Floats:
        """SD, mean, and then every effect.

        Parameters
        ----------
        total, precision : (B, n) ndarray
            Of the normal likelihood of each person's effect: its precision, 0 where nothing is
            known, and the estimate times it.

        Returns
        -------
        (B, n) ndarray
        """
        rng, variance = self._rng, self._sd.window()[:, None] ** 2
        one, own = total[..., None], precision[..., None]
        grown = 1 + own * variance
        weights = (own / grown).sum(axis=1) + self._known
        sums = (one / grown).sum(axis=1)
        log = sums**2 / weights - np.log(weights)
        log += (one**2 * variance / grown - np.log(grown)).sum(axis=1)
        self._sd.choose(0.5 * log)
        variance = self.sd[:, None] ** 2
        grown = 1 + precision * variance
        weights = (precision / grown).sum(axis=1) + self._known
        middle = (total / grown).sum(axis=1) / weights
        self.mean = middle + rng.standard_normal(middle.shape) / np.sqrt(weights)
        middle = (self.mean[:, None] + variance * total) / grown
        found: Floats = middle + np.sqrt(variance / grown) * rng.standard_normal(middle.shape)
        return found
