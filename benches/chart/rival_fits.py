"""Rivals of the chart, fitted: filters by coefficients, stored sounds, and noise shaped by FFT."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from tactileq.benches.chart.fitted import at, extrapolated, extrapolated_to_ends, update_samples
from tactileq.benches.chart.rival_costs import (
    COST_RATE_HZ,
    bands_cost,
    block_samples,
    coefficients_cost,
    grain_samples,
    grains_cost,
    loops_cost,
    shaped_noise_cost,
)
from tactileq.benches.chart.shaped_noise import ShapedFilter, ShapedNoise
from tactileq.benches.rendering.coefficients import BandTable, CoefficientTable, tabled_predictor
from tactileq.benches.rendering.levels import levels_in_motion, louder_by
from tactileq.benches.rendering.stored_sounds import Grains, Loops, SampledResponse, Sounds
from tactileq.modeling import ARModel
from tactileq.modeling.arrays import Floats
from tactileq.modeling.hand import Hand
from tactileq.modeling.models.grid import within_grid
from tactileq.modeling.rendering.cost import Cost
from tactileq.modeling.similarity import SpectralFilter


@dataclass(frozen=True, eq=False)
class Filtered:
    """White noise filtered by coefficients that are read from a table.

    Parameters
    ----------
    conditions : int
        Whose filters are stored; the table between them is made of these beforehand.
    """

    model: CoefficientTable | BandTable
    conditions: int
    layers: int = -1

    @classmethod
    def of(cls, model: ARModel) -> Filtered:
        """An autoregressive model."""
        return cls(tabled_predictor(model), model.gains.size)

    @property
    def numbers(self) -> int:
        return self.conditions * int(self.model.values.shape[-1])

    def filter(self, speed_mm_s: float, force_n: float) -> SpectralFilter:
        return self.model.filter(speed_mm_s, force_n)

    def moving(
        self, hand: Hand, update_samples: int, *, places: Sequence[int], rate_hz: float
    ) -> list[SpectralFilter]:
        """With the level that is really rendered: direct forms lose it while coefficients move."""
        course = extrapolated(hand, update_samples, rate_hz=rate_hz)
        used = places[-1] // update_samples + 1
        filters = [self.model.filter(*at(course, update)) for update in range(used)]
        levels = levels_in_motion([one.system for one in filters], samples=update_samples)
        there = [(place, filters[place // update_samples]) for place in places]
        return [one.times(louder_by(levels[place], one.system)) for place, one in there]

    def cost(self, update_ms: float, *, single: bool) -> Cost:
        nodes = self.model.values[..., 0].size
        period = update_samples(update_ms, COST_RATE_HZ)
        if isinstance(self.model, BandTable):
            layers = self.model.layers
            return bands_cost(layers, nodes=nodes, update_samples=period, single=single)
        orders = self.model.poles, self.model.zeros
        return coefficients_cost(*orders, nodes=nodes, update_samples=period, single=single)


def stored_samples(sounds: Sounds) -> int:
    """Of all sounds at 5 kHz, whatever their own rate."""
    return sounds.nodes * round(sounds.length * COST_RATE_HZ / sounds.rate_hz)


def _towards(axis: Floats, wanted: Floats) -> Floats:
    """`tq_cell_towards`: a step ends at the edge of the cell that it leads into, at the latest."""
    at, reached = float(wanted[0]), []
    for to in wanted.tolist():
        passed = axis <= at if to > at else axis < at
        cell = min(max(int(passed.sum()) - 1, 0), axis.size - 2)
        at = float(np.clip(to, axis[cell], axis[cell + 1]))
        reached.append(at)
    return np.array(reached)


@dataclass(frozen=True, eq=False)
class Looped:
    """Looped wavetables, whose weights ramp from update to update."""

    model: Loops
    layers: int = -1

    @property
    def numbers(self) -> int:
        return stored_samples(self.model)

    def filter(self, speed_mm_s: float, force_n: float) -> SpectralFilter:
        return self.model.filter(speed_mm_s, force_n)

    def moving(
        self, hand: Hand, update_samples: int, *, places: Sequence[int], rate_hz: float
    ) -> list[SpectralFilter]:
        """As `sounds.h` plays: weights lead to the next update, at most to the edge of a cell."""
        ends = extrapolated_to_ends(hand, update_samples, rate_hz=rate_hz)
        used = places[-1] // update_samples + 1
        led, level = self._led(*(reading[:used] for reading in ends))
        filters = list[SpectralFilter]()
        for place in places:
            update, into = divmod(place, update_samples)
            share, before = (into + 1) / update_samples, max(update - 1, 0)
            at_speed, at_force = (led[before] * (1 - share) + led[update] * share).tolist()
            there = self.model.filter(at_speed, at_force)
            louder = level[before] * (1 - share) + level[update] * share
            filters.append(replace(there, magnitude=there.magnitude * louder))
        return filters

    def _led(self, speed_mm_s: Floats, force_n: Floats) -> tuple[Floats, Floats]:
        """Where the weights stand after each update, (n, 2), and the level left there, (n,)."""
        axes = self.model.speeds_mm_s, self.model.forces_n
        wanted, level = within_grid(*axes, speed_mm_s=speed_mm_s, force_n=force_n)
        along = [_towards(axis, to) for axis, to in zip(axes, wanted, strict=True)]
        return np.stack(along, axis=1), level

    def cost(self, update_ms: float, *, single: bool) -> Cost:
        return loops_cost(
            nodes=self.model.nodes,
            numbers=self.numbers,
            update_samples=update_samples(update_ms, COST_RATE_HZ),
            single=single,
        )


class BlockModel(Protocol):
    """What renders blocks of some length, each for one condition."""

    @property
    def block(self) -> int: ...

    def filter(self, speed_mm_s: float, force_n: float) -> ShapedFilter | SampledResponse: ...


@dataclass(frozen=True, eq=False)
class ByBlock:
    """Blocks that overlap by half, each for where the hand should be in its middle."""

    model: BlockModel
    block_s: float
    layers: int = -1

    @property
    def interval_ms(self) -> float:
        """From one block to the next."""
        return 1e3 * self.block_s / 2

    def filter(self, speed_mm_s: float, force_n: float) -> SpectralFilter:
        return self.model.filter(speed_mm_s, force_n)

    def moving(
        self, hand: Hand, update_samples: int, *, places: Sequence[int], rate_hz: float
    ) -> list[SpectralFilter]:
        half = self.model.block // 2
        return [self._overlapping(hand, place, half=half) for place in places]

    def _overlapping(self, hand: Hand, place: int, *, half: int) -> SpectralFilter:
        newer, into = divmod(place, half)
        share = np.sin(np.pi / 2 * (into + 0.5) / half) ** 2
        filters = [self._block(hand, block * half, half) for block in (newer - 1, newer)]
        power = [(1 - share) * filters[0].magnitude ** 2, share * filters[1].magnitude ** 2]
        magnitude: Floats = np.sqrt(power[0] + power[1])
        return replace(filters[0], magnitude=magnitude)

    def _block(self, hand: Hand, start: int, half: int) -> ShapedFilter | SampledResponse:
        last, now = (max(sample, 0) for sample in (start - half, start))
        speed, force = (2 * reading[now] - reading[last] for reading in hand)
        return self.model.filter(float(speed), float(force))


@dataclass(frozen=True, eq=False)
class Shaped(ByBlock):
    """Noise shaped by FFT; a block's length is its update interval."""

    model: ShapedNoise

    @property
    def numbers(self) -> int:
        """At the lines of a block at 5 kHz."""
        lines = block_samples(self.block_s, COST_RATE_HZ) // 2 + 1
        return self.model.magnitudes[..., 0].size * lines

    def cost(self, update_ms: float, *, single: bool) -> Cost:
        return shaped_noise_cost(
            block_samples(self.block_s, COST_RATE_HZ), numbers=self.numbers, single=single
        )


@dataclass(frozen=True, eq=False)
class Grained(ByBlock):
    """Grains of recordings."""

    model: Grains

    @property
    def numbers(self) -> int:
        return stored_samples(self.model)

    def cost(self, update_ms: float, *, single: bool) -> Cost:
        return grains_cost(
            grain_samples(self.block_s, COST_RATE_HZ),
            nodes=self.model.nodes,
            numbers=self.numbers,
            single=single,
        )
