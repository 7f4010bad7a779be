"""The level of a linear filter whose coefficients move, exactly: its covariance step by step."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tactileq.modeling.arrays import Floats
from tactileq.modeling.equalizer.bands import band_coefficients, clamp_bands
from tactileq.modeling.models.parameter_table import Parameters


class System(NamedTuple):
    """z[n+1] = a·z[n] + b·w[n], y[n] = c·z[n] + d·w[n]: (N, N), (N,), (N,), and a number."""

    a: Floats
    b: Floats
    c: Floats
    d: float


def systems_of_layers(course: Parameters, *, rate_hz: float) -> list[System]:
    """What the kernel is at each of n samples with these parameters (`rendered_parameters`)."""
    frequency, bandwidth, _ = clamp_bands(
        course.frequencies_hz, course.bandwidths_hz, rate_hz=rate_hz
    )
    band = band_coefficients(frequency, bandwidth, rate_hz=rate_hz)
    gains = course.gains * band.tap
    n, m = gains.shape
    first, second = 2 * np.arange(m), 2 * np.arange(m) + 1
    a, b, c = np.zeros((n, 2 * m, 2 * m)), np.zeros((n, 2 * m)), np.zeros((n, 2 * m))
    a[:, first, first], a[:, first, second] = 1 + band.p, -band.q
    a[:, second, first], a[:, second, second] = band.q, 1 + band.r
    b[:, first], b[:, second] = band.b1, band.b2
    c[:, first], c[:, second] = gains * (2 + band.p), -gains * band.q
    d = course.noise_gain + (gains * band.b1).sum(axis=1)
    return [System(*each) for each in zip(a, b, c, d.tolist(), strict=True)]


def level_at_rest(system: System) -> float:
    """Standard deviation of y for white noise w of unit variance, long after the start."""
    from scipy.linalg import solve_discrete_lyapunov

    if not system.b.size:
        return abs(system.d)
    added = np.outer(system.b, system.b)
    covariance = np.asarray(solve_discrete_lyapunov(system.a, added, method="bilinear"))
    return _level(system, covariance.astype(np.float64))


def levels_in_motion(systems: Sequence[System], *, samples: int) -> Floats:
    """Standard deviation of y at each sample, (n·samples,), of n systems in turn.

    Each is in use for so many samples; the first one starts with z = 0. What the states hold when
    the coefficients change is what the system before has left there.

    Parameters
    ----------
    systems : sequence of System
        Of one size.
    samples : int
        ≥ 1.
    """
    covariance = np.zeros_like(systems[0].a)
    levels = np.empty(len(systems) * samples)
    for n in range(levels.size):
        system = systems[n // samples]
        levels[n] = _level(system, covariance)
        covariance = system.a @ covariance @ system.a.T + np.outer(system.b, system.b)
    return levels


def louder_by(level: float, system: System) -> float:
    """A level as a multiple of the system's own at rest; 1 where that is silent."""
    own = level_at_rest(system)
    return level / own if own > 0 else 1.0


def _level(system: System, covariance: Floats) -> float:
    power = float(system.c @ covariance @ system.c)
    return float(np.sqrt(max(power, 0.0) + system.d**2))
