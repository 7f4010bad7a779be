"""Rivals that play stored sounds (`sounds.h`): looped wavetables, and grains of recordings."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactileq.modeling.arrays import Floats
from tactileq.modeling.models.grid import Cells, Condition, fill_grid, grid_axes, within_grid
from tactileq.modeling.models.parameter_table import ParameterTable, wide_enough
from tactileq.modeling.recordings.recording import Recording
from tactileq.modeling.recordings.spectrum import MODEL_RATE_HZ, prepare

# From speed (mm/s), force (N) and (k,) frequencies in Hz to (k,) magnitudes in g per unit noise.
Magnitude = Callable[[float, float, Floats], Floats]
LARGEST = 2**15 - 1  # of 16 bits
_STARTS = 8  # of a grain's length, from one grain that counts towards the spectrum to the next


@dataclass(frozen=True, eq=False)
class SampledResponse:
    """Magnitudes (k,) at (k,) frequencies in Hz, rising from 0."""

    frequency_hz: Floats
    magnitude: Floats
    rate_hz: float

    def response(self, frequency_hz: ArrayLike) -> Floats:
        """Linear between them, (n,)."""
        return np.asarray(np.interp(np.asarray(frequency_hz), self.frequency_hz, self.magnitude))


@dataclass(frozen=True, eq=False, kw_only=True)
class Sounds:
    """One sound of N samples for each node of a grid of S speeds × F forces.

    Parameters
    ----------
    speeds_mm_s, forces_n : (S,), (F,) ndarray
        Rising, above 0, two or more each.
    samples : (S, F, N) ndarray of int16
    scales : (S, F) ndarray
        What a sound's samples are multiplied by, in g (or the recordings' unit).
    """

    speeds_mm_s: Floats
    forces_n: Floats
    samples: NDArray[np.int16]
    scales: Floats
    rate_hz: float

    @property
    def nodes(self) -> int:
        """Number of sounds."""
        return self.scales.size

    @property
    def length(self) -> int:
        """Samples of a sound, N."""
        return int(self.samples.shape[-1])

    @property
    def table(self) -> ParameterTable:
        """The scales as `sounds.h` reads them."""
        return ParameterTable(
            speeds_mm_s=self.speeds_mm_s,
            forces_n=self.forces_n,
            values=self.scales[..., None],
            signs=np.zeros(0),
        )

    @property
    def _frequency(self) -> Floats:
        return _lines_hz(self.length, self.rate_hz)

    def _blend(self, grid: Floats, condition: Condition) -> tuple[Floats, float]:
        """Values (k,) of (S, F, k), and the share of the level below the grid."""
        hand, ramp = within_grid(
            self.speeds_mm_s, self.forces_n, speed_mm_s=condition[0], force_n=condition[1]
        )
        cells = Cells(self.speeds_mm_s, self.forces_n, hand=hand)
        return cells.blend(grid)[0], float(ramp[0])


def _lines_hz(samples: int, rate_hz: float) -> Floats:
    return np.asarray(np.fft.rfftfreq(samples, 1 / rate_hz), dtype=np.float64)


@dataclass(frozen=True, eq=False, kw_only=True)
class Loops(Sounds):
    """Looped wavetables in phase with each other: their magnitudes blend linearly."""

    @cached_property
    def _lines(self) -> Floats:
        """What each loop really holds at its lines, rounding included: (S, F, N/2 + 1)."""
        spectra = np.abs(np.fft.rfft(self.samples, axis=-1)) * self.scales[..., None]
        return np.asarray(spectra / np.sqrt(self.length))

    def filter(self, speed_mm_s: float, force_n: float) -> SampledResponse:
        """What is played at one speed (mm/s) and force (N); edges as of a `TextureModel`."""
        magnitude, level = self._blend(self._lines, (speed_mm_s, force_n))
        return SampledResponse(self._frequency, magnitude * level, self.rate_hz)


def make_loops(
    axes: tuple[Floats, Floats],
    magnitude: Magnitude,
    *,
    rate_hz: float,
    seconds: float,
    rng: np.random.Generator,
) -> Loops:
    """Loops of one noise of flat magnitude and random phases, shaped at every node.

    Parameters
    ----------
    axes : (S,), (F,) ndarray
        Speeds (mm/s) and forces (N) of the nodes.
    rate_hz, seconds : float
        Of a loop.
    rng : numpy.random.Generator
    """
    length = round(seconds * rate_hz)
    frequency = _lines_hz(length, rate_hz)
    turns = np.exp(2j * np.pi * rng.random(frequency.size))
    turns[[0, -1]] = 0.0, 1.0
    wanted = np.array([[magnitude(v, f, frequency) for f in axes[1]] for v in axes[0]])
    speeds, wanted = wide_enough(axes[0], wanted, along=0)
    forces, wanted = wide_enough(axes[1], wanted, along=1)
    samples, scales = _in_16_bits(np.fft.irfft(wanted * turns * np.sqrt(length), length))
    return Loops(
        speeds_mm_s=speeds, forces_n=forces, samples=samples, scales=scales, rate_hz=rate_hz
    )


def _in_16_bits(sounds: Floats) -> tuple[NDArray[np.int16], Floats]:
    """Whole numbers, and what they are multiplied by: each sound uses the whole range."""
    scales = np.abs(sounds).max(axis=-1) / LARGEST
    scales = np.maximum(scales, np.finfo(np.float64).tiny)
    return np.rint(sounds / scales[..., None]).astype(np.int16), scales


@dataclass(frozen=True, eq=False, kw_only=True)
class Grains(Sounds):
    """Recordings played in grains from random places, faded and overlapping by half.

    Pieces around the hand are independent, so their powers blend linearly.

    Parameters
    ----------
    block : int
        Samples of a grain, even; a new one begins every half of them.
    """

    block: int

    @property
    def window(self) -> Floats:
        """The sine window of a grain, (n,): squares of its overlapping halves add up to 1."""
        return np.asarray(np.sin(np.pi * (np.arange(self.block) + 0.5) / self.block))

    @cached_property
    def _power(self) -> Floats:
        """Mean power of a grain's spectrum over its possible places, (S, F, N/2 + 1)."""
        from scipy.signal import ShortTimeFFT

        hop = max(1, self.block // _STARTS)
        transform = ShortTimeFFT(
            self.window, hop, self.rate_hz, mfft=self.length, scale_to=None, phase_shift=None
        )
        sounds = self.samples * self.scales[..., None]
        inside = range(transform.lower_border_end[1], transform.upper_border_begin(self.length)[1])
        every = transform.stft(sounds, p0=inside.start, p1=inside.stop)
        return np.asarray(np.mean(np.abs(every) ** 2, axis=-1) / np.sum(self.window**2))

    def filter(self, speed_mm_s: float, force_n: float) -> SampledResponse:
        """What is played at one speed (mm/s) and force (N); edges as of a `TextureModel`."""
        power, level = self._blend(self._power, (speed_mm_s, force_n))
        return SampledResponse(self._frequency, np.sqrt(power) * level, self.rate_hz)


def grains_of(
    by_condition: Mapping[Condition, Sequence[Recording]], *, texture: str, block: int
) -> Grains:
    """The recordings themselves, at the models' rate.

    Repeats of a condition are joined end to end; a hole of the grid gets the nearest condition's
    recording with the level that is interpolated there.
    """
    joined = {c: np.concatenate([prepare(r) for r in found]) for c, found in by_condition.items()}
    first = next(iter(by_condition.values()))[0]
    length = min(sound.size for sound in joined.values()) // 2 * 2
    joined = {c: sound[:length] for c, sound in joined.items()}
    rate_hz = min(first.rate_hz, MODEL_RATE_HZ)
    levels, _ = fill_grid({c: [x.std()] for c, x in joined.items()}, texture)
    speeds, forces = (np.array(axis) for axis in grid_axes(joined))
    sounds = np.array([[_nearest(joined, (v, f)) for f in forces] for v in speeds])
    sounds *= levels / np.maximum(sounds.std(axis=-1, keepdims=True), np.finfo(np.float64).tiny)
    speeds, sounds = wide_enough(speeds, sounds, along=0)
    forces, sounds = wide_enough(forces, sounds, along=1)
    samples, scales = _in_16_bits(sounds)
    return Grains(
        speeds_mm_s=speeds,
        forces_n=forces,
        samples=samples,
        scales=scales,
        rate_hz=rate_hz,
        block=block,
    )


def _nearest(sounds: Mapping[Condition, Floats], condition: Condition) -> Floats:
    """Of the condition itself, or of the one that differs by the smallest ratios."""
    at = np.log(condition)
    return sounds[min(sounds, key=lambda c: float(np.abs(np.log(c) - at).sum()))]
