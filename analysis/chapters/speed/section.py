"""The section on speed and accuracy: time against right answers, with each model.

docs/method/speed-accuracy.md
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
import pandas as pd

from tactileq.analysis.chapters.chapter import Answered, Stream
from tactileq.analysis.chapters.speed.comparison import (
    RIGHT_WRONG_COLUMNS,
    SPEED_COMPARISON_COLUMNS,
    SPEED_MEASURES,
    TIME_RATIO_COLUMNS,
    compare_models,
    right_and_wrong,
    time_ratios,
)
from tactileq.analysis.chapters.speed.figure import (
    figure_conditional_accuracy,
    figure_speed_accuracy,
)
from tactileq.analysis.chapters.speed.scores import (
    CONDITIONAL_COLUMNS,
    SCORE_COLUMNS,
    TEXTURE_TIME_COLUMNS,
    conditional_accuracy,
    participant_scores,
    score_means,
    speed_and_accuracy,
)
from tactileq.analysis.labels import TASK_TITLES, sentence_case
from tactileq.analysis.page.outcomes import Outcome, Weight
from tactileq.analysis.page.page import Fold, Item, Picture, Table
from tactileq.analysis.page.sections import Section, of_pairs
from tactileq.analysis.statistics.compared_answers import chance_of, holding_both
from tactileq.analysis.statistics.equivalence import ALPHA
from tactileq.modeling.errors import counted
from tactileq.modeling.files.answer_tables import ANSWER_TABLES, AnswerTable

BOTH = "both models in each trial"
# Title, note and columns of the tables behind the pictures.
_DETAILS = {
    "right_and_wrong": (
        "Times of right and wrong answers",
        "Geometric means of participants who gave both, and their ratio by a paired t-test of "
        "logarithms.",
        RIGHT_WRONG_COLUMNS,
    ),
    "scores": (
        "Time and accuracy of each participant",
        "Over the textures judged with all models shown, weighted equally; LISAS over trials.",
        SCORE_COLUMNS,
    ),
    "cells": ("By texture and model", "Median times.", TEXTURE_TIME_COLUMNS),
    "quantiles": (
        "Right answers by quantile of time",
        "Means over participants with 95% intervals over them.",
        CONDITIONAL_COLUMNS,
    ),
}


def applies(table: AnswerTable) -> bool:
    """Whether answers about surfaces are right or wrong, and timed."""
    return table.is_timed


def sections(answered: Answered) -> list[Section]:
    """A section on the time and the accuracy of answers with either model of each pair."""
    streams = list(answered.streams("speed", applies))
    by_pair = {}
    for pair in answered.pairs:
        different = answered.different(pair, applies)
        by_pair[pair] = speed_accuracy_section(
            [(stream, different[stream.task]) for stream in streams],
            models=pair,
            simulated=answered.responses.simulated,
        )
    section = of_pairs(by_pair)
    return [section] if section is not None else []


def speed_accuracy_section(
    answers: Iterable[tuple[Stream, pd.DataFrame]], *, models: tuple[str, str], simulated: bool
) -> Section | None:
    """How fast and how accurate answers were; None where answers are not scored or timed.

    Where both models are in every trial they are not compared.

    Parameters
    ----------
    answers : iterable of (Stream, DataFrame)
        Tasks with `Responses.answers`, textures with identical models left out.
    models : (str, str)
        The reference, and the other one.
    """
    items: list[Item] = []
    outcomes: list[Outcome] = []
    for stream, table in answers:
        task, shown, compared = stream.task, table, True
        groups: tuple[str, ...] = models
        if ANSWER_TABLES[task].both_models:
            shown = holding_both(task, table, models).assign(model=BOTH)
            groups, compared = (BOTH,), False
        if not len(shown) or not len(participant_scores(shown, models=groups)):
            continue
        chance = chance_of(task, shown)
        items += _pictures(shown, task, groups, chance=chance, simulated=simulated)
        if compared:
            tables, sentences = _compared(shown, models, simulated=simulated, stream=stream)
            items += tables
            outcomes += sentences
        items.append(_details(shown, task, groups, simulated=simulated, rng=stream.rng))
    if not items:
        return None
    return Section("speed", "Speed and accuracy", tuple(items), outcomes=tuple(outcomes))


def _pictures(
    answers: pd.DataFrame, task: str, models: Sequence[str], *, chance: float, simulated: bool
) -> list[Item]:
    scores = participant_scores(answers, models=models)
    points = Picture(
        f"speed_accuracy_{task}",
        f"Time against right answers, {TASK_TITLES[task]}",
        "Farther left is faster, higher is more accurate: lower and farther left is a "
        "speed–accuracy trade-off, not an advantage. Means over the textures judged with all "
        "models shown, with equal weight for each texture.",
        figure_speed_accuracy(scores, score_means(scores), models=models, simulated=simulated),
        simulated,
    )
    by_time = conditional_accuracy(answers, models=models)
    if by_time.empty:
        return [points]
    conditional = Picture(
        f"conditional_accuracy_{task}",
        f"Right answers by response time, {TASK_TITLES[task]}",
        "Conditional accuracy: each participant's answers from the fastest to the slowest group. "
        "All textures are pooled, so textures that are difficult and therefore slow make the line "
        "fall.",
        figure_conditional_accuracy(by_time, models=models, chance=chance, simulated=simulated),
        simulated,
    )
    return [points, conditional]


def _compared(
    answers: pd.DataFrame,
    models: tuple[str, str],
    *,
    simulated: bool,
    stream: Stream,
) -> tuple[list[Item], list[Outcome]]:
    """The effect of two models on time, accuracy and both together."""
    reference, other = models
    comparison = compare_models(answers, models=models, rng=stream.rng)
    ratios = time_ratios(answers, models=models, rng=stream.rng)
    whose = f"{sentence_case(TASK_TITLES[stream.task])}: " * bool(stream.ending)
    paired = Table(
        f"speed_accuracy{stream.ending}",
        f"{whose}time, accuracy and both together" if whose else "Time, accuracy and both together",
        f"Paired t-tests over participants, {other} compared with {reference} models; time is "
        "tested in logarithms, so its effect is a ratio. LISAS: mean time of right answers plus "
        "the weighted share of wrong ones (Vandierendonck 2017), low where answers are fast and "
        "right; it does not settle a trade-off. Not corrected for the number of tests; no claim "
        "rests on them.",
        comparison.replace({"measure": SPEED_MEASURES}),
        SPEED_COMPARISON_COLUMNS,
        simulated,
    )
    mixed = Table(
        f"time_ratio{stream.ending}",
        f"{whose}response time by a mixed model" if whose else "Response time by a mixed model",
        "Log time by texture × model, session and order, with a random intercept and slope of the "
        "model per participant; the degrees of freedom of t are the number of participants minus "
        "1.",
        ratios,
        TIME_RATIO_COLUMNS,
        simulated,
    )
    sentence = f"{whose}{trade_off_sentence(comparison, models=models)}"
    return [paired, mixed], [Outcome(Weight.SECONDARY, sentence)]


def _details(
    answers: pd.DataFrame,
    task: str,
    models: Sequence[str],
    *,
    simulated: bool,
    rng: np.random.Generator,
) -> Fold:
    """Tables behind the pictures."""
    frames = {
        "right_and_wrong": right_and_wrong(answers, models=models, rng=rng),
        "scores": participant_scores(answers, models=models),
        "cells": speed_and_accuracy(answers, models=models),
        "quantiles": conditional_accuracy(answers, models=models),
    }
    return Fold(
        f"Times and right answers of each participant, {TASK_TITLES[task]}",
        tuple(
            Table(f"speed_{name}_{task}", *_DETAILS[name][:2], frame, _DETAILS[name][2], simulated)
            for name, frame in frames.items()
            if len(frame)
        ),
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
