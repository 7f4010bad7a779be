"""A rig in silico, in the same process: a hand strokes, what it touches is rendered.

Everything it reports is marked `simulated`. Its time is its own: each reading moves it on by 10 ms,
so that tests and simulated studies do not wait.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from math import inf

import numpy as np

from tactileq.modeling import InputError, Renderer, TextureModel
from tactileq.modeling.arrays import Floats
from tactileq.modeling.errors import shown
from tactileq.modeling.hand import Hand
from tactileq.modeling.models.loading import AnyModel
from tactileq.modeling.rendering.plan import RenderCounters
from tactileq.rig.devices.sound.signals import tone_burst
from tactileq.rig.shared.interface import (
    SURFACES,
    Acceleration,
    Fault,
    HandRows,
    PresentationRecord,
    RigHealth,
    RigReading,
    Stimulus,
    Surface,
    ToneBurst,
    grid_of,
)

STEP_S = 0.01
ROW_S = 0.002  # of the history
STROKE_HZ = 1.0
PEAK_SPEED_MM_S = 250.0
MEAN_FORCE_N = 1.5
FORCE_SWING_N = 0.5
SIGNAL_RATE_HZ = 5000.0
HIGHEST_SIGNAL_G = 5.0
_PER_STEP = round(STEP_S * SIGNAL_RATE_HZ)


class SimulatedRig:
    """In-process twin of the rig; implements `tactileq.rig.shared.interface.TextureRig`.

    The hand strokes back and forth, 1 Hz, up to 250 mm/s, with 1 to 2 N.

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
        self._streams = 0
        self._presented: AnyModel | None = None
        self._stimulus: Stimulus | None = None
        self._stimulus_from_s = 0.0
        self._renderer: Renderer | None = (
            None  # made when the hand first moves on what is presented
        )
        self._steps = 0
        self._button = False
        self._last_vibration = np.zeros(0)
        self._presentations = 0
        self._now: PresentationRecord | None = None
        self._ended: list[PresentationRecord] = []
        self._rows: list[HandRows] = []
        self._faults: list[Fault] = []

    @property
    def simulated(self) -> bool:
        """Always True."""
        return True

    @property
    def stated(self) -> Mapping[str, object]:
        """Nothing: a twin has no file."""
        return {}

    @property
    def highest_exposure_m_s2(self) -> float:
        """Infinite: nobody is exposed."""
        return inf

    def open(self) -> None:
        """Forget what was presented before; clock, presentations and the stroke restart."""
        self.silence()
        self._steps = self._presentations = 0
        self._ended, self._rows, self._faults = [], [], []

    def close(self) -> None:
        """Fall silent."""
        self.silence()

    def arm(self) -> None:
        """Nothing: it does not push."""

    def now_s(self) -> float:
        """How far the readings have moved the hand on."""
        return self._steps * STEP_S

    def health(self) -> RigHealth:
        """All is well."""
        return RigHealth()

    def break_down(self, sentence: str) -> None:
        """Let a fault happen that makes the trial invalid."""
        self._faults.append(Fault(self.now_s(), sentence, invalidates=True))

    def take_faults(self) -> tuple[Fault, ...]:
        """What `break_down` was given since the last call."""
        taken, self._faults = tuple(self._faults), []
        return taken

    def take_history(self) -> HandRows:
        """The hand since the last call, 500 rows a second of its own time."""
        taken, self._rows = HandRows.joined(self._rows), []
        return taken

    def take_presentations(self) -> tuple[PresentationRecord, ...]:
        """The presentations that ended since the last call."""
        taken, self._ended = tuple(self._ended), []
        return taken

    def take_acceleration(self) -> tuple[Acceleration, ...]:
        """Nothing: a twin has no accelerometer."""
        return ()

    @property
    def last_vibration(self) -> Floats:
        """What the hand felt during the last reading's 10 ms, in g at the model's rate."""
        return self._last_vibration

    def present_model(self, model: AnyModel) -> float:
        """Render this model under the hand, with fresh noise."""
        self._begin("virtual", model.texture, model)
        assert self._now is not None
        speeds, forces = grid_of(model)
        self._now = replace(
            self._now, model_sha256=model.sha256, speeds_mm_s=speeds, forces_n=forces
        )
        return self.now_s()

    def present_signal(self, signal: ToneBurst | Stimulus) -> float:
        """Let the hand feel a signal: a burst at once and to its end, a stimulus as it moves on.

        Raises
        ------
        InputError
            Above 5 g; of a stimulus that is compensated for a vibrator.
        """
        if isinstance(signal, Stimulus):
            self.check_stimulus(signal)
            self._begin("virtual", signal.texture, None)
            assert self._now is not None
            self._now = replace(self._now, model_sha256=signal.sha256)
            self._stimulus, self._stimulus_from_s = signal, self.now_s()
            return self.now_s()
        _check_amplitude(signal.amplitude_g)
        made = tone_burst(
            signal.frequency_hz,
            signal.amplitude_g,
            duration_s=signal.duration_s,
            rate_hz=SIGNAL_RATE_HZ,
        )
        self._begin("virtual", f"{signal.frequency_hz:g} Hz", None)
        start_s = self.now_s()
        for part in np.split(made.samples_g, range(_PER_STEP, made.samples_g.size, _PER_STEP)):
            self._move_on()
            self._last_vibration = part
            self._log(part, SIGNAL_RATE_HZ)
        return start_s

    def check_stimulus(self, stimulus: Stimulus) -> None:
        """Refuse a stimulus that this rig cannot present.

        Raises
        ------
        InputError
            Above 5 g; where it is compensated for a vibrator, of which a twin has none.
        """
        _check_amplitude(float(np.abs(stimulus.samples_g).max(initial=0.0)))
        if stimulus.vibrator_sha256 is not None:
            raise InputError(
                "expected a stimulus without compensation at the simulated rig, which has no "
                f"vibrator, got one of {stimulus.texture} that drives one; make the set without."
            )

    def strongest_g(self, burst: ToneBurst) -> float:
        """5 g, whatever the frequency."""
        return HIGHEST_SIGNAL_G

    def present_real(self, texture: str) -> float:
        """Let the hand feel the truth that stands for this texture.

        Raises
        ------
        InputError
            If truths were given, but none for this texture.
        """
        if self._real and texture not in self._real:
            raise InputError(
                f"expected a mounted sample among {', '.join(self._real)}, got {shown(texture)}; "
                "give the twin its truth."
            )
        self._begin("real", texture, self._real.get(texture))
        return self.now_s()

    def _begin(self, surface: Surface, texture: str, felt: AnyModel | None) -> None:
        self.silence()
        self._presentations += 1
        self._streams += felt is not None
        self._presented, self._renderer = felt, None
        now_s = self.now_s()
        self._now = PresentationRecord(
            number=self._presentations, surface=surface, texture=texture, start_s=now_s, end_s=now_s
        )

    def silence(self) -> None:
        """Stop all vibration."""
        if self._now is not None:
            self._ended.append(replace(self._now, end_s=self.now_s()))
        self._presented = self._now = self._stimulus = None

    def press_button(self) -> None:
        """Press the button; the next reading reports it once."""
        self._button = True

    def read(self) -> RigReading:
        """Move the hand on by 10 ms and report where it is."""
        self._move_on()
        time_s = self.now_s()
        speed, force = _hand(np.array([time_s]))
        self._last_vibration = self._felt(time_s)
        if self._renderer is not None:
            self._log(self._last_vibration, self._renderer.rate_hz)
        elif self._stimulus is not None:
            self._log(self._last_vibration, self._stimulus.rate_hz)
        pressed, self._button = self._button, False
        return RigReading(time_s, abs(float(speed[0])), float(force[0]), pressed, simulated=True)

    def _move_on(self) -> None:
        """Move the hand on by 10 ms."""
        self._rows.append(self._history())
        self._steps += 1

    def _history(self) -> HandRows:
        """The rows of the next 10 ms."""
        count = round(STEP_S / ROW_S)
        time_s = self.now_s() + ROW_S * np.arange(1, count + 1, dtype=np.float64)
        speed, force = _hand(time_s)
        surface = "none" if self._now is None else self._now.surface
        number = 0 if self._now is None else self._now.number
        return HandRows(
            time_s=time_s,
            speed_mm_s=speed,
            force_n=force,
            surface=np.full(count, SURFACES.index(surface)),
            presentation=np.full(count, number),
            force_assumed=np.zeros(count, dtype=bool),
        )

    def _felt(self, time_s: float) -> Floats:
        if self._stimulus is not None:
            since_s = time_s - self._stimulus_from_s
            end = round(since_s * self._stimulus.rate_hz)
            begin = round((since_s - STEP_S) * self._stimulus.rate_hz)
            return self._stimulus.samples_g[begin:end]
        if self._presented is None:
            return np.zeros(0)
        if self._renderer is None:
            self._renderer = Renderer(self._presented, seed=self._seed, stream=self._streams)
        samples = round(STEP_S * self._renderer.rate_hz)
        moments = time_s - STEP_S + np.arange(1, samples + 1) / self._renderer.rate_hz
        return self._renderer.render(*_hand(moments))

    def _log(self, vibration: Floats, rate_hz: float) -> None:
        """Add what the hand felt of a virtual surface to the record of its presentation."""
        if self._now is None or self._now.surface != "virtual":
            return
        counters = RenderCounters() if self._renderer is None else replace(self._renderer.counters)
        self._now = replace(
            self._now,
            counters=counters,
            played_s=self._now.played_s + vibration.size / rate_hz,
            dose_g2_s=self._now.dose_g2_s + float(vibration @ vibration) / rate_hz,
            peak_g=max(self._now.peak_g, float(np.abs(vibration).max(initial=0.0))),
        )


def _check_amplitude(amplitude_g: float) -> None:
    if not amplitude_g <= HIGHEST_SIGNAL_G:
        raise InputError(
            f"expected a signal of at most {HIGHEST_SIGNAL_G:g} g, got {amplitude_g:g} g; lower it."
        )


def _hand(time_s: Floats) -> Hand:
    """The stroking hand at (n,) moments; the sign of its speed is the direction."""
    phase = 2 * np.pi * STROKE_HZ * time_s
    return Hand(PEAK_SPEED_MM_S * np.sin(phase), MEAN_FORCE_N + FORCE_SWING_N * np.cos(phase))
