"""What is rendered between the nodes: collapses are seen, and taken back by the fit."""

from __future__ import annotations

import numpy as np
import pytest

from tactileq.modeling.arrays import Floats
from tactileq.modeling.estimation.coherent import Observed
from tactileq.modeling.fitting.blending import Middles
from tactileq.modeling.fitting.equations import cells
from tactileq.modeling.fitting.joint_grid import LARGEST_DEFECT_DB

RATE_HZ = 1000.0


def middles_of(rows: int, columns: int) -> Middles:
    frequency = np.geomspace(15.0, 480.0, 48)
    tangent = np.tan(np.pi / RATE_HZ * frequency)[None]
    one = np.ones(tangent.shape)
    places = Observed(one, one, one, tangent, 1 / tangent, np.zeros(1), RATE_HZ)
    shares = np.full(4, 0.25) if columns > 1 else np.array([0.5, 0.0, 0.5, 0.0])
    return Middles(cells(rows, columns), shares, places, rows * columns)


def of_two_layers(gains: Floats) -> Floats:
    """Parameters (4, 7) of a 2 × 2 lattice with layers at 60 and 200 Hz."""
    rows = [np.log([0.1, 60.0, 200.0, 40.0, 60.0, *g]) for g in gains]
    return np.array(rows)


def test_equal_nodes_have_no_defect_and_powers_of_speed_hardly_any() -> None:
    middles, signs = middles_of(2, 2), np.array([1.0, -1.0])
    same = of_two_layers(np.array([(1.0, 0.5)] * 4))
    assert middles.defects_db(same, signs) == pytest.approx(0.0, abs=1e-9)
    louder = of_two_layers(np.array([(1.0, 0.5), (1.0, 0.5), (2.0, 1.0), (2.0, 1.0)]))
    louder[:, 0] += np.log([1.0, 1.0, 2.0, 2.0])
    assert middles.defects_db(louder, signs) == pytest.approx(0.0, abs=1e-9)


def test_a_sum_that_turns_its_sign_between_the_nodes_is_seen() -> None:
    """Two layers of opposite signs at one place: 2 − 1 at some nodes, 1 − 2 at the others."""
    middles, signs = middles_of(2, 2), np.array([1.0, -1.0])
    gains = np.array([(2.0, 1.0), (2.0, 1.0), (1.0, 2.0), (1.0, 2.0)])
    theta = of_two_layers(gains)
    theta[:, 1:3] = np.log(100.0)
    theta[:, 3:5] = np.log(80.0)
    theta[:, 0] = np.log(1e-3)
    # In magnitude 1 at all nodes, √2 − √2 = 0 half-way: all but the noise is gone.
    assert middles.defects_db(theta, signs)[0] > 20.0


@pytest.mark.parametrize("moving", [0.02, 0.6], ids=["at rest", "moving"])
@pytest.mark.parametrize("columns", [1, 3])
def test_slopes_are_those_of_the_cost(columns: int, moving: float) -> None:
    middles, signs = middles_of(3, columns), np.array([1.0, -1.0])
    rng = np.random.default_rng(columns)
    theta = np.log([0.1, 60.0, 200.0, 40.0, 60.0, 1.0, 0.7]) + 0.4 * rng.standard_normal(
        (3 * columns, 7)
    )
    theta[:, 1:3] = np.log([60.0, 200.0]) + moving * rng.standard_normal((3 * columns, 2))
    held = middles.held(theta, signs)
    assert held.cost > 0
    step = 1e-5 * rng.standard_normal(theta.shape)
    slope = (middles.held(theta + step, signs).cost - middles.held(theta - step, signs).cost) / 2
    assert slope == pytest.approx(-float(np.sum(held.score * step)), rel=1e-4)


def test_a_narrow_peak_that_moves_is_no_defect() -> None:
    """At 100 Hz at two nodes, at 300 Hz at the others, 10 Hz wide: half-way it is elsewhere."""
    middles = middles_of(2, 2)
    theta = np.log(np.array([(0.02, f, 10.0, 0.3) for f in (100.0, 100.0, 300.0, 300.0)]))
    assert middles.defects_db(theta, np.ones(1))[0] < 1.0


def test_a_hole_where_a_peak_passes_is_seen() -> None:
    """What lies under a moving peak turns its sign, and is missing beside the peak half-way."""
    middles, signs = middles_of(2, 2), np.array([1.0, -1.0, 1.0])
    rows = []
    for corner in range(4):
        gains = (2.0, 1.0) if corner < 2 else (1.0, 2.0)
        moving = 60.0 if corner < 2 else 90.0
        rows.append(np.log([1e-3, 100.0, 100.0, moving, 80.0, 80.0, 4.0, *gains, 5.0]))
    theta = np.array(rows)
    assert middles.defects_db(theta, signs)[0] > 5.0
    theta[:, 7:9] = np.log([2.0, 1.0])
    assert middles.defects_db(theta, signs)[0] < 1.0


def test_peaks_that_meet_at_two_nodes_are_far_from_refused() -> None:
    """A narrow peak passes a resting one, which doubles it at some nodes and not half-way."""
    middles = middles_of(2, 2)
    theta = np.log(
        np.array([(0.02, 200.0, f, 20.0, 10.0, 0.3, 0.3) for f in (200.0, 200.0, 300.0, 300.0)])
    )
    assert middles.defects_db(theta, np.ones(2))[0] < LARGEST_DEFECT_DB / 2
