"""What a simulated study of people with known effects holds.

`validation_people` lists the ways in which these people answer.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tactileq.modeling.arrays import Floats

Shape = tuple[int, int]  # studies, people

RATING_KIND, CHOICE_KIND, ODDITY_KIND = "ratings", "choice", "oddity"
BOUNDS: Mapping[str, tuple[float, float]] = {
    RATING_KIND: (-7.5, 7.5),  # points
    CHOICE_KIND: (-0.1, 0.1),  # shares of right answers
    ODDITY_KIND: (-0.1, 0.1),
}
N_TEXTURES = 7


@dataclass(frozen=True)
class DrawnStudies:
    """A batch of k simulated studies of n people, and what was planted in them.

    Attributes
    ----------
    values : ndarray, shape (k, n, 7, M, R)
        Ratings 0 … 100, or 1 (right) and 0 (wrong), by texture, model and repeat. M = 2
        (reference, other) for ratings and choice; M = 1 for oddity, whose trials hold both models.
    checks : ndarray, shape (k, n, C)
        Ratings of anchors, or right and wrong answers in catch trials; C = 0 without either.
    days : ndarray of int, shape (k, n, 7, M, R)
        Session of each trial, 0 or 1.
    orders : ndarray, shape (k, n, 7, M, R)
        Position of each trial within its session, 0 (first) … 1 (last).
    effects : ndarray, shape (k, n)
        Each person's own planted effect, in the unit of `mean`; NaN for who does not attend.
    mean : float
        Mean effect of the population that attends: latent points (ratings) or share of right
        answers in attended trials (choice: other − reference; oddity: − chance). NaN where nobody
        attends.
    outside : float
        Share of the population that attends whose own effect lies outside the bounds.
    """

    values: Floats
    checks: Floats
    days: NDArray[np.intp]
    orders: Floats
    effects: Floats
    mean: float
    outside: float


Draw = Callable[[np.random.Generator, Shape], DrawnStudies]


@dataclass(frozen=True)
class Situation:
    """A way in which people answer; called with a generator and (studies, people), it draws them.

    Attributes
    ----------
    kind : str
        `RATING_KIND`, `CHOICE_KIND` or `ODDITY_KIND`.
    line : str
        What is planted.
    draw : callable
    """

    kind: str
    line: str
    draw: Draw

    @property
    def bounds(self) -> tuple[float, float]:
        """Outside of these an effect matters, in the unit of `DrawnStudies.mean`."""
        return BOUNDS[self.kind]

    def __call__(self, rng: np.random.Generator, shape: Shape) -> DrawnStudies:
        return self.draw(rng, shape)


def shuffled(rng: np.random.Generator, shape: tuple[int, ...]) -> NDArray[np.intp]:
    """Random positions 0 … N − 1 of N trials along the last axis."""
    return np.argsort(rng.random(shape), axis=-1)


def counterbalanced(cells: tuple[int, ...]) -> NDArray[np.intp]:
    """Days of trials (k, n, 7, 2, R): every other person begins with the other model."""
    person = np.arange(cells[1])[:, None, None, None]
    model = np.arange(2)[:, None]
    return np.array(np.broadcast_to((person + model) % 2, cells), dtype=np.intp)


def on_slider(ratings: Floats) -> Floats:
    """Latent ratings as a slider stores them: in steps of 0.01, ended at 0 and 100."""
    return np.asarray(np.clip(np.round(ratings, 2), 0.0, 100.0))


def normal_quantiles(count: int) -> Floats:
    """Standard normal quantiles of `count` equal shares of people, at their middles."""
    from scipy.special import ndtri

    return np.asarray(ndtri((np.arange(count) + 0.5) / count))


def guessed(
    rng: np.random.Generator,
    right: NDArray[np.bool_],
    unsure: tuple[NDArray[np.bool_], float, float],
) -> Floats:
    """Right answers (k, n, trials), guessed by who is careless and in lapsed trials.

    `unsure`: who is careless (k, n, 1), the share of lapsed trials, the chance of a guess.
    """
    careless, lapses, chance = unsure
    guesses = careless | (rng.random(right.shape) < lapses)
    return np.where(guesses, rng.random(right.shape) < chance, right).astype(float)
