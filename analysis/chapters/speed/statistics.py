"""Speed and accuracy of answers: time against correctness, for two models.

docs/method/speed-accuracy.md
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from analysis.columns import MODEL, TEXTURE, P
from analysis.statistics.equivalence import ALPHA
from analysis.statistics.mixed import mixed_effects
from analysis.statistics.paired import (
    ignoring_case,
    paired_test,
    t_test,
    why_undefined,
    without_rounding_noise,
)
from modeling import InputError
from modeling.arrays import Floats
from modeling.errors import counted
from modeling.files.columns import Column, names

MEASURES = {
    "time_s": "response time (s, geometric mean)",
    "share_correct": "share of right answers",
    "lisas_s": "LISAS (s)",
}
RATIO, DIFFERENCE = "ratio", "difference"

PARTICIPANT = Column("participant_id", "participant", is_name=True)
CELL_COLUMNS = (
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
COMPARISON_COLUMNS = (
    Column("measure", is_name=True),
    Column("n", "participants"),
    Column("mean_reference", "mean of reference"),
    Column("mean_other", "mean of other"),
    Column("effect", "other to reference", is_name=True),
    Column("estimate"),
    Column("ci_low", "95% CI from"),
    Column("ci_high", "to"),
    Column("t", format=".2f"),
    Column("df"),
    P,
    Column("d_z", format=".2f"),
    Column("note"),
    Column("excluded"),
)
RIGHT_WRONG_COLUMNS = (
    MODEL,
    Column("n", "participants"),
    Column("right_s", "geometric mean time of right answers", "s"),
    Column("wrong_s", "of wrong answers", "s"),
    Column("ratio", "wrong to right"),
    Column("ci_low", "95% CI from"),
    Column("ci_high", "to"),
    P,
    Column("note"),
)
TIME_RATIO_COLUMNS = (
    Column("term", is_name=True),
    Column("method", is_name=True),
    Column("n", "participants"),
    Column("answers"),
    Column("ratio", "times as long", format=".3f"),
    Column("ci_low", "95% CI from", format=".3f"),
    Column("ci_high", "to", format=".3f"),
    Column("t", format=".2f"),
    Column("df", format=".0f"),
    P,
    Column("note"),
)

_TRADE_OFFS = {
    (-1, -1): "faster and less accurate: a speed–accuracy trade-off",
    (1, 1): "slower and more accurate: a speed–accuracy trade-off",
    (-1, 1): "faster and more accurate: no speed–accuracy trade-off",
    (1, -1): "slower and less accurate: no speed–accuracy trade-off",
    (0, 0): "no difference in time or accuracy was shown",
}
_ONE_SIDED = {
    (-1, 0): "faster",
    (1, 0): "slower",
    (0, -1): "less accurate",
    (0, 1): "more accurate",
}


def speed_and_accuracy(answers: pd.DataFrame, *, models: Sequence[str]) -> pd.DataFrame:
    """Median time and share of right answers per participant, texture and model.

    docs/method/speed-accuracy.md#what-counts

    Parameters
    ----------
    answers : DataFrame
        participant_id, texture, model, response_time_s (s) and correct (0, 1 or NaN), a row per
        trial. Trials without an answer or a time above 0 are left out.
    models : sequence of str

    Returns
    -------
    DataFrame
        `CELL_COLUMNS`; times of right and of wrong answers are NaN where there is none.

    Raises
    ------
    InputError
        For tables without these columns.
    """
    own = _timed(answers, models)
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
    return _in_order(table, models)[names(CELL_COLUMNS)]


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
    own = _in_all(answers, models)
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
    own = _in_all(answers, models)
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


def compare_models(
    answers: pd.DataFrame, *, models: tuple[str, str], rng: np.random.Generator
) -> pd.DataFrame:
    """Time, accuracy and LISAS with two models, paired over participants.

    docs/method/speed-accuracy.md#trade-off

    Parameters
    ----------
    answers : DataFrame
        As in `speed_and_accuracy`.
    models : (str, str)
        The reference, and the other one.
    rng : Generator
        Draws sign flips.

    Returns
    -------
    DataFrame
        `COMPARISON_COLUMNS`, rows `MEASURES`. Time is tested in logarithms: its means are
        geometric, its effect is the ratio other/reference; the others are differences
        other − reference. `excluded` names who has no value with one of the models.
    """
    scores = participant_scores(answers, models=models)
    rows = []
    for measure in MEASURES:
        wide = scores.pivot(index="participant_id", columns="model", values=measure)
        wide = wide.reindex(columns=list(models))
        whole = wide.dropna()
        excluded = ", ".join(sorted(set(answers["participant_id"]) - set(whole.index)))
        row = {"measure": measure, "excluded": excluded}
        rows.append(row | _compared(whole.to_numpy(dtype=float), measure == "time_s", rng=rng))
    return pd.DataFrame(rows, columns=names(COMPARISON_COLUMNS))


def _compared(values: Floats, as_ratio: bool, *, rng: np.random.Generator) -> dict[str, object]:
    """The paired test of (n, 2) values, in logarithms where their ratio is asked for."""
    test = paired_test(*(np.log(values) if as_ratio else values).T, rng=rng)
    back = np.exp if as_ratio else np.asarray
    shown = {
        "mean_reference": test.mean_reference,
        "mean_other": test.mean_other,
        "estimate": test.mean_difference,
        "ci_low": test.ci_low,
        "ci_high": test.ci_high,
    }
    tested = {name: getattr(test, name) for name in ("n", "t", "df", "p", "d_z", "note")}
    effect = RATIO if as_ratio else DIFFERENCE
    return {name: float(back(value)) for name, value in shown.items()} | tested | {"effect": effect}


def right_and_wrong(
    answers: pd.DataFrame, *, models: Sequence[str], rng: np.random.Generator
) -> pd.DataFrame:
    """Whether response times differ between wrong and right answers, paired over participants.

    docs/method/speed-accuracy.md#right-and-wrong-answers

    Parameters
    ----------
    answers : DataFrame
        As in `speed_and_accuracy`.
    models : sequence of str
    rng : Generator
        Draws sign flips.

    Returns
    -------
    DataFrame
        `RIGHT_WRONG_COLUMNS`, of participants with right and wrong answers, in log time.
    """
    own = _timed(answers, models)
    own = own.assign(log_s=np.log(own["response_time_s"]))
    means = own.pivot_table(index=["model", "participant_id"], columns="correct", values="log_s")
    means = means.reindex(columns=[1.0, 0.0]).dropna()
    rows = []
    for model in models:
        both = means[means.index.get_level_values("model") == model]
        test = paired_test(both[1.0], both[0.0], rng=rng)
        estimates = (test.mean_reference, test.mean_other, test.mean_difference)
        shown = np.exp([*estimates, test.ci_low, test.ci_high])
        rows.append([model, test.n, *shown, test.p, test.note])
    return pd.DataFrame(rows, columns=names(RIGHT_WRONG_COLUMNS))


def time_ratios(
    answers: pd.DataFrame, *, models: tuple[str, str], rng: np.random.Generator
) -> pd.DataFrame:
    """Time with the other model over that with the reference, by a mixed model of log time.

    docs/method/speed-accuracy.md#mixed-model

    Parameters
    ----------
    answers : DataFrame
        As in `speed_and_accuracy`, in the order of the trials; session where there are several.
    models : (str, str)
        The reference, and the other one.
    rng : Generator
        Draws sign flips of the paired test, where nothing can be fitted.

    Returns
    -------
    DataFrame
        `TIME_RATIO_COLUMNS`, a row for each term of `analysis.statistics.mixed.mixed_effects`.
    """
    own = _in_all(answers, models)
    logs = own.assign(log_time=np.log(own["response_time_s"]))
    found = mixed_effects(logs, "log_time", models=models, rng=rng)
    ratios = found.assign(
        ratio=np.exp(found["estimate"].astype(float)),
        ci_low=np.exp(found["ci_low"].astype(float)),
        ci_high=np.exp(found["ci_high"].astype(float)),
    )
    return ratios[names(TIME_RATIO_COLUMNS)]


def trade_off_sentence(comparison: pd.DataFrame, *, models: tuple[str, str]) -> str:
    """The joint result of time and accuracy; a gain in one is never reported without the other.

    docs/method/speed-accuracy.md#trade-off

    Parameters
    ----------
    comparison : DataFrame
        From `compare_models`.
    models : (str, str)
        The reference, and the other one.
    """
    by_measure = {row["measure"]: row for row in comparison.to_dict("records")}
    time, share = by_measure["time_s"], by_measure["share_correct"]
    reference, other = models
    about = f"Speed and accuracy, {other} compared with {reference} models"
    if share["n"] < 2:
        who = counted(share["n"], "participant")
        return f"{about}: not compared, because {who} answered with both."
    signs = (
        _direction(np.log(time["estimate"]), time["p"]),
        _direction(share["estimate"], share["p"]),
    )
    result = _TRADE_OFFS.get(signs) or (
        f"{_ONE_SIDED[signs]}; a difference in {'accuracy' if signs[0] else 'time'} was not shown, "
        "so a speed–accuracy trade-off is not ruled out"
    )
    points = [_signed(100 * share[name]) for name in ("estimate", "ci_low", "ci_high")]
    ratios = [f"{time[name]:.2f}" for name in ("estimate", "ci_low", "ci_high")]
    return (
        f"{about}: {result} (times as long: {_with_interval(ratios)}; right answers: "
        f"{_with_interval(points, unit=' percentage points')})."
    )


def _direction(effect: float, p: float) -> int:
    return int(np.sign(effect)) if p < ALPHA else 0


def _signed(value: float) -> str:
    return f"{value:+.1f}".replace("-", "−")


def _with_interval(numbers: Sequence[str], *, unit: str = "") -> str:
    estimate, low, high = numbers
    interval = "no interval" if "nan" in low else f"95% CI {low} to {high}"
    return f"{estimate}{unit}, {interval}"


def _mean_and_limits(values: Floats) -> tuple[float, float, float]:
    values = without_rounding_noise(values)
    low, high = (np.nan, np.nan) if why_undefined(values) else t_test(values)[2:]
    return float(values.mean()), low, high


def _timed(answers: pd.DataFrame, models: Sequence[str]) -> pd.DataFrame:
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


def _in_all(answers: pd.DataFrame, models: Sequence[str]) -> pd.DataFrame:
    """Those on textures that a participant judged with all of the models."""
    own = _timed(answers, models)
    held = own.groupby(["participant_id", "texture"])["model"].transform("nunique")
    return own[held == len(models)]


def _in_order(table: pd.DataFrame, models: Sequence[str]) -> pd.DataFrame:
    """Participants and textures by name, models in their own order."""
    places = {model: place for place, model in enumerate(models)}
    by = [name for name in ("participant_id", "texture", "model") if name in table]

    def key(column: pd.Series) -> pd.Series:
        return column.map(places) if column.name == "model" else ignoring_case(column)

    return table.sort_values(by, key=key, kind="stable", ignore_index=True)
