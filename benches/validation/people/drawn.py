"""What a simulated study of people with known effects holds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import nan

import numpy as np
from numpy.typing import NDArray

from tactileq.modeling.arrays import Floats

Shape = tuple[int, int]  # studies, people
POINTS, SHARES = (-7.5, 7.5), (-0.1, 0.1)  # bounds of ratings, and of shares of right answers
N_TEXTURES = 7


@dataclass(frozen=True, eq=False, kw_only=True)
class DrawnStudies:
    """A batch of k simulated studies of n people, and what was planted in them.

    Parameters
    ----------
    values : (k, n, 7, 2, R) ndarray
        Ratings 0 … 100, or 1 (right) and 0 (wrong), by texture, model and repeat.
    days : (n, 7, 2, R) or (k, n, 7, 2, R) ndarray of int
        Session of each trial, 0 or 1.
    orders : (k, n, 7, 2, R) ndarray
        Position of each trial among those of a session, 0 (first) … 1 (last).
    anchors : (k, n, A) ndarray
        Ratings of anchors; A = 0 without any.
    planted : (7,) ndarray
        Mean effect of the people who attend on each texture, other − reference.
    people_sd : float
        SD of their normal effects; NaN where they are not normal.
    attends : (k, n) ndarray of bool
    """

    values: Floats
    days: NDArray[np.intp]
    orders: Floats
    anchors: Floats
    planted: Floats
    attends: NDArray[np.bool_]
    people_sd: float = nan


@dataclass(frozen=True, kw_only=True)
class World:
    """A way in which people answer; called with a generator and (studies, people), it draws them.

    Parameters
    ----------
    line : str
        What is planted.
    draw : callable
    bounds : (float, float)
        In the unit of what is planted.
    held_out : str
        Commit of the rule that was fixed before the world was written; empty of others.
    """

    line: str
    draw: Callable[[np.random.Generator, Shape], DrawnStudies]
    bounds: tuple[float, float] = POINTS
    held_out: str = ""

    @property
    def rated(self) -> bool:
        """Whether answers are ratings."""
        return self.bounds == POINTS

    def __call__(self, rng: np.random.Generator, shape: Shape) -> DrawnStudies:
        return self.draw(rng, shape)


def shuffled(rng: np.random.Generator, shape: tuple[int, ...]) -> NDArray[np.intp]:
    """Random positions 0 … N − 1 of N trials along the last axis."""
    return np.argsort(rng.random(shape), axis=-1)


def on_days(people: int, *, first: int) -> NDArray[np.intp]:
    """(n, 2) days of the models, 0 and 1; so many of 20 people begin with the reference.

    Spread over the people so that the first of them alone are as balanced.
    """
    begins = np.arange(people) * first // 20 != (np.arange(people) + 1) * first // 20
    return np.where(begins[:, None], [0, 1], [1, 0])


def on_slider(ratings: Floats) -> Floats:
    """Latent ratings as a slider stores them: in steps of 0.01, ended at 0 and 100."""
    return np.asarray(np.clip(np.round(ratings, 2), 0.0, 100.0))
