"""The layers of a texture as one smooth field over its grid of speeds and forces.

Every parameter of every layer (log frequency, log bandwidth, log amplitude, log noise gain) changes
little from a condition to its neighbours: a Gaussian Markov random field of first order over the
grid (Rue and Held 2005, "Gaussian Markov random fields"). How much is little, and which parameters
change together, is read off the texture itself: the covariance of the differences between
neighbours is estimated with the field (expectation–maximisation on Laplace's approximation). Where
a record is informative it outweighs its neighbours; where it is not they decide. Conditions without
a record are part of the field, too.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from modeling.arrays import Floats, Integers
from modeling.estimation.coherent import (
    FIRST_DAMPING,
    HOPELESS_DAMPING,
    LEAST_DAMPING,
    LONGEST_STEP,
    RIDGE,
    Observed,
    Slopes,
    slopes,
)

# What differences between neighbours are expected to be, beside their trend, before anything is
# known: a sixth in each parameter, and 3 dB more in the level of all gains together. It counts as
# much as one difference more than there are parameters. Chosen where fits of planted and of drawn
# surfaces are nearest to their truths; three times looser or stiffer changes the distances by up to
# a tenth (docs/studies/real_surfaces.md).
PRIOR_CHANGE = 0.175
PRIOR_LEVEL_CHANGE = 0.38
# Precision of a parameter that no record determines: a deviation of 30 in its logarithm.
FAINTEST = 1e-3
RESTART_ROUNDS = 3
# Weight of a trend's square in the penalty: a power of speed or force of 1 is as usual as a change
# of PRIOR_CHANGE between neighbours. Matters where two speeds alone determine the trend, or none.
TREND_SHARE = PRIOR_CHANGE**2


@dataclass(frozen=True, eq=False)
class Field:
    """Neighbourhood over a rectangular grid, and the precision of differences between neighbours.

    Parameters
    ----------
    rows, columns : int
        Conditions are numbered row by row. Blocks of the equations are rows, so fewer columns
        than rows are cheaper.
    places : (C, 2) ndarray
        Log speed and log force of the conditions.
    precision : (p, p) ndarray
        Inverse covariance of the difference Δ of the parameters of two neighbours from what the
        trend gives.
    trend : (2, p) ndarray
        Change of each parameter per unit of log speed and log force: powers of speed and force.
    """

    rows: int
    columns: int
    places: Floats
    precision: Floats
    trend: Floats

    def pull(self, theta: Floats) -> Floats:
        """Gradient (C, p) of the penalty ½·Σ over neighbours of Δ'·precision·Δ."""
        pull: Floats = self.laplacian(theta - self.places @ self.trend) @ self.precision
        return pull

    def following(self, theta: Floats) -> Field:
        """The field with the trend of these parameters (C, p), where the penalty is least."""
        along = self.laplacian(self.places)
        normal = self.places.T @ along + TREND_SHARE * np.eye(2)
        trend = np.asarray(np.linalg.solve(normal, along.T @ theta), dtype=np.float64)
        return replace(self, trend=trend)

    def laplacian(self, theta: Floats) -> Floats:
        """Each condition's parameters less its neighbours', summed over the neighbours, (C, p)."""
        grid = theta.reshape(self.rows, self.columns, -1)
        out = np.zeros(grid.shape)
        down, across = np.diff(grid, axis=0), np.diff(grid, axis=1)
        out[:-1] -= down
        out[1:] += down
        out[:, :-1] -= across
        out[:, 1:] += across
        return out.reshape(theta.shape)

    def neighbours(self) -> Floats:
        """Number of neighbours of each condition, (C,)."""
        return _degrees(self.rows, self.columns).ravel()

    def penalty(self, theta: Floats) -> float:
        """½·Σ over neighbours of Δ'·precision·Δ, and a little for the trend itself."""
        rest = theta - self.places @ self.trend
        trend = TREND_SHARE * float(np.sum(self.trend * (self.trend @ self.precision)))
        return 0.5 * (trend + float(np.sum(rest * (self.laplacian(rest) @ self.precision))))

    def predicted(self, theta: Floats) -> Floats:
        """Prediction of each condition's parameters from its neighbours and the trend, (C, p)."""
        rest = theta - self.places @ self.trend
        neighbours = np.maximum(self.neighbours(), 1.0)[:, None]
        predicted: Floats = theta - self.laplacian(rest) / neighbours
        return predicted

    @property
    def degrees(self) -> int:
        """Differences that are independent of each other: the conditions less one."""
        return self.rows * self.columns - 1


def prior_covariance(m: int) -> Floats:
    """Covariance (p, p) that is expected of differences between neighbours of m layers."""
    p = 1 + 3 * m
    covariance = np.eye(p) * PRIOR_CHANGE**2
    gains = np.r_[0, 1 + 2 * m : p]
    covariance[np.ix_(gains, gains)] += PRIOR_LEVEL_CHANGE**2
    return covariance


def _degrees(rows: int, columns: int) -> Floats:
    degrees = np.zeros((rows, columns))
    degrees[1:] += 1
    degrees[:-1] += 1
    degrees[:, 1:] += 1
    degrees[:, :-1] += 1
    return degrees


class FieldFit(NamedTuple):
    """The field's maximum: parameters (C, p) and what `slopes` says there.

    `value` is the objective with the field's penalty, `field` has the trend of the parameters.
    """

    theta: Floats
    slopes: Slopes
    value: float
    field: Field


def fit_field(
    theta: Floats,
    signs: Floats | None,
    observed: Observed,
    field: Field,
    *,
    limits: tuple[Floats, Floats],
    steps: int = 20,
    enough: float = 0.3,
) -> FieldFit:
    """All conditions at once to the greatest penalised likelihood near a start.

    No condition stays worse than its neighbours predict it: such a one converged to a poor maximum,
    and is started again from their prediction.

    Parameters
    ----------
    theta : (C, p) ndarray
        The start.
    signs : (m,) ndarray, optional
        One sign per layer for the whole texture; without them layers are independent.
    observed : Observed
        One row per condition of the grid; those without a record have no weight.
    field : Field
    limits : pair of (p,) ndarray
    steps, enough
        As in `coherent.climb`.
    """
    fit = _climb_field(theta, signs, observed, field, limits=limits, steps=steps, enough=enough)
    for _ in range(RESTART_ROUNDS):
        predicted = np.clip(fit.field.predicted(fit.theta), *limits)
        poor = slopes(predicted, signs, observed).objective < fit.slopes.objective - enough
        if not poor.any():
            break
        start = np.where(poor[:, None], predicted, fit.theta)
        again = _climb_field(
            start, signs, observed, fit.field, limits=limits, steps=steps, enough=enough
        )
        if again.value >= fit.value:
            break
        fit = again
    return fit


def _climb_field(
    theta: Floats,
    signs: Floats | None,
    observed: Observed,
    field: Field,
    *,
    limits: tuple[Floats, Floats],
    steps: int,
    enough: float,
) -> FieldFit:
    """Fisher scoring with Levenberg–Marquardt damping; the trend follows."""
    low, high = limits
    theta = np.clip(theta, low, high)
    damping = FIRST_DAMPING
    field = field.following(theta)
    now = slopes(theta, signs, observed)
    value = float(now.objective.sum()) + field.penalty(theta)
    for _ in range(steps):
        diagonal = np.einsum("cpp->cp", now.information)
        blocks = now.information.copy()
        np.einsum("cpp->cp", blocks)[...] += damping * diagonal + RIDGE
        step = solve(field, blocks, now.score - field.pull(theta))
        tried = np.clip(theta + np.clip(step, -LONGEST_STEP, LONGEST_STEP), low, high)
        there = slopes(tried, signs, observed)
        value_there = float(there.objective.sum()) + field.penalty(tried)
        if value_there < value:
            field = field.following(tried)
            value_there = float(there.objective.sum()) + field.penalty(tried)
            gained = value - value_there
            theta, now, value = tried, there, value_there
            damping = max(damping / 10, LEAST_DAMPING)
            if gained < enough:
                break
        elif damping > HOPELESS_DAMPING:
            break
        else:
            damping *= 10
    return FieldFit(theta, now, value, field)


def solve(field: Field, blocks: Floats, right: Floats) -> Floats:
    """x (C, p) of (blocks + field's penalty)·x = right, by banded Cholesky factorisation.

    Parameters
    ----------
    blocks : (C, p, p) ndarray
        Symmetric, one per condition.
    right : (C, p) ndarray
    """
    from scipy.linalg import solveh_banded

    band = _band(field, blocks)
    solution = solveh_banded(band, right.ravel(), lower=True, overwrite_ab=True, check_finite=False)
    return np.asarray(solution, dtype=np.float64).reshape(right.shape)


def _band(field: Field, blocks: Floats) -> Floats:
    """Lower band of blocks + field's penalty, as SciPy's banded solvers read it."""
    count, p = blocks.shape[:2]
    places = _band_places(field.rows, field.columns, p)
    band = np.zeros((field.columns + 1) * p * count * p)
    diagonal = blocks + field.neighbours()[:, None, None] * field.precision
    band[places.diagonal] = diagonal.reshape(count, -1)[:, places.lower]
    for coupled in places.coupled:
        band[coupled] = -field.precision.ravel()
    return band.reshape(-1, count * p)[: count * p]


class _BandPlaces(NamedTuple):
    """Positions of blocks and couplings of neighbours in the band, row by row.

    `lower` (t,) are the places of a block's lower triangle in the block, `diagonal` (C, t) those in
    the band; `coupled` those of whole blocks that join neighbours in a row, and in a column.
    """

    lower: Integers
    diagonal: Integers
    coupled: tuple[Integers, Integers]


@lru_cache(maxsize=64)
def _band_places(rows: int, columns: int, p: int) -> _BandPlaces:
    grid = np.arange(rows * columns).reshape(rows, columns)
    starts, width = grid * p, grid.size * p
    row, column = np.tril_indices(p)
    diagonal = (row - column) * width + starts.reshape(-1, 1) + column
    across, down = (index.ravel() for index in np.indices((p, p)))

    def joined(first: Integers, far: int) -> Integers:
        return (far * p + across - down) * width + first.reshape(-1, 1) + down

    coupled = (joined(starts[:, :-1], 1), joined(starts[:-1], columns))
    return _BandPlaces(row * p + column, diagonal, coupled)


def log_evidence(fit: FieldFit) -> float:
    """Log likelihood of the records whatever the parameters, by Laplace's approximation.

    What a field with more parameters gains in likelihood it pays for with the volume that they
    might have had: of two fields the one with the larger evidence is the likelier (MacKay 1992,
    "Bayesian interpolation"). Up to a constant that all fields on the same records share.
    """
    from scipy.linalg import cholesky_banded

    field, p = fit.field, fit.theta.shape[1]
    blocks = fit.slopes.information + FAINTEST * np.eye(p)
    factor = cholesky_banded(_band(field, blocks), lower=True, check_finite=False)
    expected = field.degrees * np.linalg.slogdet(field.precision)[1] + p * np.log(FAINTEST)
    return -fit.value + 0.5 * float(expected) - float(np.log(factor[0]).sum())


class Covariances(NamedTuple):
    """Posterior covariances: of each condition (C, p, p), and of the differences of neighbours.

    `differences` (p, p) is the sum over all pairs of neighbours.
    """

    conditions: Floats
    differences: Floats


def covariances(field: Field, blocks: Floats) -> Covariances:
    """Blocks of the inverse of (blocks + field's penalty) that neighbours need.

    The matrix is block tridiagonal in the rows of the grid, so the wanted part of its inverse
    comes from one sweep down and one up (Takahashi, Fagan and Chin 1973).
    """
    count, p = blocks.shape[:2]
    size = field.columns * p
    identity = np.eye(field.columns)
    down = np.kron(identity, field.precision)  # minus the block that joins two rows
    pivots = []
    before = np.zeros((size, size))
    inner = _within_row(field)
    for row in range(field.rows):
        own = inner[row]
        for column in range(field.columns):
            at = slice(column * p, (column + 1) * p)
            own[at, at] += blocks[row * field.columns + column] + FAINTEST * np.eye(p)
        inverse = np.linalg.inv(own - before)
        pivots.append(inverse)
        before = down @ inverse @ down
    each = np.empty((count, p, p))
    differences = np.zeros((p, p))
    below: Floats | None = None
    for row in reversed(range(field.rows)):
        here = pivots[row]
        if below is not None:
            gain = here @ down
            cross = gain @ below
            here = here + cross @ gain.T
            between = _of_blocks(cross, p)
            both = _of_blocks(here, p).sum(axis=0) + _of_blocks(below, p).sum(axis=0)
            differences += both - between.sum(axis=0) - between.sum(axis=0).T
        each[row * field.columns : (row + 1) * field.columns] = _of_blocks(here, p)
        for column in range(field.columns - 1):
            left = slice(column * p, (column + 1) * p)
            other = slice((column + 1) * p, (column + 2) * p)
            differences += here[left, left] + here[other, other]
            differences -= here[left, other] + here[other, left]
        below = here
    return Covariances(each, differences)


def _within_row(field: Field) -> Floats:
    """The penalty's diagonal blocks, one per row of the grid: (rows, columns·p, columns·p)."""
    degrees = _degrees(field.rows, field.columns)
    joined = np.eye(field.columns, k=1) + np.eye(field.columns, k=-1)
    return np.array([np.kron(np.diag(d) - joined, field.precision) for d in degrees])


def _of_blocks(matrix: Floats, p: int) -> Floats:
    """Diagonal blocks (n, p, p) of a matrix of n × n blocks."""
    n = matrix.shape[0] // p
    blocks = matrix.reshape(n, p, n, p)
    return np.asarray(np.einsum("ipiq->ipq", blocks), dtype=np.float64)


def updated_precision(fit: FieldFit) -> Floats:
    """Precision of the differences between neighbours that this texture suggests, (p, p).

    One step of expectation–maximisation: the expected sum of squares of all differences, with
    `prior_covariance` for as many more as there are parameters and one.
    """
    p, field = fit.theta.shape[1], fit.field
    rest = fit.theta - field.places @ field.trend
    scatter = rest.T @ field.laplacian(rest)
    scatter += covariances(field, fit.slopes.information).differences
    count = p + 1
    expected = (count * prior_covariance((p - 1) // 3) + scatter) / (count + field.degrees)
    return np.asarray(np.linalg.inv((expected + expected.T) / 2))
