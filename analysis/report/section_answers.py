"""The sections on people's answers: ratings and choices."""

from __future__ import annotations

from collections.abc import Set

import numpy as np
import pandas as pd

from analysis.answers.loading import Responses
from analysis.columns import chosen, without
from analysis.figures.answers import figure_confusion, figure_correct_rates, figure_ratings
from analysis.labels import ALL_TEXTURES, MODELS, TASKS
from analysis.report.page import Fold, Picture, Table
from analysis.report.sections import Section
from analysis.report.sentences import rate_outcomes, rating_outcomes
from analysis.statistics.confusion import (
    CONFUSION_COLUMNS,
    ConfusionMatrix,
    confusion_matrices,
    confusion_table,
)
from analysis.statistics.paired import (
    RATING_TEST_COLUMNS,
    participant_means,
    rating_means,
    rating_tests,
)
from analysis.statistics.rates import (
    CORRECT_RATE_COLUMNS,
    RATE_TEST_COLUMNS,
    correct_rates,
    rate_tests,
)

PAIRED_SHOWN = (
    *("texture", "n", "mean_full", "mean_simplified", "mean_difference", "ci_low", "ci_high", "t"),
    *("df", "p", "p_holm", "d_z", "d_z_low", "d_z_high", "wilcoxon_p", "note", "excluded"),
)
RATING_TESTS_SHOWN = chosen(RATING_TEST_COLUMNS, "scale", *PAIRED_SHOWN)
RATE_TESTS_SHOWN = chosen(RATE_TEST_COLUMNS, *PAIRED_SHOWN)
CORRECT_RATES_SHOWN = (
    *without(CORRECT_RATE_COLUMNS, "note"),
    *chosen(CORRECT_RATE_COLUMNS, "note"),
)


def rating_section(responses: Responses, *, identical: Set[str] = frozenset()) -> Section:
    """Absolute evaluation (PAPER VIII-A); `identical`: textures with nothing to compare."""
    tests = rating_tests(responses.absolute, identical=identical)
    done, tile = _participants(responses, "absolute")
    picture = Picture(
        "ratings",
        "Rated similarity of virtual and real surface",
        "Bars: means over participants ± standard error; points: participants. Cf. the paper's "
        "figure 9.",
        figure_ratings(tests, rating_means(responses.absolute), simulated=responses.simulated),
        responses.simulated,
    )
    table = Table(
        "rating_tests",
        "Paired tests of the ratings",
        "Differences are simplified − full, in points of the scale. Holm over the textures of one "
        "scale. d_z: mean difference over the standard deviation of the differences. Intervals: "
        "95%.",
        tests,
        RATING_TESTS_SHOWN,
        responses.simulated,
    )
    return Section(
        "ratings",
        "Absolute evaluation: ratings",
        (picture, table),
        outcomes=tuple(rating_outcomes(tests)),
        done=(done,),
        tiles=(tile,),
        tests=tests,
    )


def choice_section(
    responses: Responses, *, identical: Set[str] = frozenset(), rng: np.random.Generator
) -> Section:
    """Relative evaluation (PAPER VIII-B); `rng` draws the bootstrap.

    `identical`: textures with nothing to compare.
    """
    relative, simulated = responses.relative, responses.simulated
    matrices = confusion_matrices(relative)
    chance = 1 / len(matrices["full"].textures)
    rates = correct_rates(relative, rng=rng, chance=chance)
    tests = rate_tests(relative, identical=identical)
    means = participant_means(relative, "correct")
    done, tile = _participants(responses, "relative")
    overall = rates[rates["texture"] == ALL_TEXTURES].set_index("model")["mean"]
    shown = " → ".join(f"{overall[model]:.0%}" for model in MODELS if model in overall)
    rate_tile = (shown, f"right answers, full → simplified (chance {chance:.0%})")
    counts = Fold(
        "Confusion matrices as tables",
        tuple(_confusion_table(matrix, simulated=simulated) for matrix in matrices.values()),
    )
    return Section(
        "choices",
        "Relative evaluation: forced choice",
        (
            *_choice_pictures(tests, means, matrices=matrices, simulated=simulated),
            *_rate_tables(rates, tests, simulated=simulated),
            counts,
        ),
        outcomes=tuple(rate_outcomes(rates, tests, matrices=matrices)),
        done=(done,),
        tiles=(tile, rate_tile),
        tests=tests,
    )


def _choice_pictures(
    tests: pd.DataFrame,
    means: pd.DataFrame,
    *,
    matrices: dict[str, ConfusionMatrix],
    simulated: bool,
) -> tuple[Picture, Picture]:
    chance = 1 / len(matrices["full"].textures)
    rates_picture = Picture(
        "correct_rates",
        "Correct rates of the forced choice",
        "Bars: means over participants ± standard error; points: participants; dashed: chance. "
        "Cf. the paper's figure 11.",
        figure_correct_rates(tests, means, simulated=simulated, chance=chance),
        simulated,
    )
    confusion_picture = Picture(
        "confusion",
        "Who was taken for whom",
        "Rows: real surface presented; columns: virtual surface answered. Per cent of the row, in "
        f"brackets the number of answers; chance is {chance:.1%}. Cf. the paper's figure 10.",
        figure_confusion(matrices, simulated=simulated),
        simulated,
    )
    return rates_picture, confusion_picture


def _rate_tables(
    rates: pd.DataFrame, tests: pd.DataFrame, *, simulated: bool
) -> tuple[Table, Table]:
    against_chance = Table(
        "correct_rates",
        "Correct rates against chance",
        "Participants are the units: mean of their rates with a 95% interval (bias-corrected and "
        "accelerated bootstrap over participants), and a one-sample t-test against chance with "
        "Holm over the textures of one model.",
        rates,
        CORRECT_RATES_SHOWN,
        simulated,
    )
    paired = Table(
        "rate_tests",
        "Paired tests of the correct rates",
        "Differences are simplified − full, as shares. Holm over the textures; the row over all "
        "textures stands outside the family. Intervals: 95%.",
        tests,
        RATE_TESTS_SHOWN,
        simulated,
    )
    return against_chance, paired


def _participants(responses: Responses, task: str) -> tuple[str, tuple[str, str]]:
    """The sentence and the tile that say how many took part, of how many."""
    where = TASKS[task]
    done, planned = responses.done(task), responses.planned.get(task)
    people = str(done.participants)
    who = "simulated participants" if responses.simulated_participants else "participants"
    who += " at the simulated rig" if responses.simulated_rig else ""
    trials = f"{len(responses.answers[task])} trials (training left out)"
    if planned is None:
        return f"{where.capitalize()}: {people} {who}, {trials}.", (people, f"{who}, {where}")
    people += f" of {planned.participants}"
    sentence = (
        f"{where.capitalize()}: {people} planned {who}, {done.sessions} of {planned.sessions} "
        f"planned sessions, {trials}."
    )
    return sentence, (people, f"planned {who}, {where}")


def _confusion_table(matrix: ConfusionMatrix, *, simulated: bool) -> Table:
    title = f"Confusion matrix, {matrix.model} model"
    note = "Counts and shares of the row (0–1)."
    table = confusion_table(matrix)
    return Table(f"confusion_{matrix.model}", title, note, table, CONFUSION_COLUMNS, simulated)
