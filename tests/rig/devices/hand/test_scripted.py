"""The scripted hand: where it is, and what its table has to be."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tactileq.modeling import InputError
from tactileq.modeling.files.columns import names
from tactileq.modeling.files.tables import write_table
from tactileq.rig.devices.hand.scripted import (
    SCRIPT_COLUMNS,
    ScriptedHand,
    ScriptedTrajectory,
    Steady,
    Strokes,
    script_of,
)
from tactileq.rig.devices.hand.settings import HandSettings
from tests.refusals import refused


def test_strokes_have_the_stated_peak_speed_and_force_and_begin_at_rest() -> None:
    strokes = Strokes(200.0, 1.5, per_s=2.0)
    time_s = np.linspace(0, 1, 2001)
    x_mm = np.array([strokes.at(moment)[0] for moment in time_s])
    speed = np.gradient(x_mm, time_s)
    assert np.abs(speed).max() == pytest.approx(200, rel=1e-3)
    assert abs(speed[0]) < 2
    assert x_mm[-1] == pytest.approx(0, abs=1e-9)  # two whole strokes
    assert strokes.at(0.3)[1:] == (0.0, 1.5)


def test_a_steady_hand_moves_on() -> None:
    assert Steady(-80.0, 2.0).at(0.5) == (-40.0, 0.0, 2.0)


def test_a_table_is_played_once_and_lifted(tmp_path: Path) -> None:
    path = tmp_path / "hand.tsv"
    rows = [(10.0, 0.0, 1.0, 1.0), (10.5, 50.0, 2.0, 3.0)]
    write_table(
        path, SCRIPT_COLUMNS, [dict(zip(names(SCRIPT_COLUMNS), row, strict=True)) for row in rows]
    )
    script = script_of(HandSettings(kind="scripted", script=str(path)))
    assert script.at(0.0) == (0.0, 1.0, 1.0)
    assert script.at(0.25) == (25.0, 1.5, 2.0)
    assert script.at(0.5) == (50.0, 2.0, 3.0)
    assert script.at(0.51) == (50.0, 2.0, 0.0)


def test_arrays_are_played_as_a_table() -> None:
    time_s = np.array([0.0, 1.0])
    script = ScriptedTrajectory(time_s, 10 * time_s, y_mm=0 * time_s, force_n=1 + time_s)
    assert script.at(0.5) == (5.0, 0.0, 1.5)
    hand = ScriptedHand(script)
    samples = hand.read()
    assert samples[0][1:] == (0.0, 0.0, None, 1.0, True, False)


@pytest.mark.parametrize(
    ("times", "expected", "got"),
    [
        ([0.0], "two", "[0.0]"),
        ([0.0, 0.0], "rising", "[0.0, 0.0]"),
        ([1.0, 0.0], "rising", "[1.0, 0.0]"),
        ([0.0, np.nan], "±1e+06", "nan"),
        ([0.0, 2e6], "±1e+06", "2e+06"),
    ],
)
def test_a_trajectory_of_times_that_do_not_rise_is_refused(
    times: list[float], expected: str, got: str
) -> None:
    time_s = np.array(times)
    with refused(InputError, names="trajectory", expected=expected, got=got):
        ScriptedTrajectory(time_s, time_s, y_mm=time_s, force_n=time_s)
