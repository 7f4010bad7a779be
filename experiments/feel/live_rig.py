"""A rig for visitors, of the parts that a desk rig is made of: hand, sound, shared memory."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable

import numpy as np

from tactileq.experiments.feel.rigs import NO_HAND, HandNow, OutputNow
from tactileq.modeling import InputError
from tactileq.modeling.models.loading import Layered
from tactileq.modeling.rendering.plan import RenderCounters
from tactileq.rig.devices.hand.reader import HandReader
from tactileq.rig.devices.sound.supervision import SoundLost
from tactileq.rig.devices.sound.vibration import VibrationOutput
from tactileq.rig.machines.force.hand import ForceHand
from tactileq.rig.machines.force.wall import Wall
from tactileq.rig.shared.live.clock import now_s
from tactileq.rig.shared.live.memory import CONTACT, FORCE_ASSUMED, GONE, OLDEST_READING_S, Live

LEVEL_S = 0.25
MASKING_LEVEL = 0.1  # RMS, share of full scale
_LIMITS = {"peak": "limited_peak", "RMS": "limited_rms", "duration": "limited_duration"}


class LiveRig:
    """Hand and sound of a rig, both open, as `tactileq.experiments.feel.rigs.FeltRig` wants them.

    Parameters
    ----------
    sound : VibrationOutput, optional
        Without it nothing is played.
    pointed : bool
        Whether the window's pointer is the hand (kind "window").
    notes : iterable of str
        What of the rig is simulated, assumed or missing.
    masking_level : float
        RMS of the noise, share of full scale.
    wall : Wall, optional
        What a force device renders under all of them.
    """

    def __init__(
        self,
        live: Live,
        hand: HandReader,
        sound: VibrationOutput | None,
        *,
        pointed: bool,
        notes: Iterable[str],
        masking_level: float = MASKING_LEVEL,
        wall: Wall | None = None,
    ) -> None:
        self._live, self._hand, self._sound = live, hand, sound
        self._pointed, self._masking_level = pointed, masking_level
        self._notes = tuple(notes)
        self._wall = wall
        self._faults: list[str] = []
        self._model: Layered | None = None
        self._seen = live.blocks_written
        self._played: deque[tuple[float, float, int, float]] = deque()
        self._counters = RenderCounters()

    @property
    def notes(self) -> tuple[str, ...]:
        """What of it is simulated, assumed or missing."""
        return self._notes

    def present_model(self, model: Layered) -> None:
        """Render this model under the hand; `take_faults` reports a fault."""
        self._counters = RenderCounters()
        self._model = model
        if self._sound is None:
            return
        try:
            self._sound.play(model)
            if isinstance(self._hand, ForceHand) and self._wall is not None:
                self._hand.show(self._wall)
        except (SoundLost, InputError) as fault:
            self._faults.append(str(fault))

    def arm(self) -> None:
        """Let a force device push; `take_faults` reports a fault."""
        if isinstance(self._hand, ForceHand):
            try:
                self._hand.arm()
            except InputError as fault:
                self._faults.append(str(fault))

    def silence(self) -> None:
        """Render nothing."""
        self._model = None
        if isinstance(self._hand, ForceHand):
            self._hand.hide()
        if self._sound is not None:
            self._sound.silence()

    def mask(self, on: bool) -> None:
        """Masking noise on or off; `take_faults` reports a fault."""
        if self._sound is None:
            return
        try:
            self._sound.masking(self._masking_level if on else 0.0)
        except (SoundLost, InputError) as fault:
            self._faults.append(str(fault))

    def point(self, x: float, y: float, *, inside: bool) -> None:
        """Move the hand by the window's pointer, where that is the hand."""
        if self._pointed:
            self._hand.push(x, y, down=inside)

    def hand(self) -> HandNow:
        """The latest reading."""
        reading = self._live.latest()
        if (
            reading is None
            or reading["flags"] & GONE
            or now_s() - reading["time_s"] > OLDEST_READING_S
        ):
            return NO_HAND
        touches = bool(reading["flags"] & CONTACT)
        return HandNow(
            speed_mm_s=float(reading["speed_mm_s"]),
            force_n=float(reading["force_n"]) if touches else 0.0,
            force_assumed=bool(reading["flags"] & FORCE_ASSUMED),
            depth_mm=float(reading["depth_mm"]),
        )

    def output(self) -> OutputNow | None:
        """Level of the last quarter of a second, limits, misses and latency."""
        if self._sound is None:
            return None
        self._seen, rows = self._live.blocks_since(self._seen)
        self._played.extend(
            zip(
                rows["time_s"].tolist(),
                rows["square_sum_g2"].tolist(),
                rows["frames"].tolist(),
                rows["peak_g"].tolist(),
                strict=True,
            )
        )
        oldest_s = now_s() - LEVEL_S
        while self._played and self._played[0][0] < oldest_s:
            self._played.popleft()
        _, squares, frames, peaks = zip(*self._played, strict=True) if self._played else [()] * 4
        return OutputNow(
            rms_g=float(np.sqrt(sum(squares) / max(sum(frames), 1))),
            peak_g=max(peaks, default=0.0),
            limits=self._touched(),
            misses=self._sound.misses,
            latency_s=self._sound.latency_s,
        )

    def _touched(self) -> tuple[str, ...]:
        """Limits that more samples touched than when this was last asked."""
        assert self._sound is not None
        counted = self._sound.counted()
        if counted is None:
            return ()
        before, self._counters = self._counters, counted.counters
        return tuple(
            name
            for name, field in _LIMITS.items()
            if getattr(self._counters, field) > getattr(before, field)
        )

    @property
    def halted(self) -> bool:
        """Whether what was presented last was halted, since nobody took the faults for a second."""
        return self._sound is not None and self._sound.halted

    def take_faults(self) -> tuple[str, ...]:
        """What went wrong since the last call; where the sound was lost another process plays on.

        Raises
        ------
        SoundLost, InputError
            If nothing can be played any more.
        """
        own, self._faults = tuple(self._faults), []
        sound = () if self._sound is None else self._sound.faults()
        if self.halted:
            self._model = None
        if self._sound is not None and self._sound.pid is None:
            self._counters = RenderCounters()
            self._sound.open() if self._model is None else self._sound.play(self._model)
        return (*own, *sound, *self._hand.faults())
