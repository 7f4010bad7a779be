"""A rig in silico, in the same process: a hand strokes, what it touches is rendered.

Everything it reports is marked `simulated`. Its time is its own: each reading moves it on by 10 ms,
so that tests and simulated studies do not wait.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from modeling import InputError, Renderer, TextureModel
from modeling.arrays import Floats
from modeling.errors import shown
from modeling.hand import Hand
from modeling.models.loading import Layered
from rig.interface import RigReading

STEP_S = 0.01
STROKE_HZ = 1.0
PEAK_SPEED_MM_S = 250.0
MEAN_FORCE_N = 1.5
FORCE_SWING_N = 0.5


class SimulatedRig:
    """In-process twin of the rig; implements `rig.interface.TextureRig`.

    The hand strokes to and fro, 1 Hz, up to 250 mm/s, with 1 to 2 N.

    Parameters
    ----------
    real : mapping of texture name to TextureModel, optional
        The truth that stands for the real surfaces; without it they are still.
    seed : int
        Seed of the vibration's noise.
    """

    def __init__(self, real: Mapping[str, TextureModel] | None = None, *, seed: int = 0) -> None:
        self._real = dict(real or {})
        self._seed = seed
        self._presentations = 0
        self._presented: Layered | None = None
        self._renderer: Renderer | None = (
            None  # made when the hand first moves on what is presented
        )
        self._steps = 0
        self._button = False
        self._last_vibration = np.zeros(0)

    @property
    def simulated(self) -> bool:
        """Always True."""
        return True

    @property
    def last_vibration(self) -> Floats:
        """What the hand felt during the last reading's 10 ms, in g at the model's rate."""
        return self._last_vibration

    def present_model(self, model: Layered) -> None:
        """Render this model under the hand, with fresh noise."""
        self._presentations += 1
        self._presented, self._renderer = model, None

    def present_real(self, texture: str) -> None:
        """Let the hand feel the truth that stands for this texture.

        Raises
        ------
        InputError
            Where truths were given, but none for this texture.
        """
        if not self._real:
            self.silence()
            return
        if texture not in self._real:
            raise InputError(
                f"expected a mounted sample among {', '.join(self._real)}, got {shown(texture)}; "
                "give the twin its truth."
            )
        self.present_model(self._real[texture])

    def silence(self) -> None:
        """Stop all vibration."""
        self._presented = None

    def press_button(self) -> None:
        """Press the button; the next reading reports it once."""
        self._button = True

    def read(self) -> RigReading:
        """Move the hand on by 10 ms and report where it is."""
        self._steps += 1
        time_s = self._steps * STEP_S
        speed, force = _hand(np.array([time_s]))
        self._last_vibration = self._felt(time_s)
        pressed, self._button = self._button, False
        return RigReading(time_s, abs(float(speed[0])), float(force[0]), pressed, simulated=True)

    def _felt(self, time_s: float) -> Floats:
        if self._presented is None:
            return np.zeros(0)
        if self._renderer is None:
            self._renderer = Renderer(self._presented, seed=self._seed, stream=self._presentations)
        samples = round(STEP_S * self._renderer.rate_hz)
        moments = time_s - STEP_S + np.arange(1, samples + 1) / self._renderer.rate_hz
        return self._renderer.render(*_hand(moments))


def _hand(time_s: Floats) -> Hand:
    """The stroking hand at (n,) moments; the sign of its speed is the direction."""
    phase = 2 * np.pi * STROKE_HZ * time_s
    return Hand(PEAK_SPEED_MM_S * np.sin(phase), MEAN_FORCE_N + FORCE_SWING_N * np.cos(phase))
