"""Pressure to newtons: planted pens, residuals, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from tactileq.modeling import InputError
from tactileq.rig.devices.hand.pressure import PressureCurve, fit_pressure
from tests.refusals import refused

WEIGHTS_N = [0.2, 0.5, 1.0, 2.0, 3.0, 4.0]


def pen(force_n: float) -> float:
    """A pen whose pressure saturates, as most do."""
    return float(1 - np.exp(-force_n / 2))


def test_a_straight_pen_is_found_exactly_and_extended() -> None:
    curve = fit_pressure([1.0, 2.0, 4.0], [0.2, 0.4, 0.8])
    assert curve.residual_n == pytest.approx(0)
    assert curve.left_out_n == pytest.approx(0)
    assert [curve.force_n(share) for share in (0.0, 0.1, 0.6, 1.0)] == pytest.approx([0, 0.5, 3, 5])


def test_below_the_lightest_weight_there_is_no_negative_force() -> None:
    curve = fit_pressure([1.0, 2.0, 4.0], [0.5, 0.6, 0.8])
    assert curve.force_n(0.1) == 0


def test_a_saturating_pen_is_met_at_its_weights_and_nearly_between() -> None:
    curve = fit_pressure(WEIGHTS_N, [pen(weight) for weight in WEIGHTS_N])
    assert curve.residual_n == pytest.approx(0, abs=1e-12)
    for weight in WEIGHTS_N:
        assert curve.force_n(pen(weight)) == pytest.approx(weight)
    between = [abs(curve.force_n(pen(force)) - force) for force in np.linspace(0.2, 4, 50)]
    assert curve.left_out_n is not None
    assert 0.01 < max(between) < curve.left_out_n  # leaving a weight out is the harder question


def test_the_residual_is_how_well_readings_repeat() -> None:
    rng = np.random.default_rng(2)
    weights = np.repeat([1.0, 2.0, 3.0], 2000)
    curve = fit_pressure(list(weights), list(weights / 10 + rng.normal(0, 0.01, weights.size)))
    assert curve.residual_n == pytest.approx(0.1, rel=0.05)  # 0.01 of the range at 10 N per range


def test_the_order_of_the_weights_does_not_matter() -> None:
    assert fit_pressure([3.0, 1.0, 2.0], [0.6, 0.2, 0.4]) == fit_pressure(
        [1.0, 2.0, 3.0], [0.2, 0.4, 0.6]
    )


@pytest.mark.parametrize(
    ("weights", "raw", "expected", "got"),
    [
        ([1.0, 2.0], [0.1, 0.2], [3, "weights"], 2),
        ([1.0, 1.0, 2.0], [0.1, 0.1, 0.2], [3, "weights"], 2),
        ([1.0, 2.0, 3.0], [0.1, 0.3, 0.2], ["pressure", "3 N", "2 N"], [0.2, 0.3]),
        ([1.0, 2.0, 3.0], [0.1, 1.0, 1.0], ["pressure", "3 N", "2 N"], 1),
        ([1.0, 2.0, 3.0], [0.1, 0.2], ["pressure", "weight"], [2, 3]),
        ([0.0, 2.0, 3.0], [0.1, 0.2, 0.3], [0.001, 10000, "weight", "N"], 0.0),
        ([1.0, 2.0, 3.0], [0.1, np.nan, 0.3], ["pressure", "2 N"], "nan"),
    ],
)
def test_refused_in_one_sentence(
    weights: list[float], raw: list[float], expected: object, got: object
) -> None:
    with refused(InputError, expected=expected, got=got):
        fit_pressure(weights, raw)


def test_points_of_a_rig_file_make_a_curve() -> None:
    curve = PressureCurve(((0.0, 0.0), (1.0, 4.0)))
    assert curve.force_n(0.25) == pytest.approx(1.0)
    with refused(InputError, expected=["pressure", "0 N"], got="((0.5, 0.0), (0.1, 4.0))"):
        PressureCurve(((0.5, 0.0), (0.1, 4.0)))
