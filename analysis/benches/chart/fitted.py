"""What the chart needs from a fitted method: filters at rest and in motion, numbers, cost."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from analysis.benches.accuracy import rendered_parameters
from analysis.benches.chart.shaped_noise import ShapedFilter, ShapedNoise
from analysis.textures.between import Truth
from modeling import ARModel, RegressedModel, Renderer, TextureModel
from modeling.arrays import Floats
from modeling.hand import Hand
from modeling.models.parameter_table import Parameters
from modeling.models.texture_model import BLENDINGS, first_peq
from modeling.rendering.cost import Cost, Operations
from modeling.rendering.plan import RenderPlan
from modeling.rendering.reference.hand import Extrapolator
from modeling.scenes.cost import stored_numbers
from modeling.similarity import SpectralFilter
from stimuli.planted.textures import FORCES_N, SPEEDS_MM_S

# All costs are those of rendering at this rate, whatever the rate of the recordings.
COST_RATE_HZ = 5000.0


class Fitted(Protocol):
    """One method, fitted to one texture."""

    @property
    def layers(self) -> int:
        """Layers of a parametric equalizer; −1 of what has none."""

    @property
    def numbers(self) -> int:
        """Numbers that are stored, over the whole grid."""

    def filter(self, speed_mm_s: float, force_n: float) -> SpectralFilter:
        """What is rendered for a hand that stays there."""

    def moving(
        self, hand: Hand, update_samples: int, *, places: Sequence[int], rate_hz: float
    ) -> list[SpectralFilter]:
        """The filters in force at some of the samples of a moving hand."""

    def cost(self, update_ms: float, *, single: bool) -> Cost | None:
        """Of rendering at 5 kHz; None of what cannot be rendered."""


def update_samples(update_ms: float, rate_hz: float) -> int:
    """An update interval in samples, at least 1."""
    return max(1, round(1e-3 * update_ms * rate_hz))


@dataclass(frozen=True, eq=False)
class Layered:
    """A parametric equalizer over a grid, or driven by regressions."""

    model: TextureModel | RegressedModel

    @property
    def layers(self) -> int:
        return self.model.n_layers

    @property
    def numbers(self) -> int:
        return stored_numbers(self.model)

    def blendings(self) -> dict[str, Layered]:
        """By name; of a grid whose layers change their signs, and of regressions, one alone."""
        if isinstance(self.model, RegressedModel):
            return {"regression": self}
        crossing = (self.model.gains > 0).any((0, 1)) & (self.model.gains < 0).any((0, 1))
        names = BLENDINGS[:1] if crossing.any() else BLENDINGS
        return {name: Layered(replace(self.model, blending=name)) for name in names}

    def filter(self, speed_mm_s: float, force_n: float) -> SpectralFilter:
        return self.model.peq(speed_mm_s, force_n)

    def moving(
        self, hand: Hand, update_samples: int, *, places: Sequence[int], rate_hz: float
    ) -> list[SpectralFilter]:
        course = rendered_parameters(self.model, hand, update_samples)
        return [
            first_peq(Parameters(*(part[[place]] for part in course)), rate_hz=rate_hz)
            for place in places
        ]

    def cost(self, update_ms: float, *, single: bool) -> Cost:
        plan = RenderPlan(
            rate_hz=COST_RATE_HZ,
            update_samples=update_samples(update_ms, COST_RATE_HZ),
            single=single,
        )
        return plan.cost(self.at_cost_rate)

    @property
    def at_cost_rate(self) -> TextureModel | RegressedModel:
        """The model as if it had been recorded at 5 kHz; what it costs does not depend on more."""
        return replace(self.model, rate_hz=COST_RATE_HZ)

    def single_error_db(self, hand: Hand, update_samples: int) -> float:
        """RMS difference of single from double precision along a stroke, dB re double."""
        rendered = [
            Renderer(self.model, update_samples=update_samples, single=single).render(*hand)
            for single in (False, True)
        ]
        difference = np.mean((rendered[1] - rendered[0]) ** 2)
        with np.errstate(divide="ignore"):
            return float(10 * np.log10(difference / np.mean(rendered[0] ** 2)))


@dataclass(frozen=True, eq=False)
class Predictor:
    """An autoregressive model over a grid; line spectral frequencies are blended."""

    model: ARModel
    layers: int = -1

    @property
    def numbers(self) -> int:
        return self.model.gains.size * self.model.n_parameters

    def filter(self, speed_mm_s: float, force_n: float) -> SpectralFilter:
        return self.model.filter(speed_mm_s, force_n)

    def moving(
        self, hand: Hand, update_samples: int, *, places: Sequence[int], rate_hz: float
    ) -> list[SpectralFilter]:
        course = extrapolated(hand, update_samples, rate_hz=rate_hz)
        return [self.filter(*at(course, place // update_samples)) for place in places]

    def cost(self, update_ms: float, *, single: bool) -> Cost:
        return predictor_cost(
            self.model.order,
            conditions=self.model.gains.size,
            update_samples=update_samples(update_ms, COST_RATE_HZ),
            single=single,
        )


@dataclass(frozen=True, eq=False)
class Shaped:
    """Noise shaped by FFT; a block's length is its update interval."""

    model: ShapedNoise
    block_s: float
    layers: int = -1

    @property
    def interval_ms(self) -> float:
        """From one block to the next at 5 kHz."""
        return 1e3 * block_samples(self.block_s, COST_RATE_HZ) / 2 / COST_RATE_HZ

    @property
    def numbers(self) -> int:
        return self.model.magnitudes.size

    def filter(self, speed_mm_s: float, force_n: float) -> SpectralFilter:
        return self.model.filter(speed_mm_s, force_n)

    def moving(
        self, hand: Hand, update_samples: int, *, places: Sequence[int], rate_hz: float
    ) -> list[SpectralFilter]:
        """Two blocks sound at a time; each is for where the hand should be in its middle."""
        half = self.model.block // 2
        return [self._overlapping(hand, place, half=half) for place in places]

    def _overlapping(self, hand: Hand, place: int, *, half: int) -> ShapedFilter:
        newer, into = divmod(place, half)
        share = np.sin(np.pi / 2 * (into + 0.5) / half) ** 2
        filters = [self._block(hand, block * half, half) for block in (newer - 1, newer)]
        power = [(1 - share) * filters[0].magnitude ** 2, share * filters[1].magnitude ** 2]
        return replace(filters[0], magnitude=np.sqrt(power[0] + power[1]))

    def _block(self, hand: Hand, start: int, half: int) -> ShapedFilter:
        last, now = (max(sample, 0) for sample in (start - half, start))
        speed, force = (2 * reading[now] - reading[last] for reading in hand)
        return self.model.filter(float(speed), float(force))

    def cost(self, update_ms: float, *, single: bool) -> Cost:
        return shaped_noise_cost(
            block_samples(self.block_s, COST_RATE_HZ), numbers=self.numbers, single=single
        )


@dataclass(frozen=True, eq=False)
class Itself:
    """The truth as the best possible method; its only error is late parameters."""

    truth: Truth
    rate_hz: float
    layers: int = -1
    numbers: int = 0

    def filter(self, speed_mm_s: float, force_n: float) -> SpectralFilter:
        return _TrueFilter(self.truth, speed_mm_s, force_n, self.rate_hz)

    def moving(
        self, hand: Hand, update_samples: int, *, places: Sequence[int], rate_hz: float
    ) -> list[SpectralFilter]:
        course = extrapolated(hand, update_samples, rate_hz=rate_hz)
        known = Hand(  # a surface is known on the usual grid
            np.clip(np.abs(course.speed_mm_s), *SPEEDS_MM_S[[0, -1]]),
            np.clip(course.force_n, *FORCES_N[[0, -1]]),
        )
        return [self.filter(*at(known, place // update_samples)) for place in places]

    def cost(self, update_ms: float, *, single: bool) -> None:
        return None


@dataclass(frozen=True, eq=False)
class _TrueFilter:
    truth: Truth
    speed_mm_s: float
    force_n: float
    rate_hz: float

    def response(self, frequency_hz: ArrayLike) -> Floats:
        return self.truth.magnitude(frequency_hz, speed_mm_s=self.speed_mm_s, force_n=self.force_n)


def extrapolated(hand: Hand, update_samples: int, *, rate_hz: float) -> Hand:
    """The hand in the middle of each update, as the renderer extrapolates it from readings."""
    plan = RenderPlan(rate_hz=rate_hz, update_samples=update_samples)
    readings = Hand(*(reading[::update_samples] for reading in hand))
    amid, _ = Extrapolator(plan, (SPEEDS_MM_S, FORCES_N))(readings)
    return amid


def at(hand: Hand, index: int) -> tuple[float, float]:
    """Speed without direction and force at one place."""
    return abs(float(hand.speed_mm_s[index])), float(hand.force_n[index])


def block_samples(block_s: float, rate_hz: float) -> int:
    """Length of an FFT block: the power of two next to so many seconds."""
    return int(2 ** np.rint(np.log2(block_s * rate_hz)))


# --- Operations, counted (tests/analysis/benches/test_counted_rivals.py counts them)

_CHUNK = 64  # samples that a stream keeps of its noise, as the kernel does
_EXTRAPOLATING = Operations(14, 6, 2, 0)
_READING = Operations(12, 5, 2, 0)  # the place in the grid, and one value of it
_BLENDED = Operations(6, 6, 0, 0)  # another value
_NOISE = Operations(1, 2, 0, 0)  # a number of noise


def predictor_cost(order: int, *, conditions: int, update_samples: int, single: bool) -> Cost:
    """An autoregressive filter of even order p ≥ 4 in direct form (`rivals.h`).

    An update turns p line spectral frequencies into coefficients; as often as not every sample, the
    hand is extrapolated as by the kernel.
    """
    p, real_bytes = order, 4 if single else 8
    update = Operations((p * p + 34 * p) // 2 + 12, (p * p + 78 * p) // 4 + 5, 2, 0)
    return Cost(
        per_sample=_sum((1, Operations(p, p + 1, 0, 0)), (1, _NOISE)),
        per_update=_sum((1, update), (int(update_samples > 1), _EXTRAPOLATING)),
        update_samples=update_samples,
        table_bytes=conditions * (p + 1) * real_bytes,
        state_bytes=(2 * p + 1 + _CHUNK) * real_bytes,
        bytes_per_sample=(2 * p + 3) * real_bytes,
        bytes_per_update=4 * (p + 1) * real_bytes,
    )


def shaped_noise_cost(block: int, *, numbers: int, single: bool) -> Cost:
    """Noise shaped by a real inverse FFT of n = 2^k samples every n/2 of them.

    The FFT by split radix: n/2·(3·log2 n − 5) + 4 sums and n/2·(log2 n − 3) + 2 products (Sorensen,
    Jones, Heideman and Burrus 1987, "Real-valued fast Fourier transform algorithms"). Everything is
    due when a block begins.
    """
    n, real_bytes = block, 4 if single else 8
    power = round(np.log2(n))
    transform = Operations(n // 2 * (3 * power - 5) + 4, n // 2 * (power - 3) + 2, 0, 0)
    shaping = Operations(n // 2, 2 * n, 0, 0)  # magnitudes, window, overlap
    return Cost(
        per_sample=Operations(0, 0, 0, 0),
        per_update=_sum(
            (1, _READING),
            (n // 2, _BLENDED),
            (n, _NOISE),
            (1, transform),
            (1, shaping),
            (1, _EXTRAPOLATING),
        ),
        update_samples=n // 2,
        table_bytes=numbers * real_bytes,
        state_bytes=2 * n * real_bytes,
        bytes_per_sample=0,
        bytes_per_update=(4 * (n // 2 + 1) + 4 * n) * real_bytes,
    )


def _sum(*parts: tuple[int, Operations]) -> Operations:
    return Operations(
        *(
            sum(times * getattr(of, name) for times, of in parts)
            for name in ("additions", "multiplications", "divisions", "square_roots")
        )
    )
