"""The answer to the report's question: one sentence, and the sentences behind it."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from analysis.answers.loading import Responses
from analysis.columns import p_value
from analysis.labels import ALL_TEXTURES, TASKS
from analysis.report.outcomes import Outcome, Weight
from analysis.report.sentences import ALPHA, signed
from analysis.statistics.overall import CORRECT_RATE

Row = Mapping[Hashable, Any]
NOBODY_ASKED = "Nobody was asked: this report holds models and no answers."


def answer(
    overall: pd.DataFrame, families: Sequence[pd.DataFrame], *, responses: Responses | None
) -> str:
    """Can anybody feel the difference? One sentence with intervals, computed from the answers.

    Parameters
    ----------
    overall : DataFrame
        From `overall.overall_tests`.
    families : sequence of DataFrame
        The paired tests texture by texture.
    responses : Responses, optional
        Who answered, and where.
    """
    if responses is None or not responses.textures:
        return NOBODY_ASKED
    if overall.empty:
        return "Nothing to compare: the full and simplified models of all textures are identical."
    told = f"{_circumstances(responses)}{_verdict(overall, families)}{_changes(overall)}"
    shown = overall["p_holm"] < ALPHA
    if overall["ci_low"].notna().any() and not shown.any():
        told += "; whatever lies within these intervals is not ruled out"
    return f"{told[0].upper()}{told[1:]}."


def overall_outcomes(overall: pd.DataFrame) -> list[Outcome]:
    """One sentence per measure, from `overall.overall_tests`."""
    return [
        Outcome(Weight.OVERALL, _overall_outcome(row))
        for row in overall.to_dict("records")
        if pd.notna(row["p_holm"])
    ]


def unfinished_tasks(responses: Responses) -> list[str]:
    """For each task that has less than was planned: how much of it there is."""
    told = []
    for task in responses.unfinished:
        done, planned = responses.done(task), responses.planned[task]
        told.append(
            f"{TASKS[task]}: {done.participants} of {planned.participants} planned participants, "
            f"{done.sessions} of {planned.sessions} planned sessions"
        )
    return told


def _overall_outcome(row: Row) -> str:
    p = p_value(row["p_holm"])
    return (
        f"{row['measure'].capitalize()}, simplified − full: {_change(row)}, t({row['df']}) = "
        f"{signed(row['t'], 2)}, Holm p {p if p.startswith('<') else f'= {p}'}, "
        f"d_z = {signed(row['d_z'], 2)} (textures: {row['textures']}; participants: {row['n']})."
    )


def _circumstances(responses: Responses) -> str:
    """Nobody may take a simulated or an unfinished study for a finished one with people."""
    if responses.simulated_participants:
        where = "in a simulation without people, "
    elif responses.simulated_rig:
        where = "at a simulated rig, where nobody felt a real surface, "
    else:
        where = ""
    return where + ("so far, " if responses.unfinished else "")


def _verdict(overall: pd.DataFrame, families: Iterable[pd.DataFrame]) -> str:
    if overall["p_holm"].isna().all():
        return "it cannot be told yet, for want of answers that vary between participants"
    if (overall["p_holm"] < ALPHA).any():
        return f"yes, over {_textures(overall)} together"
    single = [
        tests[(tests["p_holm"] < ALPHA) & (tests["texture"] != ALL_TEXTURES)] for tests in families
    ]
    differing = sorted({texture for tests in single for texture in tests["texture"]})
    if differing:
        return (
            f"in single textures ({', '.join(differing)}), but no difference was shown over "
            f"{_textures(overall)} together"
        )
    return "no difference was shown, which is not to say that there is none"


def _textures(overall: pd.DataFrame) -> str:
    count = int(overall["textures"].max())
    return f"{count} texture{'s' * (count != 1)}"


def _changes(overall: pd.DataFrame) -> str:
    measured = overall[overall["mean_difference"].notna()].to_dict("records")
    listed = ", ".join(f"{row['measure']} {_change(row)}" for row in measured)
    return f": mean difference, simplified − full, of the {listed}" if listed else ""


def _change(row: Row) -> str:
    rate = row["measure"] == CORRECT_RATE
    unit, factor = ("percentage points", 100.0) if rate else ("points of 100", 1.0)
    difference, low, high = (
        factor * row[name] for name in ("mean_difference", "ci_low", "ci_high")
    )
    undefined = np.isnan(low)
    interval = "no interval" if undefined else f"95% CI {signed(low, 1)} to {signed(high, 1)}"
    return f"{signed(difference, 1)} {unit} ({interval})"
