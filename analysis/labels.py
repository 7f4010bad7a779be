"""Names that answers, tables and figures share."""

from __future__ import annotations

# The sets of models that the statistics compare, the reference first.
MODELS = ("full", "simplified")
TASKS = {
    "absolute": "absolute evaluation",
    "relative": "forced choice",
    "oddity": "oddity task",
    "threshold": "detection threshold",
}
SCALES = {
    "magnitude_similarity": "vibration magnitude",
    "frequency_similarity": "frequency pattern",
}
# What claims can be about: columns of tables of answers, in words.
MEASURES = {
    **{column: f"rated similarity of {scale}" for column, scale in SCALES.items()},
    "correct": "correct rate",
}

ALL_TEXTURES = "all textures"

ALL_LAYERS = "all layers"

IDENTICAL = "identical models, nothing to compare"

SIGNIFICANCE_MARKS = ((0.001, "***"), (0.01, "**"), (0.05, "*"))


def significance_mark(p: float) -> str:
    """*, ** or *** below .05, .01 and .001; nothing else, and nothing for NaN."""
    return next((mark for level, mark in SIGNIFICANCE_MARKS if p < level), "")
