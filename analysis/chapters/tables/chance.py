"""Accuracy of each condition against chance, and the sensitivity d′ that it corresponds to.

docs/method/tables.md#chance
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
import pandas as pd

from tactileq.analysis.chapters.tables.factorial import cell_means, interval_of
from tactileq.analysis.chapters.tables.sentences import D_PRIME
from tactileq.analysis.columns import P
from tactileq.analysis.statistics.dprime import d_primes, m_afc_d_prime, yes_no_d_prime
from tactileq.analysis.statistics.paired import holm, mean_test, why_undefined
from tactileq.modeling.files.columns import Column, names

CHANCE_COLUMNS = (
    Column("condition", is_name=True),
    Column("n", "participants"),
    Column("mean", "accuracy"),
    Column("ci_low", "95% CI from"),
    Column("ci_high", "to"),
    Column("t", format=".2f"),
    Column("df"),
    P,
    Column("p_holm", "p (Holm)", is_p_value=True),
    D_PRIME,
    Column("d_prime_low", "95% CI from", format=".2f"),
    Column("d_prime_high", "to", format=".2f"),
    Column("note"),
)
DPrime = tuple[float, float, float, str]  # with its interval, and why there is none
UNDEFINED = (np.nan, np.nan, np.nan)


def against_chance(
    answers: pd.DataFrame,
    cells: pd.DataFrame,
    *,
    factors: Sequence[str],
    presented: Sequence[str],
    rng: np.random.Generator,
) -> pd.DataFrame:
    """One-sample t-tests of participants' accuracies against one in so many presented classes.

    Parameters
    ----------
    answers : DataFrame
        participant_id, the factors, presented, answered, correct and count.
    cells : DataFrame
        From `factorial.participant_cells`.
    presented : sequence of str
        Two or more.
    rng : Generator
        Draws sign flips, which give p where all participants are equally accurate.

    Returns
    -------
    DataFrame
        `CHANCE_COLUMNS`, a row per condition; t and p are NaN of one participant, d′ wherever it
        would be infinite.
    """
    rows = []
    for row in cell_means(cells, factors).to_dict("records"):
        own = cells.loc[cells["condition"] == row["condition"], "mean"].to_numpy(dtype=float)
        t, p = mean_test(own - 1 / len(presented), rng=rng) if own.size > 1 else (np.nan, np.nan)
        which = np.logical_and.reduce([answers[f] == row[f] for f in factors])
        d_prime, low, high, why = _d_prime(
            answers[which] if factors else answers,
            presented,
            shares=(row["mean"], row["ci_low"], row["ci_high"]),
        )
        note = "; ".join(filter(None, (why_undefined(own.round(12)), why)))
        tested: dict[str, object] = {"t": t, "df": own.size - 1, "p": p, "note": note}
        of_d_prime = {"d_prime": d_prime, "d_prime_low": low, "d_prime_high": high}
        rows.append(row | tested | of_d_prime)
    table = pd.DataFrame(rows).assign(p_holm=lambda table: holm(table["p"]))
    return table[names(CHANCE_COLUMNS)]


def _d_prime(
    answers: pd.DataFrame, presented: Sequence[str], *, shares: tuple[float, float, float]
) -> DPrime:
    there = answers.loc[answers["count"] > 0, "presented"].nunique()
    if there < len(presented):
        return *UNDEFINED, f"no d′: {there} of {len(presented)} classes presented"
    if len(presented) == 2:
        return _two_class_d_prime(answers, presented)
    of = partial(m_afc_d_prime, alternatives=len(presented))
    d, low, high = (x if np.isfinite(x) else np.nan for x in d_primes(*shares, of=of))
    return d, low, high, "" if np.isfinite(d) else f"no d′: accuracy {shares[0]:.0f}"


def _two_class_d_prime(answers: pd.DataFrame, presented: Sequence[str]) -> DPrime:
    """Mean over the participants who were presented both, each by hits and false alarms."""
    if not answers["answered"].isin(presented).all():
        return *UNDEFINED, "no d′: answers other than the two classes"
    counts = answers.pivot_table(
        index="participant_id",
        columns=["presented", "answered"],
        values="count",
        aggfunc="sum",
    ).reindex(columns=pd.MultiIndex.from_product([presented, presented]), fill_value=0)
    hits, misses, false_alarms, rejections = counts.fillna(0).to_numpy(dtype=float).T
    values = yes_no_d_prime(
        hits, hits + misses, false_alarms=false_alarms, noise=false_alarms + rejections
    )
    values = values[np.isfinite(values)]
    if not values.size:
        return *UNDEFINED, "no d′: no participant was presented both classes"
    return float(values.mean()), *interval_of(values), ""
