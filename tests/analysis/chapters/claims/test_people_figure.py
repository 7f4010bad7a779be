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
    ATTENDING,
    CARELESS,
    figure_people,
    plot_people,
)
from tactileq.analysis.chapters.claims.predictive_figure import figure_predictive
from tactileq.analysis.statistics.caveats import EQUALITY
from tactileq.analysis.statistics.equivalence import DIFFERENT, INCONCLUSIVE
from tactileq.analysis.statistics.verdicts import ClaimFound
from tests.analysis.conftest import by_model, people_summary, people_table

SUMMARY = people_summary(mean=(5.0, -1.0, 9.0), sd=(4.0, 2.5, 6.1))
EFFECTS = [3.0, -2.0, 15.0, 1.0, 12.0, 0.5, -1.0, 2.0]


@pytest.fixture(scope="module")
def judged(found) -> ClaimFound:
    """Eight people, of whom one is careless."""
    return by_model(found[0], SUMMARY, people=people_table(EFFECTS, careless=(0,)))


def drawn(ax: Axes, mark: str) -> list[tuple[float, float]]:
    lines = [line for line in ax.lines if line.get_marker() == mark]
    return [(float(x), float(y)) for line in lines for x, y in line.get_xydata()]


def legend_of(figure: Figure) -> list[str]:
    return [text.get_text() for text in figure.legends[0].get_texts()]


def test_people_stand_in_the_order_of_their_effects(judged):
    ax = plot_people(judged, simulated=True)
    attending, careless = (drawn(ax, kind[0]) for kind in (ATTENDING, CARELESS))
    assert sorted(attending + careless) == [
        (float(place), effect) for place, effect in enumerate(sorted(EFFECTS))
    ]
    assert [effect for _, effect in careless] == [3.0]
    assert to_hex(ATTENDING[1]) != to_hex(CARELESS[1])


def test_sd_bounds_and_careless_people_are_written_into_the_figure(judged):
    figure = figure_people(judged, simulated=True)
    [ax] = figure.axes
    title = ax.get_title(loc="left")
    assert judged.claim.name in title
    assert INCONCLUSIVE in title
    assert "4.0 (95% CI 2.5 to 6.1)" in title
    days = plot_people(replace(judged, by_day=True), simulated=True).get_title(loc="left")
    assert "people and days" in days
    assert any("sub-01" in label for label in legend_of(figure))
    assert "SIMULATED" in [text.get_text() for text in ax.texts]
    assert "points of 100" in ax.get_ylabel()
    [band] = ax.patches
    assert band.get_extents().transformed(ax.transData.inverted()).intervaly == pytest.approx(
        [-7.5, 7.5]
    )


def test_the_check_shows_what_was_given_among_what_is_predicted(judged):
    people = judged.people
    figure = figure_predictive(judged, simulated=True)
    ends, spread, repeats = figure.axes
    for ax, given in ((ends, 100 * people.given.at_ends[0]), (repeats, people.given.repeated[0])):
        [line] = [one for one in ax.lines if one.get_color() == "black" or one.get_lw() == 2]
        assert float(line.get_xdata()[0]) == pytest.approx(given)
    total = sum(bar.get_height() for bar in ends.patches)
    assert total == len(people.replicated.at_ends)
    [dots] = [one for one in spread.lines if one.get_marker() == "o"]
    np.testing.assert_allclose(dots.get_ydata(), np.sort(people.given.spread[0]))
    once = replace(people.given, repeated=np.array([np.nan]))
    single = replace(judged, people=replace(people, given=once))
    assert len(figure_predictive(single, simulated=False).axes) == 2


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
    assert (SUMMARY.mean, 0.0) in drawn(ax, MARKS[INCONCLUSIVE][0])
    intervals = {
        tuple(map(float, line.get_xdata())): float(line.get_ydata()[0])
        for line in ax.lines
        if line.get_marker() == "None"
    }
    assert intervals[SUMMARY.mean_low, SUMMARY.mean_high] >= 0.0
    row = judged.tests.iloc[0]
    assert intervals[row["ci90_low"], row["ci90_high"]] == pytest.approx(BESIDE)


def test_every_word_of_equality_has_a_look_of_its_own(found, judged):
    words = (*EQUALITY, DIFFERENT, INCONCLUSIVE)
    assert len({MARKS[word][0] for word in words}) == len(words)
    same = by_model(found[1], people_summary())
    legend = legend_of(figure_forest([judged, same, found[2]], simulated=True))
    assert {INCONCLUSIVE, "equivalent", "95% CI of the model"} <= set(legend)
    assert "95% CI of the model" not in legend_of(figure_forest(found, simulated=True))
