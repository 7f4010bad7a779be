"""A pose from three points, planted."""

from __future__ import annotations

from datetime import date

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from tactileq.modeling import InputError
from tactileq.rig.desk.calibration.pose import Touched, pose_of

DAY = date(2026, 11, 28)


def points(turn: np.ndarray, origin: np.ndarray, *local: tuple[float, float]) -> list[Touched]:
    """Points of a plane, each reached from 10 mm above."""
    found = []
    for x, y in local:
        way = [turn @ np.array([x, y, 10.0 * share]) + origin for share in np.linspace(1, 0, 20)]
        found.append(Touched(point_mm=way[-1], way_mm=np.array(way)))
    return found


@settings(max_examples=50, deadline=None)
@given(
    angles=st.tuples(*[st.floats(-3, 3)] * 3),
    origin=st.tuples(*[st.floats(-50, 50)] * 3),
    mirrored=st.booleans(),
)
def test_a_planted_pose_is_found(
    angles: tuple[float, float, float], origin: tuple[float, float, float], mirrored: bool
) -> None:
    turn = Rotation.from_euler("xyz", angles).as_matrix()
    third = (10.0, -40.0) if mirrored else (10.0, 40.0)  # z is the side of the tool all the same
    first, second, last = points(turn, np.array(origin), (0.0, 0.0), (50.0, 0.0), third)
    pose = pose_of((first, second, last), today=DAY)
    assert pose.origin_mm == pytest.approx(origin, abs=1e-3)
    found = np.column_stack([pose.x, pose.y, pose.z])
    assert found == pytest.approx(turn, abs=1e-4)


@pytest.mark.parametrize(
    ("local", "told"),
    [
        (((0.0, 0.0), (15.0, 0.0), (0.0, 40.0)), "got 15.0 mm"),
        (((0.0, 0.0), (50.0, 0.0), (90.0, 5.0)), "got an angle of 3°"),
    ],
)
def test_points_that_give_no_frame_are_refused(
    local: tuple[tuple[float, float], ...], told: str
) -> None:
    first, second, third = points(np.eye(3), np.zeros(3), *local)
    with pytest.raises(InputError, match=told):
        pose_of((first, second, third), today=DAY)
