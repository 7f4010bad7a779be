"""The section on confusions: which textures were taken for which, and what follows from that.

docs/method/confusions.md
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from analysis.columns import MODEL, TEXTURE, P
from analysis.figures.confusions import figure_confusion, figure_similarities
from analysis.page.outcomes import Outcome, Weight
from analysis.page.page import Fold, Item, Picture, Table
from analysis.page.sections import Section
from analysis.report.sentences import confusion_outcomes
from analysis.statistics.buttons import BUTTON_COLUMNS, ButtonPreference, button_preference
from analysis.statistics.confusion import (
    CONFUSION_COLUMNS,
    ConfusionMatrix,
    confusion_matrices,
    confusion_table,
    participant_counts,
)
from analysis.statistics.confusion_change import confusion_change_p
from analysis.statistics.information import transferred_information
from analysis.statistics.similarity_choice import (
    FEWEST_CLASSES,
    MOST_CLASSES,
    SimilarityChoice,
    similarity_choice,
)
from modeling.files.columns import Column, names, p_value

ALPHA = 0.05
INFORMATION_COLUMNS = (
    MODEL,
    Column("participants"),
    Column("trials"),
    Column("uncorrected", "as counted", "bit"),
    Column("bits", "corrected", "bit"),
    Column("ci_low", "95% CI from"),
    Column("ci_high", "to"),
)
CHANGE_COLUMNS = (
    Column("reference", is_name=True),
    Column("other", is_name=True),
    Column("participants"),
    P,
)
SIMILARITY_COLUMNS = (
    MODEL,
    TEXTURE,
    Column("other", "and", is_name=True),
    Column("similarity"),
)
BIAS_COLUMNS = (MODEL, TEXTURE, Column("bias", "response bias"))
FIT_COLUMNS = (
    MODEL,
    Column("deviance"),
    Column("df"),
    P,
    Column("p_simulated", "p of simulated tables", is_p_value=True),
)


def confusion_section(
    relative: pd.DataFrame,
    models: Sequence[str],
    *,
    simulated: bool,
    rng: np.random.Generator,
) -> Section:
    """Which textures were taken for which with each set of models, the reference first.

    Parameters
    ----------
    relative : DataFrame
        `Responses.relative`, with answers.
    models : sequence of str
        Two sets at least.
    simulated : bool
    rng : Generator
        Draws swaps, layouts and tables.
    """
    matrices = confusion_matrices(relative, tuple(models))
    textures = next(iter(matrices.values())).textures
    change = _changes(relative, matrices, rng=rng)
    information = _information(relative, matrices)
    liked = button_preference(relative, rng=rng)
    choices = {}
    if FEWEST_CLASSES <= len(textures) <= MOST_CLASSES:
        choices = {
            model: similarity_choice(matrix.counts, rng=rng)
            for model, matrix in matrices.items()
            if matrix.counts.any()
        }
    return Section(
        "confusions",
        "Confusions",
        (
            _picture(matrices, simulated=simulated),
            _change_table(change, simulated=simulated),
            _information_table(information, simulated=simulated),
            *_similarity_items(choices, textures, simulated=simulated),
            _button_table(liked, simulated=simulated),
            Fold(
                "Confusion matrices as tables",
                tuple(_counts_table(matrix, simulated=simulated) for matrix in matrices.values()),
            ),
        ),
        outcomes=(
            *_change_outcomes(change),
            *_button_outcomes(liked),
            *confusion_outcomes(matrices),
        ),
    )


def _changes(
    relative: pd.DataFrame, matrices: Mapping[str, ConfusionMatrix], *, rng: np.random.Generator
) -> pd.DataFrame:
    """Whether each other set is confused differently than the reference."""
    reference, *others = matrices
    before, counts = participant_counts(relative, matrices[reference])
    rows = []
    for other in others:
        after, changed = participant_counts(relative, matrices[other])
        both = [name for name in before if name in after]
        p = float("nan")
        if both:
            one = counts[[before.index(name) for name in both]]
            two = changed[[after.index(name) for name in both]]
            p = confusion_change_p(one, two, rng=rng)
        rows.append((reference, other, len(both), p))
    return pd.DataFrame(rows, columns=names(CHANGE_COLUMNS))


def _information(relative: pd.DataFrame, matrices: Mapping[str, ConfusionMatrix]) -> pd.DataFrame:
    """For each set of models with answers of at least two participants."""
    rows = []
    for model, matrix in matrices.items():
        people, counts = participant_counts(relative, matrix)
        if len(people) < 2:
            continue
        found = transferred_information(counts)
        rows.append({"model": model, **vars(found)})
    return pd.DataFrame(rows, columns=names(INFORMATION_COLUMNS))


def _picture(matrices: Mapping[str, ConfusionMatrix], *, simulated: bool) -> Picture:
    chance = 1 / len(next(iter(matrices.values())).textures)
    return Picture(
        "confusion",
        "Which texture was taken for which",
        "Rows: real surface presented; columns: virtual surface answered. Percentage of the row, "
        f"with the number of answers in brackets; chance is {chance:.1%}. Compare figure 10 of the "
        "paper.",
        figure_confusion(matrices, simulated=simulated),
        simulated,
    )


def _change_table(change: pd.DataFrame, *, simulated: bool) -> Table:
    return Table(
        "confusion_change",
        "Are two models confused differently?",
        "Permutation test that swaps the two models' matrices of row shares within participants. "
        "Participants who answered with both models.",
        change,
        CHANGE_COLUMNS,
        simulated,
    )


def _information_table(information: pd.DataFrame, *, simulated: bool) -> Table:
    return Table(
        "transferred_information",
        "Transferred information",
        "All participants' answers pooled in one matrix, corrected after Miller and Madow; "
        "intervals: jackknife over participants. Not given for single participants: 21 trials "
        "yield 1.27 bit at pure chance.",
        information,
        INFORMATION_COLUMNS,
        simulated,
    )


def _similarity_items(
    choices: Mapping[str, SimilarityChoice], textures: Sequence[str], *, simulated: bool
) -> tuple[Item, ...]:
    """The picture and the tables of the similarity choice model; none without a matrix."""
    if not choices:
        return ()
    fit = pd.DataFrame(
        [(m, c.deviance, c.df, c.p, c.p_simulated) for m, c in choices.items()],
        columns=names(FIT_COLUMNS),
    )
    pairs = [
        (model, textures[i], textures[j], value)
        for model, choice in choices.items()
        for (i, j), value in np.ndenumerate(choice.similarities)
        if i < j
    ]
    biases = [
        (model, texture, bias)
        for model, choice in choices.items()
        for texture, bias in zip(textures, choice.biases, strict=True)
    ]
    picture = Picture(
        "similarities",
        "Perceived similarity of the textures",
        "Similarities of Luce's choice model, which separates response biases from the confusions "
        "(0: never confused, 1: not told apart; –: never recognised).",
        figure_similarities(
            {model: choice.similarities for model, choice in choices.items()},
            textures,
            simulated=simulated,
        ),
        simulated,
    )
    fitted = Table(
        "similarity_fit",
        "Does the similarity choice model hold?",
        "Deviance of the quasi-symmetric log-linear model; a small p means that confusions are "
        "asymmetric beyond response biases. p of simulated tables where counts are too few for χ². "
        "Answers of one participant are treated as independent here, so p tends to be too small.",
        fit,
        FIT_COLUMNS,
        simulated,
    )
    tables = (
        Table(
            "similarities",
            "Similarities",
            "For each pair of textures.",
            pd.DataFrame(pairs, columns=names(SIMILARITY_COLUMNS)),
            SIMILARITY_COLUMNS,
            simulated,
        ),
        Table(
            "biases",
            "Response biases",
            "They sum to 1 for each model.",
            pd.DataFrame(biases, columns=names(BIAS_COLUMNS)),
            BIAS_COLUMNS,
            simulated,
        ),
    )
    return picture, fitted, Fold("Similarities and biases as tables", tables)


def _button_table(liked: ButtonPreference, *, simulated: bool) -> Table:
    return Table(
        "buttons",
        "Wrong answers by button",
        "Expected: if every button except the right one had been equally likely. Preference shared "
        f"by participants: p {_p(liked.p_shared)}; individual preferences: p "
        f"{_p(liked.p_personal)} (redrawn layouts).",
        liked.table,
        BUTTON_COLUMNS,
        simulated,
    )


def _counts_table(matrix: ConfusionMatrix, *, simulated: bool) -> Table:
    title = f"Confusion matrix, {matrix.model} model"
    note = "Counts and shares of the row (0–1)."
    table = confusion_table(matrix)
    return Table(f"confusion_{matrix.model}", title, note, table, CONFUSION_COLUMNS, simulated)


def _change_outcomes(change: pd.DataFrame) -> list[Outcome]:
    sentences = []
    for row in change.to_dict("records"):
        if np.isfinite(row["p"]):
            differs = "were" if row["p"] < ALPHA else "were not shown to be"
            sentences.append(
                f"Textures {differs} confused differently with {row['other']} than with "
                f"{row['reference']} models (permutation test, p {_p(row['p'])}; participants: "
                f"{row['participants']})."
            )
    return [Outcome(Weight.SECONDARY, sentence) for sentence in sentences]


def _button_outcomes(liked: ButtonPreference) -> list[Outcome]:
    if not min(liked.p_shared, liked.p_personal) < ALPHA:
        return []
    return [
        Outcome(
            Weight.SECONDARY,
            "Caveat: some buttons were preferred, whatever texture they held (redrawn layouts: "
            f"shared preference p {_p(liked.p_shared)}, individual preferences p "
            f"{_p(liked.p_personal)}).",
        )
    ]


def _p(p: float) -> str:
    if np.isnan(p):
        return "n/a"
    shown = p_value(p)
    return shown if shown.startswith("<") else f"= {shown}"
