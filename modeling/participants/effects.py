"""How the effect of a model differs between people: a mixture of normal distributions.

docs/method/participants.md#effects
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from tactileq.modeling.arrays import Floats, Integers

COMPONENTS = 3


@dataclass(frozen=True, kw_only=True)
class EffectPriors:
    """Priors of the mixture of which people's effects are drawn, in the unit of the effects.

    Parameters
    ----------
    mean_sd : float
        SD of the normal prior (about 0) of the components' means.
    spread : float
        Scale of the half-normal prior of the SD of effects within a component.
    weight : float
        Parameter of the symmetric Dirichlet prior of the weights of the components.
    """

    mean_sd: float
    spread: float
    weight: float


@dataclass(frozen=True, eq=False, kw_only=True)
class EffectMixture:
    """Mixtures Σ w_k N(m_k, v²), one for each of B studies.

    Parameters
    ----------
    weights, means : (B, K) ndarray
    spread : (B,) ndarray
        v, > 0.
    """

    weights: Floats
    means: Floats
    spread: Floats

    def mean(self) -> Floats:
        """(B,) mean effect of a person."""
        found: Floats = (self.weights * self.means).sum(axis=1)
        return found

    def share_outside(self, bounds: tuple[float, float]) -> Floats:
        """(B,) share of people whose effect lies outside the bounds."""
        low, high = ((bound - self.means) / self.spread[:, None] for bound in bounds)
        outside: Floats = (self.weights * (ndtr(low) + ndtr(-high))).sum(axis=1)
        return np.clip(outside, 0.0, 1.0)


def drawn_mixture(priors: EffectPriors, studies: int, *, rng: np.random.Generator) -> EffectMixture:
    """Mixtures of B studies, drawn from their prior."""
    weights = drawn_weights(np.full((studies, COMPONENTS), priors.weight), rng)
    return EffectMixture(
        weights=weights,
        means=rng.normal(0.0, priors.mean_sd, (studies, COMPONENTS)),
        spread=np.abs(rng.normal(0.0, priors.spread, studies)),
    )


def drawn_effects(mixture: EffectMixture, people: int, *, rng: np.random.Generator) -> Floats:
    """(B, n) effects of n people of each study."""
    of = drawn_places(
        np.broadcast_to(
            mixture.weights[:, None], (*mixture.weights[:, :1].shape[:1], people, COMPONENTS)
        ),
        rng,
    )
    means = np.take_along_axis(mixture.means, of, axis=1)
    return means + mixture.spread[:, None] * rng.standard_normal(of.shape)


def drawn_weights(parameters: Floats, rng: np.random.Generator) -> Floats:
    """Dirichlet draws along the last axis."""
    gammas = rng.standard_gamma(parameters) + 1e-300
    shares: Floats = gammas / gammas.sum(axis=-1, keepdims=True)
    return shares


def drawn_places(weights: Floats, rng: np.random.Generator) -> Integers:
    """One index along the last axis for each row, drawn with these weights (any positive sum)."""
    total = np.cumsum(weights, axis=-1)
    at = rng.random(total.shape[:-1]) * total[..., -1]
    places: Integers = (total[..., :-1] <= at[..., None]).sum(axis=-1)
    return places
