"""Reliability of the answers: agreement, repeatability, ends of the scale, carelessness.

docs/method/reliability.md
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from typing import Literal

import numpy as np
import pandas as pd
from scipy import stats

from tactileq.analysis.statistics.paired import ignoring_case, sign_flips_p
from tactileq.modeling.errors import counted
from tactileq.modeling.files.answer_tables import ENDS
from tactileq.modeling.files.columns import Column, names

ALPHA = 0.05
LEAST_ANSWERS = 5  # fewer do not show how somebody answers

AGREEMENT_COLUMNS = (
    Column("scale", is_name=True),
    Column("kind", "intraclass correlation", is_name=True),
    Column("ratings", "ratings in it"),
    Column("icc", "ICC", format=".2f"),
    Column("ci_low", "95% CI from", format=".2f"),
    Column("ci_high", "to", format=".2f"),
    Column("participants"),
    Column("cells", "textures × models"),
    Column("excluded"),
    Column("note"),
)
RATER_COLUMNS = (
    Column("participant_id", "participant", is_name=True),
    Column("scale", is_name=True),
    Column("ratings"),
    Column("mean", format=".1f"),
    Column("share_at_ends", "share at ends", format=".2f"),
    Column("repeated_cells", "textures × models rated again"),
    Column("within_sd", "SD between repeats", format=".1f"),
)
SIGN_COLUMNS = (
    Column("participant_id", "participant", is_name=True),
    Column("sign", "what stands out", is_name=True),
    Column("detail"),
)

# McGraw and Wong's names, and of how many ratings each is.
_KINDS = {
    "ICC(A,1)": ("agreement, one rating", False),
    "ICC(A,k)": ("agreement, mean of all", True),
    "ICC(C,1)": ("consistency, one rating", False),
    "ICC(C,k)": ("consistency, mean of all", True),
}


def agreement(ratings: pd.DataFrame, scale: str) -> pd.DataFrame:
    """Intraclass correlations of the ratings on one scale, two-way, with 95 % intervals.

    docs/method/reliability.md#agreement

    Parameters
    ----------
    ratings : DataFrame
        participant_id, texture, model and `scale`, a row per answer (NaN: not answered). What is
        rated are the cells texture × model; the participants are the raters. Repeats are averaged.

    Returns
    -------
    DataFrame
        `AGREEMENT_COLUMNS`, a row for each kind of correlation. Participants without an answer in
        one of the cells are left out and named under `excluded`; the limits have the two decimals
        of the library. Where there is no correlation it is NaN and `note` says why.
    """
    cells = ratings.pivot_table(
        index="participant_id", columns=["texture", "model"], values=scale, observed=True
    )
    everybody = ratings["participant_id"].unique()
    complete = cells.dropna()
    why = _why_no_correlation(complete)
    found = {} if why else _correlations(complete)
    rows = [
        {
            "scale": scale,
            "kind": kind,
            "ratings": len(complete) if of_mean else 1,
            **found.get(name, dict.fromkeys(("icc", "ci_low", "ci_high"), np.nan)),
            "participants": len(complete),
            "cells": complete.shape[1],
            "excluded": ", ".join(sorted(set(everybody) - set(complete.index))),
            "note": why,
        }
        for name, (kind, of_mean) in _KINDS.items()
    ]
    return pd.DataFrame(rows, columns=names(AGREEMENT_COLUMNS))


def _why_no_correlation(complete: pd.DataFrame) -> str:
    people, cells = complete.shape
    if people < 2 or cells < 2:
        return f"undefined: {counted(people, 'participant')} with {counted(cells, 'cell')}"
    values = complete.to_numpy(dtype=float)
    if np.ptp(values) == 0:
        return "undefined: all ratings are the same"
    # Rounding noise of a perfect agreement would be divided by itself.
    residuals = values - values.mean(axis=0) - values.mean(axis=1, keepdims=True) + values.mean()
    if np.abs(residuals).max() < 1e-9:
        return "undefined: participants differ only in their mean"
    return ""


def _correlations(complete: pd.DataFrame) -> dict[str, dict[str, float]]:
    from pingouin import intraclass_corr  # late: it takes a second to import

    flat = complete.set_axis(range(complete.shape[1]), axis=1)
    long = flat.melt(ignore_index=False, var_name="cell", value_name="rating").reset_index()
    with warnings.catch_warnings():
        # It uses an argument that pandas will drop; nothing of ours.
        warnings.simplefilter("ignore", DeprecationWarning)
        table = intraclass_corr(long, targets="cell", raters="participant_id", ratings="rating")
    return {
        row["Type"]: {
            "icc": float(row["ICC"]),
            "ci_low": float(row["CI95"][0]),
            "ci_high": float(row["CI95"][1]),
        }
        for row in table.to_dict("records")
    }


def rater_table(ratings: pd.DataFrame, scale: str) -> pd.DataFrame:
    """How each participant used a scale, and how much their repeated ratings differ.

    docs/method/reliability.md#repeatability

    Parameters
    ----------
    ratings : DataFrame
        As in `agreement`.

    Returns
    -------
    DataFrame
        `RATER_COLUMNS`, a row per participant. `share_at_ends`: share of the ratings at 0 or 100.
        `within_sd`: standard deviation between ratings of the same texture with the same model,
        pooled over the cells that were rated again; NaN where none was.
    """
    answered = ratings[ratings[scale].notna()]
    rows = []
    for person, own in answered.groupby("participant_id"):
        variances = own.groupby(["texture", "model"], observed=True)[scale].agg(["var", "count"])
        again = variances[variances["count"] > 1]
        rows.append(
            {
                "participant_id": person,
                "scale": scale,
                "ratings": len(own),
                "mean": own[scale].mean(),
                "share_at_ends": own[scale].isin(ENDS).mean(),
                "repeated_cells": len(again),
                "within_sd": _pooled_sd(again),
            }
        )
    table = pd.DataFrame(rows, columns=names(RATER_COLUMNS))
    return table.sort_values("participant_id", key=ignoring_case, ignore_index=True)


def _pooled_sd(again: pd.DataFrame) -> float:
    """Each cell weighs by its degrees of freedom; NaN without a cell."""
    df = again["count"] - 1
    return float(np.sqrt((again["var"] * df).sum() / df.sum())) if len(again) else float("nan")


def within_participant_sd(raters: pd.DataFrame) -> float:
    """Standard deviation between a participant's own ratings of the same, over all participants.

    docs/method/reliability.md#repeatability

    Parameters
    ----------
    raters : DataFrame
        From `rater_table`.

    Returns
    -------
    float
        Root of the participants' mean variance, everybody weighing the same; NaN without repeats.
    """
    return float(np.sqrt((raters["within_sd"] ** 2).mean()))


def same_ratings(ratings: pd.DataFrame, scale: str) -> pd.DataFrame:
    """Participants whose ratings on a scale are all the same.

    docs/method/reliability.md#careless-answers

    Parameters
    ----------
    ratings : DataFrame
        participant_id and `scale`.

    Returns
    -------
    DataFrame
        `SIGN_COLUMNS`, a row for each such participant with at least five ratings; a description,
        never an exclusion.
    """
    by_person = ratings.groupby("participant_id")[scale].agg(["count", "min", "max"])
    same = by_person[(by_person["count"] >= LEAST_ANSWERS) & (by_person["min"] == by_person["max"])]
    return _signs(
        (person, "all ratings the same", f"{count:.0f} ratings of {value:g}")
        for person, count, value in same[["count", "min"]].itertuples(name=None)
    )


def fast_answers(answers: pd.DataFrame, *, limit_s: float) -> pd.DataFrame:
    """Participants all of whose answers came faster than a limit.

    Parameters
    ----------
    answers : DataFrame
        participant_id and response_time_s.
    limit_s : float
        Seconds, > 0; stated before the data.

    Returns
    -------
    DataFrame
        As `same_ratings`.
    """
    by_person = answers.groupby("participant_id")["response_time_s"].agg(["count", "max"])
    fast = by_person[(by_person["count"] >= LEAST_ANSWERS) & (by_person["max"] < limit_s)]
    return _signs(
        (person, f"every answer within {limit_s:g} s", f"{count:.0f} answers, slowest {slow:.2g} s")
        for person, count, slow in fast.itertuples(name=None)
    )


def answers_at_chance(
    answers: pd.DataFrame, *, chance: float, rng: np.random.Generator
) -> pd.DataFrame:
    """Participants who are not shown to be above chance where the group is.

    Their right answers are not above chance and below the others' mean rate (exact binomial tests,
    each one-sided at 5 %), so that nobody is named because of few trials; the group's rates are
    above chance by sign flips (one-sided, 5 %).

    docs/method/reliability.md#careless-answers

    Parameters
    ----------
    answers : DataFrame
        participant_id and correct (0, 1 or NaN).
    chance : float
        Rate of a guessing participant, 0 … 1.
    rng : Generator
        Draws sign flips.

    Returns
    -------
    DataFrame
        As `same_ratings`.
    """
    people = answers.groupby("participant_id")["correct"].agg(["sum", "count", "mean"])
    people = people[people["count"] >= LEAST_ANSWERS]
    above = (people["mean"] - chance).to_numpy(dtype=float)
    if len(people) < 2 or sign_flips_p(above, rng=rng, alternative="greater") >= ALPHA:
        return _signs(())
    found = []
    for person, right, count, rate in people.itertuples(name=None):
        others = float(people["mean"].drop(person).mean())
        if not _differs(right, count, chance, "greater") and _differs(right, count, others, "less"):
            rates = f"{right:.0f} of {count:.0f} right ({rate:.0%}; chance {chance:.0%}, "
            found.append((person, "right answers at chance", f"{rates}the others {others:.0%})"))
    return _signs(found)


def _differs(
    right: float, count: float, rate: float, alternative: Literal["greater", "less"]
) -> bool:
    test = stats.binomtest(int(right), int(count), rate, alternative=alternative)
    return bool(test.pvalue < ALPHA)


def _signs(found: Iterable[tuple[str, str, str]]) -> pd.DataFrame:
    return pd.DataFrame(list(found), columns=names(SIGN_COLUMNS), dtype=object)
