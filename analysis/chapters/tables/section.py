"""The sections on answers that come as tables of another experiment."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from tactileq.analysis.answers.imported import ImportedAnswers
from tactileq.analysis.chapters.tables.factorial import (
    ANOVA_COLUMNS,
    CONDITION_COLUMNS,
    PAIR_COLUMNS,
    PARTICIPANT_CELL_COLUMNS,
    CompleteCells,
    cell_means,
    complete_cells,
    overall_mean,
    pairwise_tests,
    participant_cells,
    repeated_measures_anova,
)
from tactileq.analysis.chapters.tables.figure import figure_factorial
from tactileq.analysis.figures.confusions import plot_confusion
from tactileq.analysis.page.outcomes import Outcome, Weight
from tactileq.analysis.page.page import Fold, Picture, Table
from tactileq.analysis.page.sections import Headline, Section
from tactileq.analysis.statistics.confusion import (
    CONFUSION_COLUMNS,
    ConfusionMatrix,
    confusion_table,
)
from tactileq.modeling.errors import counted
from tactileq.modeling.files.columns import p_value

ALPHA = 0.05
WORDS = {"correct": "accuracy", "value": "mean"}
LABELS = {"correct": "accuracy (share of right answers, 0–1)", "value": "mean (unit of the table)"}


def table_sections(imported: ImportedAnswers, *, rng: np.random.Generator) -> list[Section]:
    """Accuracy or mean by condition, analysis of variance, confusion matrices.

    Parameters
    ----------
    rng : Generator
        Draws the sign flips of the paired tests.
    """
    factors = list(imported.factors)
    cells = participant_cells(imported.answers, imported.measure, factors=factors)
    first = replace(
        _condition_section(imported, cells), headline=Headline(answer_of_table(imported))
    )
    sections = [first]
    if factors and cells["participant_id"].nunique() > 1:
        complete = complete_cells(cells, factors)
        sections.append(_anova_section(complete, imported.measure, rng=rng))
    if imported.classes:
        sections.append(_confusion_section(imported))
    return sections


def answer_of_table(imported: ImportedAnswers) -> str:
    """The sentence on top of the report: the mean over participants with its interval."""
    cells = participant_cells(imported.answers, imported.measure, factors=list(imported.factors))
    mean, low, high = overall_mean(cells)
    people = cells["participant_id"].nunique()
    who = "1 participant" if people == 1 else f"{people} participants"
    interval = "" if np.isnan(low) else f", 95% CI {_figure(low)} to {_figure(high)}"
    what = WORDS[imported.measure].capitalize()
    chance = f"; chance {1 / len(imported.classes):.3f}" if _has_chance(imported) else ""
    return f"{what} {_figure(mean)} over {who}{interval}{chance}."


def _has_chance(imported: ImportedAnswers) -> bool:
    return bool(imported.classes) and imported.measure == "correct"


def _figure(value: float) -> str:
    return f"{value:.3f}".replace("-", "−")


def _condition_section(imported: ImportedAnswers, cells: pd.DataFrame) -> Section:
    word, factors = WORDS[imported.measure], list(imported.factors)
    means = cell_means(cells, factors)
    how = "Wilson" if imported.measure == "correct" else "Student's t over trials"
    by = f" by {', '.join(factors)}" if factors else ""
    table = Table(
        "by_condition",
        f"{word.capitalize()}{by}",
        "Mean over participants, each counting once, with a 95% interval (Student's t over "
        "participants).",
        means,
        CONDITION_COLUMNS,
        False,
    )
    own = Table(
        "by_participant",
        f"{word.capitalize()} of each participant",
        f"95% intervals: {how}.",
        cells,
        PARTICIPANT_CELL_COLUMNS,
        False,
    )
    people = cells["participant_id"].nunique()
    trials = int(imported.answers["count"].sum())
    missed = f"; left out without an answer: {imported.missed}" if imported.missed else ""
    return Section(
        "conditions",
        f"{word.capitalize()} by condition",
        (*_pictures(imported, cells, means), table, Fold("Each participant", (own,))),
        outcomes=(Outcome(Weight.OVERALL, answer_of_table(imported)),),
        done=(
            f"Tables: {counted(people, 'participant')}, "
            f"{counted(trials, 'answered trial')}{missed}.",
        ),
        tiles=((str(people), "participants"), (str(trials), "answered trials")),
    )


def _pictures(
    imported: ImportedAnswers, cells: pd.DataFrame, means: pd.DataFrame
) -> tuple[Picture, ...]:
    if not imported.factors:
        return ()
    figure = figure_factorial(
        cells, means, factors=imported.factors, label=LABELS[imported.measure], simulated=False
    )
    title = f"{WORDS[imported.measure].capitalize()} by {', '.join(imported.factors)}"
    note = "Thin: participants; bold: mean over participants with its 95% confidence interval."
    return (Picture("by_condition", title, note, figure, False),)


def _anova_section(complete: CompleteCells, measure: str, *, rng: np.random.Generator) -> Section:
    anova, pairs = repeated_measures_anova(complete), pairwise_tests(complete, rng=rng)
    left_out = ""
    if complete.excluded:
        names = ", ".join(complete.excluded)
        left_out = f" Left out because answers are missing in some condition: {names}."
    tables = (
        Table(
            "anova",
            "Repeated-measures analysis of variance",
            f"Of each participant's {WORDS[measure]} per condition. ε: Greenhouse–Geisser "
            f"correction; not needed for effects with one degree of freedom.{left_out}",
            anova,
            ANOVA_COLUMNS,
            False,
        ),
        Table(
            "pairs",
            "Levels compared in pairs",
            "Paired t-tests over participants, averaged over the other factors. Holm over the "
            "pairs of one factor. Intervals: 95% each, not corrected.",
            pairs,
            PAIR_COLUMNS,
            False,
        ),
    )
    outcomes = [_effect(row, measure) for row in anova.to_dict("records") if row["F"] == row["F"]]
    return Section(
        "anova",
        "Effects of the factors",
        tables,
        outcomes=tuple(outcomes),
        done=(f"Analysis of variance of {len(complete.participants)} participants.{left_out}",),
    )


def _effect(row: Mapping[Hashable, Any], measure: str) -> Outcome:
    p = float(row["p_corrected"])
    verb = "changes" if p < ALPHA else "was not shown to change"
    probability = p_value(p) if p < 0.001 else f"= {p_value(p)}"
    return Outcome(
        Weight.OVERALL if p < ALPHA else Weight.SECONDARY,
        f"{row['effect']} {verb} the {WORDS[measure]}: F({row['df_effect']}, {row['df_error']}) = "
        f"{row['F']:.3f}, p {probability} (Greenhouse–Geisser), generalized η² = "
        f"{row['generalized_eta_squared']:.3f}.",
    )


def _confusion_section(imported: ImportedAnswers) -> Section:
    matrices = imported_matrices(imported)
    pictures = tuple(
        Picture(
            f"confusion_{number}",
            f"Which class was taken for which: {matrix.model}",
            "Rows: presented; columns: answered. Percentage of the row, with the number of answers "
            "of all participants in brackets.",
            _figure_of(matrix),
            False,
        )
        for number, matrix in enumerate(matrices, 1)
    )
    tables = tuple(
        Table(
            f"confusion_{number}",
            f"Confusion matrix: {matrix.model}",
            "Counts and shares of the row (0–1).",
            confusion_table(matrix),
            CONFUSION_COLUMNS,
            False,
        )
        for number, matrix in enumerate(matrices, 1)
    )
    fold = Fold("Confusion matrices as tables", tables)
    return Section("confusions", "Confusions", (*pictures, fold))


def imported_matrices(imported: ImportedAnswers) -> list[ConfusionMatrix]:
    """Answers counted over participants, a matrix per condition, all over the same classes."""
    answers, classes = imported.answers, list(imported.classes)
    parts: list[tuple[str, pd.DataFrame]] = [("all conditions", answers)]
    if imported.factors:
        parts = [
            (", ".join(f"{f} {level}" for f, level in zip(imported.factors, key, strict=True)), own)
            for key, own in answers.groupby(list(imported.factors))
        ]
    matrices = []
    for name, own in parts:
        counts = own.pivot_table(
            index="presented", columns="answered", values="count", aggfunc="sum", fill_value=0
        ).reindex(index=classes, columns=classes, fill_value=0)
        matrices.append(ConfusionMatrix(name, tuple(classes), counts.to_numpy(dtype=np.int64)))
    return matrices


def _figure_of(matrix: ConfusionMatrix) -> Figure:
    side = 2.5 + 0.75 * len(matrix.textures)
    figure = Figure(figsize=(side, side), layout="constrained")
    ax = plot_confusion(matrix, simulated=False, ax=figure.subplots())
    ax.set_xlabel("answered")
    ax.set_ylabel("presented")
    return figure
