"""The figure of the hand shows everybody, the means and their intervals."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from matplotlib.colors import to_hex
from scipy import stats

from tactileq.analysis.chapters.hand.figure import figure_hand, plot_measure
from tactileq.analysis.page.drawing import GREY
from tactileq.analysis.page.saving import png_of

pytestmark = pytest.mark.filterwarnings("error")
PAIR = ("full", "simplified")


def means_of(values: np.ndarray, measure: str = "speed_mm_s") -> pd.DataFrame:
    table = pd.DataFrame(np.asarray(values, dtype=float), columns=["reference", "other"])
    people = [f"sub-{n:02d}" for n in range(len(table))]
    return table.assign(task="absolute", measure=measure, participant_id=people)


def test_everybody_is_joined_and_the_interval_is_that_of_t():
    values = np.array([[100, 110], [120, 118], [90, 130]])
    ax = plot_measure(means_of(values), "speed_mm_s", models=PAIR, simulated=False)
    joined = [line for line in ax.lines if to_hex(line.get_color()) == GREY.lower()]
    assert [list(line.get_ydata()) for line in joined] == values.tolist()
    for column, bars in enumerate(ax.containers):
        own = values[:, column]
        (segment,) = bars.lines[2][0].get_segments()
        expected = stats.t.interval(0.95, 2, own.mean(), stats.sem(own))
        assert segment[:, 1].tolist() == pytest.approx(list(expected))
    assert [tick.get_text() for tick in ax.get_xticklabels()] == list(PAIR)
    assert ax.get_ylabel() == "mean speed while touching (mm/s)"


def test_only_what_was_measured_has_a_panel_and_simulated_is_stamped():
    speed = means_of([[100, 110], [np.nan, 7]])
    both = pd.concat([speed, means_of([[1, 1.2], [1.5, 1.4]], "force_n")])
    for table, panels in ((speed, 1), (both, 2)):
        figure = figure_hand(table, models=PAIR, simulated=True)
        assert len(figure.axes) == panels
        for ax in figure.axes:
            assert "SIMULATED" in [text.get_text() for text in ax.texts]
        assert png_of(figure, dpi=40)[0].startswith(b"\x89PNG")
    assert len([x for x in figure_hand(speed, models=PAIR, simulated=False).axes[0].texts]) == 0


@pytest.mark.parametrize("values", [[[100, 110]], [[100, 100], [100, 100]]])
def test_without_variation_there_is_a_mean_without_an_interval(values):
    ax = plot_measure(means_of(values), "speed_mm_s", models=PAIR, simulated=False)
    assert all(not bars.has_yerr for bars in ax.containers)
    assert ax.containers[0].lines[0].get_ydata().tolist() == [100]
