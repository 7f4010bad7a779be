"""Marks of significance."""

from __future__ import annotations

import numpy as np
import pytest

from tactileq.analysis.labels import significance_mark


@pytest.mark.parametrize(
    ("p", "mark"),
    [(0.0, "***"), (0.00099, "***"), (0.001, "**"), (0.01, "*"), (0.049, "*"), (0.05, "")],
)
def test_marks(p: float, mark: str) -> None:
    assert significance_mark(p) == mark
    assert significance_mark(np.nan) == ""
