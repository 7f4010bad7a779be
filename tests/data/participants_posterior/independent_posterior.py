"""Posteriors of the model of the participant by an independent sampler, for the golden test.

Not run by the tests. Needs PyMC, NumPyro, JAX and ArviZ in an environment of their own:

    python -m venv golden
    golden/bin/pip install pymc==5.28.5 numpyro==0.22.0 jax==0.10.2 arviz==0.23.4
    golden/bin/python independent_posterior.py            # all, or ratings, choices, oddity

It imports nothing of this project. The model is written anew from its definition
(modeling/participants, `drawn_ratings` and `drawn_choices`), for Hamiltonian Monte Carlo (NUTS):
- lapses, and who is careless or of which component, are summed out exactly (weights of the
  components and share of careless people integrated analytically, by a sum over their counts);
- ratings at an end of the scale have the probability of a judgement beyond it;
- afterwards classes, weights and all that depends on them are drawn given each draw, exactly.
Data are simulated here, by hand and not from the priors.
"""

from __future__ import annotations

import json
import os
import re
import sys
import time
from pathlib import Path

os.environ.setdefault("XLA_FLAGS", "--xla_force_host_platform_device_count=4")

import arviz
import jax
import numpy as np
import numpyro
import pymc as pm
import pytensor.tensor as pt
from scipy.special import gammaln, ndtr

HERE = Path(__file__).parent
K = 3  # components
CHAINS, TUNE, ACCEPT = 4, 1500, 0.9
AT_END, LENGTH = 0.02, 100.0

RATING_PRIORS = {
    "effects": {"mean_sd": 25.0, "spread": 1.9, "weight": 0.02},
    "level": [60.0, 20.0],
    "person_sd": 10.0,
    "cell_sd": 5.0,
    "anchor_sd": 12.0,
    "texture_sd": 15.0,
    "texture_effect_sd": 6.0,
    "anchor": [-25.0, 20.0],
    "trend_sd": 6.0,
    "rating_sd": 9.0,
    "rating_df": 10.0,
    "careless_scale": 60.0,
    "lapses": [1.0, 19.0],
    "careless": [1.0, 14.0],
}
_CHOICE = {
    "ability": [1.5, 1.0],
    "person_sd": 0.6,
    "texture_sd": 0.5,
    "texture_effect_sd": 0.2,
    "trend_sd": 0.3,
    "lapses": [1.0, 14.0],
    "careless": [1.0, 14.0],
    "catch": [30.0, 1.0],
}
CHOICE_PRIORS = {"effects": {"mean_sd": 0.7, "spread": 0.2, "weight": 0.05}, **_CHOICE}
ODDITY_PRIORS = {"effects": {"mean_sd": 2.0, "spread": 0.2, "weight": 0.05}, **_CHOICE}


# Data.


def simulated_ratings() -> dict:
    """Ten people, four textures, both models once each in two sessions, two anchors."""
    rng = np.random.default_rng(20)
    n, t = 10, 4
    session = np.zeros((n, t, 2, 1))
    place = np.zeros((n, t, 2, 1))
    for i in range(n):
        days = np.repeat([-0.5, 0.5], t)[rng.permutation(2 * t)]
        places = np.zeros(2 * t)
        for day in (-0.5, 0.5):
            places[days == day] = np.round(rng.permutation(t) / (t - 1) - 0.5, 4)
        session[i, :, :, 0], place[i, :, :, 0] = days.reshape(t, 2), places.reshape(t, 2)
    person = 62 + 14 * rng.standard_normal(n)
    effect = 1.5 * rng.standard_normal(n)
    person[7] += 10.0
    effect[3] = 20.0
    texture = np.array([14.0, -9.0, 5.0, -10.0])
    own = np.array([3.0, -4.0, 0.0, 1.0])
    sd = 8 * np.exp(0.2 * rng.standard_normal(n))
    cell = 4 * rng.standard_normal((n, t))
    middle = (person[:, None] + cell + texture)[..., None, None] + np.array([-0.5, 0.5])[
        :, None
    ] * (effect[:, None] + own)[..., None, None]
    values = (
        middle
        + 4 * session
        - 5 * place
        + sd[:, None, None, None] * rng.standard_normal(middle.shape)
    )
    anchors = person[:, None] + np.array([-35.0, -15.0]) + 9 * rng.standard_normal((n, 2))
    values[8] = person[8] + 5 * rng.standard_normal(values[8].shape)  # careless
    anchors[8] = person[8] + 5 * rng.standard_normal(2)
    values[0, 1, 1, 0], values[5, 2, 0, 0], anchors[6, 1] = 3.0, 100.0, 91.0  # lapses
    values, anchors = np.clip(np.round(values), 0, 100), np.clip(np.round(anchors), 0, 100)
    values[7, 3, 0, 0] = np.nan  # unanswered
    return {
        "values": values,
        "anchors": anchors,
        "trends": np.stack([session, place]),
    }


def simulated_choices() -> dict:
    """Ten people, four textures, two models, three answers each, one of seven; no catch trials."""
    rng = np.random.default_rng(21)
    n, t = 10, 4
    session = np.round(rng.choice([-0.5, -1 / 6, 1 / 6, 0.5], (n, t, 2)), 4)
    ability = 1.7 + 0.6 * rng.standard_normal(n)
    effect = -0.1 + 0.1 * rng.standard_normal(n)
    effect[2] = -1.6
    level = ability[:, None] + np.array([0.5, -0.4, 0.1, -0.2])
    d = level[..., None] + np.array([-0.5, 0.5]) * effect[:, None, None] + 0.4 * session
    asked = np.full((n, t, 2), 3.0)
    asked[4, 1, 0] = 2.0
    right = np.zeros_like(asked)
    for at in np.ndindex(right.shape):
        for _ in range(int(asked[at])):
            heard = rng.standard_normal(7)
            heard[0] += d[at]
            lapsed = rng.random() < 0.05 or at[0] == 7  # the person at 7 is careless
            right[at] += rng.integers(7) == 0 if lapsed else heard.argmax() == 0
    return {
        "right": right,
        "asked": asked,
        "catch_right": np.zeros(n),
        "catch_asked": np.zeros(n),
        "trends": session[None],
    }


def simulated_oddity() -> dict:
    """Twelve people, four textures, six answers each, six catch trials."""
    rng = np.random.default_rng(22)
    n, t = 12, 4
    place = np.round(rng.uniform(-0.3, 0.3, (n, t, 1)), 3)
    d = np.zeros(n)
    d[1], d[6] = 2.6, 1.9
    asked, right = np.full((n, t, 1), 6.0), np.zeros((n, t, 1))
    for at in np.ndindex(right.shape):
        for _ in range(6):
            three = rng.standard_normal(3)
            three[0] += max(0.0, d[at[0]] + [0.3, -0.2, 0.1, -0.3][at[1]] * (d[at[0]] > 0))
            right[at] += odd_one(three[None])[0] == 0 if at[0] != 9 else rng.integers(3) == 0
    catch = rng.binomial(6, 0.96, n).astype(float)
    catch[9] = 3.0
    return {
        "right": right,
        "asked": asked,
        "catch_right": catch,
        "catch_asked": np.full(n, 6.0),
        "trends": place[None],
    }


def odd_one(values: np.ndarray) -> np.ndarray:
    """Which of three lies outside the pair that is closest together."""
    apart = [np.abs(values[:, 1] - values[:, 2]), np.abs(values[:, 0] - values[:, 2])]
    return np.argmin([*apart, np.abs(values[:, 0] - values[:, 1])], axis=0)


# Shares of right answers.


def forced_choice(d):
    """∫ φ(x) Φ(x + d)^6 dx by Gauss–Hermite."""
    x, w = np.polynomial.hermite_e.hermegauss(48)
    w = w / w.sum()
    return (normal_cdf(x + d[..., None]) ** 6 * w).sum(axis=-1)


def oddity(d):
    """P(|d + √1.5 t| > 3 |u| / √2): odd one to the middle of the others, and these two apart."""
    u, w = np.polynomial.legendre.leggauss(64)
    u = 4 * (u + 1)  # 0 … 8
    w = 4 * w * 2 * np.exp(-u * u / 2) / np.sqrt(2 * np.pi)
    d = (np if isinstance(d, np.ndarray) else pt).maximum(d, 0.0)[..., None]
    far = 3 * u / np.sqrt(2)
    return ((normal_cdf((d - far) / np.sqrt(1.5)) + normal_cdf((-d - far) / np.sqrt(1.5))) * w).sum(
        axis=-1
    )


def normal_cdf(x):
    return ndtr(x) if isinstance(x, np.ndarray) else 0.5 * pt.erfc(-x / np.sqrt(2.0))


def check_shares() -> None:
    """Both integrals against a million simulated trials."""
    rng = np.random.default_rng(1)
    for d in (0.0, 0.8, 2.0):
        heard = rng.standard_normal((1_000_000, 7))
        heard[:, 0] += d
        assert abs((heard.argmax(axis=1) == 0).mean() - forced_choice(np.array(d))) < 0.002
        assert abs((odd_one(heard[:, :3]) == 0).mean() - oddity(np.array(d))) < 0.002


# Classes summed out.


def log_weights(n: int, alpha: float, careless: list[float]) -> np.ndarray:
    """(n + 1)^3: log prior probability of one sequence of classes with these counts."""
    counts = np.stack(np.meshgrid(*[np.arange(n + 1)] * K, indexing="ij"))
    attend = counts.sum(axis=0)
    others = np.maximum(n - attend, 0)
    log = gammaln(K * alpha) - gammaln(K * alpha + attend)
    log = log + (gammaln(alpha + counts) - gammaln(alpha)).sum(axis=0)
    a, b = careless
    log += gammaln(a + others) + gammaln(b + attend) - gammaln(a + b + n)
    log += gammaln(a + b) - gammaln(a) - gammaln(b)
    return np.where(attend <= n, log, -np.inf)


def log_marginal(log_a, n: int, log_w: np.ndarray):
    """Log of Σ over all sequences of classes of prior times likelihoods exp(log_a) (n, K + 1)."""
    top = pt.max(log_a, axis=1)
    a = pt.exp(log_a - top[:, None])
    table = np.zeros((n + 1,) * K)
    table[0, 0, 0] = 1.0
    table = pt.as_tensor(table)
    for i in range(n):
        new = a[i, K] * table
        for k in range(K):
            parts = [slice(None)] * K
            parts[k] = slice(0, n)
            shape = [n + 1] * K
            shape[k] = 1
            new = new + a[i, k] * pt.concatenate([pt.zeros(shape), table[tuple(parts)]], axis=k)
        table = new
    return pt.log((table * np.exp(log_w)).sum()) + top.sum()


def drawn_classes(log_a: np.ndarray, log_w: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """(S, n) class of each person (K is careless), given log likelihoods (S, n, K + 1)."""
    s, n, _ = log_a.shape
    a = np.exp(log_a - log_a.max(axis=2, keepdims=True))
    tables = np.zeros((n + 1, s, *(n + 1,) * K))
    tables[0][:, 0, 0, 0] = 1.0
    for i in range(n):
        tables[i + 1] = a[:, i, K, None, None, None] * tables[i]
        for k in range(K):
            low, high = [slice(None)] * (K + 1), [slice(None)] * (K + 1)
            low[k + 1], high[k + 1] = slice(0, n), slice(1, None)
            tables[i + 1][tuple(high)] += a[:, i, k, None, None, None] * tables[i][tuple(low)]
    weights = (tables[n] * np.exp(log_w)).reshape(s, -1).cumsum(axis=1)
    at = (weights < (rng.random(s) * weights[:, -1])[:, None]).sum(axis=1)
    counts = np.stack(np.unravel_index(at, log_w.shape), axis=1)
    classes = np.zeros((s, n), dtype=int)
    rows = np.arange(s)
    for i in range(n - 1, -1, -1):
        chances = np.zeros((s, K + 1))
        for k in range(K + 1):
            left = counts - (np.arange(K) == k)
            possible = (left >= 0).all(axis=1)
            left = np.maximum(left, 0)
            chances[:, k] = (
                possible * a[:, i, k] * tables[i][rows, left[:, 0], left[:, 1], left[:, 2]]
            )
        total = chances.cumsum(axis=1)
        classes[:, i] = (total < (rng.random(s) * total[:, -1])[:, None]).sum(axis=1)
        counts = counts - (np.arange(K) == classes[:, i, None])
    return classes


# Models; each gives `log_a` (n, K + 1), the log likelihoods of a person in each class.


def mixture_of(priors: dict, n: int):
    """(K, n) effect that each person has in each component."""
    means = pm.Normal("means", 0.0, priors["effects"]["mean_sd"], shape=K)
    spread = pm.HalfNormal("spread", priors["effects"]["spread"])
    own = pm.Normal("own", shape=n)
    return pm.Deterministic("component_effects", means[:, None] + spread * own)


def variance(name: str, typical: float):
    return pm.InverseGamma(name, alpha=2.0, beta=typical**2)


def without_mean(name: str, sd: float, t: int):
    free = pm.Normal(f"{name} free", shape=t)
    return pm.Deterministic(name, sd * (free - free.mean()))


def ratings_model(data: dict, p: dict) -> pm.Model:
    n, t, _, _ = data["values"].shape
    with pm.Model() as model:
        effects = mixture_of(p, n)
        level = pm.Normal("level", *p["level"])
        person_sd = pt.sqrt(variance("person variance", p["person_sd"]))
        person = pm.Normal("person", level, person_sd, shape=n)
        cell = pt.sqrt(variance("cell variance", p["cell_sd"])) * pm.Normal("cell", shape=(n, t))
        texture = without_mean("textures", p["texture_sd"], t)
        own = without_mean("texture_effects", p["texture_effect_sd"], t)
        slopes = pm.Normal("slopes", 0.0, p["trend_sd"], shape=len(data["trends"]))
        a = data["anchors"].shape[1]
        anchor = pm.Normal("anchor", *p["anchor"], shape=a)
        anchor_sd = pt.sqrt(variance("anchor variance", p["anchor_sd"]))
        anchors = anchor + anchor_sd * pm.Normal("anchor own", shape=(n, a))
        lapses = pm.Beta("lapses", *p["lapses"])
        squared = p["rating_sd"] ** 2 * pm.Gamma("typical gamma", 2.0, 1.0) / 2
        pm.Deterministic("typical", pt.sqrt(squared))
        half = p["rating_df"] / 2
        sd = pt.sqrt(half * squared / pm.Gamma("variance gamma", half, 1.0, shape=n))
        careless_sd = pt.sqrt(p["careless_scale"] / pm.Exponential("careless gamma", 1.0, shape=n))

        felt = (person[:, None] + cell)[..., None, None] + sum(
            slopes[c] * data["trends"][c] for c in range(len(data["trends"]))
        )
        halves = np.array([-0.5, 0.5])[:, None]

        def log_of(answers, middle, scale):
            known = np.isfinite(answers)
            x = np.where(known, answers, 50.0)
            z = (x - middle) / scale
            inside = pt.exp(-z * z / 2) / np.sqrt(2 * np.pi) / scale
            judged = pt.switch(
                x <= 0, normal_cdf(z), pt.switch(x >= LENGTH, normal_cdf(-z), inside)
            )
            blind = np.where((x <= 0) | (x >= LENGTH), AT_END, (1 - 2 * AT_END) / LENGTH)
            log = pt.log((1 - lapses) * judged + lapses * blind) * known
            return log.sum(axis=tuple(range(1, answers.ndim)))

        shown = (person[:, None] + anchors, sd[:, None])
        of_anchors = log_of(data["anchors"], *shown)
        of_classes = []
        for k in range(K):
            apart = (effects[k][:, None] + own)[..., None, None] * halves
            middle = felt + texture[:, None, None] + apart
            of_classes.append(log_of(data["values"], middle, sd[:, None, None, None]) + of_anchors)
        of_classes.append(
            log_of(data["values"], felt, careless_sd[:, None, None, None])
            + log_of(data["anchors"], person[:, None] + np.zeros(a), careless_sd[:, None])
        )
        classes_of(of_classes, n, p)
    return model


def choices_model(data: dict, p: dict, share, chance: float) -> pm.Model:
    n, t, m = data["right"].shape
    right, wrong = data["right"], data["asked"] - data["right"]
    caught, missed = data["catch_right"], data["catch_asked"] - data["catch_right"]
    with pm.Model() as model:
        effects = mixture_of(p, n)
        texture = pm.Normal("textures", 0.0, p["texture_sd"], shape=t)
        slopes = pm.Normal("slopes", 0.0, p["trend_sd"], shape=len(data["trends"]))
        lapses = pm.Beta("lapses", *p["lapses"])
        catch = pm.Beta("catch", *p["catch"])
        trend = sum(slopes[c] * data["trends"][c] for c in range(len(data["trends"])))
        base = texture[:, None] + trend
        if m == 2:
            level = pm.Normal("level", *p["ability"])
            person_sd = pt.sqrt(variance("person variance", p["person_sd"]))
            ability = pm.Normal("ability", level, person_sd, shape=n)
            own = pm.Normal("texture_effects", 0.0, p["texture_effect_sd"], shape=t)
            base = base + ability[:, None, None]
        of_catch_p = lapses * chance + (1 - lapses) * catch
        of_classes = []
        for k in range(K):
            if m == 2:
                d = base + np.array([-0.5, 0.5]) * (effects[k][:, None] + own)[..., None]
            else:
                d = base + effects[k][:, None, None]
            rate = lapses * chance + (1 - lapses) * share(d)
            log = (right * pt.log(rate) + wrong * pt.log(1 - rate)).sum(axis=(1, 2))
            of_classes.append(log + caught * pt.log(of_catch_p) + missed * pt.log(1 - of_catch_p))
        guessed = (right.sum(axis=(1, 2)) + caught) * np.log(chance)
        guessed = guessed + (wrong.sum(axis=(1, 2)) + missed) * np.log(1 - chance)
        of_classes.append(pt.as_tensor(guessed))
        classes_of(of_classes, n, p)
    return model


def classes_of(of_classes: list, n: int, p: dict) -> None:
    log_a = pm.Deterministic("log_a", pt.stack(of_classes, axis=1))
    pm.Potential(
        "answers", log_marginal(log_a, n, log_weights(n, p["effects"]["weight"], p["careless"]))
    )


# Summaries.


def completed(post: dict, p: dict, rng: np.random.Generator) -> dict[str, np.ndarray]:
    """Attention, effects (in the model's unit) and mean of the mixture, drawn given each draw."""
    chains, draws, n, _ = post["log_a"].shape
    flat = post["log_a"].reshape(-1, n, K + 1)
    log_w = log_weights(n, p["effects"]["weight"], p["careless"])
    classes = np.concatenate(
        [drawn_classes(part, log_w, rng) for part in np.array_split(flat, max(1, len(flat) // 250))]
    )
    counts = (classes[..., None] == np.arange(K)).sum(axis=1)
    gammas = rng.standard_gamma(p["effects"]["weight"] + counts) + 1e-300
    weights = gammas / gammas.sum(axis=1, keepdims=True)
    any_of = (rng.random((len(flat), n, 1)) > weights.cumsum(axis=1)[:, None, :-1]).sum(axis=2)
    places = np.where(classes < K, classes, any_of)
    by_component = post["component_effects"].reshape(-1, K, n)
    effects = np.take_along_axis(by_component, places[:, None], axis=1)[:, 0]
    means = post["means"].reshape(-1, K)
    return {
        "mixture_mean": (weights * means).sum(axis=1).reshape(chains, draws),
        "attends": (classes < K).reshape(chains, draws, n).astype(float),
        "effects": effects.reshape(chains, draws, n),
    }


def effects_in_shares(post: dict, effects: np.ndarray, share, chance: float) -> np.ndarray:
    """(chains, draws, n) effect on the share of right answers, mean over textures."""
    textures = post["textures"][:, :, None]
    if "ability" not in post:
        return share(effects[..., None] + textures).mean(axis=-1) - chance
    level = post["ability"][..., None] + textures
    apart = 0.5 * (effects[..., None] + post["texture_effects"][:, :, None])
    return (share(level + apart) - share(level - apart)).mean(axis=-1)


def summary(draws: np.ndarray) -> dict:
    """Mean, SD, MCSE of the mean, bulk effective sample size, R-hat of (chains, draws, …)."""
    flat = draws.reshape(*draws.shape[:2], -1)
    found: dict = {name: [] for name in ("mean", "sd", "mcse", "ess", "r_hat")}
    for i in range(flat.shape[2]):
        x = flat[..., i]
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


# Each data set: its data, priors, model, bounds, share and chance, length of the chains, and seed.

SEVEN, THREE = 1 / 7, 1 / 3
PLANS = {
    "ratings": (simulated_ratings, RATING_PRIORS, None, 0.0, 7.5, 6000, 131),
    "choices": (simulated_choices, CHOICE_PRIORS, forced_choice, SEVEN, 0.1, 3000, 32),
    "oddity": (simulated_oddity, ODDITY_PRIORS, oddity, THREE, 0.1, 3000, 33),
}


def sampled(name: str, draws: int) -> dict:
    simulate, priors, share, chance, bound, _, seed = PLANS[name]
    data = simulate()
    model = (
        ratings_model(data, priors) if share is None else choices_model(data, priors, share, chance)
    )
    with model:
        trace = pm.sample(
            draws,
            tune=TUNE,
            chains=CHAINS,
            nuts_sampler="numpyro",
            target_accept=ACCEPT,
            random_seed=seed,
            progressbar=False,
        )
    post = {k: v.values for k, v in trace.posterior.items()}
    rng = np.random.default_rng(seed)
    drawn = completed(post, priors, rng)
    if share is not None:
        drawn["effects"] = effects_in_shares(post, drawn["effects"], share, chance)
    outside = (np.abs(drawn["effects"]) > bound) & (drawn["attends"] > 0)
    drawn["outside"] = outside.sum(axis=2).astype(float)
    kept = ("spread", "lapses", "typical", "level", "textures", "texture_effects", "slopes")
    drawn |= {name: post[name] for name in kept if name in post}
    summaries = {name: summary(one) for name, one in drawn.items()}
    for key, one in summaries.items():
        print(key, one, flush=True)
    stats = trace.sample_stats
    worst = max(np.max(one["r_hat"]) for one in summaries.values())
    return {
        "source": {
            "script": Path(__file__).name,
            "programs": {
                "pymc": pm.__version__,
                "numpyro": numpyro.__version__,
                "jax": jax.__version__,
                "arviz": arviz.__version__,
            },
            "sampler": f"NUTS (NumPyro), target acceptance {ACCEPT}",
            "chains": CHAINS,
            "tuning": TUNE,
            "draws": draws,
            "seed": seed,
            "divergences": int(stats["diverging"].values.sum()),
            "r_hat_max": float(f"{worst:.5g}"),
            "ess_min": round(float(min(np.min(one["ess"]) for one in summaries.values()))),
        },
        "priors": priors,
        "alternatives": None if share is None else round(1 / chance),
        "bounds": [-bound, bound],
        "data": {k: np.where(np.isnan(v), None, v).tolist() for k, v in data.items()},
        "posterior": summaries,
    }


def main(names: list[str]) -> None:
    check_shares()
    for name in names or PLANS:
        start = time.time()
        draws = int(os.environ.get("DRAWS", PLANS[name][5]))
        found = sampled(name, draws)
        print(name, round(time.time() - start), "s", found["source"], flush=True)
        text = json.dumps(found, indent=1, ensure_ascii=False)
        # One line for the innermost lists.
        text = re.sub(r"\[[^\[\]{}]*\]", lambda at: " ".join(at[0].split()), text)
        (HERE / f"{name}.json").write_text(text.replace("[ ", "[").replace(" ]", "]") + "\n")


if __name__ == "__main__":
    main(sys.argv[1:])
