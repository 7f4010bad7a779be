"""Samplers of the participants' posterior against Hamiltonian Monte Carlo of the same model.

The golden summaries come from PyMC and NumPyro (tests/data/participants_posterior), where the model
is written anew and everything discrete is summed out.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose

from tactileq.analysis.statistics.participants.choices import ChoiceSampler
from tactileq.analysis.statistics.participants.ratings import RatingSampler
from tactileq.modeling.arrays import Floats
from tactileq.modeling.participants.choices import (
    ODDITY,
    ChoicePriors,
    ChoiceStudies,
    forced_choice,
)
from tactileq.modeling.participants.effects import EffectPriors
from tactileq.modeling.participants.ratings import RatingPriors, RatingStudies

DATA = Path(__file__).parents[2] / "data" / "participants_posterior"
Sampler = RatingSampler | ChoiceSampler
CHAINS, WARM_UP, EVERY = 64, 200, 2
STEPS = {"ratings": 900, "choices": 640, "oddity": 960}
RARE = 1e-4  # error of a probability that is 0 or 1 in all golden draws


def golden(name: str) -> dict:
    return json.loads((DATA / f"{name}.json").read_text())


def arrays(data: dict, chains: int) -> dict[str, Floats]:
    """The study once for every chain; trends have an axis before that of the studies."""
    found = {}
    for name, values in data.items():
        axis = int(name == "trends")
        one = np.expand_dims(np.array(values, dtype=float), axis)
        found[name] = np.repeat(one, chains, axis=axis)
    return found


def priors_of(stored: dict) -> dict:
    rest = {k: tuple(v) if isinstance(v, list) else v for k, v in stored.items() if k != "effects"}
    return {"effects": EffectPriors(**stored["effects"]), **rest}


def sampler_of(gold: dict, chains: int) -> Sampler:
    data, priors = arrays(gold["data"], chains), priors_of(gold["priors"])
    rng = np.random.default_rng(5)
    if gold["alternatives"] is None:
        return RatingSampler(RatingStudies(**data), RatingPriors(**priors), rng=rng)
    model = ODDITY if gold["alternatives"] == 3 else forced_choice(gold["alternatives"])
    return ChoiceSampler(ChoiceStudies(**data), model, ChoicePriors(**priors), rng=rng)


def observed(sampler: Sampler, bounds: list[float]) -> dict[str, Floats]:
    effects = sampler.person_effects()
    outside = ((effects < bounds[0]) | (effects > bounds[1])) & sampler.attends
    found = {
        "mixture_mean": sampler.mixture.mean(),
        "spread": sampler.mixture.spread,
        "lapses": sampler.lapses,
        "effects": effects,
        "attends": sampler.attends,
        "outside": outside.sum(axis=1),
    }
    if isinstance(sampler, RatingSampler):
        own = {
            "typical": np.sqrt(sampler._typical),
            "level": sampler._level,
            "textures": sampler._texture,
            "texture_effects": sampler.texture_effects,
            "slopes": sampler._slopes.T,
        }
    else:
        own = {
            "level": sampler._level,
            "textures": sampler._state.textures,
            "texture_effects": sampler._state.texture_effects,
            "slopes": sampler._state.slopes.T,
        }
    return found | {name: np.array(one, dtype=float) for name, one in own.items()}


def sampled(sampler: Sampler, bounds: list[float], steps: int) -> dict[str, Floats]:
    """(chains, S, …) draws of each quantity."""
    for _ in range(WARM_UP):
        sampler.step()
    sampler.settle()
    kept = []
    for step in range(steps):
        sampler.step()
        if step % EVERY == 0:
            kept.append(observed(sampler, bounds))
    return {name: np.stack([one[name] for one in kept], axis=1).astype(float) for name in kept[0]}


def compared(name: str) -> pd.DataFrame:
    """Golden and our own means and SDs of each quantity, with the standard error of a difference.

    That of our mean comes from the means of independent chains.
    """
    gold = golden(name)
    draws = sampled(sampler_of(gold, CHAINS), gold["bounds"], STEPS[name])
    parts = []
    for key, stored in gold["posterior"].items():
        ours = draws[key].reshape(*draws[key].shape[:2], -1)
        error = ours.mean(axis=1).std(axis=0, ddof=1) / np.sqrt(CHAINS)
        part = {
            "quantity": [f"{key} {k + 1}" for k in range(ours.shape[2])],
            "golden": stored["mean"],
            "golden_sd": stored["sd"],
            "ours": ours.mean(axis=(0, 1)),
            "ours_sd": ours.std(axis=(0, 1)),
            "error": np.hypot(error, np.maximum(stored["mcse"], RARE * (key == "attends"))),
        }
        parts.append(pd.DataFrame(part))
    return pd.concat(parts, ignore_index=True)


@pytest.mark.parametrize(
    "name",
    ["ratings", "choices", pytest.param("oddity", marks=pytest.mark.long("samples a third model"))],
)
def test_posterior_is_that_of_the_independent_sampler(name: str) -> None:
    table = compared(name)
    apart = (table.ours - table.golden).abs()
    # A probability next to 0 or 1 has next to no SD.
    sd = table.golden_sd.clip(lower=0.02)
    probable = table.quantity.str.startswith("attends")
    sd = sd.where(probable, table.golden_sd)
    assert not (table.error > 0.06 * sd).any(), "too few steps to tell"
    assert not (apart > 4 * table.error).any(), table[apart > 4 * table.error]
    assert not (apart > 0.1 * sd).any(), table[apart > 0.1 * sd]
    assert_allclose(table.ours_sd[~probable], table.golden_sd[~probable], rtol=0.1)


@pytest.mark.parametrize("name", ["ratings", "choices", "oddity"])
def test_independent_sampler_converged(name: str) -> None:
    source = golden(name)["source"]
    assert source["r_hat_max"] < 1.01
    assert source["ess_min"] > 1000
    assert source["divergences"] <= 0.001 * source["chains"] * source["draws"]
