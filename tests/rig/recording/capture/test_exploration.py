"""Percentiles of free strokes, and the grid that follows."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tactileq.modeling import InputError
from tactileq.rig.recording.capture.exploration import explored, grid_for, grid_text
from tactileq.rig.recording.capture.grid import StrokeGrid
from tactileq.rig.shared.live.memory import CONTACT, FORCE_ASSUMED
from tests.refusals import refused


def test_percentiles_are_of_time_and_of_the_moving_hand_alone(readings_of) -> None:
    rng = np.random.default_rng(0)
    speed = np.where(rng.random(8000) < 0.5, 1, -1) * rng.uniform(100, 200, 8000)
    force = rng.uniform(1, 2, 8000)
    speed[6000:] = 2.0  # at rest for 4 s
    rows = readings_of(speed, force, flags=CONTACT)
    rows["flags"][:1000] = 0  # hovering, fast
    rows["speed_mm_s"][:1000] = 900
    # Ten times the readings in the same time must not count ten times.
    dense = np.repeat(rows[1000:2000], 10)
    dense["time_s"] = rows["time_s"][1000] + np.arange(dense.size) / 5000
    rows = np.concatenate((rows[:1000], dense, rows[2000:]))
    dense_speed = rows["speed_mm_s"][1000:11000]
    dense_speed[:] = np.sign(dense_speed) * 190
    found = explored(rows)
    assert found.seconds == pytest.approx(10.0, abs=0.01)
    assert found.speed_mm_s.size == 2000
    assert (found.force_assumed, found.simulated) == (False, False)
    # A fifth of the time at 190, the rest spread evenly from 100 to 200.
    assert found.speed_percentiles_mm_s["p50"] == pytest.approx(162.5, abs=3)
    assert found.force_percentiles_n["p5"] == pytest.approx(1.05, abs=0.03)


def test_the_grid_goes_from_the_5th_to_the_95th_percentile(readings_of) -> None:
    speed, force = np.linspace(39, 361, 10_000), np.linspace(0.45, 3.55, 10_000)
    found = explored(readings_of(speed, force))
    grid = grid_for(found)
    assert grid.speeds_mm_s.tolist() == [55.0, 105.0, 150.0, 200.0, 250.0, 295.0, 345.0]
    assert grid.forces_n == pytest.approx([0.6, 1.05, 1.55, 2.0, 2.45, 2.95, 3.4])
    assert grid_for(found, speeds=1, forces=2).conditions == [(200.0, 1.7), (200.0, 3.4)]


def test_steps_too_narrow_to_be_rounded_stay_as_they_are(readings_of) -> None:
    found = explored(readings_of(np.linspace(60, 70, 5000), np.full(5000, 1.0)))
    grid = grid_for(found, forces=1)
    assert np.diff(grid.speeds_mm_s) == pytest.approx(1.5, abs=0.01)


def test_an_assumed_force_is_one_value(readings_of) -> None:
    rows = readings_of(np.full(4000, 120.0), np.full(4000, 1.33), flags=CONTACT | FORCE_ASSUMED)
    found = explored(rows)
    assert found.force_assumed
    assert grid_for(found, speeds=1).conditions == [(120.0, 1.33)]


def test_strokes_as_a_sine_give_a_grid_that_begins_off_rest(readings_of) -> None:
    speed = 280 * np.sin(2 * np.pi * np.arange(10_000) / 500)
    grid = grid_for(explored(readings_of(speed, np.ones(10_000))), forces=1)
    assert grid.speeds_mm_s.tolist() == [40.0, 80.0, 120.0, 160.0, 200.0, 240.0, 280.0]


def test_the_file_loads_back_equal(tmp_path: Path, readings_of) -> None:
    found = explored(readings_of(np.linspace(40, 360, 5000), np.linspace(0.4, 2, 5000)))
    grid = grid_for(found, speeds=3)
    (tmp_path / "grid.toml").write_text(grid_text(grid, found))
    assert StrokeGrid.load(tmp_path / "grid.toml").to_dict() == grid.to_dict()
    assert "simulated = true" in (tmp_path / "grid.toml").read_text()


def test_too_little_is_refused(readings_of) -> None:
    for count in (2000, 0):
        rows = readings_of(np.full(count, 90.0), np.ones(count))
        with refused(InputError, expected="5 s", got=f"{count / 500:.1f} s"):
            explored(rows)
    with refused(InputError, expected=["force", 7], got="1 to 1"):
        grid_for(explored(readings_of(np.linspace(50, 200, 3000), np.ones(3000))))
    with refused(InputError, expected=["speeds", 1, 50], got=0):
        grid_for(explored(readings_of(np.full(3000, 90.0), np.ones(3000))), speeds=0)
