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

from tactileq.modeling.arrays import Floats, Integers
from tactileq.modeling.estimation.coherent import (
    FIRST_DAMPING,
    HOPELESS_DAMPING,
    LEAST_DAMPING,
    LONGEST_STEP,
    RIDGE,
    Observed,
    Slopes,
    slopes,
)
from tactileq.modeling.fitting.blending import Middles
from tactileq.modeling.fitting.equations import Blocks, Corners, band_of, rows_of, solve_blocks

# What differences between neighbours are expected to be, beside their trend, before anything is
# known: a sixth in each parameter, and 3 dB more in the level of all gains together. It counts as
# much as one difference more than there are parameters. Chosen where fits of planted and of drawn
# surfaces are nearest to their truths; three times looser or stiffer changes the distances by up to
# a tenth (docs/studies/real_surfaces.md). Doubled on 11 drawn surfaces (tools/double_constants.py):
# +14 %, worst +47 %, two layers fewer, as looser differences make a layer worth less; that of the
# level +1 %, worst +20 %.
PRIOR_CHANGE = 0.175
PRIOR_LEVEL_CHANGE = 0.38
# Precision of a parameter that no record determines: a deviation of 30 in its logarithm.
FAINTEST = 1e-3
RESTART_ROUNDS = 3
# Of Student's t distribution, by which the levels of records scatter: a single one that is far off
# does not bend the field.
FREEDOM = 3.0
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
    records : Corners
        Where the records lie in the lattice.
    middles : Middles, optional
        The middles of the cells, where the blended response is looked at.
    level_sd : (K,) ndarray, optional
        By how much (nepers) the level of each record scatters about the field; without it not at
        all.
    """

    rows: int
    columns: int
    places: Floats
    precision: Floats
    trend: Floats
    records: Corners
    middles: Middles | None = None
    level_sd: Floats | None = None

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
        return np.asarray(_laplacian(self.rows, self.columns) @ theta)

    def neighbours(self) -> Floats:
        """Number of neighbours of each condition, (C,)."""
        return np.asarray(_laplacian(self.rows, self.columns).diagonal())

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

    def blocks(self) -> Blocks:
        """The penalty's second derivatives."""
        own = self.neighbours()[:, None, None] * self.precision
        beside = np.broadcast_to(-self.precision, own.shape)
        return Blocks(own, across=beside, down=beside)

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


@lru_cache(maxsize=64)
def _laplacian(rows: int, columns: int) -> Floats:
    """Numbers of neighbours on the diagonal, −1 for each pair of neighbours, (C, C)."""
    node = np.arange(rows * columns).reshape(rows, columns)
    laplacian = np.zeros((node.size, node.size))
    for a, b in ((node[1:], node[:-1]), (node[:, 1:], node[:, :-1])):
        laplacian[a, b] = laplacian[b, a] = -1.0
    np.fill_diagonal(laplacian, -laplacian.sum(axis=1))
    laplacian.setflags(write=False)
    return laplacian


class FieldFit(NamedTuple):
    """The field's maximum: parameters (N, p) of the nodes and what `slopes` says of the records.

    `level` (K,) is what the records are louder than the field, in nepers; `value` is the objective
    with the penalties, `information` that of the records and of the
    middles of the cells on the nodes, `field` has the trend of the parameters.
    """

    theta: Floats
    level: Floats
    slopes: Slopes
    value: float
    information: Blocks
    field: Field

    @property
    def at_records(self) -> Floats:
        """The parameters (K, p) of the records, each at its own level."""
        return louder(self.field.records.blended(self.theta), self.level)


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
    """All nodes at once to the greatest penalised likelihood near a start.

    No record stays worse than the neighbours of its nodes predict it: such nodes converged to a
    poor maximum, and are started again from their prediction.

    Parameters
    ----------
    theta : (N, p) ndarray
        The start.
    signs : (m,) ndarray, optional
        One sign per layer for the whole texture; without them layers are independent.
    observed : Observed
        One row per record; rows without any have no weight.
    limits : pair of (p,) ndarray
    steps, enough
        As in `coherent.climb`.
    """
    fit = _climb_field(theta, signs, observed, field, limits=limits, steps=steps, enough=enough)
    for _ in range(RESTART_ROUNDS):
        predicted = np.clip(fit.field.predicted(fit.theta), *limits)
        there = louder(field.records.blended(predicted), fit.level)
        there = slopes(there, signs, observed).objective
        poor = field.records.touched(there < fit.slopes.objective - enough)
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


def louder(theta: Floats, level: Floats) -> Floats:
    """Parameters (K, p) with all gains raised by a level (K,) in nepers."""
    raised = theta.copy()
    raised[:, _gains(theta.shape[1])] += level[:, None]
    return raised


def _gains(p: int) -> Integers:
    """Places of the noise gain and of the layers' amplitudes among p parameters."""
    return np.concatenate(([0], np.arange(1 + 2 * ((p - 1) // 3), p)))


class _Levels(NamedTuple):
    """Of records' levels: information (K, p) shared with their parameters, own (K,), score (K,)."""

    shared: Floats
    own: Floats
    score: Floats

    def step(self, theta: Floats) -> Floats:
        """Step (K,) of the levels with a step (K, p) of the records' parameters."""
        step = (self.score - np.einsum("kp,kp->k", self.shared, theta)) / self.own
        return np.asarray(np.clip(step, -LONGEST_STEP, LONGEST_STEP))


class _There(NamedTuple):
    """What is known at one set of parameters: the records' slopes, and the cost with all else."""

    records: Slopes
    levels: _Levels | None
    cost: float
    information: Blocks
    score: Floats


# What is maximised, over the parameters θ of all nodes and the level ℓ of each record:
#
#     Σ log L(record | θ there, louder by ℓ) + Σ log t(ℓ/sd) − ½ Σ Δ'·precision·Δ − middles' cost
#
# L is Whittle's likelihood; t is Student's, so that a single record that is far off in level does
# not bend the field; Δ are the differences of neighbours, less the trend. Easy to break are:
#
# - The levels are eliminated from each step. Each is one number that touches one record, so what
#   they leave for the nodes is an outer product per record (a Schur complement), and the equations
#   of the nodes stay block tridiagonal.
# - `stiffness` is the weight of iteratively reweighted least squares, not the second derivative of
#   −log t, which is negative beyond sd·√ν, where the heavy tail is needed.
# - The trend is no unknown of the step. `following` puts it where the penalty is least for the
#   parameters that are tried, and only values with a trend of their own are compared.
def _looked_at(
    theta: Floats, level: Floats, signs: Floats | None, observed: Observed, field: Field
) -> _There:
    at = field.records.blended(theta)
    found = slopes(at if field.level_sd is None else louder(at, level), signs, observed)
    cost, levels = float(found.objective.sum()), None
    of_records, pull = found.information, found.score
    if field.level_sd is not None:
        ratio = (level / field.level_sd) ** 2 / FREEDOM
        cost += 0.5 * (FREEDOM + 1) * float(np.log1p(ratio).sum())
        stiffness = (FREEDOM + 1) / (FREEDOM * (1 + ratio) * field.level_sd**2)
        gains = _gains(at.shape[1])
        shared = of_records[:, :, gains].sum(axis=2)
        own = shared[:, gains].sum(axis=1) + stiffness
        levels = _Levels(shared, own, pull[:, gains].sum(axis=1) - stiffness * level)
        # What is left for the field once the level has taken its share.
        of_records = of_records - shared[:, :, None] * (shared / own[:, None])[:, None, :]
        pull = pull - shared * (levels.score / own)[:, None]
    information = field.records.coupled(of_records)
    score = field.records.gathered(pull)
    if field.middles is not None and signs is not None and signs.size:
        held = field.middles.held(theta, signs)
        cost, score = cost + held.cost, score + held.score
        information = information.plus(held.information)
    return _There(found, levels, cost, information, score)


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
    level = np.zeros(len(observed.power))
    damping = FIRST_DAMPING
    field = field.following(theta)
    now = _looked_at(theta, level, signs, observed, field)
    value = now.cost + field.penalty(theta)
    for _ in range(steps):
        step = solve(field, _damped(now.information, damping), now.score - field.pull(theta))
        tried = np.clip(theta + np.clip(step, -LONGEST_STEP, LONGEST_STEP), low, high)
        level_tried = level
        if now.levels is not None:
            level_tried = level + now.levels.step(field.records.blended(tried - theta))
        there = _looked_at(tried, level_tried, signs, observed, field)
        following = field.following(tried)
        value_there = there.cost + following.penalty(tried)
        if value_there < value:
            field = following
            gained = value - value_there
            theta, level, now, value = tried, level_tried, there, value_there
            damping = max(damping / 10, LEAST_DAMPING)
            if gained < enough:
                break
        elif damping > HOPELESS_DAMPING:
            break
        else:
            damping *= 10
    return FieldFit(theta, level, now.records, value, now.information, field)


def _damped(information: Blocks, damping: float) -> Blocks:
    own = information.own.copy()
    diagonal = np.einsum("cpp->cp", own)  # a view
    diagonal += damping * diagonal + RIDGE
    return information._replace(own=own)


def solve(field: Field, information: Blocks, right: Floats) -> Floats:
    """x (N, p) of (information + field's penalty)·x = right (N, p)."""
    return solve_blocks(information.plus(field.blocks()), right, columns=field.columns)


def log_evidence(fit: FieldFit) -> float:
    """Log likelihood of the records whatever the parameters, by Laplace's approximation.

    What a field with more parameters gains in likelihood it pays for with the volume that they
    might have had: of two fields the one with the larger evidence is the likelier (MacKay 1992,
    "Bayesian interpolation"). Up to a constant that all fields on the same records share.
    """
    from scipy.linalg import cholesky_banded

    field, p = fit.field, fit.theta.shape[1]
    matrix = _with_faintest(fit.information).plus(field.blocks())
    band = band_of(matrix, columns=field.columns)
    factor = cholesky_banded(band, lower=True, check_finite=False)
    expected = field.degrees * np.linalg.slogdet(field.precision)[1] + p * np.log(FAINTEST)
    return -fit.value + 0.5 * float(expected) - float(np.log(factor[0]).sum())


class Covariances(NamedTuple):
    """Posterior covariances: of each condition (C, p, p), and of the differences of neighbours.

    `differences` (p, p) is the sum over all pairs of neighbours.
    """

    conditions: Floats
    differences: Floats


def _with_faintest(information: Blocks) -> Blocks:
    own = information.own + FAINTEST * np.eye(information.own.shape[1])
    return information._replace(own=own)


def covariances(field: Field, information: Blocks) -> Covariances:
    """Blocks of the inverse of (information + field's penalty) that neighbours need.

    The matrix is block tridiagonal in the rows of the lattice, so the wanted part of its inverse
    comes from one sweep down and one up (Takahashi, Fagan and Chin 1973).
    """
    count, p = information.own.shape[:2]
    size = field.columns * p
    matrix = _with_faintest(information).plus(field.blocks())
    pivots: list[tuple[Floats, Floats]] = []
    before = np.zeros((size, size))
    for own, after in rows_of(matrix, columns=field.columns):
        inverse = np.asarray(np.linalg.inv(own - before), dtype=np.float64)
        pivots.append((inverse, after))
        before = after.T @ inverse @ after
    each = np.empty((count, p, p))
    differences = np.zeros((p, p))
    below: Floats | None = None
    for row in reversed(range(field.rows)):
        here, after = pivots[row]
        if below is not None:
            gain = -here @ after
            cross = gain @ below
            here = here + cross @ gain.T
            between = _diagonal_blocks(cross, p)
            both = _diagonal_blocks(here, p).sum(axis=0) + _diagonal_blocks(below, p).sum(axis=0)
            differences += both - between.sum(axis=0) - between.sum(axis=0).T
        each[row * field.columns : (row + 1) * field.columns] = _diagonal_blocks(here, p)
        for column in range(field.columns - 1):
            left = slice(column * p, (column + 1) * p)
            other = slice((column + 1) * p, (column + 2) * p)
            differences += here[left, left] + here[other, other]
            differences -= here[left, other] + here[other, left]
        below = here
    return Covariances(each, differences)


def _diagonal_blocks(matrix: Floats, p: int) -> Floats:
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
    scatter += covariances(field, fit.information).differences
    count = p + 1
    expected = (count * prior_covariance((p - 1) // 3) + scatter) / (count + field.degrees)
    return np.asarray(np.linalg.inv((expected + expected.T) / 2))


def effective_parameters(fit: FieldFit) -> float:
    """How many parameters the records determine: the trace of their share of the information.

    The neighbours determine the rest (MacKay 1992).
    """
    after = covariances(fit.field, fit.information)
    by_neighbours = float(np.sum(fit.field.precision * after.differences))
    by_neighbours += FAINTEST * float(np.einsum("cpp->", after.conditions))
    return fit.theta.size - by_neighbours
