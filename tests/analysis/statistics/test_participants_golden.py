"""The sampler of the participants' posterior against Hamiltonian Monte Carlo of the same model.

The golden summaries come from PyMC and NumPyro (tests/data/participants_posterior), where the model
is written anew and everything discrete is summed out.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.testing import assert_allclose

from tactileq.analysis.statistics.participants.ratings import RatingSampler
from tactileq.modeling.arrays import Floats
from tactileq.modeling.participants.ratings import RatingPriors, RatingStudies

DATA = Path(__file__).parents[2] / "data" / "participants_posterior"
CHAINS, WARM_UP, STEPS, EVERY = 64, 200, 900, 2
RARE = 1e-4  # error of a probability that is 0 or 1 in all golden draws


def golden() -> dict:
    return json.loads((DATA / "ratings.json").read_text())


def sampler_of(gold: dict) -> RatingSampler:
    """The study once for every chain; trends have an axis before that of the studies."""
    data = {}
    for name, values in gold["data"].items():
        axis = int(name == "trends")
        one = np.expand_dims(np.array(values, dtype=float), axis)
        data[name] = np.repeat(one, CHAINS, axis=axis)
    priors = {k: tuple(v) if isinstance(v, list) else v for k, v in gold["priors"].items()}
    rng = np.random.default_rng(5)
    return RatingSampler(RatingStudies(**data), RatingPriors(**priors), rng=rng)


def observed(sampler: RatingSampler) -> dict[str, Floats]:
    found = {
        "mean": sampler.population.mean,
        "people_sd": sampler.population.sd,
        "interaction_sd": sampler.interaction_sd,
        "lapses": sampler.lapses,
        "careless": sampler.careless,
        "effects": sampler.effects,
        "attends": sampler.attends,
        "typical": sampler.typical_sd,
        "level": sampler._level,
        "textures": sampler._texture,
        "texture_effects": sampler.texture_effects,
        "slopes": sampler._slopes[sampler._varying].T,
    }
    return {name: np.array(one, dtype=float) for name, one in found.items()}


def sampled(sampler: RatingSampler) -> dict[str, Floats]:
    """(chains, S, …) draws of each quantity."""
    for _ in range(WARM_UP):
        sampler.step()
    kept = []
    for step in range(STEPS):
        sampler.step()
        if step % EVERY == 0:
            kept.append(observed(sampler))
    return {name: np.stack([one[name] for one in kept], axis=1) for name in kept[0]}


def compared() -> pd.DataFrame:
    """Golden and our own means and SDs of each quantity, with the standard error of a difference.

    That of our mean comes from the means of independent chains.
    """
    gold = golden()
    draws = sampled(sampler_of(gold))
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


def test_posterior_is_that_of_the_independent_sampler() -> None:
    table = compared()
    apart = (table.ours - table.golden).abs()
    # A probability next to 0 or 1 has next to no SD.
    sd = table.golden_sd.clip(lower=0.02)
    probable = table.quantity.str.startswith("attends")
    sd = sd.where(probable, table.golden_sd)
    assert not (table.error > 0.06 * sd).any(), "too few steps to tell"
    assert not (apart > 4 * table.error).any(), table[apart > 4 * table.error]
    assert not (apart > 0.1 * sd).any(), table[apart > 0.1 * sd]
    assert_allclose(table.ours_sd[~probable], table.golden_sd[~probable], rtol=0.1)


def test_independent_sampler_converged() -> None:
    source = golden()["source"]
    assert source["r_hat_max"] < 1.01
    assert source["ess_min"] > 1000
    assert source["divergences"] <= 0.001 * source["chains"] * source["draws"]
