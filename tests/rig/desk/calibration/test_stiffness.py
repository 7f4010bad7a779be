"""Stiffness from force against depth, planted with friction and noise."""

from __future__ import annotations

import numpy as np
import pytest

from tactileq.modeling import InputError
from tactileq.rig.desk.calibration.stiffness import pressed

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
