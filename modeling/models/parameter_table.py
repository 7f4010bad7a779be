"""A layered model as the renderer sees it: parameters over a grid, and how to interpolate.

Between its nodes a table is read linearly, whatever the model. A model that blends in logarithms
gives a table with more nodes, as many as it takes to be close to its own laws: nothing that reads
tables needs to know, and the kernel needs no logarithm.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tactileq.modeling.arrays import Floats
from tactileq.modeling.errors import InputError
from tactileq.modeling.models.grid import Cells, within_grid

# Between nodes of a logarithmic table neither the axis nor a parameter changes by more than 3 dB;
# read linearly, a power law is then met to 0.27 dB along each axis. But a cell has at most eight
# parts, which a layer that vanishes from one condition to the next would exceed.
LARGEST_STEP = 0.35
MOST_PARTS = 8
# Where there is one speed or force alone, the second node: so near that a hand beyond it is beyond
# the grid, but told apart in single precision.
NEXT = 1 + 1e-6
LOWEST_GAIN_SHARE = 1e-6  # of a layer's largest gain, where one of 0 is to be blended
# Gains below it are 0. From sample to sample a gain moves by a thousandth of its largest value or
# more, which single precision has to hold in full: a step that is rounded to 0 never ends a fade.
LEAST_GAIN = 1e3 * float(np.finfo(np.float32).tiny)


class Parameters(NamedTuple):
    """PEQ parameters at n points: noise gain (n,), frequency, bandwidth and gain (n, m)."""

    noise_gain: Floats
    frequencies_hz: Floats
    bandwidths_hz: Floats
    gains: Floats


def flushed_to_zero(gains: Floats) -> Floats:
    """Gains (g) of any shape, with 0 for those below `LEAST_GAIN`."""
    return np.where(np.abs(gains) < LEAST_GAIN, 0.0, gains)


@dataclass(frozen=True, eq=False, kw_only=True)
class ParameterTable:
    """PEQ parameters of m layers over a grid of S speeds × F forces, as `kernel.h` reads them.

    Parameters
    ----------
    speeds_mm_s, forces_n : (S,), (F,) ndarray
        Rising, above 0, two or more each, as `kernel.h` wants them (see `wide_enough`).
    values : (S, F, 1 + 3m) ndarray
        Noise gain, then all frequencies (Hz), all bandwidths (Hz), all signed gains; gains below
        `LEAST_GAIN` become 0.
    signs : (m,) ndarray
        1 or −1 where the layer's gain must not cross 0 (a grid of a regression's corners may), 0
        where it may.

    Raises
    ------
    InputError
        For values that are not finite (coefficients of a regression that overflow).
    """

    speeds_mm_s: Floats
    forces_n: Floats
    values: Floats
    signs: Floats

    def __post_init__(self) -> None:
        if not np.isfinite(self.values).all():
            raise InputError(
                "expected finite parameters over the grid, got NaN or inf; make the model again."
            )
        floor, shape, gains = np.split(self.values, [1, 1 + 2 * self.n_layers], axis=-1)
        parts = [flushed_to_zero(floor), shape, flushed_to_zero(gains)]
        object.__setattr__(self, "values", np.concatenate(parts, axis=-1))

    @property
    def n_layers(self) -> int:
        """Number of layers, m."""
        return self.signs.size

    @property
    def largest_gains(self) -> Floats:
        """Largest amplitude of the noise gain and of every layer's gain over the grid, (1 + m,)."""
        gains = self._signed(self.values[..., 1 + 2 * self.n_layers :])
        every = np.concatenate([np.maximum(self.values[..., :1], 0.0), np.abs(gains)], axis=-1)
        largest: Floats = every.max(axis=(0, 1))
        return largest

    def _signed(self, gains: Floats) -> Floats:
        """Gains (…, m) without what crosses 0 and must not."""
        return np.where(self.signs * gains < 0, 0.0, gains)

    def at(self, speed_mm_s: ArrayLike, force_n: ArrayLike) -> Parameters:
        """Bilinear interpolation over the grid; edges: docs/method/rendering.md#grid-edges.

        Parameters
        ----------
        speed_mm_s, force_n : (n,) array_like
            As in `TextureModel.parameters`.
        """
        hand, ramp = within_grid(
            self.speeds_mm_s, self.forces_n, speed_mm_s=speed_mm_s, force_n=force_n
        )
        values = Cells(self.speeds_mm_s, self.forces_n, hand=hand).blend(self.values)
        frequencies, bandwidths, gains = np.split(values[:, 1:], 3, axis=1)
        gains = self._signed(gains)
        return Parameters(
            np.maximum(values[:, 0], 0.0) * ramp,
            frequencies,
            bandwidths,
            gains * ramp[:, None],
        )


def wide_enough(axis: Floats, values: Floats, *, along: int) -> tuple[Floats, Floats]:
    """An axis of two nodes from a single one, which is repeated, since others are unknown.

    Parameters
    ----------
    axis : (n,) ndarray
    values : (S, F, k) ndarray
    along : {0, 1}
        Which dimension of the values belongs to the axis.
    """
    if axis.size > 1:
        return axis, values
    return axis[0] * np.array([1.0, NEXT]), np.repeat(values, 2, axis=along)


def logarithmic_nodes(
    speeds_mm_s: Floats, forces_n: Floats, values: Floats
) -> tuple[Floats, Floats, Floats]:
    """Axes and values of a finer grid that is linear in logarithms between the given nodes.

    Every parameter follows a power of speed and force between two conditions.

    Parameters
    ----------
    speeds_mm_s, forces_n : (S,), (F,) ndarray
    values : (S, F, k) ndarray
        No parameter changes its sign; one that is 0 somewhere is blended as a millionth of its
        largest amplitude.

    Returns
    -------
    (S',), (F',) and (S', F', k) ndarray
        The given nodes are among them, with their very values.
    """
    largest = np.abs(values).max(axis=(0, 1), initial=0.0)
    signs = np.sign(np.sign(values).sum(axis=(0, 1)))  # a sum of values could overflow
    floor = np.maximum(LOWEST_GAIN_SHARE * largest, np.finfo(np.float64).tiny)
    logs = np.log(np.maximum(np.abs(values), floor))
    speeds, by_speed = _finer(
        speeds_mm_s, np.abs(np.diff(logs, axis=0)).max(axis=(1, 2), initial=0)
    )
    forces, by_force = _finer(forces_n, np.abs(np.diff(logs, axis=1)).max(axis=(0, 2), initial=0))
    finer = signs * np.exp(np.einsum("as,bf,sfk->abk", by_speed, by_force, logs))
    given = np.ix_(
        np.flatnonzero(np.isin(speeds, speeds_mm_s)), np.isin(forces, forces_n).nonzero()[0]
    )
    finer[given] = values
    return speeds, forces, finer


def _finer(axis: Floats, steps: Floats) -> tuple[Floats, Floats]:
    """A finer axis, and the weights (n', n) of linear interpolation over its logarithm."""
    nodes = [axis[:1]]
    for low, high, step in zip(axis[:-1], axis[1:], steps, strict=True):
        widest = max(step, np.log(high / low))
        parts = int(np.clip(np.ceil(widest / LARGEST_STEP), 1, MOST_PARTS))
        nodes.append(np.append(np.geomspace(low, high, parts + 1)[1:-1], high))
    finer = np.concatenate(nodes)
    weights = [np.interp(np.log(finer), np.log(axis), unit) for unit in np.eye(axis.size)]
    return finer, np.stack(weights, axis=1)
