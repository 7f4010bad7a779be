"""Newtons from a pen's pressure, by calibration weights (docs/method/hand.md#pressure)."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import isfinite, sqrt
from statistics import fmean

from tactileq.modeling.checks import HIGHEST_FORCE_N, check_number, is_number
from tactileq.modeling.errors import InputError, shown
from tactileq.rig.devices.hand.settings import Points, check_points

FEWEST_WEIGHTS = 3


@dataclass(frozen=True)
class PressureCurve:
    """Force over pressure: straight lines between points, the outer ones extended.

    Parameters
    ----------
    points : tuple of (float, float)
        Pressure as a share of the device's range, rising; force in N, rising, ≥ 0.
    residual_n : float, optional
        RMS deviation of the fitted readings from the curve: how well they repeat.
    left_out_n : float, optional
        Largest error at an inner weight of a curve through the others: how well it interpolates.
    """

    points: Points
    residual_n: float | None = None
    left_out_n: float | None = None

    def __post_init__(self) -> None:
        check_points(self.points)

    def force_n(self, pressure: float) -> float:
        """Force (N, ≥ 0) for a pressure as a share of the device's range."""
        shares = [share for share, _ in self.points]
        index = min(max(bisect_left(shares, pressure), 1), len(shares) - 1)
        (x0, y0), (x1, y1) = self.points[index - 1], self.points[index]
        return max(0.0, y0 + (y1 - y0) * (pressure - x0) / (x1 - x0))


def fit_pressure(weights_n: Sequence[float], raw: Sequence[float]) -> PressureCurve:
    """The curve through the mean pressures of weights that were laid on.

    Parameters
    ----------
    weights_n : (n,) sequence of float
        Force of the weight of each reading, above 0; three or more different ones, each as often
        as one likes.
    raw : (n,) sequence of float
        The pressure read, as a share of the device's range: the force that readings have with the
        points (0, 0) and (1, 1).

    Raises
    ------
    InputError
        For too few weights, or where a larger weight does not give a larger mean pressure.
    """
    means = _means(weights_n, raw)
    points = tuple((share, weight) for weight, share in means)
    curve = PressureCurve(points)
    errors = [curve.force_n(p) - weight for weight, p in zip(weights_n, raw, strict=True)]
    residual = sqrt(fmean(error * error for error in errors))
    return PressureCurve(points, residual_n=residual, left_out_n=_left_out(points))


def _means(weights_n: Sequence[float], raw: Sequence[float]) -> list[tuple[float, float]]:
    """Weights, sorted, each with its mean pressure."""
    if len(weights_n) != len(raw):
        raise InputError(
            f"expected a pressure for each weight, got {len(raw)} of {len(weights_n)}; read again."
        )
    readings: dict[float, list[float]] = {}
    for weight, pressure in zip(weights_n, raw, strict=True):
        check_number("a weight in N", weight, low=0.001, high=HIGHEST_FORCE_N)
        if not is_number(pressure) or not isfinite(pressure):
            raise InputError(
                f"expected a number as pressure under {weight:g} N, got {shown(pressure)}; read "
                "it again."
            )
        readings.setdefault(float(weight), []).append(float(pressure))
    if len(readings) < FEWEST_WEIGHTS:
        raise InputError(
            f"expected {FEWEST_WEIGHTS} or more different weights, got "
            f"{len(readings)}; place more on the pen."
        )
    means = [(weight, fmean(readings[weight])) for weight in sorted(readings)]
    for (light, before), (heavy, after) in pairwise(means):
        if after <= before:
            raise InputError(
                f"expected more pressure under {heavy:g} N than under {light:g} N, got {after:g} "
                f"after {before:g}; the pen saturates there or the weight leaned, so leave that "
                "weight out or place it again."
            )
    return means


def _left_out(points: Points) -> float:
    """Largest error at an inner point of the curve through all others."""
    errors = []
    for index in range(1, len(points) - 1):
        others = PressureCurve(points[:index] + points[index + 1 :])
        errors.append(abs(others.force_n(points[index][0]) - points[index][1]))
    return max(errors)
