"""Correct rates of the relative task, against chance and between models."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import numpy as np
import pandas as pd
from scipy import stats

from analysis.columns import MODEL, TEXTURE, Column, P, names
from analysis.labels import ALL_TEXTURES, MODELS
from analysis.statistics.paired import (
    CI_HIGH,
    CI_LOW,
    CONFIDENCE,
    DF,
    NOTE,
    P_HOLM,
    PAIRED_COLUMNS,
    T,
    holm,
    ignoring_case,
    mean,
    paired_family,
    standard_error,
    t_test,
    why_undefined,
    without_rounding_noise,
)
from modeling import InputError
from modeling.arrays import Floats

BOOTSTRAP_RESAMPLES = 5000
RATE_TEST_COLUMNS = PAIRED_COLUMNS


def rate_tests(relative: pd.DataFrame, *, identical: Collection[str] = frozenset()) -> pd.DataFrame:
    """Paired tests of the correct rates (PAPER VIII-B), Holm over the textures.

    Parameters
    ----------
    relative : DataFrame
        `Responses.relative`; rates are shares 0–1 per participant.
    identical : collection of str
        As in `rating_tests`. They stay in the row over all textures, where the choice was among
        all models of one kind.

    Returns
    -------
    DataFrame
        One row per texture as in `rating_tests`, then one over all textures, which is not part
        of the family (its p_holm is NaN).
    """
    family = paired_family(relative, "correct", identical=identical)
    overall = paired_family(relative.assign(texture=ALL_TEXTURES), "correct")
    tests = pd.concat([family, overall.assign(p_holm=np.nan)], ignore_index=True)
    return tests[names(RATE_TEST_COLUMNS)]


CORRECT_RATE_COLUMNS = (
    TEXTURE,
    MODEL,
    Column("participants"),
    Column("trials"),
    Column("mean"),
    Column("se", "SE"),
    *(CI_LOW, CI_HIGH, T, DF, P, NOTE, P_HOLM),
)


def correct_rates(
    relative: pd.DataFrame, *, rng: np.random.Generator, chance: float = 1 / 7
) -> pd.DataFrame:
    """Correct rates per texture and model against chance, participants as units.

    docs/method/statistics.md#correct-rates

    Parameters
    ----------
    relative : DataFrame
        Columns participant_id, texture, model, correct (0, 1 or NaN).
    rng : Generator
        Draws the participants of the bootstrap.
    chance : float
        Rate of a guessing participant, 0 … 1.

    Returns
    -------
    DataFrame
        texture, model, participants, trials, mean, se, ci_low, ci_high (95 %, bias-corrected and
        accelerated bootstrap over participants), t, df, p (one-sample t of the participants'
        rates against chance, two-sided), note, p_holm (over the textures of one model). The rows
        `all textures` pool a participant's trials and stand outside the family.
    """
    pooled = relative.assign(texture=ALL_TEXTURES)
    rows = []
    for model in MODELS:
        for table in (relative, pooled):
            chosen = table[table["model"] == model]
            family = pd.DataFrame(
                _rate_row(cell, rng=rng, chance=chance) | {"texture": texture, "model": model}
                for texture, cell in chosen.groupby("texture", sort=False)
            )
            if family.empty:
                continue
            family["p_holm"] = holm(family["p"]) if table is relative else np.nan
            rows.append(family.sort_values("texture", key=ignoring_case))
    if not rows:
        raise InputError("expected answers of the forced choice, got none; run a session first.")
    return pd.concat(rows, ignore_index=True)[names(CORRECT_RATE_COLUMNS)]


def _rate_row(cell: pd.DataFrame, *, rng: np.random.Generator, chance: float) -> dict[str, Any]:
    rates = cell.groupby("participant_id")["correct"].mean().dropna().to_numpy(dtype=float)
    against_chance = without_rounding_noise(rates - chance)
    undefined = why_undefined(against_chance)
    t, p = (np.nan, np.nan) if undefined else t_test(against_chance)[:2]
    low, high = (np.nan, np.nan) if undefined else bootstrap_interval(rates, rng)
    return {
        "participants": rates.size,
        "trials": int(cell["correct"].notna().sum()),
        "mean": mean(rates),
        "se": standard_error(rates),
        "ci_low": low,
        "ci_high": high,
        "t": t,
        "df": max(rates.size - 1, 0),
        "p": p,
        "note": undefined,
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
