"""Correct rates of the forced choice against chance."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from scipy import stats

from tactileq.analysis.columns import MODEL, TEXTURE, P
from tactileq.analysis.labels import ALL_TEXTURES
from tactileq.analysis.statistics.paired import (
    CONFIDENCE,
    holm,
    ignoring_case,
    mean,
    mean_test,
    standard_error,
    why_undefined,
    without_rounding_noise,
)
from tactileq.modeling import InputError
from tactileq.modeling.arrays import Floats
from tactileq.modeling.files.columns import Column, names

BOOTSTRAP_RESAMPLES = 5000
UNKNOWN_CHANCE = "chance not declared"
CORRECT_RATE_COLUMNS = (
    TEXTURE,
    MODEL,
    Column("participants"),
    Column("trials"),
    Column("mean"),
    Column("se", "SE"),
    Column("ci_low", "95% CI from"),
    Column("ci_high", "to"),
    Column("t"),
    Column("df"),
    P,
    Column("note"),
    Column("p_holm", "p (Holm)", is_p_value=True),
)


def correct_rates(
    answers: pd.DataFrame,
    models: Sequence[str],
    *,
    rng: np.random.Generator,
    chance: float = 1 / 7,
) -> pd.DataFrame:
    """Correct rates per texture and model against chance, participants as units.

    docs/method/statistics.md#correct-rates

    Parameters
    ----------
    answers : DataFrame
        Columns participant_id, texture, model, correct (0, 1 or NaN).
    models : sequence of str
        The sets of models, in the order of the rows.
    rng : Generator
        Draws the participants of the bootstrap, and sign flips.
    chance : float
        Rate of a guessing participant, 0 … 1; NaN where it is not known, so that nothing is tested.

    Returns
    -------
    DataFrame
        texture, model, participants, trials, mean, se, ci_low, ci_high (95 %, bias-corrected and
        accelerated bootstrap over participants), t, df, p (one-sample t of the participants'
        rates against chance, two-sided; of sign flips where all have one rate), note, p_holm (over
        the textures of one model). The rows `all textures` stand outside the family: means over
        the textures, each counting once, of participants who answered on all of them.

    Raises
    ------
    InputError
        Where nobody answered.
    """
    rates = answers.groupby(["model", "texture", "participant_id"])["correct"].mean().dropna()
    trials = answers[answers["correct"].notna()].groupby(["model", "texture"]).size()
    rows: list[pd.DataFrame] = []
    for model in models:
        if model not in rates.index.get_level_values("model"):
            continue
        wide = rates.loc[model].unstack("texture")
        family = pd.DataFrame(
            {
                "texture": texture,
                "trials": int(trials[model, texture]),
                **_rate_row(of_texture.dropna().to_numpy(float), rng=rng, chance=chance),
            }
            for texture, of_texture in wide.items()
        ).sort_values("texture", key=ignoring_case)
        complete = wide.dropna()
        overall = _rate_row(complete.mean(axis=1).to_numpy(float), rng=rng, chance=chance)
        of_complete = answers["participant_id"].isin(complete.index) & (answers["model"] == model)
        overall |= {
            "texture": ALL_TEXTURES,
            "trials": int(answers[of_complete]["correct"].notna().sum()),
        }
        both = [family.assign(p_holm=holm(family["p"])), pd.DataFrame([overall])]
        rows += [table.assign(model=model) for table in both]
    if not rows:
        raise InputError("expected answers that are right or wrong, got none; run a session first.")
    return pd.concat(rows, ignore_index=True)[names(CORRECT_RATE_COLUMNS)]


def _rate_row(rates: Floats, *, rng: np.random.Generator, chance: float) -> dict[str, Any]:
    """Of one rate per participant."""
    undefined = why_undefined(without_rounding_noise(rates))
    low, high = (np.nan, np.nan) if undefined else bootstrap_interval(rates, rng)
    t, p = (np.nan, np.nan) if np.isnan(chance) else mean_test(rates - chance, rng=rng)
    return {
        "participants": rates.size,
        "mean": mean(rates),
        "se": standard_error(rates),
        "ci_low": low,
        "ci_high": high,
        "t": t,
        "df": max(rates.size - 1, 0),
        "p": p,
        "note": UNKNOWN_CHANCE if np.isnan(chance) else undefined,
    }


def bootstrap_interval(rates: Floats, rng: np.random.Generator) -> tuple[float, float]:
    """95 % interval of the mean of (n,) rates, not all equal, over resampled participants."""
    low, high = bootstrap_intervals(rates[None, :], rng)
    return float(low[0]), float(high[0])


def bootstrap_intervals(rates: Floats, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """The same of each row of (k, n) rates, (k,) each."""
    interval = stats.bootstrap(
        (rates,),
        np.mean,
        axis=1,
        n_resamples=BOOTSTRAP_RESAMPLES,
        confidence_level=CONFIDENCE,
        method="BCa",
        rng=rng,
    ).confidence_interval
    return np.asarray(interval.low), np.asarray(interval.high)


def clopper_pearson(hits: int, of: int, *, confidence: float = CONFIDENCE) -> tuple[float, float]:
    """Exact interval of a probability by `hits` of `of` (Clopper and Pearson 1934)."""
    interval = stats.binomtest(hits, of).proportion_ci(confidence, method="exact")
    return float(interval.low), float(interval.high)
