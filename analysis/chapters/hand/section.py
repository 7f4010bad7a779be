"""The section on the hand: speed, force and contact by model.

docs/method/reliability.md#hand
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from typing import Any

import numpy as np
import pandas as pd

from tactileq.analysis.chapters.chapter import Answered
from tactileq.analysis.chapters.hand.figure import figure_hand
from tactileq.analysis.chapters.hand.statistics import (
    HAND_PARTICIPANT_COLUMNS,
    HAND_TEST_COLUMNS,
    hand_by_participant,
    hand_means,
    hand_tests,
)
from tactileq.analysis.labels import TASK_TITLES, signed
from tactileq.analysis.page.outcomes import Outcome, Weight
from tactileq.analysis.page.page import Fold, Picture, Table
from tactileq.analysis.page.sections import Section, of_pairs
from tactileq.modeling.files.columns import without

ALPHA = 0.05
TESTS_SHOWN = without(HAND_TEST_COLUMNS, "se_reference", "se_other")
MEASURE_WORDS = {
    "speed_mm_s": ("speed while touching", "mm/s"),
    "force_n": ("force while touching", "N"),
    "contact_s": ("time in contact per trial", "s"),
    "presentations": ("presentations per trial", ""),
}


def sections(answered: Answered) -> list[Section]:
    """A section on the hand with either model of each pair, where it was measured."""
    if answered.hand is None:
        return []
    own = answered.hand[answered.hand["task"].isin(list(answered.finished))]
    simulated = answered.responses.simulated
    by_pair = {}
    for pair in answered.pairs:
        moved = own[~own["texture"].isin(list(answered.responses.identical(pair)))]
        by_pair[pair] = hand_section(moved, models=pair, simulated=simulated, rng=answered.rng)
    section = of_pairs(by_pair)
    return [section] if section is not None else []


def hand_section(
    hand: pd.DataFrame, *, models: tuple[str, str], simulated: bool, rng: np.random.Generator
) -> Section | None:
    """How the hand moved with each model; None where no task measured it with both.

    Parameters
    ----------
    hand : DataFrame
        From `tactileq.analysis.answers.hand.load_hand`.
    models : (str, str)
        The reference, and the other one.
    rng : Generator
        Draws sign flips.
    """
    if hand.empty:
        return None
    tests = hand_tests(hand, models=models, rng=rng)
    measured = tests[tests["measure"].isin(["speed_mm_s", "force_n"]) & (tests["n"] > 0)]
    if measured.empty:
        return None
    means = hand_means(hand, models=models)
    tasks = list(dict.fromkeys(measured["task"]))
    pictures = [
        _picture(means[means["task"] == task], task, models=models, simulated=simulated)
        for task in tasks
    ]
    return Section(
        "hand",
        "How the hand moved",
        (*pictures, *_tables(tests, means, models=models, simulated=simulated)),
        outcomes=(Outcome(Weight.SECONDARY, hand_caveat(tests, models=models)),),
    )


def hand_caveat(tests: pd.DataFrame, *, models: tuple[str, str]) -> str:
    """One sentence on how the hand moved differently with the other model.

    Parameters
    ----------
    tests : DataFrame
        From `hand_tests`.
    models : (str, str)
        The reference, and the other one.
    """
    reference, other = models
    compared = tests[tests["n"] > 0]
    apart = compared[compared["p"] < ALPHA]
    if apart.empty:
        main = compared[compared["measure"].isin(["speed_mm_s", "force_n"])]
        return (
            f"No difference in hand movement between {reference} and {other} models was shown "
            f"({other} − {reference}: {_listed(main)})."
        )
    return (
        f"Caveat: the hand moved differently with {other} than with {reference} models ({other} − "
        f"{reference}: {_listed(apart)}), so a difference in the answers, or its absence, may be "
        "due to the hand rather than the models."
    )


def _listed(tests: pd.DataFrame) -> str:
    return "; ".join(_difference(row) for row in tests.to_dict("records"))


def _difference(row: Mapping[Hashable, Any]) -> str:
    words, unit = MEASURE_WORDS[row["measure"]]
    digits = 1 if row["measure"] == "speed_mm_s" else 2
    mean, low, high = (
        signed(row[name], digits) for name in ("mean_difference", "ci_low", "ci_high")
    )
    interval = f" (95% CI {low} to {high})" if np.isfinite(row["ci_low"]) else ""
    return f"{words} in the {TASK_TITLES[row['task']]} {mean} {unit}".rstrip() + interval


def _picture(
    means: pd.DataFrame, task: str, *, models: tuple[str, str], simulated: bool
) -> Picture:
    return Picture(
        f"hand_{task}",
        f"Speed and force of the hand by model, {TASK_TITLES[task]}",
        "Points: participants, with a line between the two models of each, and the mean with its "
        "95% confidence interval. Means over the textures that a participant judged with both "
        "models.",
        figure_hand(means, models=models, simulated=simulated),
        simulated,
    )


def _tables(
    tests: pd.DataFrame, means: pd.DataFrame, *, models: tuple[str, str], simulated: bool
) -> tuple[Table, Fold]:
    reference, other = models
    labels = {
        name: f"{words} ({unit})".replace(" ()", "")
        for name, (words, unit) in MEASURE_WORDS.items()
    }
    paired = Table(
        "hand_tests",
        "Hand movement with each model",
        f"Paired t-tests, {other} − {reference}. A participant's value is the mean over the "
        "textures judged with both models. Only virtual surfaces, and only trials that were "
        "answered. Not corrected for the number of tests.",
        tests.assign(measure=tests["measure"].map(labels), task=tests["task"].map(TASK_TITLES)),
        TESTS_SHOWN,
        simulated,
    )
    participants = hand_by_participant(means)
    each = Table(
        "hand",
        "Hand movement of each participant",
        f"Reference: {reference} models; other: {other} models. Means over the textures judged "
        "with both. n/a: not measured, or not stored by any session.",
        participants.assign(task=participants["task"].map(TASK_TITLES)),
        HAND_PARTICIPANT_COLUMNS,
        simulated,
    )
    return paired, Fold("Hand movement of each participant", (each,))
