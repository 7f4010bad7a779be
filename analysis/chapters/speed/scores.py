"""Time and accuracy of single participants: cells, scores, conditional accuracy.

docs/method/speed-accuracy.md
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from tactileq.analysis.columns import MODEL, TEXTURE
from tactileq.analysis.statistics.paired import (
    ignoring_case,
    t_test,
    why_undefined,
    without_rounding_noise,
)
from tactileq.modeling import InputError
from tactileq.modeling.arrays import Floats
from tactileq.modeling.files.columns import Column, names

PARTICIPANT = Column("participant_id", "participant", is_name=True)
TEXTURE_TIME_COLUMNS = (
    PARTICIPANT,
    TEXTURE,
    MODEL,
    Column("trials"),
    Column("median_s", "median time", "s"),
    Column("share_correct", "share of right answers", format=".2f"),
    Column("median_right_s", "median time of right answers", "s"),
    Column("median_wrong_s", "median time of wrong answers", "s"),
)
SCORE_COLUMNS = (
    PARTICIPANT,
    MODEL,
    Column("trials"),
    Column("time_s", "geometric mean time", "s"),
    Column("share_correct", "share of right answers", format=".2f"),
    Column("lisas_s", "LISAS", "s"),
)
MEAN_COLUMNS = (
    MODEL,
    Column("n", "participants"),
    Column("time_s", "geometric mean time", "s"),
    Column("time_low", "95% CI from", "s"),
    Column("time_high", "to", "s"),
    Column("share_correct", "share of right answers"),
    Column("share_low", "95% CI from"),
    Column("share_high", "to"),
)
CONDITIONAL_COLUMNS = (
    MODEL,
    Column("quantile", "quantile of time"),
    Column("n", "participants"),
    Column("time_s", "geometric mean time", "s"),
    Column("share_correct", "share of right answers"),
    Column("ci_low", "95% CI from"),
    Column("ci_high", "to"),
)


def speed_and_accuracy(answers: pd.DataFrame, *, models: Sequence[str]) -> pd.DataFrame:
    """Median time and share of right answers per participant, texture and model.

    docs/method/speed-accuracy.md#what-counts

    Parameters
    ----------
    answers : DataFrame
        participant_id, texture, model, response_time_s (s) and correct (0, 1 or NaN), a row per
        trial. Trials without an answer or a time above 0 are left out.

    Returns
    -------
    DataFrame
        `TEXTURE_TIME_COLUMNS`; times of right and of wrong answers are NaN where there is none.

    Raises
    ------
    InputError
        For tables without these columns.
    """
    own = timed_answers(answers, models)
    right = own["correct"] == 1
    times = own["response_time_s"]
    cells = own.assign(right_s=times.where(right), wrong_s=times.where(~right)).groupby(
        ["participant_id", "texture", "model"], sort=False
    )
    table = cells.agg(
        trials=("correct", "size"),
        median_s=("response_time_s", "median"),
        share_correct=("correct", "mean"),
        median_right_s=("right_s", "median"),
        median_wrong_s=("wrong_s", "median"),
    ).reset_index()
    return _in_order(table, models)[names(TEXTURE_TIME_COLUMNS)]


def participant_scores(answers: pd.DataFrame, *, models: Sequence[str]) -> pd.DataFrame:
    """Time, share of right answers and LISAS of each participant with each model.

    docs/method/speed-accuracy.md#what-counts

    Parameters
    ----------
    answers : DataFrame
        As in `speed_and_accuracy`.
    models : sequence of str
        Only textures that a participant judged with all of them count.

    Returns
    -------
    DataFrame
        `SCORE_COLUMNS`. Time (geometric mean) and share weigh textures equally; LISAS is of all
        trials, NaN where it cannot be had (`lisas`).
    """
    own = judged_with_all(answers, models)
    logs = own.assign(time_s=np.log(own["response_time_s"]), share_correct=own["correct"])
    cells = logs.groupby(["participant_id", "model", "texture"])[["time_s", "share_correct"]].mean()
    means = cells.groupby(["participant_id", "model"]).mean().reset_index()
    means["time_s"] = np.exp(means["time_s"])
    people = own.groupby("participant_id")
    found = {
        (who, model): score for who, trials in people for model, score in lisas(trials).items()
    }
    counts = own.groupby(["participant_id", "model"]).size()
    keys = list(zip(means["participant_id"], means["model"], strict=True))
    means["lisas_s"] = [found[key] for key in keys]
    means["trials"] = [int(counts[key]) for key in keys]
    return _in_order(means, models)[names(SCORE_COLUMNS)]


def lisas(trials: pd.DataFrame) -> pd.Series:
    """Linear integrated speed–accuracy scores of one participant, s, by model.

    Mean time of right answers plus share of wrong ones, the latter weighted by S_RT/S_PE, the
    standard deviations over the participant's trials (Vandierendonck 2017).
    docs/method/speed-accuracy.md#lisas

    Parameters
    ----------
    trials : DataFrame
        model, response_time_s (s, > 0) and correct (0 or 1), of one participant.

    Returns
    -------
    Series
        By model; the mean time alone where no answer with it was wrong, NaN where none was right,
        or where some were wrong and a single one was right with either model.
    """
    right = trials[trials["correct"] == 1]
    wrong = 1.0 - trials["correct"].astype(float)
    times = right.groupby("model")["response_time_s"].mean().reindex(trials["model"].unique())
    errors = wrong.groupby(trials["model"]).mean()
    # Without an error there is nothing to divide by, and nothing to add.
    spread = wrong.std()
    weight = right["response_time_s"].std() / spread if spread > 0 else 0.0
    return times + (weight * errors).where(errors > 0, 0.0)


def score_means(scores: pd.DataFrame) -> pd.DataFrame:
    """Means over participants, of log time and of the share, with 95 % intervals.

    Parameters
    ----------
    scores : DataFrame
        From `participant_scores`.

    Returns
    -------
    DataFrame
        `MEAN_COLUMNS`; limits are NaN where participants do not vary.
    """
    rows = []
    for model, own in scores.groupby("model", sort=False):
        time, *times = _mean_and_limits(np.log(own["time_s"].to_numpy(dtype=float)))
        share, *shares = _mean_and_limits(own["share_correct"].to_numpy(dtype=float))
        rows.append([model, len(own), *np.exp([time, *times]), share, *shares])
    return pd.DataFrame(rows, columns=names(MEAN_COLUMNS))


def conditional_accuracy(
    answers: pd.DataFrame, *, models: Sequence[str], bins: int = 4
) -> pd.DataFrame:
    """Share of right answers by quantile of response time.

    docs/method/speed-accuracy.md#conditional-accuracy

    Parameters
    ----------
    answers : DataFrame
        As in `speed_and_accuracy`.
    models : sequence of str
        Participants with fewer than `bins` answers on one of them are left out.
    bins : int
        Quantiles, ≥ 2: each participant's answers with a model, from the fastest, in groups of
        one size (where it does not divide, sizes differ by one).

    Returns
    -------
    DataFrame
        `CONDITIONAL_COLUMNS`, quantiles from 1. Means over participants with 95 % intervals over
        them, NaN where they do not vary.
    """
    if bins < 2:
        raise InputError(f"expected two quantiles of time or more, got {bins}; give more bins.")
    own = judged_with_all(answers, models)
    times = own.groupby(["participant_id", "model"])["response_time_s"]
    place, size = times.rank(method="first") - 1, times.transform("size")
    own = own.assign(
        quantile=(place * bins // size).astype(int) + 1,
        log_s=np.log(own["response_time_s"]),
        enough=size >= bins,
    )
    own = own[own.groupby("participant_id")["enough"].transform("all")]
    groups = ["model", "quantile", "participant_id"]
    each = own.groupby(groups)[["log_s", "correct"]].mean().reset_index()
    rows = []
    for (model, quantile), people in each.groupby(["model", "quantile"]):
        share, low, high = _mean_and_limits(people["correct"].to_numpy(dtype=float))
        time_s = float(np.exp(people["log_s"].mean()))
        rows.append([model, quantile, len(people), time_s, share, low, high])
    return _in_order(pd.DataFrame(rows, columns=names(CONDITIONAL_COLUMNS)), models)


def _mean_and_limits(values: Floats) -> tuple[float, float, float]:
    values = without_rounding_noise(values)
    low, high = (np.nan, np.nan) if why_undefined(values) else t_test(values)[2:]
    return float(values.mean()), low, high


def timed_answers(answers: pd.DataFrame, models: Sequence[str]) -> pd.DataFrame:
    """The answers on these models that have a time and are right or wrong."""
    needed = ("participant_id", "texture", "model", "response_time_s", "correct")
    missing = [name for name in needed if name not in answers]
    if missing:
        raise InputError(
            f"expected answers with the columns {', '.join(needed)}, got none called "
            f"{', '.join(missing)}; give the answers of a task with right ones."
        )
    known = answers["response_time_s"].between(0, np.inf, inclusive="neither")
    known &= answers["correct"].notna() & answers["model"].isin(models)
    kept = [*needed, *(["session"] if "session" in answers else [])]
    return answers.loc[known, kept].astype({"correct": float})


def judged_with_all(answers: pd.DataFrame, models: Sequence[str]) -> pd.DataFrame:
    """Those on textures that a participant judged with all of the models."""
    own = timed_answers(answers, models)
    held = own.groupby(["participant_id", "texture"])["model"].transform("nunique")
    return own[held == len(models)]


def _in_order(table: pd.DataFrame, models: Sequence[str]) -> pd.DataFrame:
    """Participants and textures by name, models in their own order."""
    places = {model: place for place, model in enumerate(models)}
    by = [name for name in ("participant_id", "texture", "model") if name in table]

    def key(column: pd.Series) -> pd.Series:
        return column.map(places) if column.name == "model" else ignoring_case(column)

    return table.sort_values(by, key=key, kind="stable", ignore_index=True)
