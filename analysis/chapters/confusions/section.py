"""The chapter on confusions: which textures were taken for which, and what follows from that.

docs/method/confusions.md
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import pandas as pd

from tactileq.analysis.chapters.chapter import Answered, Stream
from tactileq.analysis.chapters.confusions.buttons import (
    BUTTON_COLUMNS,
    ButtonPreference,
    button_preference,
)
from tactileq.analysis.chapters.confusions.change import confusion_change_p
from tactileq.analysis.chapters.confusions.figure import figure_confusion, figure_similarities
from tactileq.analysis.chapters.confusions.information import transferred_information
from tactileq.analysis.chapters.confusions.similarity_choice import (
    FEWEST_CLASSES,
    MOST_CLASSES,
    SimilarityChoice,
    similarity_choice,
)
from tactileq.analysis.columns import MODEL, TEXTURE, P
from tactileq.analysis.labels import TASK_TITLES, sentence_case
from tactileq.analysis.page.outcomes import Outcome, Weight, described
from tactileq.analysis.page.page import Fold, Item, Picture, Table
from tactileq.analysis.page.sections import Section, of_task
from tactileq.analysis.statistics.compared_answers import models_of
from tactileq.analysis.statistics.confusion import (
    CONFUSION_COLUMNS,
    ConfusionMatrix,
    confusion_matrices,
    confusion_table,
    participant_counts,
)
from tactileq.modeling.files.answer_tables import ANSWER_TABLES, AnswerTable
from tactileq.modeling.files.columns import Column, names, p_value

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
CHOICE_FIT_COLUMNS = (
    MODEL,
    Column("deviance"),
    Column("df"),
    P,
    Column("p_simulated", "p of simulated tables", is_p_value=True),
)


def applies(table: AnswerTable) -> bool:
    """Whether a trial asks which of several textures the one presented is."""
    return table.is_identification


def sections(answered: Answered) -> list[Section]:
    """A section for each task that asks for a texture among the same ones in every trial."""
    found = []
    for stream in answered.streams("confusions", applies):
        answers = answered.responses.answers[stream.task]
        listed = answers[ANSWER_TABLES[stream.task].alternatives]
        if answered.judged_in(stream.task) and _are_always_the_same(listed):
            found.append(
                confusion_section(
                    answers.assign(layout=listed),
                    models_of(answered.responses, stream.task),
                    simulated=answered.responses.simulated,
                    stream=stream,
                )
            )
    return found


def _are_always_the_same(listed: pd.Series) -> bool:
    """Whether every trial offered the same alternatives, in whatever order."""
    return len({frozenset(alternatives.split("|")) for alternatives in listed.dropna()}) <= 1


def confusion_section(
    answers: pd.DataFrame, models: Sequence[str], *, simulated: bool, stream: Stream
) -> Section:
    """Which textures were taken for which with each set of models, the reference first.

    Parameters
    ----------
    answers : DataFrame
        Of the stream's task; `layout` lists the alternatives.
    models : sequence of str
        Two sets at least.
    stream : Stream
        Its generator draws swaps, layouts and tables.
    """
    rng = stream.rng
    matrices = confusion_matrices(answers, tuple(models))
    textures = next(iter(matrices.values())).textures
    change = _changes(answers, matrices, rng=rng)
    information = _information(answers, matrices)
    liked = button_preference(answers, rng=rng)
    choices = {}
    if FEWEST_CLASSES <= len(textures) <= MOST_CLASSES:
        choices = {
            model: similarity_choice(matrix.counts, rng=rng)
            for model, matrix in matrices.items()
            if matrix.counts.any()
        }
    whose = f"{sentence_case(TASK_TITLES[stream.task])}: " * bool(stream.ending)
    section = Section(
        "confusions",
        f"Confusions in the {TASK_TITLES[stream.task]}",
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
        outcomes=tuple(
            replace(outcome, sentence=f"{whose}{outcome.sentence}")
            for outcome in (
                *_change_outcomes(change),
                *_button_outcomes(liked),
                *confusion_outcomes(matrices),
            )
        ),
    )
    return of_task(section, stream.ending)


def _changes(
    answers: pd.DataFrame, matrices: Mapping[str, ConfusionMatrix], *, rng: np.random.Generator
) -> pd.DataFrame:
    """Whether each other set is confused differently than the reference."""
    reference, *others = matrices
    before, counts = participant_counts(answers, matrices[reference])
    rows = []
    for other in others:
        after, changed = participant_counts(answers, matrices[other])
        both = [name for name in before if name in after]
        p = float("nan")
        if both:
            one = counts[[before.index(name) for name in both]]
            two = changed[[after.index(name) for name in both]]
            p = confusion_change_p(one, two, rng=rng)
        rows.append((reference, other, len(both), p))
    return pd.DataFrame(rows, columns=names(CHANGE_COLUMNS))


def _information(answers: pd.DataFrame, matrices: Mapping[str, ConfusionMatrix]) -> pd.DataFrame:
    """For each set of models with answers of at least two participants."""
    rows = []
    for model, matrix in matrices.items():
        people, counts = participant_counts(answers, matrix)
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
        columns=names(CHOICE_FIT_COLUMNS),
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
        CHOICE_FIT_COLUMNS,
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


def confusion_outcomes(matrices: Mapping[str, ConfusionMatrix]) -> list[Outcome]:
    """The most frequent confusion with each model, where there is one."""
    return [
        outcome
        for matrix in matrices.values()
        for outcome in described(_strongest_confusion(matrix))
    ]


def _strongest_confusion(matrix: ConfusionMatrix) -> list[str]:
    wrong = matrix.counts.copy()
    np.fill_diagonal(wrong, 0)
    if not wrong.any():
        return []
    shares = np.where(wrong > 0, matrix.row_shares, 0.0)
    row, column = np.unravel_index(int(np.argmax(shares)), shares.shape)
    return [
        f"Most frequent confusion with the {matrix.model} model: {matrix.textures[row]} was taken "
        f"for {matrix.textures[column]} in {shares[row, column]:.0%} of its trials "
        f"({wrong[row, column]} answers)."
    ]
