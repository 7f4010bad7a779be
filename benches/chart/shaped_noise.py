"""A rival: noise with an arbitrary spectrum, shaped by FFT block by block.

Each block is the inverse FFT of random numbers times the spectrum that was recorded, faded in and
out by a sine window and added to the block before, which it overlaps by half.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from tactileq.modeling.arrays import Floats
from tactileq.modeling.models.grid import Cells, Condition, fill_grid, grid_axes, within_grid
from tactileq.modeling.recordings.spectrum import Spectrum, mean_spectrum


@dataclass(frozen=True, eq=False)
class ShapedFilter:
    """One spectrum rendered in blocks: magnitudes (n/2 + 1,) in g per unit noise."""

    magnitude: Floats
    rate_hz: float

    def response(self, frequency_hz: ArrayLike) -> Floats:
        """Root of the power density, (k,) in g per unit noise: lines widened by the window."""
        block = 2 * (self.magnitude.size - 1)
        share = np.asarray(frequency_hz, dtype=np.float64) / self.rate_hz
        density: Floats = np.sqrt(_lines_heard(block, share.tobytes()) @ self.magnitude**2)
        return density


@lru_cache(maxsize=4)
def _lines_heard(block: int, share: bytes) -> Floats:
    """Weights (k, n/2 + 1) of the lines' powers at k frequencies, given as shares of the rate."""
    half = block // 2
    lines = np.arange(-half, half)
    weights = _window_power(np.frombuffer(share)[:, None] * block - lines, block)
    heard = np.zeros((len(weights), half + 1))
    np.add.at(heard.T, np.abs(lines), weights.T)
    return heard


def _window_power(offset: Floats, block: int) -> Floats:
    """|W|² of the sine window, `offset` lines of the FFT off; sums to 1 over the lines.

    The window is the sum of two complex exponentials half a line above and below 0.
    """
    above, below = _dirichlet(offset - 0.5, block), _dirichlet(offset + 0.5, block)
    power: Floats = 0.5 * (above + below) ** 2
    return power


def _dirichlet(offset: Floats, block: int) -> Floats:
    """The transform of a rectangular window, 1 at no offset; its sign alternates as the sine's."""
    angle = np.pi * offset
    small = np.abs(np.sin(angle / block)) < 1e-12
    safe = np.where(small, 1.0, block * np.sin(angle / block))
    return np.where(small, 1.0, np.sin(angle) / safe)


@dataclass(frozen=True, eq=False)
class ShapedNoise:
    """Magnitudes over a grid of S speeds × F forces, blended linearly.

    Parameters
    ----------
    speeds_mm_s, forces_n : (S,), (F,) ndarray
    magnitudes : (S, F, n/2 + 1) ndarray
        At the lines of a block of n samples, in g per unit noise.
    """

    speeds_mm_s: Floats
    forces_n: Floats
    magnitudes: Floats
    rate_hz: float

    @property
    def block(self) -> int:
        """Samples of a block, n; a new one begins every n/2."""
        return 2 * (self.n_parameters - 1)

    @property
    def n_parameters(self) -> int:
        """Numbers per condition."""
        return int(self.magnitudes.shape[-1])

    def filter(self, speed_mm_s: float, force_n: float) -> ShapedFilter:
        """What is rendered at one speed (mm/s) and force (N); edges as of a `TextureModel`."""
        hand, ramp = within_grid(
            self.speeds_mm_s, self.forces_n, speed_mm_s=speed_mm_s, force_n=force_n
        )
        cells = Cells(self.speeds_mm_s, self.forces_n, hand=hand)
        return ShapedFilter(cells.blend(self.magnitudes)[0] * ramp[0], self.rate_hz)

    def render(self, hand: Sequence[Condition], rng: np.random.Generator) -> Floats:
        """Half a block for each (speed, force), each read when its block begins."""
        window = np.sin(np.pi * (np.arange(self.block) + 0.5) / self.block)
        half = self.block // 2
        overlap, parts = np.zeros(half), []
        for speed, force in hand:
            magnitude = self.filter(speed, force).magnitude
            lines = rng.standard_normal((2, magnitude.size))
            lines[1, [0, -1]] = 0.0
            lines[0, [0, -1]] *= np.sqrt(2)
            spectrum = magnitude * (lines[0] + 1j * lines[1]) * np.sqrt(half)
            faded = window * np.fft.irfft(spectrum, self.block)
            parts.append(overlap + faded[:half])
            overlap = faded[half:]
        return np.concatenate(parts)


def fit_shaped_noise(
    by_condition: Mapping[Condition, Sequence[Spectrum]], *, texture: str, block: int
) -> ShapedNoise:
    """The recorded spectra at the lines of a block: mean power within half a line's spacing.

    Parameters
    ----------
    by_condition : mapping of (speed, force) to Spectrum
        Repeats of a condition are averaged; holes of the grid are interpolated.
    texture : str
        For messages.
    block : int
        Even.
    """
    speeds, forces = grid_axes(by_condition)
    rows = {c: _lines(mean_spectrum(list(found)), block) for c, found in by_condition.items()}
    magnitudes, _ = fill_grid(rows, texture)
    [rate_hz] = {found[0].rate_hz for found in by_condition.values()}
    return ShapedNoise(np.array(speeds), np.array(forces), magnitudes, rate_hz)


def _lines(measured: Spectrum, block: int) -> Floats:
    power = measured.without_leakage**2 * np.pi / 4  # |FFT|²/n, see `Spectrum.magnitude`
    line_hz = measured.rate_hz / block
    nearest = np.rint(measured.frequency_hz / line_hz).astype(int)
    count = np.bincount(nearest, minlength=block // 2 + 1)
    total = np.bincount(nearest, weights=power, minlength=block // 2 + 1)
    lines: Floats = np.sqrt(total / np.maximum(count, 1))
    return lines
