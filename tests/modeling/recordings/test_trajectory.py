"""Hands over time: linear in between, held at the ends, and what is no stroke."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tactileq.modeling import InputError
from tactileq.modeling.recordings.trajectory import Trajectory, load_trajectory
from tests.refusals import refused

HEADER = "time_s,speed_mm_s,force_n\n"


def test_csv_is_read_and_interpolated(tmp_path: Path) -> None:
    path = tmp_path / "hand.csv"
    path.write_text("force_n,time_s,speed_mm_s\n1,10,0\n2,10.5,100\n0,11,-100\n")
    hand = load_trajectory(path, name="there and back")
    assert hand.duration_s == 1.0
    assert (hand.highest_speed_mm_s, hand.highest_force_n) == (100.0, 2.0)
    speed, force = hand.at(np.array([-5.0, 0.0, 0.25, 0.5, 0.75, 1.0, 9.0]))
    assert speed.tolist() == [0, 0, 50, 100, 0, -100, -100]
    assert force.tolist() == [1, 1, 1.5, 2, 1, 0, 0]


def test_lift_off_is_passed_on(tmp_path: Path) -> None:
    path = tmp_path / "hand.csv"
    path.write_text(HEADER + "0,10,1\n1,nan,nan\n2,10,1\n3,10,1\n")
    speed, force = load_trajectory(path, name="hop").at(np.array([0.5, 1.0, 1.5, 2.5]))
    assert np.isnan(speed).tolist() == np.isnan(force).tolist() == [True, True, True, False]
    lifted = Trajectory("off", np.arange(2.0), np.full(2, np.nan), np.full(2, np.nan))
    assert (lifted.highest_speed_mm_s, lifted.highest_force_n) == (0.0, 0.0)


@pytest.mark.parametrize(
    ("text", "expected", "got"),
    [
        (HEADER, ["two", "times"], 0),
        (HEADER + "0,10,1\n", ["two", "times"], 1),
        (HEADER + "0,10,1\n0,10,1\n", ["rising", "times"], "0 s"),
        (HEADER + "0,10,1\n2,10,1\n1.5,10,1\n", ["rising", "times"], ["1.5 s", "2 s"]),
        (HEADER + "0,10,1\nnan,10,1\n", ["rising", "times"], "nan s"),
        (HEADER + "0,10,1\n4000,10,1\n", "3600 s", "4000 s"),
    ],
)
def test_what_is_no_stroke(tmp_path: Path, text: str, expected: object, got: object) -> None:
    (tmp_path / "hand.csv").write_text(text)
    with refused(InputError, names="hand", expected=expected, got=got):
        load_trajectory(tmp_path / "hand.csv", name="hand")


def test_files_that_are_no_csv(tmp_path: Path) -> None:
    with refused(InputError, expected=["trajectory", tmp_path / "none.csv"], got="nothing"):
        load_trajectory(tmp_path / "none.csv", name="hand")
    (tmp_path / "bytes.csv").write_bytes(b"\xff\x00\x01")
    with refused(InputError, expected=["trajectory", tmp_path / "bytes.csv"], got="bytes"):
        load_trajectory(tmp_path / "bytes.csv", name="hand")


def test_arrays_of_different_lengths() -> None:
    with refused(InputError, expected="'odd'", got=["(2,)", "(3,)"]):
        Trajectory("odd", np.arange(2.0), np.ones(3), np.ones(2))
