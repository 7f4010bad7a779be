"""The section on speed and accuracy: time against right answers, with each model.

docs/method/speed-accuracy.md
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from analysis.figures.speed_accuracy import figure_conditional_accuracy, figure_speed_accuracy
from analysis.labels import TASKS
from analysis.page.outcomes import Outcome, Weight
from analysis.page.page import Fold, Item, Picture, Table
from analysis.page.sections import Section
from analysis.statistics.speed_accuracy import (
    CELL_COLUMNS,
    COMPARISON_COLUMNS,
    CONDITIONAL_COLUMNS,
    MEASURES,
    RIGHT_WRONG_COLUMNS,
    SCORE_COLUMNS,
    TIME_RATIO_COLUMNS,
    compare_models,
    conditional_accuracy,
    participant_scores,
    right_and_wrong,
    score_means,
    speed_and_accuracy,
    time_ratios,
    trade_off_sentence,
)
from analysis.statistics.verdicts import chance_of, holding_both

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
    "cells": ("By texture and model", "Median times.", CELL_COLUMNS),
    "quantiles": (
        "Right answers by quantile of time",
        "Means over participants with 95% intervals over them.",
        CONDITIONAL_COLUMNS,
    ),
}


def speed_accuracy_section(
    answers: Mapping[str, pd.DataFrame],
    *,
    models: tuple[str, str],
    simulated: bool,
    rng: np.random.Generator,
) -> Section | None:
    """How fast and how accurate answers were; None where answers are not scored or timed.

    In the odd-one-out task both models are in every trial, so they are not compared.

    Parameters
    ----------
    answers : mapping of task to DataFrame
        `Responses.answers`, textures with identical models left out.
    models : (str, str)
        The reference, and the other one.
    simulated : bool
    rng : Generator
        Draws sign flips.
    """
    items: list[Item] = []
    outcomes: list[Outcome] = []
    relative = answers.get("relative", pd.DataFrame())
    if len(relative) and len(participant_scores(relative, models=models)):
        chance = chance_of("relative", relative)
        items += _pictures(relative, "relative", models, chance=chance, simulated=simulated)
        tables, outcomes = _compared(relative, models, simulated=simulated, rng=rng)
        items += tables
        items.append(_details(relative, "relative", models, simulated=simulated, rng=rng))
    oddity = answers.get("oddity", pd.DataFrame(columns=["layout"]))
    oddity = holding_both("oddity", oddity, models).assign(model=BOTH)
    if len(oddity) and len(participant_scores(oddity, models=(BOTH,))):
        chance = chance_of("oddity", oddity)
        items += _pictures(oddity, "oddity", (BOTH,), chance=chance, simulated=simulated)
        items.append(_details(oddity, "oddity", (BOTH,), simulated=simulated, rng=rng))
    if not items:
        return None
    return Section("speed", "Speed and accuracy", tuple(items), outcomes=tuple(outcomes))


def _pictures(
    answers: pd.DataFrame, task: str, models: Sequence[str], *, chance: float, simulated: bool
) -> list[Item]:
    scores = participant_scores(answers, models=models)
    points = Picture(
        f"speed_accuracy_{task}",
        f"Time against right answers, {TASKS[task]}",
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
        f"Right answers by response time, {TASKS[task]}",
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
    rng: np.random.Generator,
) -> tuple[list[Item], list[Outcome]]:
    """The effect of two models on time, accuracy and both together."""
    reference, other = models
    comparison = compare_models(answers, models=models, rng=rng)
    ratios = time_ratios(answers, models=models, rng=rng)
    paired = Table(
        "speed_accuracy",
        "Time, accuracy and both together",
        f"Paired t-tests over participants, {other} compared with {reference} models; time is "
        "tested in logarithms, so its effect is a ratio. LISAS: mean time of right answers plus "
        "the weighted share of wrong ones (Vandierendonck 2017), low where answers are fast and "
        "right; it does not settle a trade-off. Not corrected for the number of tests; no claim "
        "rests on them.",
        comparison.replace({"measure": MEASURES}),
        COMPARISON_COLUMNS,
        simulated,
    )
    mixed = Table(
        "time_ratio",
        "Response time by a mixed model",
        "Log time by texture × model, session and order, with a random intercept and slope of the "
        "model per participant; the degrees of freedom of t are the number of participants minus "
        "1.",
        ratios,
        TIME_RATIO_COLUMNS,
        simulated,
    )
    sentences = [trade_off_sentence(comparison, models=models), *_ratio_sentences(ratios, models)]
    return [paired, mixed], [Outcome(Weight.SECONDARY, sentence) for sentence in sentences]


def _ratio_sentences(ratios: pd.DataFrame, models: tuple[str, str]) -> list[str]:
    found = ratios.to_dict("records")[0]
    if not np.isfinite(found["ci_low"]):
        return []
    how = "; ".join(filter(None, [f"{found['method']} of log time", found["note"]]))
    return [
        f"Answers with {models[1]} models took {found['ratio']:.2f} times as long as with "
        f"{models[0]} models (95% CI {found['ci_low']:.2f} to {found['ci_high']:.2f}; {how})."
    ]


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
        f"Times and right answers of each participant, {TASKS[task]}",
        tuple(
            Table(f"speed_{name}_{task}", *_DETAILS[name][:2], frame, _DETAILS[name][2], simulated)
            for name, frame in frames.items()
            if len(frame)
        ),
    )
