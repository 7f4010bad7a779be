"""Stiffness from force against depth, planted with friction and noise."""

from __future__ import annotations

import numpy as np
import pytest

from tactileq.modeling import InputError
from tactileq.rig.desk.calibration.stiffness import check_virtual, pressed
from tests.refusals import refused

SHARE = np.linspace(0, 1, 2000)
FORCE_N = 3 * np.sin(np.pi * SHARE) ** 2


@pytest.mark.parametrize("stiffness", [0.2, 1.0, 5.0])
@pytest.mark.parametrize("friction_n", [0.0, 0.1])
def test_the_stiffness_is_free_of_friction(stiffness: float, friction_n: float) -> None:
    noise = np.random.default_rng(1).normal(0, 0.005, SHARE.size)
    way = np.where(SHARE < 0.5, -1, 1)  # it holds back on the way down, and on the way up
    depth = (FORCE_N + way * friction_n) / stiffness + noise
    found = pressed(FORCE_N, depth, simulated=True)
    assert found.stiffness_n_per_mm == pytest.approx(stiffness, rel=0.01)
    assert found.friction_n == pytest.approx(friction_n, abs=0.02)


@pytest.mark.parametrize(
    "depth",
    [
        np.zeros(SHARE.size),
        0.001 * FORCE_N,
        -FORCE_N,
        np.random.default_rng(2).normal(0, 1, SHARE.size),
    ],
    ids=["rigid", "nearly rigid", "pulled", "noise"],
)
def test_what_is_no_spring_is_refused(depth: np.ndarray) -> None:
    with pytest.raises(InputError, match="gives way like a spring"):
        pressed(FORCE_N, depth, simulated=True)


@pytest.mark.parametrize("stiffness", [1.6, 0.4])
def test_a_virtual_wall_that_is_not_as_commanded_is_refused(stiffness: float) -> None:
    """Twice as stiff: the tool rests on the real surface, too."""
    found = pressed(FORCE_N, FORCE_N / stiffness, simulated=True)
    with refused(InputError, expected=0.8, got=stiffness):
        check_virtual(found, commanded_n_per_mm=0.8)


@pytest.mark.parametrize(("stiffness", "loading"), [(1.05, 1.0), (1.14, 1.2), (0.85, 0.8)])
def test_a_virtual_wall_is_as_commanded_within_what_is_inexact(
    stiffness: float, loading: float
) -> None:
    """10 %, and half of the difference between loading and unloading."""
    unloading = 1 / (2 / stiffness - 1 / loading)
    depth = FORCE_N / np.where(SHARE < 0.5, loading, unloading)
    found = pressed(FORCE_N, depth, simulated=True)
    assert found.stiffness_n_per_mm == pytest.approx(stiffness)
    check_virtual(found, commanded_n_per_mm=1.0)
