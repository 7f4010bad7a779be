"""The sections on people's answers: ratings and choices."""

from __future__ import annotations

import numpy as np
import pandas as pd

from analysis.answers.loading import Responses
from analysis.columns import chosen, without
from analysis.figures.answers import figure_confusion, figure_correct_rates, figure_ratings
from analysis.labels import ALL_TEXTURES, MODELS
from analysis.report.page import Fold, Picture, Table
from analysis.report.sections import Section
from analysis.report.sentences import rate_outcomes, rating_outcomes
from analysis.statistics.confusion import (
    CONFUSION_COLUMNS,
    ConfusionMatrix,
    confusion_matrices,
    confusion_table,
)
from analysis.statistics.paired import RATING_TEST_COLUMNS, rating_tests
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


def rating_section(responses: Responses) -> Section:
    """Absolute evaluation (PAPER VIII-A)."""
    tests = rating_tests(responses.absolute, identical=responses.identical)
    done, tile = _participants(responses, responses.absolute, where="absolute evaluation")
    picture = Picture(
        "ratings",
        "Rated similarity of virtual and real surface",
        "Means over participants ± standard error. Cf. the paper's figure 9.",
        figure_ratings(tests, simulated=responses.simulated),
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


def choice_section(responses: Responses, *, rng: np.random.Generator) -> Section:
    """Relative evaluation (PAPER VIII-B); `rng` draws the bootstrap."""
    relative, simulated = responses.relative, responses.simulated
    matrices = confusion_matrices(relative)
    chance = 1 / len(matrices["full"].textures)
    rates = correct_rates(relative, rng=rng, chance=chance)
    tests = rate_tests(relative, identical=responses.identical)
    done, tile = _participants(responses, relative, where="forced choice")
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
            *_choice_pictures(tests, matrices, simulated=simulated),
            *_rate_tables(rates, tests, simulated=simulated),
            counts,
        ),
        outcomes=tuple(rate_outcomes(rates, tests, matrices=matrices)),
        done=(done,),
        tiles=(tile, rate_tile),
        tests=tests,
    )


def _choice_pictures(
    tests: pd.DataFrame, matrices: dict[str, ConfusionMatrix], *, simulated: bool
) -> tuple[Picture, Picture]:
    chance = 1 / len(matrices["full"].textures)
    rates_picture = Picture(
        "correct_rates",
        "Correct rates of the forced choice",
        "Means over participants ± standard error; dashed: chance. Cf. the paper's figure 11.",
        figure_correct_rates(tests, simulated=simulated, chance=chance),
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


def _participants(
    responses: Responses, trials: pd.DataFrame, *, where: str
) -> tuple[str, tuple[str, str]]:
    """The sentence and the tile that say how many took part."""
    people = trials["participant_id"].nunique()
    who = "simulated participants" if responses.simulated_participants else "participants"
    who += " at the simulated rig" if responses.simulated_rig else ""
    sentence = f"{where.capitalize()}: {people} {who}, {len(trials)} trials (training left out)."
    return sentence, (str(people), f"{who}, {where}")


def _confusion_table(matrix: ConfusionMatrix, *, simulated: bool) -> Table:
    title = f"Confusion matrix, {matrix.model} model"
    note = "Counts and shares of the row (0–1)."
    table = confusion_table(matrix)
    return Table(f"confusion_{matrix.model}", title, note, table, CONFUSION_COLUMNS, simulated)
