"""Speed and accuracy of answers: time against correctness, for two models.

docs/method/speed-accuracy.md
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from tactileq.analysis.chapters.speed.scores import (
    judged_with_all,
    participant_scores,
    timed_answers,
)
from tactileq.analysis.columns import MODEL, P
from tactileq.analysis.statistics.mixed import mixed_effects
from tactileq.analysis.statistics.paired import (
    paired_test,
)
from tactileq.modeling.arrays import Floats
from tactileq.modeling.files.columns import Column, names

SPEED_MEASURES = {
    "time_s": "response time (s, geometric mean)",
    "share_correct": "share of right answers",
    "lisas_s": "LISAS (s)",
}
RATIO, DIFFERENCE = "ratio", "difference"

SPEED_COMPARISON_COLUMNS = (
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
        `SPEED_COMPARISON_COLUMNS`, rows `SPEED_MEASURES`. Time is tested in logarithms: its means
        are geometric, its effect is the ratio other/reference; the others are differences
        other − reference. `excluded` names who has no value with one of the models.
    """
    scores = participant_scores(answers, models=models)
    rows = []
    for measure in SPEED_MEASURES:
        wide = scores.pivot(index="participant_id", columns="model", values=measure)
        wide = wide.reindex(columns=list(models))
        whole = wide.dropna()
        excluded = ", ".join(sorted(set(answers["participant_id"]) - set(whole.index)))
        row = {"measure": measure, "excluded": excluded}
        rows.append(row | _compared(whole.to_numpy(dtype=float), measure == "time_s", rng=rng))
    return pd.DataFrame(rows, columns=names(SPEED_COMPARISON_COLUMNS))


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
    rng : Generator
        Draws sign flips.

    Returns
    -------
    DataFrame
        `RIGHT_WRONG_COLUMNS`, of participants with right and wrong answers, in log time.
    """
    own = timed_answers(answers, models)
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
        `TIME_RATIO_COLUMNS`, a row for each term of
        `tactileq.analysis.statistics.mixed.mixed_effects`.
    """
    own = judged_with_all(answers, models)
    logs = own.assign(log_time=np.log(own["response_time_s"]))
    found = mixed_effects(logs, "log_time", models=models, rng=rng)
    ratios = found.assign(
        ratio=np.exp(found["estimate"].astype(float)),
        ci_low=np.exp(found["ci_low"].astype(float)),
        ci_high=np.exp(found["ci_high"].astype(float)),
    )
    return ratios[names(TIME_RATIO_COLUMNS)]
