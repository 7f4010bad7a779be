"""What the page on a table says."""

from __future__ import annotations

from itertools import product

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from tactileq.analysis.answers.imported import ImportedAnswers
from tactileq.analysis.chapters.tables.section import imported_matrices, table_sections
from tactileq.analysis.chapters.tables.sentences import figures
from tactileq.analysis.page.page import Fold, Table
from tactileq.analysis.page.sections import Section

DONT_KNOW = "don't know"


def answers_of(values: np.ndarray, *, measure: str = "value", **more: object) -> ImportedAnswers:
    """One answer per participant and cell of (n, levels …) values; factors A, B, …"""
    factors = tuple("ABCD"[: values.ndim - 1])
    rows = [
        {"participant_id": f"P{who}", **dict(zip(factors, map(str, levels), strict=True))}
        | {measure: values[(who, *levels)], "count": 10}
        for who, *levels in product(*map(range, values.shape))
        if np.isfinite(values[(who, *levels)])
    ]
    return ImportedAnswers(pd.DataFrame(rows), factors, measure, **more)


def identified(people: int = 5, **more: object) -> ImportedAnswers:
    """Four classes, 6 trials each: 4 right, 1 taken for the next, 1 unknown; one more of P0."""
    classes = ("a", "b", "c", "d")
    rows = [
        {"participant_id": f"P{who}", "presented": name, "answered": said, "count": count}
        | {"correct": float(name == said)}
        for who in range(people)
        for place, name in enumerate(classes)
        for said, count in ((name, 4 + (who == 0)), (classes[place - 1], 1), (DONT_KNOW, 1))
    ]
    fields = {"classes": (*classes, DONT_KNOW), "presented": classes, **more}
    return ImportedAnswers(pd.DataFrame(rows), (), "correct", **fields)


def sections_of(imported: ImportedAnswers) -> list[Section]:
    return table_sections(imported, rng=np.random.default_rng(0))


def headline(imported: ImportedAnswers) -> list[str]:
    found = sections_of(imported)[0].headline
    assert found is not None
    return [found.subject, *found.points]


def all_words(sections: list[Section]) -> str:
    """Headings, findings, captions and columns."""
    words: list[str] = []
    for section in sections:
        words += [section.heading, *section.findings, *section.done]
        for item in section.items:
            for each in item.items if isinstance(item, Fold) else [item]:
                words += [each.title, each.note]
                words += [c.heading for c in each.columns] if isinstance(each, Table) else []
    return " ".join(words)


def test_an_effect_of_two_levels_has_whole_degrees_of_freedom_and_no_correction() -> None:
    values = np.random.default_rng(1).normal([0.81, 0.64], 0.08, (10, 2))
    (sentence,) = headline(answers_of(values, measure="correct"))
    t = stats.ttest_rel(values[:, 0], values[:, 1]).statistic
    means = [f"{level}: {mean:.2f}" for level, mean in enumerate(values.mean(axis=0))]
    assert sentence.startswith(f"Accuracy differs between levels of A ({', '.join(means)}; ")
    assert f"F(1, 9) = {t**2:.2f}, p " in sentence
    assert "Greenhouse" not in sentence
    anova = sections_of(answers_of(values))[1].items[0]
    assert isinstance(anova, Table)
    assert "epsilon" not in [column.name for column in anova.columns]


def test_effects_stand_in_order_and_interactions_qualify_them() -> None:
    values = np.random.default_rng(2).normal(size=(9, 2, 3))
    values[:, 1, 2] += 9
    subject, *points = headline(answers_of(values))
    assert subject == "Mean by A and B"
    assert [("levels of A" in p, "levels of B" in p) for p in points[:2]] == [(1, 0), (0, 1)]
    assert "The effects of A and B on the mean depend on each other (A × B: F(" in points[2]
    assert "need not hold at every level of the other factor" in points[2]
    assert ".00, 16.00" not in points[1]
    assert "(Greenhouse–Geisser)" in points[1]


def test_nothing_found_is_no_evidence() -> None:
    values = np.random.default_rng(3).normal(size=(9, 2, 2, 2, 2))
    said = headline(answers_of(values))
    assert said[1].startswith("We found no evidence that the mean differs between levels of A")
    assert said[-1].startswith("We found no evidence of interactions (11 tests, the least p = .")
    assert "not shown" not in " ".join(said)


@pytest.mark.parametrize(
    ("steps", "told"),
    [
        ([0.5, 0.75], "(1 − 0) is exactly 0.250 in each of the 8 participants"),
        ([0.5, 0.5], "Accuracy is exactly the same at all levels of A in each of the 8 part"),
        ([0.5, 0.75, 0.6], "differences in accuracy between levels of A are exactly the same in"),
    ],
)
def test_a_constant_difference_is_stated(steps: list[float], told: str) -> None:
    values = np.arange(8)[:, None] / 40 + np.array(steps)
    (sentence,) = headline(answers_of(values, measure="correct"))
    assert told in sentence
    assert "F and p of this test do not exist" in sentence
    assert ("sign flips" in sentence) == (len(set(steps)) > 1)


def test_without_factors_the_mean_is_compared_with_chance_of_what_was_presented() -> None:
    imported = identified(notes=("First.", "Second."))
    first, chance, _ = sections_of(imported)
    (sentence,) = headline(imported)
    # 20 of 28 trials of P0 are right, 16 of 24 of the others.
    shares = np.array([20 / 28, *[16 / 24] * 4])
    assert sentence.startswith(f"Accuracy is {shares.mean():.3f} over 5 participants (95% CI ")
    t = stats.ttest_1samp(shares, 0.25).statistic
    assert f"Accuracy is above chance (0.250; t(4) = {t:.2f}, p < .001)." in sentence
    assert first.findings[1:] == ("First.", "Second.")
    assert '20 answers "don\'t know" count as wrong' in chance.findings[-1]
    assert "0.200" not in all_words(sections_of(imported))


def test_an_answer_that_was_never_presented_has_a_column_and_no_row() -> None:
    (matrix,) = imported_matrices(identified())
    assert (matrix.rows, matrix.textures) == (tuple("abcd"), (*"abcd", DONT_KNOW))
    assert matrix.counts.sum(axis=1).tolist() == [31] * 4
    assert matrix.counts[:, 4].sum() == 20
    assert np.isfinite(matrix.row_shares).all()


def test_a_response_has_neither_right_answers_nor_chance() -> None:
    values = np.random.default_rng(4).integers(0, 11, (6, 3)) / 10
    imported = answers_of(values, measure="correct", response="rougher")
    (sentence,) = headline(imported)
    assert "the share of answers 'rougher' differs between levels of A" in sentence
    words = all_words(sections_of(imported)).casefold()
    assert not [word for word in ("accuracy", "chance", "right", "correct ") if word in words]


def test_one_participant_is_tested_by_trials_alone() -> None:
    (sentence,) = headline(identified(people=1))
    assert sentence.startswith("Accuracy is 0.71 over 28 trials of one participant (95% CI 0.53 to")
    p = stats.binomtest(20, 28, 0.25, alternative="greater").pvalue
    assert p < 0.001
    assert "one-sided, p < .001" in sentence
    (alone,) = headline(answers_of(np.ones((1, 3))))
    assert "Effects of A are not tested, as there is one participant." in alone


def test_empty_cells_leave_people_out_and_too_few_are_not_tested() -> None:
    values = np.random.default_rng(5).normal(size=(4, 3))
    values[0, 1] = np.nan
    tested = sections_of(answers_of(values))[1]
    assert "1 participant (P0)" in tested.deviations[0]
    assert "F(" in tested.findings[0]
    values[1, 0] = values[2, 2] = np.nan
    (sentence,) = headline(answers_of(values))
    assert "not tested, as 1 participant answered in every condition" in sentence


@pytest.mark.parametrize(
    ("values", "told"),
    [
        ((0.811, 0.642), ["0.81", "0.64"]),
        ((500.0, 500.4), ["500.00", "500.40"]),
        ((57.31, 61.25), ["57.3", "61.2"]),
        ((0.6, -0.2, 1.4), ["0.60", "−0.20", "1.40"]),
        ((2.0, 2.0), ["2.00", "2.00"]),
        ((3.02e-7, 4.1e-7), ["3.02e−07", "4.1e−07"]),
    ],
)
def test_numbers_show_that_they_differ(values: tuple[float, ...], told: list[str]) -> None:
    assert figures(*values) == told
