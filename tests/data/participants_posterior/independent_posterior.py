"""The posterior of the model of ratings by an independent sampler, for the golden test.

Not run by the tests. Needs PyMC, NumPyro, JAX and ArviZ in an environment of their own:

    python -m venv golden
    golden/bin/pip install pymc==5.28.5 numpyro==0.22.0 jax==0.10.2 arviz==0.23.4
    golden/bin/python independent_posterior.py            # writes ratings.json; DRAWS=… for a trial

It imports nothing of this project. The model is written anew from its definition
(modeling/participants, `drawn_ratings`), for Hamiltonian Monte Carlo (NUTS):
- lapses, and who is careless, are summed out exactly;
- ratings at an end of the scale have the probability of a judgement beyond it;
- afterwards who attends is drawn given each draw, exactly.
Data are simulated here, by hand and not from the priors.
"""

from __future__ import annotations

import json
import os
import re
import time
from pathlib import Path

os.environ.setdefault("XLA_FLAGS", "--xla_force_host_platform_device_count=4")

import arviz
import jax
import numpy as np
import numpyro
import pymc as pm
import pytensor.tensor as pt

HERE = Path(__file__).parent
CHAINS, TUNE, DRAWS, ACCEPT, SEED = 4, 2000, 25000, 0.95, 43
AT_END, LENGTH = 0.02, 100.0
HALVES = np.array([-0.5, 0.5])[:, None]  # reference, other

PRIORS = {
    "mean_sd": 25.0,
    "people_sd": 10.0,
    "interaction_sd": 10.0,
    "level": [60.0, 20.0],
    "person_sd": 10.0,
    "cell_sd": 5.0,
    "anchor_sd": 12.0,
    "texture_sd": 15.0,
    "texture_effect_sd": 20.0,
    "anchor": [-25.0, 20.0],
    "trend_sd": 15.0,
    "rating_sd": 9.0,
    "rating_df": 10.0,
    "careless_scale": 60.0,
    "lapses": [1.0, 19.0],
    "careless": [1.0, 14.0],
}
SUMMARIZED = (
    *("mean", "people_sd", "interaction_sd", "lapses", "careless", "effects", "attends"),
    *("typical", "level", "textures", "texture_effects", "slopes"),
)


def simulated() -> dict[str, np.ndarray]:
    """Nine people, three textures, both models twice each in one session, two anchors."""
    rng = np.random.default_rng(40)
    n, t, repeats = 9, 3, 2
    shape = (n, t, 2, repeats)
    trials = t * 2 * repeats
    order = np.array([rng.permutation(trials) for _ in range(n)])
    place = np.round(order / (trials - 1) - 0.5, 4).reshape(shape)
    person = 70 + 15 * rng.standard_normal(n)
    person[0] -= 36.0  # near the ends of the scale
    person[7] += 9.0
    effect = 6 + 6 * rng.standard_normal(n)
    texture, own = np.array([13.0, -4.0, -9.0]), np.array([5.0, -6.0, 1.0])
    deviation = 5 * rng.standard_normal((n, t))
    sd = 7 * np.exp(0.2 * rng.standard_normal(n))
    cell = 4 * rng.standard_normal((n, t))
    apart = (effect[:, None] + own + deviation)[..., None, None] * HALVES
    middle = (person[:, None] + cell + texture)[..., None, None] + apart - 6 * place
    values = middle + sd[:, None, None, None] * rng.standard_normal(shape)
    anchors = person[:, None] + np.array([-42.0, -17.0]) + 9 * rng.standard_normal((n, 2))
    values[7] = person[7] + 5 * rng.standard_normal(shape[1:])  # careless
    anchors[7] = person[7] + 5 * rng.standard_normal(2)
    anchors[6] = 60.0, 55.0  # may be careless
    values[1, 2, 0, 1], values[4, 0, 1, 0] = 97.0, 4.0  # lapses
    values, anchors = np.clip(np.round(values), 0, 100), np.clip(np.round(anchors), 0, 100)
    values[2, 1, 1, 0] = values[5, 0, 0, 1] = np.nan  # unanswered
    trends = np.stack([np.zeros(shape), place])  # one session
    return {"values": values, "anchors": anchors, "trends": trends}


def normal_cdf(x):
    return 0.5 * pt.erfc(-x / np.sqrt(2.0))


def sd_of(name: str, typical: float):
    """The variance is inverse gamma, of shape 2 and mean typical²."""
    return typical / pt.sqrt(pm.Gamma(f"{name} gamma", 2.0, 1.0))


def without_mean(name: str, sd: float, t: int):
    free = pm.Normal(f"{name} free", shape=t)
    return pm.Deterministic(name, sd * (free - free.mean()))


def model_of(data: dict[str, np.ndarray], p: dict) -> pm.Model:
    n, t, _, _ = data["values"].shape
    a = data["anchors"].shape[1]
    varying = [one for one in data["trends"] if np.ptp(one) > 0]
    with pm.Model() as model:
        mean = pm.Normal("mean", 0.0, p["mean_sd"])
        people_sd = pm.HalfNormal("people_sd", p["people_sd"])
        effects = pm.Deterministic("effects", mean + people_sd * pm.Normal("effect", shape=n))
        interaction_sd = pm.HalfNormal("interaction_sd", p["interaction_sd"])
        deviations = interaction_sd * pm.Normal("deviation", shape=(n, t))
        textures = without_mean("textures", p["texture_sd"], t)
        texture_effects = without_mean("texture_effects", p["texture_effect_sd"], t)
        level = pm.Normal("level", *p["level"])
        person = pm.Normal("person", level, sd_of("person", p["person_sd"]), shape=n)
        cells = sd_of("cell", p["cell_sd"]) * pm.Normal("cell", shape=(n, t))
        slopes = pm.Normal("slopes", 0.0, p["trend_sd"], shape=len(varying))
        anchor = pm.Normal("anchor", *p["anchor"], shape=a)
        anchors = anchor + sd_of("anchor", p["anchor_sd"]) * pm.Normal("own anchor", shape=(n, a))
        squared = p["rating_sd"] ** 2 * pm.Gamma("typical gamma", 2.0, 1.0) / 2
        pm.Deterministic("typical", pt.sqrt(squared))
        half = p["rating_df"] / 2
        sd = pt.sqrt(half * squared / pm.Gamma("variance gamma", half, 1.0, shape=n))
        careless_sd = pt.sqrt(p["careless_scale"] / pm.Exponential("careless gamma", 1.0, shape=n))
        lapses = pm.Beta("lapses", *p["lapses"])
        careless = pm.Beta("careless", *p["careless"])

        def log_of(answers, middle, scale):
            """(n,) log likelihood of answers (n, …), lapses summed out."""
            scale = scale.reshape((n, *[1] * (answers.ndim - 1)))
            known = np.isfinite(answers)
            x = np.where(known, answers, 50.0)
            z = (x - middle) / scale
            inside = pt.exp(-z * z / 2) / np.sqrt(2 * np.pi) / scale
            at_end = pt.switch(x <= 0, normal_cdf(z), normal_cdf(-z))
            ends = (x <= 0) | (x >= LENGTH)
            blind = np.where(ends, AT_END, (1 - 2 * AT_END) / LENGTH)
            log = pt.log((1 - lapses) * pt.switch(ends, at_end, inside) + lapses * blind) * known
            return log.reshape((n, -1)).sum(axis=1)

        own = (person[:, None] + cells)[..., None, None]
        own = own + sum(slopes[c] * one for c, one in enumerate(varying))
        apart = (effects[:, None] + texture_effects + deviations)[..., None, None] * HALVES
        attending = log_of(data["values"], own + textures[:, None, None] + apart, sd)
        attending += log_of(data["anchors"], person[:, None] + anchors, sd) + pt.log1p(-careless)
        others = log_of(data["values"], own, careless_sd) + pt.log(careless)
        others += log_of(data["anchors"], person[:, None], careless_sd)
        pm.Deterministic("log ratio", attending - others)
        pm.Potential("answers", pt.logaddexp(attending, others).sum())
    return model


def summary(draws: np.ndarray) -> dict:
    """Mean, SD, MCSE of the mean, bulk effective sample size, R-hat of (chains, draws, …)."""
    flat = draws.reshape(*draws.shape[:2], -1)
    found: dict = {name: [] for name in ("mean", "sd", "mcse", "ess", "r_hat")}
    for x in np.moveaxis(flat, 2, 0):
        constant = np.ptp(x) == 0
        found["mean"].append(float(x.mean()))
        found["sd"].append(float(x.std()))
        found["mcse"].append(0.0 if constant else np.ravel(arviz.mcse(x))[0].item())
        found["ess"].append(float(x.size) if constant else float(arviz.ess(x)))
        found["r_hat"].append(1.0 if constant else float(arviz.rhat(x)))
    return {
        name: [float(f"{v:.6g}") for v in values] if draws.ndim == 3 else float(f"{values[0]:.6g}")
        for name, values in found.items()
    }


def sampled(data: dict[str, np.ndarray], draws: int) -> dict:
    with model_of(data, PRIORS):
        trace = pm.sample(
            draws,
            tune=TUNE,
            chains=CHAINS,
            nuts_sampler="numpyro",
            target_accept=ACCEPT,
            random_seed=SEED,
            progressbar=False,
        )
    post = {name: one.values for name, one in trace.posterior.items()}
    chance = 1 / (1 + np.exp(-post["log ratio"]))
    post["attends"] = (np.random.default_rng(SEED).random(chance.shape) < chance).astype(float)
    summaries = {name: summary(post[name]) for name in SUMMARIZED}
    programs = {"pymc": pm, "numpyro": numpyro, "jax": jax, "arviz": arviz}
    return {
        "source": {
            "script": Path(__file__).name,
            "programs": {name: one.__version__ for name, one in programs.items()},
            "sampler": f"NUTS (NumPyro), target acceptance {ACCEPT}",
            "chains": CHAINS,
            "tuning": TUNE,
            "draws": draws,
            "seed": SEED,
            "divergences": int(trace.sample_stats["diverging"].values.sum()),
            "r_hat_max": float(f"{max(np.max(one['r_hat']) for one in summaries.values()):.5g}"),
            "ess_min": round(float(min(np.min(one["ess"]) for one in summaries.values()))),
        },
        "priors": PRIORS,
        "data": {name: np.where(np.isnan(v), None, v).tolist() for name, v in data.items()},
        "posterior": summaries,
    }


def main() -> None:
    start = time.time()
    found = sampled(simulated(), int(os.environ.get("DRAWS", DRAWS)))
    for name, one in found["posterior"].items():
        print(name, one)
    print(found["source"], round(time.time() - start), "s")
    text = json.dumps(found, indent=1, ensure_ascii=False)
    # One line for the innermost lists.
    text = re.sub(r"\[[^\[\]{}]*\]", lambda at: " ".join(at[0].split()), text)
    (HERE / "ratings.json").write_text(text.replace("[ ", "[").replace(" ]", "]") + "\n")


if __name__ == "__main__":
    main()
