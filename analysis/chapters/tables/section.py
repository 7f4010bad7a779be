"""The sections on answers that come as tables of another experiment."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from scipy import stats

from tactileq.analysis.answers.imported import ImportedAnswers, in_order
from tactileq.analysis.chapters.tables.chance import CHANCE_COLUMNS, against_chance
from tactileq.analysis.chapters.tables.factorial import (
    ANOVA_COLUMNS,
    CONDITION_COLUMNS,
    CORRECTED,
    PAIR_COLUMNS,
    PARTICIPANT_CELL_COLUMNS,
    cell_means,
    complete_cells,
    overall_mean,
    pairwise_tests,
    participant_cells,
    repeated_measures_anova,
)
from tactileq.analysis.chapters.tables.figure import figure_factorial
from tactileq.analysis.chapters.tables.sentences import (
    MOST_NAMES,
    chance_sentences,
    d_prime_sentence,
    effect_sentences,
    listed,
    mean_sentence,
    measure_of,
    other_answers,
    participants_above,
    sentence_of,
    subject_of,
)
from tactileq.analysis.figures.confusions import plot_confusion
from tactileq.analysis.page.outcomes import Outcome, Weight, described
from tactileq.analysis.page.page import Fold, Picture, Table
from tactileq.analysis.page.sections import Headline, Section
from tactileq.analysis.statistics.confusion import (
    CONFUSION_COLUMNS,
    ConfusionMatrix,
    confusion_table,
)
from tactileq.modeling.errors import counted, shortened
from tactileq.modeling.files.columns import Column, Columns, without

MOST_PICTURES = 48  # panels, and matrices
ABOVE_CHANCE = Column("p_above_chance", "p above chance (binomial)", is_p_value=True)


def table_sections(imported: ImportedAnswers, *, rng: np.random.Generator) -> list[Section]:
    """Accuracy or mean by condition, analysis of variance, chance and d′, confusion matrices.

    Parameters
    ----------
    rng : Generator
        Draws the sign flips of tests over participants.
    """
    factors = list(imported.factors)
    cells = participant_cells(imported.answers, imported.measure, factors=factors)
    if _chance(imported):
        right = (cells["mean"] * cells["trials"]).round()
        above = stats.binom.sf(right - 1, cells["trials"], _chance(imported))
        cells = cells.assign(p_above_chance=above)
    mean = mean_sentence(imported, cells, overall=overall_mean(cells))
    first = _condition_section(imported, cells, mean=mean)
    effects = [_effects_section(imported, cells, rng=rng)] if factors else []
    chance = [_chance_section(imported, cells, rng=rng)] if _chance(imported) else []
    headline = _headline(imported, mean, tests=effects or chance)
    confusions = [_confusion_section(imported)] if imported.classes else []
    return [replace(first, headline=headline), *effects, *chance, *confusions]


def _headline(imported: ImportedAnswers, mean: str, *, tests: Sequence[Section]) -> Headline:
    """The effects; without tests of any, the mean and how it compares with chance."""
    found = [sentence for section in tests for sentence in section.findings]
    if not imported.factors or not any(section.items for section in tests):
        return Headline(" ".join([mean, *found[:1]]))
    if len(found) == 1:
        return Headline(found[0])
    subject = f"{sentence_of(measure_of(imported))} by {listed(imported.factors)}"
    return Headline(subject, tuple(found))


def _presented(imported: ImportedAnswers) -> tuple[str, ...]:
    return imported.presented or imported.classes


def _chance(imported: ImportedAnswers) -> float:
    """Share of right answers by guessing; 0 where it is not known, or no answer is right."""
    choices = len(_presented(imported))
    known = choices > 1 and imported.measure == "correct" and not imported.response
    return 1 / choices if known else 0.0


def _condition_section(imported: ImportedAnswers, cells: pd.DataFrame, *, mean: str) -> Section:
    measure, factors = measure_of(imported), list(imported.factors)
    means = cell_means(cells, factors)
    how = "Student's t over trials" if imported.measure == "value" else "Wilson"
    by = f" by {', '.join(factors)}" if factors else ""
    title = f"{sentence_of(measure)}{by}"
    table = Table(
        "by_condition",
        title,
        "Mean over participants, each counting once, with a 95% interval (Student's t over "
        "participants).",
        means,
        CONDITION_COLUMNS,
        False,
    )
    binomial = " Exact binomial test against chance, one-sided." if _chance(imported) else ""
    own = Table(
        "by_participant",
        f"{sentence_of(measure)} of each participant",
        f"95% intervals: {how}.{binomial}",
        cells,
        (*PARTICIPANT_CELL_COLUMNS, ABOVE_CHANCE) if binomial else PARTICIPANT_CELL_COLUMNS,
        False,
    )
    people = cells["participant_id"].nunique()
    trials = int(imported.answers["count"].sum())
    missed = f"; left out without an answer: {imported.missed}" if imported.missed else ""
    pictures = _pictures(imported, cells, means=means, title=title)
    return Section(
        "conditions",
        f"{sentence_of(measure)} by condition" if factors else sentence_of(measure),
        (*pictures, table, Fold("Each participant", (own,))),
        outcomes=(Outcome(Weight.OVERALL, mean), *described(imported.notes)),
        done=(
            f"Tables: {counted(people, 'participant')}, "
            f"{counted(trials, 'answered trial')}{missed}.",
        ),
        tiles=tuple(
            (str(number), counted(number, noun).partition(" ")[2])
            for number, noun in ((people, "participant"), (trials, "answered trial"))
        ),
    )


def _pictures(
    imported: ImportedAnswers, cells: pd.DataFrame, *, means: pd.DataFrame, title: str
) -> tuple[Picture, ...]:
    first, *others = imported.factors or [""]
    if not first or len(means[others].drop_duplicates()) > MOST_PICTURES:
        return ()
    label = f"{measure_of(imported)} (0–1)"
    if imported.measure == "value":
        label = "mean (unit of the table)"
    elif not imported.response:
        label = "accuracy (proportion correct, 0–1)"
    chance = _chance(imported)
    figure = figure_factorial(
        cells,
        means,
        factors=imported.factors,
        label=label,
        simulated=False,
        chance=chance or None,
    )
    note = "Thin: participants; bold: mean over participants with its 95% confidence interval."
    note += f" Dashed: chance, {chance:.3f}." if chance else ""
    return (Picture("by_condition", title, note, figure, False),)


def _effects_section(
    imported: ImportedAnswers, cells: pd.DataFrame, *, rng: np.random.Generator
) -> Section:
    """The tests of the factors; a sentence without a chapter where there are too few people."""
    if cells["participant_id"].nunique() < 2:
        return _untested(imported, "there is one participant")
    complete = complete_cells(cells, imported.factors)
    excluded = shortened(", ".join(complete.excluded), longest=MOST_NAMES)
    left_out = (
        "Left out of the analysis of variance because answers are missing in some condition: "
        f"{counted(len(complete.excluded), 'participant')} ({excluded})."
    )
    deviations = (left_out,) if complete.excluded else ()
    n = len(complete.participants)
    if n < 2:
        whole = f"{counted(n, 'participant')} answered in every condition"
        return replace(_untested(imported, whole), deviations=deviations)
    anova, pairs = repeated_measures_anova(complete), pairwise_tests(complete, rng=rng)
    return Section(
        "anova",
        "Effects of the factors",
        (_anova_table(anova, measure_of(imported)), _pair_table(pairs)),
        outcomes=tuple(
            Outcome(Weight.OVERALL, sentence)
            for sentence in effect_sentences(
                complete, anova, pairs=pairs, subject=subject_of(imported)
            )
        ),
        done=(f"Analysis of variance of {n} participants.",),
        deviations=deviations,
    )


def _untested(imported: ImportedAnswers, why: str) -> Section:
    text = f"Effects of {listed(imported.factors)} are not tested, as {why}."
    return Section("anova", "", (), outcomes=(Outcome(Weight.OVERALL, text),), done=(text,))


def _anova_table(anova: pd.DataFrame, measure: str) -> Table:
    columns: Columns = ANOVA_COLUMNS
    note = f"Of each participant's {measure} per condition."
    if (anova["df_effect"] == 1).all():
        columns = without(columns, *CORRECTED)
    else:
        note += " ε: Greenhouse–Geisser correction; not needed with one degree of freedom."
    if len(anova) > 1:
        note += " p is not corrected for the number of effects."
    title = "Repeated-measures analysis of variance"
    return Table("anova", title, note, anova, columns, False)


def _pair_table(pairs: pd.DataFrame) -> Table:
    return Table(
        "pairs",
        "Levels compared in pairs",
        "Paired t-tests over participants, averaged over the other factors. Holm over the pairs of "
        "one factor. Intervals: 95% each, not corrected.",
        pairs,
        PAIR_COLUMNS,
        False,
    )


def _chance_section(
    imported: ImportedAnswers, cells: pd.DataFrame, *, rng: np.random.Generator
) -> Section:
    chance, presented = _chance(imported), _presented(imported)
    found = against_chance(
        imported.answers, cells, factors=imported.factors, presented=presented, rng=rng
    )
    other = other_answers(imported.answers, presented)
    model, how = (
        f"{len(presented)}-alternative forced choice without bias",
        ("d′ follows from accuracy (Hacker and Ratcliff 1979), as do the limits of its interval"),
    )
    if len(presented) == 2:
        model = "z(hits) − z(false alarms)"
        how = "d′ is the mean over participants, corrected loglinearly (Hautus 1995)"
    elif other:
        how += "; as answers that name no presented class count as wrong, it is a lower limit"
    sentences = [
        *chance_sentences(found, chance),
        participants_above(cells, chance),
        d_prime_sentence(found, model),
        other,
    ]
    table = Table(
        "chance",
        f"Accuracy against chance ({chance:.3f}), and d′",
        "One-sample t-tests over participants, two-sided; Holm over the conditions. "
        f"{how}. Model of d′: {model}.",
        found,
        CHANCE_COLUMNS,
        False,
    )
    outcomes = tuple(Outcome(Weight.SECONDARY, text) for text in sentences if text)
    return Section("chance", "Accuracy against chance, and d′", (table,), outcomes=outcomes)


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
    """Answers counted over participants, all over the same classes.

    A matrix per condition, or one of all where there are too many to look at.
    """
    answers, classes, presented = imported.answers, imported.classes, _presented(imported)
    parts: list[tuple[str, pd.DataFrame]] = [("all conditions", answers)]
    groups = list(answers.groupby(list(imported.factors))) if imported.factors else []
    if 0 < len(groups) <= MOST_PICTURES:
        groups.sort(key=lambda group: [in_order(level) for level in group[0]])
        parts = [
            (", ".join(f"{f} {level}" for f, level in zip(imported.factors, key, strict=True)), own)
            for key, own in groups
        ]
    matrices = []
    for name, own in parts:
        counts = own.pivot_table(
            index="presented", columns="answered", values="count", aggfunc="sum", fill_value=0
        ).reindex(index=list(presented), columns=list(classes), fill_value=0)
        matrix = ConfusionMatrix(name, classes, counts.to_numpy(dtype=np.int64), presented)
        matrices.append(matrix)
    return matrices


def _figure_of(matrix: ConfusionMatrix) -> Figure:
    width, height = (2.5 + 0.75 * len(names) for names in (matrix.textures, matrix.rows))
    figure = Figure(figsize=(width, height), layout="constrained")
    ax = plot_confusion(matrix, simulated=False, ax=figure.subplots())
    ax.set_xlabel("answered")
    ax.set_ylabel("presented")
    return figure
