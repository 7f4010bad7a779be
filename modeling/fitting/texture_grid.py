"""The spectra of one texture on its rectangular grid of speeds and forces."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from modeling.arrays import Bools, Floats, Integers
from modeling.estimation.coherent import Observed, limits_of, observe
from modeling.estimation.likelihood import LOWEST_HZ, Power, signal_power, split
from modeling.fitting.blending import Middles
from modeling.fitting.equations import Corners, cells
from modeling.fitting.field import Field
from modeling.models.grid import Condition
from modeling.recordings.spectrum import Spectrum

# On larger grids layers are searched on every second or third node of either axis, so many at most.
COARSE_NODES = 4
MIDDLE_POINTS = 48  # frequencies at which blends are looked at


@dataclass(frozen=True, eq=False)
class TextureGrid:
    """Conditions row by row, the longer axis in rows, and what was recorded in them.

    Parameters
    ----------
    conditions : list of (speed, force), C of them
    powers : list of Power or None
        None where nothing was recorded, or only silence.
    rows, columns : int
        C = rows × columns.
    """

    conditions: list[Condition]
    powers: list[Power | None]
    rows: int
    columns: int

    @cached_property
    def recorded(self) -> Bools:
        """Where there is a power, (C,)."""
        return np.array([power is not None for power in self.powers], dtype=bool)

    @cached_property
    def _known(self) -> list[Power]:
        return [power for power in self.powers if power is not None]

    @cached_property
    def scale(self) -> float:
        """The unit of all gains in a fit: geometric mean of the spectra's maxima."""
        return float(np.exp(np.mean([np.log(power.scale) for power in self._known])))

    @property
    def rate_hz(self) -> float:
        """Of all spectra."""
        return self._known[0].rate_hz

    @cached_property
    def step_hz(self) -> float:
        """The finest distance of spectral lines."""
        return min(power.step_hz for power in self._known)

    @cached_property
    def steps_hz(self) -> Floats:
        """Distance of spectral lines in each condition, (C,); the finest where unknown."""
        steps = [self.step_hz if power is None else power.step_hz for power in self.powers]
        return np.array(steps)

    @cached_property
    def places(self) -> Floats:
        """Log speed and log force of each condition, less their means, (C, 2)."""
        places = np.log(np.array(self.conditions))
        return np.asarray(places - places.mean(axis=0))

    def limits(self, m: int) -> tuple[Floats, Floats]:
        """Lowest and highest parameters of m layers."""
        return limits_of(m, rate_hz=self.rate_hz, step_hz=self.step_hz)

    def observed(self, theta: Floats) -> Observed:
        """The spectra in bins that are narrow near the layers of (C, p) parameters."""
        _, frequency, bandwidth, _ = split(theta, (theta.shape[1] - 1) // 3)
        return observe(self.powers, np.exp(frequency), np.exp(bandwidth), scale=self.scale)

    def field(self, precision: Floats, *, middles: bool = False) -> Field:
        """A field over this grid, without a trend yet; with `middles` blends may have no holes."""
        flat = np.zeros((2, len(precision)))
        held = self.middles if middles and self.rows > 1 else None
        return Field(
            self.rows, self.columns, self.places, precision, flat, self.corners, middles=held
        )

    @cached_property
    def corners(self) -> Corners:
        """Where the records lie: each at the node of its number."""
        nodes = np.repeat(np.arange(len(self.powers))[:, None], 4, axis=1)
        shares = np.zeros(nodes.shape)
        shares[:, 0] = 1.0
        return Corners(nodes, shares, len(self.conditions))

    @cached_property
    def middles(self) -> Middles:
        """The middles of the cells."""
        corners = cells(self.rows, self.columns)
        shares = np.full(4, 0.25) if self.columns > 1 else np.array([0.5, 0.0, 0.5, 0.0])
        highest = max(power.frequency_hz[-1] for power in self._known)
        frequency = np.geomspace(LOWEST_HZ, highest, MIDDLE_POINTS)
        tangent = np.tan(np.pi / self.rate_hz * frequency)[None]
        one = np.ones(tangent.shape)
        places = Observed(one, one, one, tangent, 1 / tangent, np.zeros(1), self.rate_hz)
        return Middles(corners, shares, places, len(self.conditions))

    def levels(self) -> Floats:
        """Log amplitude of white noise of each condition's power, (C,); the mean where unknown."""
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

    def every_second(self) -> Bools:
        """Every second condition, as the black fields of a chessboard; no corner, if possible."""
        row, column = np.indices((self.rows, self.columns))
        return np.asarray((row + column) % 2 == 1).ravel()

    def coarse(self) -> TextureGrid:
        """A part of the grid with few nodes on either axis, both ends in."""
        rows, columns = _nodes(self.rows), _nodes(self.columns)
        chosen = (rows[:, None] * self.columns + columns[None, :]).ravel()
        part = TextureGrid(
            [self.conditions[i] for i in chosen],
            [self.powers[i] for i in chosen],
            rows.size,
            columns.size,
        )
        if part.recorded.sum() < 0.75 * chosen.size:  # too many holes to search between
            return self
        return self if chosen.size == len(self.conditions) else part


def texture_grid(spectra: Mapping[Condition, Spectrum]) -> TextureGrid:
    """The rectangular grid that the conditions span, with holes where there is no spectrum."""
    speeds = sorted({speed for speed, _ in spectra})
    forces = sorted({force for _, force in spectra})
    if len(speeds) >= len(forces):
        grid = [(speed, force) for speed in speeds for force in forces]
    else:
        grid = [(speed, force) for force in forces for speed in speeds]
    powers = [signal_power(spectra[c]) if c in spectra else None for c in grid]
    fewer, more = sorted((len(speeds), len(forces)))
    return TextureGrid(grid, powers, more, fewer)


def _nodes(count: int) -> Integers:
    return np.unique(np.rint(np.linspace(0, count - 1, min(count, COARSE_NODES))).astype(np.intp))
