"""Whether the hand moved differently with one model than with the other.

docs/method/reliability.md#hand
"""

from __future__ import annotations

from dataclasses import asdict

import numpy as np
import pandas as pd

from tactileq.analysis.answers.hand import HAND_MEASURES
from tactileq.analysis.columns import P
from tactileq.analysis.statistics.draws import generators
from tactileq.analysis.statistics.paired import paired_test
from tactileq.modeling.files.columns import Column, names

_CELL = ["task", "measure", "participant_id"]

HAND_TEST_COLUMNS = (
    Column("task", is_name=True),
    Column("measure", is_name=True),
    Column("n"),
    Column("mean_reference", "mean of reference"),
    Column("se_reference", "SE"),
    Column("mean_other", "mean of other"),
    Column("se_other", "SE"),
    Column("mean_difference", "difference"),
    Column("ci_low", "95% CI from"),
    Column("ci_high", "to"),
    Column("t"),
    Column("df"),
    P,
    Column("d_z", "d_z"),
    Column("sign_flips_p", "sign flips p", is_p_value=True),
    Column("excluded"),
    Column("note"),
)

HAND_PARTICIPANT_COLUMNS = (
    Column("task", is_name=True),
    Column("participant_id", "participant", is_name=True),
    Column("speed_mm_s_reference", "speed, reference", "mm/s"),
    Column("speed_mm_s_other", "other", "mm/s"),
    Column("force_n_reference", "force, reference", "N"),
    Column("force_n_other", "other", "N"),
    Column("contact_s_reference", "in contact per trial, reference", "s"),
    Column("contact_s_other", "other", "s"),
    Column("presentations_reference", "presentations per trial, reference"),
    Column("presentations_other", "other"),
)


def hand_means(hand: pd.DataFrame, *, models: tuple[str, str]) -> pd.DataFrame:
    """Each participant's hand with either model, over the textures judged with both.

    docs/method/reliability.md#hand

    Parameters
    ----------
    hand : DataFrame
        From `tactileq.analysis.answers.hand.load_hand`.
    models : (str, str)
        The reference, and the other one.

    Returns
    -------
    DataFrame
        task, measure (a column's name in `hand`), participant_id, reference, other; each texture
        counts once; NaN where no texture has a value with both models.
    """
    long = hand[hand["model"].isin(models)].melt(
        ["task", "participant_id", "texture", "model"], list(HAND_MEASURES), "measure"
    )
    both = long.set_index([*_CELL, "texture", "model"])["value"].unstack("model")
    both = both.reindex(columns=list(models)).set_axis(["reference", "other"], axis=1)
    means = both.where(both.notna().all(axis=1)).groupby(_CELL).mean().reset_index()
    everybody = hand[["task", "participant_id"]].drop_duplicates()
    rows = everybody.merge(pd.DataFrame({"measure": HAND_MEASURES}), how="cross")
    return rows.merge(means, how="left")[[*_CELL, "reference", "other"]]


def hand_by_participant(means: pd.DataFrame) -> pd.DataFrame:
    """The same with a row per task and participant.

    Parameters
    ----------
    means : DataFrame
        From `hand_means`.

    Returns
    -------
    DataFrame
        `HAND_PARTICIPANT_COLUMNS`.
    """
    wide = means.pivot(index=["task", "participant_id"], columns="measure")
    wide = wide.set_axis(wide.columns.map(lambda pair: f"{pair[1]}_{pair[0]}"), axis=1)
    return wide.reset_index()[names(HAND_PARTICIPANT_COLUMNS)]


def hand_tests(
    hand: pd.DataFrame, *, models: tuple[str, str], rng: np.random.Generator
) -> pd.DataFrame:
    """Paired comparison of every measure of the hand between two models.

    docs/method/reliability.md#hand

    Parameters
    ----------
    hand, models
        As for `hand_means`.
    rng : Generator
        Draws sign flips.

    Returns
    -------
    DataFrame
        `HAND_TEST_COLUMNS`, a row per task and measure; differences are other − reference. Not
        corrected for their number, so that a doubt is reported rather than missed. Participants
        without a texture measured with both models are left out and named under `excluded`.
    """
    rows = []
    draws = generators(rng)
    for (task, measure), own in hand_means(hand, models=models).groupby(_CELL[:2], sort=False):
        pairs = own.dropna(subset=["reference", "other"])
        test = asdict(paired_test(pairs["reference"], pairs["other"], rng=draws[str(task)]))
        excluded = ", ".join(sorted(set(own["participant_id"]) - set(pairs["participant_id"])))
        rows.append({"task": task, "measure": measure, **test, "excluded": excluded})
    return pd.DataFrame(rows, columns=names(HAND_TEST_COLUMNS))
