"""Names that answers, tables and figures share."""

from __future__ import annotations

from collections.abc import Iterable

from tactileq.modeling.files.answer_tables import ANSWER_TABLES

# The sets of models that the statistics compare, the reference first.
MODELS = ("full", "simplified")
TASK_TITLES = {task: table.title for task, table in ANSWER_TABLES.items()}
SCALES: dict[str, str] = {}
for _column in (column for table in ANSWER_TABLES.values() for column in table.columns):
    if _column.scale and SCALES.setdefault(_column.name, _column.scale) != _column.scale:
        raise ValueError(
            f"expected the scale {SCALES[_column.name]!r} in every column {_column.name}, got "
            f"{_column.scale!r}; give the column another name."
        )
# What claims can be about: columns of tables of answers, in words.
MEASURES = {
    **{column: f"rated similarity of {scale}" for column, scale in SCALES.items()},
    "correct": "correct rate",
}


def unit_of(measure: str) -> tuple[str, float]:
    """The unit in which differences of a measure are stated, and the factor that leads to it."""
    return ("percentage points", 100.0) if measure == "correct" else ("points of 100", 1.0)


def sentence_case(words: str) -> str:
    """Words at the beginning of a sentence; unlike `str.capitalize` it leaves the others alone."""
    return words[:1].upper() + words[1:]


ALL_TEXTURES = "all textures"

ALL_LAYERS = "all layers"

IDENTICAL = "identical models, nothing to compare"

SIGNIFICANCE_MARKS = ((0.001, "***"), (0.01, "**"), (0.05, "*"))


def significance_mark(p: float) -> str:
    """*, ** or *** below .05, .01 and .001; nothing else, and nothing for NaN."""
    return next((mark for level, mark in SIGNIFICANCE_MARKS if p < level), "")


def signed(value: float, digits: int) -> str:
    """A number with its sign, with a true minus sign."""
    return f"{round(value, digits) + 0.0:+.{digits}f}".replace("-", "−")


def names_or_none(textures: Iterable[str]) -> str:
    """Names as a list in a sentence."""
    return ", ".join(textures) or "none"
