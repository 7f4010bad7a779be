"""The spectra of one texture on its rectangular grid of speeds and forces."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tactileq.modeling.arrays import Bools, Floats, Integers
from tactileq.modeling.estimation.coherent import Observed, limits_of, observe
from tactileq.modeling.estimation.likelihood import (
    LOWEST_FITTED_HZ,
    NEPER_DB,
    Power,
    signal_power,
    split,
)
from tactileq.modeling.fitting.blending import Middles
from tactileq.modeling.fitting.equations import Corners, cells, corners_of
from tactileq.modeling.fitting.field import Field
from tactileq.modeling.models.grid import Condition
from tactileq.modeling.recordings.spectrum import Spectrum

# On larger grids layers are searched on every second or third node of either axis, so many at most.
COARSE_NODES = 4
# Of the grid that speeds and forces span: with less of it recorded, conditions are scattered.
LEAST_FILLED = 0.5
MOST_NODES = 7  # on an axis of scattered conditions
SAME_VALUE = 0.1  # of log speed or force: values that are nearer share a node
SMOOTHING = 1e-3
NEAR_SHARE = 0.25
# In nepers: the standard deviation of levels of records of one surface about a smooth field, which
# misses hidden conditions by 1.2 dB in the median (docs/method/fitting.md#scattered-conditions).
LEVEL_SCATTER = 0.2
AT_NODE, OUTLIER = 1e-6, 10.0
# In nepers (14 dB); of 200 drawn surfaces no record is more than 7.2 dB off.
OUTLIER_ABOVE = 1.6
OUTLIER_ROUNDS = 4
MOST_OUTLIERS = 0.1  # of all records
FEWEST_FOR_OUTLIERS = 15
SAMPLED = 48  # frequencies at which responses are compared


@dataclass(frozen=True, eq=False)
class TextureGrid:
    """A lattice of N nodes, row by row, the longer axis in rows, and what was recorded in it.

    Parameters
    ----------
    conditions : list of (speed, force), N of them
        The nodes.
    powers : list of Power or None
        One per record; None where nothing was recorded, or only silence.
    rows, columns : int
        N = rows × columns.
    scattered : list of (speed, force), optional
        Where the records were made; without it they are the nodes, in their order.
    """

    conditions: list[Condition]
    powers: list[Power | None]
    rows: int
    columns: int
    scattered: list[Condition] | None = None

    @cached_property
    def recorded(self) -> Bools:
        """Which records have a power, (K,)."""
        return np.array([power is not None for power in self.powers], dtype=bool)

    @cached_property
    def _powers_there(self) -> list[Power]:
        return [power for power in self.powers if power is not None]

    @cached_property
    def scale(self) -> float:
        """The unit of all gains in a fit: geometric mean of the spectra's maxima."""
        return float(np.exp(np.mean([np.log(power.scale) for power in self._powers_there])))

    @property
    def rate_hz(self) -> float:
        """Of all spectra."""
        return self._powers_there[0].rate_hz

    @cached_property
    def step_hz(self) -> float:
        """The finest distance of spectral lines."""
        return min(power.step_hz for power in self._powers_there)

    @cached_property
    def steps_hz(self) -> Floats:
        """Distance of spectral lines of each record, (K,); the finest where unknown."""
        steps = [self.step_hz if power is None else power.step_hz for power in self.powers]
        return np.array(steps)

    @cached_property
    def places(self) -> Floats:
        """Log speed and log force of each node, less their means, (N, 2)."""
        places = np.log(np.array(self.conditions))
        return np.asarray(places - places.mean(axis=0))

    @cached_property
    def record_places(self) -> Floats:
        """The same of each record, (K, 2), with the means of the nodes."""
        if self.scattered is None:
            return self.places
        mean = np.log(np.array(self.conditions)).mean(axis=0)
        return np.asarray(np.log(np.array(self.scattered)) - mean)

    @cached_property
    def corners(self) -> Corners:
        """Where the records lie in the cells of the lattice."""
        nodes = self.places.reshape(self.rows, self.columns, 2)
        by_row = int(np.argmax(np.ptp(nodes[:, 0], axis=0)))
        axes = nodes[:, 0, by_row], nodes[0, :, 1 - by_row]
        return corners_of(self.record_places[:, [by_row, 1 - by_row]], axes)

    @cached_property
    def _to_nodes(self) -> Floats:
        """Values (N, K) at the nodes that suit values at the records, smooth between them."""
        if self.corners.are_nodes:
            return np.eye(len(self.conditions))
        weights = self.corners.weights[self.recorded]
        rough = self.field(np.eye(1)).laplacian(np.eye(len(self.conditions)))
        to_nodes = np.zeros((len(self.conditions), len(self.powers)))
        normal = weights.T @ weights + SMOOTHING * rough
        to_nodes[:, self.recorded] = np.linalg.solve(normal, weights.T)
        return to_nodes

    def at_nodes(self, values: Floats) -> Floats:
        """Values (N, …) at the nodes from those at the records (K, …)."""
        return values if self.corners.are_nodes else np.asarray(self._to_nodes @ values)

    @cached_property
    def near(self) -> Bools:
        """Which records (K) decide about which nodes (N): they are nearest to them, (K, N)."""
        return np.asarray((self.corners.weights > NEAR_SHARE) & self.recorded[:, None])

    @cached_property
    def known(self) -> Bools:
        """Nodes (N,) that some record decides about."""
        return np.asarray(self.near.any(axis=0))

    def limits(self, m: int) -> tuple[Floats, Floats]:
        """Lowest and highest parameters of m layers."""
        return limits_of(m, rate_hz=self.rate_hz, step_hz=self.step_hz)

    def observed(self, theta: Floats) -> Observed:
        """The spectra in bins that are narrow near the layers of (N, p) parameters."""
        theta = self.corners.blended(theta)
        _, frequency, bandwidth, _ = split(theta, (theta.shape[1] - 1) // 3)
        return observe(self.powers, np.exp(frequency), np.exp(bandwidth), scale=self.scale)

    def field(self, precision: Floats, *, middles: bool = False) -> Field:
        """A field over this grid, without a trend yet; with `middles` blends may have no holes."""
        flat = np.zeros((2, len(precision)))
        held = self.middles if middles and self.rows > 1 else None
        return Field(
            self.rows,
            self.columns,
            self.places,
            precision,
            flat,
            self.corners,
            middles=held,
            level_sd=self.level_sd,
        )

    @cached_property
    def level_sd(self) -> Floats | None:
        """By how much (nepers) the level of each record scatters about the field, (K,), or None.

        At a node the field may be as loud as its record; between the nodes it is smooth, while
        levels are not. An outlier has no say in the level.
        """
        usual = AT_NODE if self.scattered is None else LEVEL_SCATTER
        sd = np.where(self.outliers, OUTLIER, usual)
        return None if (sd == AT_NODE).all() else sd

    @cached_property
    def surprises(self) -> Floats:
        """How much louder (nepers) a record is than the others suggest, (K,); 0 where unknown.

        Than a quadratic function of log speed and log force, fitted without what is far off it.
        """
        known = np.flatnonzero(self.recorded)
        surprise = np.zeros(len(self.powers))
        if known.size < FEWEST_FOR_OUTLIERS:
            return surprise
        levels, (a, b) = self.levels()[known], self.record_places[known].T
        design = np.column_stack((np.ones(known.size), a, b, a * a, a * b, b * b))
        near = np.ones(known.size, dtype=bool)
        for _ in range(OUTLIER_ROUNDS):
            rest = levels - design @ np.linalg.lstsq(design[near], levels[near], rcond=None)[0]
            near = np.abs(rest) <= OUTLIER_ABOVE
            if near.mean() < 1 - MOST_OUTLIERS:  # then it is not they that are wrong
                return surprise
        surprise[known] = rest
        return surprise

    def surprising(self) -> list[tuple[Condition, float]]:
        """The outliers, and by how many dB they are louder than the others suggest."""
        places = self.conditions if self.scattered is None else self.scattered
        rows = np.flatnonzero(self.outliers)
        return [(places[row], float(NEPER_DB * self.surprises[row])) for row in rows]

    @cached_property
    def outliers(self) -> Bools:
        """Records whose level is far from what the others suggest, (K,)."""
        return np.asarray(np.abs(self.surprises) > OUTLIER_ABOVE)

    @cached_property
    def middles(self) -> Middles:
        """The middles of the cells."""
        corners = cells(self.rows, self.columns)
        shares = np.full(4, 0.25) if self.columns > 1 else np.array([0.5, 0.0, 0.5, 0.0])
        return Middles(corners, shares, self.sampled, len(self.conditions))

    @cached_property
    def sampled(self) -> Observed:
        """Frequencies at which responses are compared, one row, evenly spaced in logarithms."""
        highest = max(power.frequency_hz[-1] for power in self._powers_there)
        frequency = np.geomspace(LOWEST_FITTED_HZ, highest, SAMPLED)
        tangent = np.tan(np.pi / self.rate_hz * frequency)[None]
        one = np.ones(tangent.shape)
        return Observed(one, one, one, tangent, 1 / tangent, np.zeros(1), self.rate_hz)

    def levels(self) -> Floats:
        """Log amplitude of white noise of each condition's power, (K,); the mean where unknown."""
        levels = np.full(len(self.powers), np.nan)
        for row, power in enumerate(self.powers):
            if power is not None:
                mean = np.sum(power.power * power.weight) / power.weight.sum()
                levels[row] = 0.5 * np.log(mean) + np.log(power.scale / self.scale)
        return np.where(np.isnan(levels), np.nanmean(levels), levels)

    def spread(self, count: int) -> Integers:
        """This number of recorded conditions, spread over all parts of the grid."""
        rows = np.flatnonzero(self.recorded)
        stride = max(1, round(0.382 * rows.size))
        while np.gcd(stride, rows.size) > 1:
            stride += 1
        return rows[np.arange(min(count, rows.size)) * stride % rows.size]

    def coarse(self) -> TextureGrid:
        """A part of the grid with few nodes on either axis, both ends in."""
        rows, columns = _nodes(self.rows), _nodes(self.columns)
        chosen = (rows[:, None] * self.columns + columns[None, :]).ravel()
        nodes = [self.conditions[i] for i in chosen]
        if self.scattered is not None:
            return TextureGrid(nodes, self.powers, rows.size, columns.size, self.scattered)
        powers = [self.powers[i] for i in chosen]
        part = TextureGrid(nodes, powers, rows.size, columns.size)
        if part.recorded.sum() < 0.75 * chosen.size:  # too many holes to search between
            return self
        return self if chosen.size == len(self.conditions) else part


def texture_grid(spectra: Mapping[Condition, Spectrum]) -> TextureGrid:
    """The lattice of the conditions, with holes where there is no spectrum.

    Conditions that fill less than half of the grid which their speeds and forces span are
    scattered: they are blended from a lattice over their range.
    """
    speeds = sorted({speed for speed, _ in spectra})
    forces = sorted({force for _, force in spectra})
    if scattered := len(spectra) < LEAST_FILLED * len(speeds) * len(forces):
        most = int(np.ceil(np.sqrt(len(spectra))))
        speeds, forces = _axis(speeds, most=most), _axis(forces, most=most)
    if len(speeds) >= len(forces):
        grid = [(speed, force) for speed in speeds for force in forces]
    else:
        grid = [(speed, force) for force in forces for speed in speeds]
    fewer, more = sorted((len(speeds), len(forces)))
    if scattered:
        powers = [signal_power(spectrum) for spectrum in spectra.values()]
        return TextureGrid(grid, powers, more, fewer, list(spectra))
    found = [signal_power(spectra[c]) if c in spectra else None for c in grid]
    return TextureGrid(grid, found, more, fewer)


def _axis(values: Sequence[float], *, most: int) -> list[float]:
    """Nodes of one axis: the means of groups of values, or evenly spread where these are many."""
    logs = np.log(np.array(values))
    groups = np.split(logs, np.flatnonzero(np.diff(logs) > SAME_VALUE) + 1)
    if len(groups) <= MOST_NODES:
        nodes = np.array([group.mean() for group in groups])
    else:
        nodes = np.linspace(logs[0], logs[-1], min(MOST_NODES, most))
    return [float(value) for value in np.exp(nodes)]


def _nodes(count: int) -> Integers:
    return np.unique(np.rint(np.linspace(0, count - 1, min(count, COARSE_NODES))).astype(np.intp))
