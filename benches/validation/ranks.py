"""Simulation-based calibration of the sampler: ranks of drawn truths among posterior draws.

Talts et al. (2018), arXiv 1804.06788; docs/method/validation.md#ranks
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import partial
from typing import Any

import numpy as np
import pandas as pd
from scipy import stats

from tactileq.analysis.statistics.participants.ratings import RatingSampler
from tactileq.modeling.arrays import Floats
from tactileq.modeling.checks import check_whole
from tactileq.modeling.files.columns import Column, names
from tactileq.modeling.participants.ratings import RatingPriors, drawn_ratings
from tactileq.modeling.seeds import generator, number_of

BINS = 10
PEOPLE, TEXTURES = 12, 4
WARM_UP, STEPS, EVERY = 400, 2000, 20
AT_ONCE = 100

RANK_COLUMNS = (
    Column("answers", is_name=True),
    Column("quantity", is_name=True),
    Column("simulations"),
    Column("ranks", "studies in each tenth of the ranks", is_name=True),
    Column("p", "p of uniform ranks (χ²)", is_p_value=True),
)
Quantities = Mapping[str, Floats]


def _ratings(
    repeats: int, studies: int, rng: np.random.Generator
) -> tuple[Quantities, list[Quantities]]:
    trends = np.zeros((2, studies, PEOPLE, TEXTURES, 2, repeats))
    trends[1] = rng.uniform(-0.5, 0.5, trends[1].shape)
    priors = RatingPriors()
    drawn = drawn_ratings(priors, trends=trends, anchors=2, rng=rng)
    sampler = RatingSampler(drawn.studies, priors, rng=rng)
    truth = {
        "mean effect": drawn.mean,
        "effect on one texture": drawn.mean + drawn.texture_effects[:, 0],
        "SD between people": drawn.people_sd,
        "effect of one participant": drawn.effects[:, 0],
        "careless participants": drawn.careless.sum(axis=1) + rng.random(studies),
        "lapsed trials": drawn.lapses,
        "SD of ratings": drawn.rating_sd,
        "SD of deviations on textures": drawn.interaction_sd,
    }

    if repeats == 1:  # held at 0
        del truth["SD of deviations on textures"]

    def now() -> Quantities:
        """The same in the present state of the sampler."""
        mean = sampler.population.mean
        return {
            "mean effect": mean,
            "effect on one texture": mean + sampler.texture_effects[:, 0],
            "SD between people": sampler.population.sd,
            "effect of one participant": sampler.effects[:, 0],
            "careless participants": (~sampler.attends).sum(axis=1) + rng.random(studies),
            "lapsed trials": sampler.lapses,
            "SD of ratings": sampler.typical_sd,
            "SD of deviations on textures": sampler.interaction_sd,
        }

    for _ in range(WARM_UP):
        sampler.step()
    kept = []
    for step in range(STEPS):
        sampler.step()
        if step % EVERY == 0:
            kept.append(now())
    return truth, kept


Kind = Callable[[int, np.random.Generator], tuple[Quantities, list[Quantities]]]
RANK_KINDS: Mapping[str, Kind] = {
    "single ratings": partial(_ratings, 1),
    "two repeats": partial(_ratings, 2),
}


def simulate_ranks(kind: str, *, simulations: int, seed: int) -> list[dict[str, Any]]:
    """Ranks of one kind of studies: a row for each quantity.

    Parameters
    ----------
    kind : str
        One of `RANK_KINDS`.
    simulations : int
        1 … 1 000 000.
    seed : int
        ≥ 0.
    """
    check_whole("simulations", simulations, low=1, high=1_000_000)
    ranks: dict[str, list[Floats]] = {}
    for start in range(0, simulations, AT_ONCE):
        rng = generator(seed, number_of(f"ranks of {kind}"), start)
        truth, draws = RANK_KINDS[kind](min(AT_ONCE, simulations - start), rng)
        for name, value in truth.items():
            below = np.sum([one[name] < value for one in draws], axis=0)
            places = 1 + np.sum([one[name] == value for one in draws], axis=0)
            rank = (below + places * rng.random(len(value))) / (len(draws) + 1)
            ranks.setdefault(name, []).append(rank)
    return [_row(kind, name, np.concatenate(found)) for name, found in ranks.items()]


def _row(kind: str, name: str, ranks: Floats) -> dict[str, Any]:
    counts, _ = np.histogram(ranks, bins=BINS, range=(0.0, 1.0))
    return {
        "answers": kind,
        "quantity": name,
        "simulations": len(ranks),
        "ranks": " ".join(map(str, counts)),
        "p": float(stats.chisquare(counts).pvalue),
    }


def rank_table(rows: Iterable[dict[str, Any]]) -> pd.DataFrame:
    """The rows of `simulate_ranks` as a table of `RANK_COLUMNS`."""
    return pd.DataFrame(list(rows), columns=names(RANK_COLUMNS))
