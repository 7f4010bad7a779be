"""People one by one, and the forest with the model's intervals: what is drawn where."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from tactileq.analysis.chapters.claims.forest import BESIDE, MARKS, figure_forest, plot_forest
from tactileq.analysis.chapters.claims.people_figure import (
    CARELESS,
    INSIDE,
    OUTSIDE,
    figure_people,
    plot_people,
)
from tactileq.analysis.statistics.caveats import EQUALITY
from tactileq.analysis.statistics.equivalence import EQUAL_ON_AVERAGE, FELT
from tactileq.analysis.statistics.verdicts import ClaimFound
from tests.analysis.conftest import by_model, people_summary, people_table

SUMMARY = people_summary(mean=(5.0, -1.0, 9.0), share=(0.42, 0.25, 0.58), most=0.55, somebody=1.0)
EFFECTS = [3.0, -2.0, 15.0, 1.0, 12.0, 0.5, -1.0, 2.0]


@pytest.fixture(scope="module")
def judged(found) -> ClaimFound:
    """Two of eight people outside the bounds, and one careless."""
    table = people_table(EFFECTS, outside=(2, 4), careless=(0,))
    return by_model(found[0], SUMMARY, people=table)


def drawn(ax: Axes, mark: str) -> list[tuple[float, float]]:
    lines = [line for line in ax.lines if line.get_marker() == mark]
    return [(float(x), float(y)) for line in lines for x, y in line.get_xydata()]


def legend_of(figure: Figure) -> list[str]:
    return [text.get_text() for text in figure.legends[0].get_texts()]


def test_people_stand_in_the_order_of_their_effects(judged):
    ax = plot_people(judged, simulated=True)
    inside, outside, careless = (drawn(ax, kind[0]) for kind in (INSIDE, OUTSIDE, CARELESS))
    assert sorted(inside + outside + careless) == [
        (float(place), effect) for place, effect in enumerate(sorted(EFFECTS))
    ]
    assert [effect for _, effect in outside] == [12.0, 15.0]
    assert [effect for _, effect in careless] == [3.0]
    assert len({to_hex(kind[1]) for kind in (INSIDE, OUTSIDE, CARELESS)}) == 3


def test_share_bounds_and_careless_people_are_written_into_the_figure(judged):
    figure = figure_people(judged, simulated=True)
    [ax] = figure.axes
    title = ax.get_title(loc="left")
    assert judged.claim.name in title
    assert FELT in title
    assert "42% (95% CI 25% to 58%)" in title
    assert any("sub-01" in label for label in legend_of(figure))
    assert "SIMULATED" in [text.get_text() for text in ax.texts]
    assert "points of 100" in ax.get_ylabel()
    [band] = ax.patches
    assert band.get_extents().transformed(ax.transData.inverted()).intervaly == pytest.approx(
        [-7.5, 7.5]
    )


def test_no_upper_limit_of_people_is_drawn_where_there_is_doubt(judged):
    doubted = replace(judged, tests=judged.tests.assign(doubt="anchors failed"))
    title = plot_people(doubted, simulated=True).get_title(loc="left")
    assert "25%" in title
    assert "58%" not in title


def test_choices_are_drawn_in_percentage_points(found):
    table = people_table([0.2] * 8)
    ax = plot_people(by_model(found[2], SUMMARY, people=table), simulated=False)
    assert "percentage points" in ax.get_ylabel()
    assert [effect for _, effect in drawn(ax, INSIDE[0])] == pytest.approx([20.0] * 8)
    assert not ax.texts


@pytest.mark.parametrize("people", [8, 36, 100])
def test_any_number_of_people_fits(found, people):
    effects = list(np.linspace(-12.0, 3.0, people))
    figure = figure_people(
        by_model(found[0], SUMMARY, people=people_table(effects)), simulated=True
    )
    figure.canvas.draw()
    [ax] = figure.axes
    labels = [one.get_window_extent() for one in ax.get_xticklabels() if one.get_text()]
    assert not any(a.overlaps(b) for a, b in pairwise(labels))
    assert len(labels) == (people if people < 50 else 0)


def test_the_forest_shows_the_mean_that_the_verdict_rests_on(judged):
    ax = plot_forest(judged, simulated=True, ax=Figure().subplots())
    [(x, y)] = drawn(ax, MARKS[FELT][0])
    assert (x, y) == (SUMMARY.mean, 0.0)
    intervals = {
        tuple(map(float, line.get_xdata())): float(line.get_ydata()[0])
        for line in ax.lines
        if line.get_marker() == "None"
    }
    assert intervals[SUMMARY.mean_low, SUMMARY.mean_high] >= 0.0
    row = judged.tests.iloc[0]
    assert intervals[row["ci90_low"], row["ci90_high"]] == pytest.approx(BESIDE)


def test_every_word_of_equality_has_a_look_of_its_own(found, judged):
    words = (*EQUALITY, FELT)
    assert len({MARKS[word][0] for word in words}) == len(words)
    same = by_model(found[1], people_summary())
    legend = legend_of(figure_forest([judged, same, found[2]], simulated=True))
    assert {FELT, EQUAL_ON_AVERAGE, "95% CI of the model"} <= set(legend)
    assert "95% CI of the model" not in legend_of(figure_forest(found, simulated=True))
