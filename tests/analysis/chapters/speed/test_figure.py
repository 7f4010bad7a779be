"""Figures of speed and accuracy: points, lines, intervals, and what is missing."""

from __future__ import annotations

import io

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose

from tactileq.analysis.chapters.speed.figure import (
    figure_conditional_accuracy,
    figure_speed_accuracy,
)
from tactileq.analysis.chapters.speed.scores import (
    conditional_accuracy,
    participant_scores,
    score_means,
)
from tactileq.analysis.figures.answers import ROLE_COLOURS

MODELS = ("full", "simplified")
pytestmark = pytest.mark.filterwarnings("error")


@pytest.fixture
def answers(choices: pd.DataFrame) -> pd.DataFrame:
    """Choices of sixteen people, each with times of their own."""
    factors = np.exp(np.random.default_rng(7).normal(0, 0.4, len(choices)))
    return choices.assign(response_time_s=choices["response_time_s"] * factors)


@pytest.mark.parametrize("simulated", [True, False])
def test_a_point_per_participant_and_model_and_a_line_between(answers, simulated):
    scores = participant_scores(answers, models=MODELS)
    means = score_means(scores)
    figure = figure_speed_accuracy(scores, means, models=MODELS, simulated=simulated)
    (ax,) = figure.axes
    joined = [line for line in ax.lines if len(line.get_xdata()) == 2]
    assert len(joined) == 16
    first = scores[scores["participant_id"] == "sub-01"]
    assert_allclose(joined[0].get_xdata(), first["time_s"])
    assert_allclose(joined[0].get_ydata(), first["share_correct"])
    points = [line for line in ax.lines if len(line.get_xdata()) == 16]
    assert [line.get_color() for line in points] == list(ROLE_COLOURS.values())
    assert [line.get_marker() for line in points] == ["o", "s"]
    assert ax.get_xscale() == "log"
    assert "(s" in ax.get_xlabel()
    assert any(text.get_text() == "SIMULATED" for text in ax.texts) is simulated


def test_means_have_their_intervals_in_both_directions(answers):
    scores = participant_scores(answers, models=MODELS)
    means = score_means(scores)
    (ax,) = figure_speed_accuracy(scores, means, models=MODELS, simulated=False).axes
    row = means.iloc[0]
    across, upright = (bars.get_segments()[0] for bars in ax.containers[0][2])
    share, time = row["share_correct"], row["time_s"]
    assert_allclose(across, [[row["time_low"], share], [row["time_high"], share]])
    assert_allclose(upright, [[time, row["share_low"]], [time, row["share_high"]]])


def test_one_participant_and_one_model_are_drawn(answers):
    one = answers[answers["participant_id"] == "sub-01"]
    scores = participant_scores(one, models=("full",))
    figure = figure_speed_accuracy(scores, score_means(scores), models=("full",), simulated=False)
    figure.savefig(io.BytesIO())
    table = conditional_accuracy(one, models=("full",))
    figure_conditional_accuracy(table, models=("full",), simulated=False).savefig(io.BytesIO())
    assert "joins" not in figure.get_supxlabel()


@pytest.mark.parametrize("simulated", [True, False])
def test_a_line_per_model_over_the_quantiles(answers, simulated):
    table = conditional_accuracy(answers, models=MODELS, bins=3)
    figure = figure_conditional_accuracy(table, models=MODELS, chance=1 / 7, simulated=simulated)
    (ax,) = figure.axes
    lines = [line for line in ax.lines if line.get_marker() in ("o", "s")]
    for line, model in zip(lines, MODELS, strict=True):
        own = table[table["model"] == model]
        assert_allclose(np.asarray(line.get_xdata(), dtype=float), own["time_s"])
        assert_allclose(np.asarray(line.get_ydata(), dtype=float), own["share_correct"])
    assert any(line.get_label() == "chance, 14.3%" for line in ax.lines)
    assert any(text.get_text() == "SIMULATED" for text in ax.texts) is simulated
