"""Simulation-based calibration of the samplers: ranks of drawn truths among posterior draws.

Talts et al. (2018), arXiv 1804.06788; docs/method/validation.md#ranks
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np
import pandas as pd
from scipy import stats

from tactileq.analysis.statistics.participants.choices import ChoiceSampler, population_effects
from tactileq.analysis.statistics.participants.ratings import RatingSampler
from tactileq.modeling.arrays import Bools, Floats
from tactileq.modeling.checks import check_whole
from tactileq.modeling.files.columns import Column, names
from tactileq.modeling.participants.choices import (
    ODDITY,
    ChoicePriors,
    DecisionModel,
    drawn_choices,
    forced_choice,
    mean_effect,
)
from tactileq.modeling.participants.ratings import RatingPriors, drawn_ratings
from tactileq.modeling.seeds import generator, number_of

BINS = 10
PEOPLE, TEXTURES = 12, 4
WARM_UP, STEPS, EVERY = 400, 2000, 20
AT_ONCE = 100
RATING_BOUNDS, CHOICE_BOUNDS = (-7.5, 7.5), (-0.1, 0.1)

RANK_COLUMNS = (
    Column("answers", is_name=True),
    Column("quantity", is_name=True),
    Column("simulations"),
    Column("ranks", "studies in each tenth of the ranks", is_name=True),
    Column("p", "p of uniform ranks (χ²)", is_p_value=True),
)
Quantities = Mapping[str, Floats]


def _ratings(studies: int, rng: np.random.Generator) -> tuple[Quantities, list[Quantities]]:
    trends = np.zeros((2, studies, PEOPLE, TEXTURES, 2, 1))
    trends[1] = rng.uniform(-0.5, 0.5, trends[1].shape)
    priors = RatingPriors()
    drawn = drawn_ratings(priors, trends=trends, anchors=2, rng=rng)
    sampler = RatingSampler(drawn.studies, priors, rng=rng)
    truth = {
        "mean effect": drawn.mixture.mean(),
        "spread of effects": drawn.mixture.spread,
        "effect of one participant": drawn.effects[:, 0],
        "participants outside": _outside(drawn.effects, ~drawn.careless, RATING_BOUNDS, rng=rng),
        "careless participants": drawn.careless.sum(axis=1) + rng.random(studies),
        "lapsed trials": drawn.lapses,
        "SD of ratings": drawn.rating_sd,
    }

    def now() -> Quantities:
        return {
            "mean effect": sampler.mixture.mean(),
            "spread of effects": sampler.mixture.spread,
            "effect of one participant": sampler.effects[:, 0],
            "participants outside": _outside(
                sampler.effects, sampler.attends, RATING_BOUNDS, rng=rng
            ),
            "careless participants": (~sampler.attends).sum(axis=1) + rng.random(studies),
            "lapsed trials": sampler.lapses,
            "SD of ratings": sampler.typical_sd,
        }

    return truth, _draws(sampler, now)


def _choices(
    model: DecisionModel, studies: int, rng: np.random.Generator
) -> tuple[Quantities, list[Quantities]]:
    models = 1 if model.both_models else 2
    shape = (studies, PEOPLE, TEXTURES, models)
    trends = np.zeros((2, *shape))
    if models == 2:
        turns = np.where(np.arange(PEOPLE) % 2, 0.5, -0.5)
        trends[0] = turns[:, None, None] * np.array([1.0, -1.0])
    priors = ChoicePriors.of(model)
    drawn = drawn_choices(
        model,
        priors,
        asked=np.full(shape, 6.0 / models),
        catch_asked=np.full(shape[:2], 6.0 * (models == 1)),
        trends=trends,
        rng=rng,
    )
    sampler = ChoiceSampler(drawn.studies, model, priors, rng=rng)
    mean, _ = population_effects(
        model,
        drawn.people,
        drawn.mixture,
        level=drawn.level,
        person_sd=drawn.person_sd,
        models=models,
    )
    effects = mean_effect(model.share(drawn.people.d_prime(models)), model.chance).mean(axis=-1)
    truth = {
        "mean effect": mean,
        "participants outside": _outside(effects, ~drawn.careless, CHOICE_BOUNDS, rng=rng),
        "careless participants": drawn.careless.sum(axis=1) + rng.random(studies),
        "lapsed trials": drawn.lapses,
    }

    def now() -> Quantities:
        return {
            "mean effect": sampler.mean_effects()[0],
            "participants outside": _outside(
                sampler.person_effects(), sampler.attends, CHOICE_BOUNDS, rng=rng
            ),
            "careless participants": (~sampler.attends).sum(axis=1) + rng.random(studies),
            "lapsed trials": sampler.lapses,
        }

    return truth, _draws(sampler, now)


def _outside(
    effects: Floats, attends: Bools, bounds: tuple[float, float], *, rng: np.random.Generator
) -> Floats:
    """(B,) how many people's effects lie outside; ties are broken at random."""
    found = ((effects < bounds[0]) | (effects > bounds[1])) & attends
    counts: Floats = found.sum(axis=1) + rng.random(len(found))
    return counts


def _draws(
    sampler: RatingSampler | ChoiceSampler, now: Callable[[], Quantities]
) -> list[Quantities]:
    for _ in range(WARM_UP):
        sampler.step()
    sampler.settle()
    kept = []
    for step in range(STEPS):
        sampler.step()
        if step % EVERY == 0:
            kept.append(now())
    return kept


Kind = Callable[[int, np.random.Generator], tuple[Quantities, list[Quantities]]]
RANK_KINDS: Mapping[str, Kind] = {
    "ratings": _ratings,
    "forced choice": lambda studies, rng: _choices(forced_choice(TEXTURES), studies, rng),
    "odd one out": lambda studies, rng: _choices(ODDITY, studies, rng),
}


def simulate_ranks(kind: str, *, simulations: int, seed: int) -> list[dict[str, Any]]:
    """Ranks of one kind of answers: a row for each quantity.

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
