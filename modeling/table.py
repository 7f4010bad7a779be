"""What a layered model tells the renderer: parameters over a grid, and how to read between."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from modeling.errors import InputError
from modeling.grid import Cells, Floats, within_grid


class Parameters(NamedTuple):
    """PEQ parameters at n points: noise gain (n,), frequency, bandwidth and gain (n, m)."""

    noise_gain: Floats
    frequencies_hz: Floats
    bandwidths_hz: Floats
    gains: Floats


@dataclass(frozen=True, eq=False, kw_only=True)
class ParameterTable:
    """PEQ parameters of m layers over a grid of S speeds × F forces, as `kernel.h` reads them.

    Parameters
    ----------
    speeds_mm_s, forces_n : (S,), (F,) ndarray
        Rising, above 0, two or more each.
    values : (S, F, 1 + 3m) ndarray
        Noise gain, then all frequencies (Hz), all bandwidths (Hz), all signed gains.
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
        """Bilinear interpolation over the grid, with the edges of METHOD 9 (`within_grid`).

        Parameters
        ----------
        speed_mm_s, force_n : (n,) array_like
            As in `TextureModel.parameters`.
        """
        hand = within_grid(self.speeds_mm_s, self.forces_n, speed_mm_s=speed_mm_s, force_n=force_n)
        values = Cells(self.speeds_mm_s, self.forces_n, hand=hand).blend(self.values)
        frequencies, bandwidths, gains = np.split(values[:, 1:], 3, axis=1)
        gains = self._signed(gains)
        return Parameters(
            np.maximum(values[:, 0], 0.0) * hand.ramp,
            frequencies,
            bandwidths,
            gains * hand.ramp[:, None],
        )
