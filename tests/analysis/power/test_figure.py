"""The figure of planning: a line for each verdict that came, marked as simulated."""

from __future__ import annotations

import pandas as pd

from tactileq.analysis.labels import ALL_TEXTURES
from tactileq.analysis.power.figure import figure_power
from tactileq.analysis.power.power import EVERY_TEXTURE, Verdict, power_table
from tactileq.analysis.statistics.equivalence import EQUIVALENT, INCONCLUSIVE


def table_of(claims: int) -> pd.DataFrame:
    found = [
        Verdict(f"claim {claim}", texture, n, EQUIVALENT if number < n else INCONCLUSIVE)
        for claim in range(claims)
        for texture in (ALL_TEXTURES, "canvas", EVERY_TEXTURE)
        for n in (8, 16)
        for number in range(20)
    ]
    return power_table(found, simulations=20)


def test_every_claim_has_a_panel_with_its_verdicts():
    figure = figure_power(table_of(2))
    panels = [ax for ax in figure.axes if ax.get_title(loc="left")]
    assert [ax.get_title(loc="left") for ax in panels] == ["claim 0", "claim 1"]
    for ax in panels:
        labels = ax.get_legend_handles_labels()[1]
        assert labels == ["equivalent", "inconclusive", "every single texture equivalent"]
        assert "SIMULATED" in [text.get_text() for text in ax.texts]
        assert ax.get_xlabel() == "participants"
        assert list(ax.get_xticks()) == [8, 16]
        (target,) = [line for line in ax.lines if set(line.get_ydata()) == {0.8}]
        assert target.get_linestyle() == ":"
    equal = panels[0].containers[0]
    assert list(equal.lines[0].get_ydata()) == [0.4, 0.8]


def test_panels_without_a_claim_are_empty_and_one_n_is_enough():
    figure = figure_power(table_of(4))
    assert len([ax for ax in figure.axes if not ax.axison]) == 2
    one = table_of(1)
    figure = figure_power(one[one["n"] == 8])
    assert list(figure.axes[0].get_xticks()) == [8]
