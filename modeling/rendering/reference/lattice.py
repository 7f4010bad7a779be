"""The all-pole rival's filter, in Python."""

from __future__ import annotations

from typing import Any

import numpy as np

from tactileq.modeling.hand import Hand
from tactileq.modeling.models.ar_model import ARModel
from tactileq.modeling.models.line_spectral import prediction_coefficients, reflection_coefficients
from tactileq.modeling.rendering.noise import white_noise
from tactileq.modeling.rendering.plan import RenderPlan
from tactileq.modeling.rendering.reference.hand import GainRamps

# Rounding must not put a pole on the unit circle.
_HIGHEST_REFLECTION = 1 - 1e-12


class LatticeFilter:
    """An all-pole filter as a normalised lattice (Gray and Markel 1975), at the model's rate.

    Every stage turns (its input, its state) by an angle, so with white noise of unit variance all
    states and the unscaled output have unit variance too; the gain is applied after it. A direct
    form, stable as each of its filters is, can grow without bound when they change.
    """

    def __init__(self, model: ARModel, plan: RenderPlan) -> None:
        self.clamped = 0
        self._model = model
        self.axes = (model.speeds_mm_s, model.forces_n)
        self._state = [0.0] * model.order
        self._stages = [(0.0, 1.0)] * model.order
        self._gain = GainRamps(plan.own, np.array([model.rendered_gains.max()]))

    def settings(self, amid: Hand, end: Hand) -> list[Any]:
        """Gain, RMS per gain, and sine and cosine of every stage from the highest order down."""
        middle, last = self._model.parameters(*amid), self._model.parameters(*end)
        sine = reflection_coefficients(prediction_coefficients(middle.line_spectral_frequencies))
        sine = np.nan_to_num(np.clip(sine, -_HIGHEST_REFLECTION, _HIGHEST_REFLECTION))
        cosine = np.sqrt((1 - sine) * (1 + sine))
        rms = 1 / cosine.prod(axis=-1)
        table = np.stack([sine, cosine], axis=-1)[:, ::-1]
        stages = [[tuple(stage) for stage in update] for update in table.tolist()]
        return list(zip(last.gain.tolist(), rms.tolist(), stages, strict=True))

    def update(self, setting: Any) -> None:
        """Put angles into force, and start the ramp of the gain."""
        gain, rms, self._stages = setting
        self._gain.update([gain], [rms])

    def inputs(self, key: np.uint64, start: int, *, count: int) -> tuple[list[float], ...]:
        """The next noise, of unit variance."""
        return (white_noise(key, start, count).tolist(),)

    def filter(self, *inputs: list[float]) -> list[float]:
        """The lattice with the angles in force."""
        state, output = self._state, []
        highest = len(self._stages) - 1
        levels = self._gain.course(0, len(inputs[0]))
        for forward, level in zip(inputs[0], levels, strict=True):
            for stage, (sine, cosine) in enumerate(self._stages):
                held = state[highest - stage]
                backward = sine * forward + cosine * held
                forward = cosine * forward - sine * held
                if stage:
                    state[highest - stage + 1] = backward
            state[0] = forward
            output.append(level * forward)
        return output
