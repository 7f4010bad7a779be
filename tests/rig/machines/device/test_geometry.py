"""Kinematics and statics of two cables against their closed forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactileq.modeling import InputError
from tactileq.rig.machines.device.geometry import CableGeometry
from tests.refusals import refused

DEVICE = CableGeometry()
PLACES = st.tuples(st.floats(-200.0, 200.0), st.floats(-140.0, -20.0)).map(np.array)
FORCES = st.tuples(st.floats(-5.0, 5.0), st.floats(-2.0, 8.0)).map(np.array)


@given(PLACES)
def test_lengths_give_the_place_back(place: np.ndarray) -> None:
    assert DEVICE.place_mm(DEVICE.lengths_mm(place)) == pytest.approx(place, abs=1e-9)


def test_many_places_at_once() -> None:
    places = np.random.default_rng(1).uniform([-200, -140], [200, -20], size=(500, 2))
    assert np.abs(DEVICE.place_mm(DEVICE.lengths_mm(places)) - places).max() < 1e-9


@given(PLACES)
def test_the_jacobian_is_the_derivative_of_the_lengths(place: np.ndarray) -> None:
    step = 1e-4
    columns = [
        (DEVICE.lengths_mm(place + move) - DEVICE.lengths_mm(place - move)) / (2 * step)
        for move in step * np.eye(2)
    ]
    assert np.abs(DEVICE.jacobian(place) - np.stack(columns, axis=-1)).max() < 1e-8


@given(PLACES)
def test_its_determinant_is_that_of_the_closed_form(place: np.ndarray) -> None:
    left, right = DEVICE.lengths_mm(place)
    expected = 2 * DEVICE.half_mm * -place[1] / (left * right)
    assert abs(np.linalg.det(DEVICE.jacobian(place))) == pytest.approx(expected, rel=1e-9)


@given(PLACES, FORCES, st.tuples(st.floats(-1, 1), st.floats(-1, 1)).map(np.array))
def test_virtual_work_of_cables_and_force_is_the_same(
    place: np.ndarray, force: np.ndarray, move: np.ndarray
) -> None:
    """−tᵀ dl = Fᵀ dp, to 1e-9."""
    tensions = DEVICE.exact_tensions_n(place, force)
    work = float(-tensions @ (DEVICE.jacobian(place) @ move))
    scale = max(1.0, float(np.abs(tensions).max()))
    assert abs(work - float(force @ move)) <= 1e-9 * scale


@given(PLACES, FORCES)
def test_a_force_in_the_cone_needs_no_cable_that_pushes(
    place: np.ndarray, force: np.ndarray
) -> None:
    low, high = DEVICE.cone(place)
    inside = force[1] > 0 and low * force[1] < force[0] < high * force[1]
    outside = force[1] < 0 or not low * force[1] - 1e-6 <= force[0] <= high * force[1] + 1e-6
    tensions = DEVICE.exact_tensions_n(place, force)
    if inside:
        assert tensions.min() > -1e-9
    elif outside:
        assert tensions.min() < 0


@given(PLACES, FORCES)
def test_what_is_given_is_possible_and_marked_where_it_differs(
    place: np.ndarray, force: np.ndarray
) -> None:
    pull = DEVICE.pull(place, force)
    assert pull.tensions_n.min() >= DEVICE.least_n
    assert pull.tensions_n.max() <= DEVICE.most_n
    assert pull.force_n == pytest.approx(DEVICE.force_n(place, pull.tensions_n))
    if not pull.clipped:
        assert pull.force_n == pytest.approx(force, abs=1e-9)
    else:
        assert np.abs(pull.force_n - force).max() > 1e-13


def test_tensions_are_those_of_the_method() -> None:
    """At (0, −50 mm) 3.5 N up need 10.6 N of each cable, at (0, −10 mm) 52.5 N."""
    for depth, tension in ((-50.0, 10.6), (-10.0, 52.5)):
        exact = DEVICE.exact_tensions_n(np.array([0.0, depth]), np.array([0.0, 3.5]))
        assert exact == pytest.approx([tension, tension], abs=0.05)
    assert DEVICE.strongest_n(np.array([0.0, -50.0])) == pytest.approx(3.5 * 16 / 10.64, rel=1e-3)


def test_a_force_that_is_too_large_keeps_its_direction() -> None:
    pull = DEVICE.pull(np.array([50.0, -60.0]), np.array([1.0, 20.0]))
    assert pull.clipped
    assert pull.force_n[0] / pull.force_n[1] == pytest.approx(1 / 20)
    assert pull.tensions_n.max() == pytest.approx(DEVICE.most_n)


@pytest.mark.parametrize(
    ("changed", "facts"),
    [
        ({"high_x_mm": 300.0}, {"expected": "between the motors", "got": "300 mm"}),
        ({"high_z_mm": 0.0}, {"expected": "below the motors", "got": "0 mm"}),
        ({"most_n": 0.1}, {"expected": "largest tension", "got": "0.1 N"}),
        ({"half_mm": float("nan")}, {"names": "half_mm"}),
    ],
)
def test_geometry_whose_cables_cannot_pull_is_refused(
    changed: dict[str, Any], facts: dict[str, str]
) -> None:
    with refused(InputError, **facts):
        CableGeometry(**changed)


def test_lengths_at_which_no_tool_hangs_are_refused() -> None:
    with refused(InputError, expected="below the motors", got="250 and 250"):
        DEVICE.place_mm([250.0, 250.0])
