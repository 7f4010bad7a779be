"""Which layers a texture may have: how many, where, with which signs.

docs/method/fitting.md#layer-search, docs/method/fitting.md#sign-search

The search runs on a coarse part of the grid, with a strong smoothing prior. Layers grow one by one
as independent ones, whose powers add and which need no signs; then signs are tried; layers that the
coherent response does not need are taken away, and such as it lacks are added. Spectra without
clear peaks are also begun from layers spread over them, with every sign.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

from tactileq.modeling.arrays import Floats
from tactileq.modeling.equalizer.signs import neighbouring_patterns
from tactileq.modeling.estimation.coherent import Climbed, Observed, climb, observe, without_layer
from tactileq.modeling.estimation.given_count import starts_of
from tactileq.modeling.estimation.likelihood import NEPER_POWER_DB, split
from tactileq.modeling.fitting.field import (
    FieldFit,
    effective_parameters,
    fit_field,
    log_evidence,
    prior_covariance,
    updated_precision,
)
from tactileq.modeling.fitting.growth import (
    CLEAR_EVIDENCE,
    candidates,
    inserted,
    inserted_independently,
)
from tactileq.modeling.fitting.texture_grid import TextureGrid

MOST_LAYERS = 12
# Chosen on drawn surfaces and planted random spectra. What doubling does was looked at on 11 drawn
# surfaces (tools/double_constants.py): mean distance from the truth between the conditions, worst
# surface, time of the fit. Where nothing is said, nothing changed there: it bounds the work, or
# counts on surfaces that are harder than these.
# Of the field while searching: layers must not change places. Doubled: −1 %, worst +11 %.
STIFFNESS = 3.0
# A layer must raise the log likelihood by so much per record to be looked at.
LEAST_GAIN = 4.0
# Conditions, spread over the grid, by which the best of several starts is chosen. Doubled: +2 %,
# worst +11 %, two layers fewer.
DECIDING_CONDITIONS = 6
# Conditions from whose spectra a few layers are carried to all others. Doubled: single surfaces
# between −6 and +4 %.
STARTING_CONDITIONS = 2
MOST_SPREAD_LAYERS = 3  # doubled: 2.4 times the time
ALL_PATTERNS = 4  # up to so many layers every combination of signs is tried
# How many of the likeliest go on. Signs doubled: +1 %, worst +11 %; growth and removals: 1.2 and
# 1.4 times the time; starts: −1 %, worst +6 %, 1.3 times the time.
TRIED_SIGNS, TRIED_GROWTH, TRIED_REMOVALS, TRIED_STARTS = 2, 2, 2, 3
CONTENDERS = 2  # per number of layers; doubled: 1.6 times the time
ROUGH_ROUNDS = 1  # of the covariance while searching; doubled: +1 %, 1.4 times the time
# In log evidence per record, for a solution to be looked at in full. Doubled: −1 %, 1.5 times the
# time.
NOT_WORSE = 3.0


@dataclass(frozen=True, eq=False)
class Solution:
    """Layers of a texture: parameters (N, p) of nodes, relative to the grid's scale, signs (m,).

    `value` is the penalised misfit, less what scatter alone gives in these bins, so that solutions
    in different bins can be compared; `observed` are the bins.
    """

    theta: Floats
    signs: Floats
    value: float
    observed: Observed
    fit: FieldFit

    @property
    def count(self) -> int:
        """Number of layers."""
        return self.signs.size

    @cached_property
    def evidence(self) -> float:
        """Log evidence, comparable between solutions in different bins."""
        return log_evidence(self.fit) + float(self.observed.scatter.sum())

    @cached_property
    def at_db(self) -> float:
        """Expected distance from the true spectra at the records.

        What the misfit has above scatter, and as much for each parameter that the records
        determine as it costs in other records than these (Akaike 1974).
        """
        return self._distance_db(self.lost)

    @cached_property
    def lost(self) -> float:
        """The same in log likelihood."""
        return self._excess + effective_parameters(self.fit)

    @cached_property
    def unexplained_db(self) -> float:
        """What the misfit has above scatter, as a distance."""
        return self._distance_db(self._excess)

    @property
    def _excess(self) -> float:
        return float((self.fit.slopes.misfit - self.observed.scatter).sum())

    def _distance_db(self, lost: float) -> float:
        """The distance that costs so much log likelihood."""
        return float(NEPER_POWER_DB * np.sqrt(2 * max(lost, 0.0) / self.observed.weight.sum()))

    @cached_property
    def distance_db(self) -> float:
        """Expected distance at the records and between them, where blends should be near nodes."""
        return float(np.hypot(self.at_db, self.between_db))

    @cached_property
    def between_db(self) -> float:
        """What blends between the records add to the distance: the RMS of their defects."""
        return float(np.sqrt(np.mean(self._defects_db**2)))

    @cached_property
    def blend_defect_db(self) -> float:
        """Largest distance of a blend half-way between nodes from the mean of their logarithms."""
        return float(self._defects_db.max())

    @cached_property
    def _defects_db(self) -> Floats:
        middles = self.fit.field.middles
        return np.zeros(1) if middles is None else middles.defects_db(self.theta, self.signs)


def fitted(
    grid: TextureGrid,
    theta: Floats,
    signs: Floats,
    *,
    precision: Floats | None = None,
    observed: Observed | None = None,
    steps: int = 12,
    enough: float = 1.0,
    middles: bool = False,
) -> Solution:
    """The field near a start (N, p); by default with the strong prior of the search."""
    if precision is None:
        precision = search_precision(signs.size)
    observed = grid.observed(theta) if observed is None else observed
    fit = fit_field(
        theta,
        signs,
        observed,
        grid.field(precision, middles=middles),
        limits=grid.limits(signs.size),
        steps=steps,
        enough=enough,
    )
    value = fit.value - float(observed.scatter.sum())
    return Solution(fit.theta, signs, value, observed, fit)


def search_precision(m: int) -> Floats:
    """Precision of the field of m layers while they are searched."""
    return np.asarray(np.linalg.inv(prior_covariance(m)) * STIFFNESS)


def search(grid: TextureGrid, *, count: int | None = None) -> list[Solution]:
    """Contenders on the whole grid, two per number of layers at most, the likelier first.

    Parameters
    ----------
    grid : TextureGrid
        One condition or more with a spectrum.
    count : int, optional
        The only number of layers to be considered.
    """
    part = grid.coarse()
    pool = _SolutionPool(part, count)
    _grow(pool)
    _reduce(pool)
    if pool.best().count <= MOST_SPREAD_LAYERS:
        _spread(pool)
    if _complete(pool):
        _reduce(pool)
    if part is grid:
        return pool.contenders()
    return [expanded(grid, part, s) for s in pool.contenders()]


class _SolutionPool:
    """Solutions on the coarse grid, by number of layers."""

    def __init__(self, grid: TextureGrid, count: int | None) -> None:
        self.grid, self.count = grid, count
        self.records = int(grid.recorded.sum())
        self.most = MOST_LAYERS if count is None else max(count, 1)
        noise = fitted(grid, grid.at_nodes(grid.levels())[:, None], np.zeros(0))
        self._solutions: dict[int, list[Solution]] = {0: [noise]}

    def add(self, solutions: Sequence[Solution]) -> None:
        for solution in solutions:
            self._solutions.setdefault(solution.count, []).append(solution)

    def of(self, count: int) -> Solution | None:
        """The best with so many layers."""
        return max(self._solutions.get(count, []), key=lambda s: s.evidence, default=None)

    def rank(self, solution: Solution) -> tuple[int, float]:
        """Ranking, larger is better: the requested number of layers first, then the evidence."""
        off = 0 if self.count is None else abs(solution.count - self.count)
        return -off, solution.evidence

    def best(self) -> Solution:
        return max(self._every(), key=self.rank)

    def largest(self) -> int:
        """The largest number of layers among the solutions."""
        return max(self._solutions)

    def contenders(self) -> list[Solution]:
        best = self.best()
        least = best.evidence - NOT_WORSE * self.records
        chosen: list[Solution] = []
        for solution in sorted(self._every(), key=self.rank, reverse=True):
            off = self.rank(solution)[0] != self.rank(best)[0] or solution.evidence < least
            alike = [s for s in chosen if s.count == solution.count]
            near = any(abs(solution.value - s.value) < 1.0 for s in alike)
            if not (off or near or len(alike) == CONTENDERS):
                chosen.append(solution)
        return chosen

    def _every(self) -> list[Solution]:
        return [s for solutions in self._solutions.values() for s in solutions]


def _grow(pool: _SolutionPool) -> None:
    """Independent layers, one by one, along laws over the grid; each number of them with signs.

    Where coherent layers cancel or add up, independent ones go on growing indefinitely; it ends
    when two more have not made the coherent solution any better.
    """
    grid = pool.grid
    theta, now, idle = pool.best().theta, pool.best().value, 0
    for m in range(1, pool.most + 1):
        at_records = grid.corners.blended(theta)
        found = candidates(grid, at_records, None)
        if not found:
            return
        start = inserted_independently(at_records, found[0], rate_hz=grid.rate_hz)
        start = grid.at_nodes(start)
        observed = grid.observed(start)
        field, limits = grid.field(search_precision(m)), grid.limits(m)
        fit = fit_field(start, None, observed, field, limits=limits, steps=12, enough=1.0)
        value = fit.value - float(observed.scatter.sum())
        if now - value < LEAST_GAIN * pool.records:
            return
        theta, now, best = fit.theta, value, pool.best()
        pool.add(_with_signs(grid, theta))
        idle = 0 if pool.best() is not best else idle + 1
        if idle == 2:
            return


def _with_signs(grid: TextureGrid, theta: Floats) -> list[Solution]:
    """Independent layers made coherent, with the signs that suit them best."""
    m = (theta.shape[1] - 1) // 3
    noise, frequency, bandwidth, gain = split(theta, m)
    patterns = np.array(list(product((1.0, -1.0), repeat=m)))
    if m > ALL_PATTERNS:
        patterns = neighbouring_patterns(np.median(np.exp(frequency), axis=0))
    starts = []
    for signs in patterns:
        # At its peak alone, G_w + s·G has the power G_w² + gain².
        amplitude = np.hypot(np.exp(noise), np.exp(gain)) - signs * np.exp(noise)
        amplitude = np.maximum(amplitude, 1e-3 * np.exp(noise))
        starts.append((np.hstack((noise, frequency, bandwidth, np.log(amplitude))), signs))
    return [fitted(grid, *start) for start in _likeliest(grid, starts, TRIED_SIGNS)]


def _reduce(pool: _SolutionPool) -> None:
    """Backward elimination: the layer whose removal costs least is removed."""
    for m in range(pool.largest(), 1, -1):
        solution = pool.of(m)
        if solution is None:
            continue
        starts = [
            (without_layer(solution.theta, layer), np.delete(solution.signs, layer))
            for layer in range(m)
        ]
        likeliest = _likeliest(pool.grid, starts, TRIED_REMOVALS)
        pool.add([fitted(pool.grid, *start) for start in likeliest])


def _complete(pool: _SolutionPool) -> bool:
    """Further layers where the coherent response lacks them; whether any was worth it."""
    completed = False
    while True:
        best = pool.best()
        if best.count >= pool.most:
            return completed
        grid = pool.grid
        at_records = grid.corners.blended(best.theta)
        found = [
            inserted(at_records, best.signs, candidate, sign=sign, rate_hz=grid.rate_hz)
            for candidate in candidates(grid, at_records, best.signs)
            for sign in (1.0, -1.0)
        ]
        starts = [(grid.at_nodes(theta), signs) for theta, signs in found]
        if not starts:
            return completed
        pool.add([fitted(grid, *start) for start in _likeliest(grid, starts, TRIED_GROWTH)])
        if pool.best() is best:
            return completed
        completed = True


def completed(grid: TextureGrid, solution: Solution) -> Solution:
    """The solution, with layers added where some condition clearly lacks them.

    The coarse grid may not show a layer that is heard at one speed alone.
    """
    excess = solution.fit.slopes.misfit - solution.observed.scatter
    if not (excess[grid.recorded] > CLEAR_EVIDENCE).any():
        return solution
    pool = _SolutionPool(grid, None)
    pool.add([solution])
    _complete(pool)
    return pool.best()


def in_frequency_order(grid: TextureGrid, solution: Solution) -> Solution:
    """The solution with layers in the order of their frequencies, where two speeds allow for it.

    They do not determine which layers have crossed; that none has is likelier if it is as near.
    """
    _, frequency, _, _ = split(solution.theta, solution.count)
    order = np.argsort(frequency, axis=1, kind="stable")
    if len({speed for speed, _ in grid.conditions}) != 2 or (order == order[0]).all():
        return solution
    columns = np.hstack([part * solution.count + order for part in range(3)])
    theta = solution.theta.copy()
    theta[:, 1:] = np.take_along_axis(theta[:, 1:], columns, axis=1)
    patterns = neighbouring_patterns(np.median(np.exp(theta[:, 1 : 1 + solution.count]), axis=0))
    likeliest = _likeliest(grid, [(theta, signs) for signs in patterns], TRIED_SIGNS)
    tried = [fitted(grid, *start, observed=solution.observed, middles=True) for start in likeliest]
    return max([solution, *tried], key=lambda s: s.evidence)


def _spread(pool: _SolutionPool) -> None:
    """Two or three layers spread over single spectra, every sign, carried to all conditions."""
    counts = range(2, MOST_SPREAD_LAYERS + 1) if pool.count is None else [pool.count]
    for count in counts:
        if count <= MOST_SPREAD_LAYERS:
            pool.add(_spread_layers(pool.grid, count))


def _spread_layers(grid: TextureGrid, count: int) -> list[Solution]:
    levels, bins = grid.levels(), grid.observed(np.zeros((len(grid.conditions), 1)))
    patterns = np.array(list(product((1.0, -1.0), repeat=count)))
    carried = []
    for row in grid.spread(STARTING_CONDITIONS):
        power = grid.powers[row]
        assert power is not None, "only recorded conditions are spread"
        starts = starts_of(power, count)
        starts[:, np.r_[0, 1 + 2 * count : 1 + 3 * count]] += np.log(power.scale / grid.scale)
        theta = np.repeat(starts, len(patterns), axis=0)
        signs = np.tile(patterns, (len(starts), 1))
        here = bins.rows(np.full(len(theta), row))
        fits = climb(theta, signs, here, limits=grid.limits(count), steps=20, enough=1.0)
        for best in _distinct(fits, TRIED_STARTS - 1):
            everywhere = np.tile(best.theta, (len(levels), 1))
            gains = np.r_[0, 1 + 2 * count : 1 + 3 * count]
            everywhere[:, gains] += (levels - levels[row])[:, None]
            carried.append((grid.at_nodes(everywhere), best.signs))
    rough = [fitted(grid, *c, observed=bins, steps=8, enough=5.0) for c in carried]
    rough.sort(key=lambda s: s.value)
    return [fitted(grid, s.theta, s.signs) for s in rough[:TRIED_STARTS]]


def _distinct(fits: Climbed, count: int) -> list[Climbed]:
    """The most likely rows that differ from each other."""
    chosen: list[Climbed] = []
    for row in np.argsort(fits.objective, kind="stable"):
        fit = fits.row(int(row))
        if all(abs(fit.objective - c.objective) > 1.0 for c in chosen):
            chosen.append(fit)
        if len(chosen) == count:
            break
    return chosen


def _likeliest(
    grid: TextureGrid, starts: Sequence[tuple[Floats, Floats]], count: int
) -> list[tuple[Floats, Floats]]:
    """The best of some starts with this number of layers, by their fit in a few conditions."""
    some = grid.spread(DECIDING_CONDITIONS)
    theta = np.concatenate([grid.corners.blended(theta)[some] for theta, _ in starts])
    signs = np.concatenate([np.tile(signs, (some.size, 1)) for _, signs in starts])
    m = signs.shape[1]
    _, frequency, bandwidth, _ = split(theta, m)
    powers = [grid.powers[i] for i in some] * len(starts)
    observed = observe(powers, np.exp(frequency), np.exp(bandwidth), scale=grid.scale)
    fits = climb(theta, signs, observed, limits=grid.limits(m), steps=10, enough=1.0)
    loss = np.sort((fits.objective - observed.scatter).reshape(len(starts), -1), axis=1)
    # In a few conditions a start may lead to a poor maximum.
    held = loss[:, : max(1, round(0.67 * some.size))].sum(axis=1)
    return [starts[i] for i in np.argsort(held, kind="stable")[:count]]


def expanded(grid: TextureGrid, part: TextureGrid, solution: Solution) -> Solution:
    """A solution of the coarse grid on the whole one: linear in log speed and log force."""
    from scipy.interpolate import RegularGridInterpolator

    places = np.log(np.array(part.conditions)).reshape(part.rows, part.columns, 2)
    by_row = int(np.argmax(np.ptp(places[:, 0], axis=0)))
    axes = [places[:, 0, by_row], places[0, :, 1 - by_row]]
    values = solution.theta.reshape(part.rows, part.columns, -1)
    for axis, nodes in enumerate(axes):
        if nodes.size == 1:  # constant along an axis of one node
            axes[axis] = nodes[0] + np.array([-1.0, 1.0])
            values = np.repeat(values, 2, axis=axis)
    wanted = np.log(np.array(grid.conditions))[:, [by_row, 1 - by_row]]
    theta = np.asarray(RegularGridInterpolator(tuple(axes), values)(wanted), dtype=np.float64)
    theta[:, np.r_[0, 1 + 2 * solution.count : theta.shape[1]]] += np.log(part.scale / grid.scale)
    return learned(grid, theta, solution.signs, rounds=ROUGH_ROUNDS)


def learned(grid: TextureGrid, theta: Floats, signs: Floats, *, rounds: int) -> Solution:
    """The field near a start (N, p), its smoothness estimated from it; blends are held."""
    observed = grid.observed(theta)
    precision = np.asarray(np.linalg.inv(prior_covariance(signs.size)))
    for _ in range(rounds):
        solution = fitted(
            grid,
            theta,
            signs,
            precision=precision,
            observed=observed,
            steps=8,
            enough=0.5,
            middles=True,
        )
        theta, precision = solution.theta, updated_precision(solution.fit)
    return fitted(grid, theta, signs, precision=precision, steps=8, enough=0.3, middles=True)
