"""Marks of significance, and counts with their nouns."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.labels import counted, significance_mark


@pytest.mark.parametrize(
    ("p", "mark"),
    [(0.0, "***"), (0.00099, "***"), (0.001, "**"), (0.01, "*"), (0.049, "*"), (0.05, "")],
)
def test_marks(p: float, mark: str) -> None:
    assert significance_mark(p) == mark
    assert significance_mark(np.nan) == ""


@pytest.mark.parametrize(
    ("number", "text"), [(0, "0 layers"), (1, "1 layer"), (2, "2 layers"), (np.int64(1), "1 layer")]
)
def test_counts_agree_with_their_nouns(number: int, text: str) -> None:
    assert counted(number, "layer") == text
