"""Simulated forced choice by day: right answers of people whose d′ changes from day to day."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tactileq.benches.validation.people.drawn import (
    N_TEXTURES,
    SHARES,
    DrawnStudies,
    Shape,
    World,
    on_days,
    shuffled,
)

ABILITY, ABILITY_SD = 1.8, 0.3  # median d′, and SD of its logarithm between people
LEARNING = 0.15  # growth of the logarithm of d′ from the first to the second day
DIFFICULTY = np.array([1.3, 0.8, 1.1, 0.7, 1.2, 0.9, 1.0])  # factors of d′ by texture
REPEATS = 6


@dataclass(frozen=True, kw_only=True)
class _Choices:
    """People who say which of seven textures it was, with one model on each of two days.

    Parameters
    ----------
    day_sd : float
        SD of the logarithm of d′ between the days of a person.
    lost : float
        Share of right answers lost with the other model, on average.
    first : int
        Of 20 people, who begins with the reference.
    """

    day_sd: float
    lost: float = 0.0
    first: int = 10

    def __call__(self, rng: np.random.Generator, shape: Shape) -> DrawnStudies:
        cells = (*shape, N_TEXTURES, 2, REPEATS)
        days = on_days(shape[1], first=self.first)
        log = np.log(ABILITY) + rng.normal(0, ABILITY_SD, (*shape, 1)) + LEARNING * (days - 0.5)
        log = log + rng.normal(0, self.day_sd, (*shape, 2))
        d_prime = np.exp(log)[:, :, None, :, None] * DIFFICULTY[:, None, None]
        own = rng.standard_normal(cells) + d_prime
        # The strongest of six other percepts.
        others = rng.standard_normal((N_TEXTURES - 1, *cells)).max(axis=0)
        right = own > others
        taken = np.array([0.0, self.lost])[:, None] / right.mean(axis=(0, 1, 3, 4))[:, None, None]
        right &= rng.random(cells) >= taken
        orders = shuffled(rng, (*shape, 2, N_TEXTURES * REPEATS)) / (N_TEXTURES * REPEATS - 1)
        orders = orders.reshape(*shape, 2, N_TEXTURES, REPEATS).swapaxes(2, 3)
        return DrawnStudies(
            values=right.astype(float),
            days=np.broadcast_to(days[:, None, :, None], cells[1:]),
            orders=orders,
            anchors=np.empty((*shape, 0)),
            planted=np.full(N_TEXTURES, -self.lost),
            attends=np.ones(shape, dtype=bool),
        )


CHOICE_WORLDS: Mapping[str, World] = {
    name: World(line=line, draw=choices, bounds=SHARES)
    for name, line, choices in (
        ("choices, days .25", "no effect; SD of log d′ between days 0.25", _Choices(day_sd=0.25)),
        ("choices, days .4", "no effect; SD of log d′ between days 0.4", _Choices(day_sd=0.4)),
        (
            "choices, at the bound",
            "a tenth fewer right; SD of log d′ between days 0.25",
            _Choices(day_sd=0.25, lost=0.1),
        ),
        (
            "choices, 13 and 7",
            "the same, 13 of 20 begin with the reference",
            _Choices(day_sd=0.25, lost=0.1, first=13),
        ),
    )
}
