"""What the chart needs from a fitted method: filters at rest and in motion, numbers, cost."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from tactileq.analysis.textures.between import Truth
from tactileq.benches.chart.rival_costs import COST_RATE_HZ
from tactileq.benches.rendering.accuracy import rendered_parameters
from tactileq.benches.rendering.levels import levels_in_motion, louder_by, systems_of_layers
from tactileq.modeling import RegressedModel, Renderer, TextureModel
from tactileq.modeling.arrays import Floats
from tactileq.modeling.hand import Hand
from tactileq.modeling.models.parameter_table import Parameters
from tactileq.modeling.models.texture_model import BLENDINGS, first_peq
from tactileq.modeling.rendering.cost import Cost
from tactileq.modeling.rendering.plan import RenderPlan
from tactileq.modeling.rendering.reference.hand import Extrapolator
from tactileq.modeling.scenes.cost import stored_numbers
from tactileq.modeling.similarity import SpectralFilter
from tactileq.stimuli.planted.textures import FORCES_N, SPEEDS_MM_S


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
        """The filters in force at some rising samples of a moving hand.

        Each with the level that is really rendered there, which the states have left by earlier
        coefficients; its spectrum is that of the coefficients of the moment.
        """

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
        until = Parameters(*(part[: places[-1] + 1] for part in course))
        systems = systems_of_layers(until, rate_hz=rate_hz)
        levels = levels_in_motion(systems, samples=1)
        filters = list[SpectralFilter]()
        for place in places:
            peq = first_peq(Parameters(*(part[[place]] for part in course)), rate_hz=rate_hz)
            factor = louder_by(levels[place], systems[place])
            filters.append(
                replace(peq, noise_gain=peq.noise_gain * factor, gains=peq.gains * factor)
            )
        return filters

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
    return _extrapolated(hand, update_samples, rate_hz=rate_hz)[0]


def extrapolated_to_ends(hand: Hand, update_samples: int, *, rate_hz: float) -> Hand:
    """The same at the last sample of each update."""
    return _extrapolated(hand, update_samples, rate_hz=rate_hz)[1]


def _extrapolated(hand: Hand, update_samples: int, *, rate_hz: float) -> tuple[Hand, Hand]:
    plan = RenderPlan(rate_hz=rate_hz, update_samples=update_samples)
    readings = Hand(*(reading[::update_samples] for reading in hand))
    return Extrapolator(plan, (SPEEDS_MM_S, FORCES_N))(readings)


def at(hand: Hand, index: int) -> tuple[float, float]:
    """Speed without direction and force at one place."""
    return abs(float(hand.speed_mm_s[index])), float(hand.force_n[index])
