"""The figure of factors: panels, lines per participant, the bold mean."""

from __future__ import annotations

import pandas as pd
import pytest

from tactileq.analysis.chapters.tables.factorial import cell_means, participant_cells
from tactileq.analysis.chapters.tables.figure import figure_factorial


@pytest.mark.parametrize("simulated", [True, False])
def test_a_panel_per_level_and_a_line_per_participant(simulated: bool) -> None:
    rows = [
        {"participant_id": who, "A": a, "B": b, "count": 1, "correct": float(who == a)}
        for who in "1234"
        for a in "123"
        for b in "12"
    ]
    cells = participant_cells(pd.DataFrame(rows), "correct", factors=["A", "B"])
    means = cell_means(cells, ["A", "B"])
    figure = figure_factorial(
        cells, means, factors=["A", "B"], label="accuracy", simulated=simulated
    )
    assert [ax.get_title(loc="left") for ax in figure.axes] == ["B 1", "B 2"]
    for ax in figure.axes:
        own = [line for line in ax.lines if line.get_marker() == "o"]
        assert len(own) == 4
        assert list(own[1].get_ydata()) == [0.0, 1.0, 0.0]
        bold = next(line for line in ax.lines if line.get_marker() == "s")
        assert list(bold.get_ydata()) == [0.25, 0.25, 0.25]
        assert any(text.get_text() == "SIMULATED" for text in ax.texts) is simulated
