"""The desk rig: a sound card that plays, a device that reads the hand, as one `TextureRig`.

docs/rig-file.md
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import asdict, dataclass, replace
from datetime import date
from math import inf, isfinite
from typing import Any

import numpy as np

from tactileq.modeling import InputError
from tactileq.modeling.arrays import Floats
from tactileq.modeling.models.loading import AnyModel
from tactileq.modeling.rendering.plan import RenderCounters
from tactileq.rig.desk.checks import Requirements, check_rig
from tactileq.rig.desk.journal import Journal
from tactileq.rig.desk.lock import rig_locked
from tactileq.rig.desk.parts import hand_reader, vibration_output
from tactileq.rig.desk.pen import Pen
from tactileq.rig.desk.stimuli import check_made_for, check_stimulus
from tactileq.rig.desk.walls import Walls, usual_wall
from tactileq.rig.devices.hand.reader import HandReader
from tactileq.rig.devices.sound.signals import tone_burst
from tactileq.rig.devices.sound.supervision import SoundLost
from tactileq.rig.devices.sound.vibration import Presented, VibrationOutput
from tactileq.rig.machines.force.hand import ForceHand
from tactileq.rig.machines.force.states import State
from tactileq.rig.shared.interface import (
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
from tactileq.rig.shared.live.clock import now_s, sleep
from tactileq.rig.shared.live.memory import GONE, OLDEST_READING_S, Live
from tactileq.rig.shared.setup.rig_file import RigFile

FIRST_READING_S = 5.0
LOOK_S = 0.1  # interval of checks while waiting for a burst


@dataclass(frozen=True)
class RigParts:
    """What an open rig consists of."""

    live: Live
    sound: VibrationOutput
    reader: HandReader
    journal: Journal
    pen: Pen | None


class DeskRig:
    """A rig of parts on a desk; implements `tactileq.rig.shared.interface.TextureRig`.

    What fails while it is open is reported by `take_faults`, and what was lost is started again by
    what is presented next. `read` and `take_faults` are the heartbeat: see `TextureRig`.

    Parameters
    ----------
    requirements : Requirements, optional
        Those of the study; without them neither the calibration's age nor the hand is checked.
    override : str, optional
        Reason to use it although its latency is too long, or a wall too stiff to be passive.
    seed : int
        Of all noise.
    walls : Walls, optional
        Of a force device: rendered under the virtual surfaces. Without it a wall as stiff as the
        real surface.

    Raises
    ------
    InputError
        As `check_rig`.
    """

    def __init__(
        self,
        rig_file: RigFile,
        *,
        requirements: Requirements | None = None,
        override: str | None = None,
        seed: int = 0,
        walls: Walls | None = None,
    ) -> None:
        if rig_file.force_device is not None and walls is None:
            walls = Walls(usual=usual_wall(rig_file))
        check_rig(rig_file, requirements, today=date.today(), override=override, walls=walls)
        self._walls = walls
        self._file = rig_file
        self._override = override
        self._seed = seed
        self._stack = ExitStack()
        self._open: RigParts | None = None
        self._opened_s = 0.0
        self._presentations = 0
        self._now: PresentationRecord | None = None
        self._signal_end_s = 0.0
        self._playing = 0  # the card's own number of what is presented now
        self._ended: list[PresentationRecord] = []
        self._faults: list[Fault] = []
        self._lost = 0
        self._pen_lost = False

    # --- Open and close ---------------------------------------------------------------------

    @property
    def simulated(self) -> bool:
        """Whether the hand is scripted, or the card declared to be none."""
        return self._file.simulated

    @property
    def highest_exposure_m_s2(self) -> float:
        """That of [limits] in its file."""
        return self._file.highest_exposure_m_s2

    @property
    def parts(self) -> RigParts:
        """What it consists of while it is open, for those who show it live."""
        if self._open is None:
            raise RuntimeError("the rig is closed")
        return self._open

    @property
    def stated(self) -> Mapping[str, object]:
        """Its file and hash, what is assumed, what was overridden, and what was found."""
        rig = self._file
        found: dict[str, object] = {}
        if self._open is not None:
            found = {
                "HandDevice": self._open.reader.device_name,
                "HandFirmware": self._open.reader.firmware() or "n/a",
                "OutputLatencyS": self._open.sound.latency_s,
            }
        return {
            "Name": rig.rig.name,
            "SHA256": rig.sha256,
            "Override": self._override or "n/a",
            **found,
            **self._stated_walls(),
            "Assumed": {name: figure.to_dict() for name, figure in rig.assumed()},
            "File": rig.to_dict(),
        }

    def _stated_walls(self) -> dict[str, object]:
        """The walls of a force device, whose force is commanded, not sensed."""
        if self._walls is None:
            return {}
        return {
            "Force": "commanded",
            "Walls": {name: asdict(wall) for name, wall in self._walls.named().items()},
        }

    def open(self) -> None:
        """Lock the rig, and start what plays and reads.

        Raises
        ------
        InputError
            If another process uses it, or a part is not there or does not do what the rig file
            says.
        """
        with ExitStack() as stack:
            stack.enter_context(rig_locked(self._file.rig.name))
            live = stack.enter_context(Live.create())
            reader = hand_reader(self._file, live, seed=self._seed)
            sound = vibration_output(self._file, live, hand=reader, seed=self._seed)
            stack.enter_context(reader)
            _wait_for_reading(live)
            stack.callback(sound.close)
            try:
                sound.open()
                sound.masking(self._file.sound.masking_level)
            except SoundLost as lost:
                raise InputError(str(lost)) from None
            self._opened_s = now_s()
            journal = Journal(
                live,
                opened_s=self._opened_s,
                rate_hz=self._file.output_rate_hz,
                real_measured=self._file.real_surface.hand_measured,
            )
            stack.enter_context(journal)
            pen = None
            if self._file.accelerometer is not None:
                pen = stack.enter_context(Pen(self._file.accelerometer))
            self._open = RigParts(live, sound, reader, journal, pen)
            self._stack = stack.pop_all()
        self._presentations, self._lost, self._pen_lost = 0, 0, False
        self._ended, self._faults = [], []

    def close(self) -> None:
        """Fall silent, end both processes and let others use the rig."""
        if self._open is not None:
            try:
                self.silence()
            finally:
                self._open = None
                self._stack.close()

    def __enter__(self) -> DeskRig:
        self.open()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def now_s(self) -> float:
        """Since it was opened."""
        return now_s() - self._opened_s

    # --- Presentations ----------------------------------------------------------------------

    def present_model(self, model: AnyModel) -> float:
        """Render this model under the hand; returns when its first sample has left.

        Where nothing plays any more, that is a fault, and the time is now.

        Raises
        ------
        InputError
            For one of a higher rate than the card's, or an AR model that `lattice_fields` refuses.
        """
        self.silence()
        sound = self.parts.sound
        start_s = self._started(lambda: sound.play(model))
        self._show_wall(model.texture)
        speeds, forces = grid_of(model)
        return self._begin(
            "virtual",
            model.texture,
            start_s=start_s,
            model_sha256=model.sha256,
            speeds_mm_s=speeds,
            forces_n=forces,
        )

    def present_signal(self, signal: ToneBurst | Stimulus) -> float:
        """Play a signal once; returns when its first sample has left.

        A burst, compensated, after one that still plays; a stimulus at once. Where nothing plays
        any more, that is a fault.

        Raises
        ------
        InputError
            For a signal beyond the limits; of a stimulus also one that `check_stimulus` refuses.
        """
        if isinstance(signal, Stimulus):
            return self._present_stimulus(signal)
        while (left_s := self._signal_end_s - now_s()) > 0:
            self._notice()
            sleep(min(left_s, LOOK_S))
        self.silence()
        sound, samples = self.parts.sound, self._samples(signal)
        start_s = self._started(lambda: sound.play_signal(samples))
        self._signal_end_s = start_s + signal.duration_s
        return self._begin("virtual", f"{signal.frequency_hz:g} Hz", start_s=start_s)

    def check_stimulus(self, stimulus: Stimulus) -> None:
        """Refuse a stimulus at another rate or for another vibrator than this rig's, or too strong.

        Raises
        ------
        InputError
        """
        check_stimulus(self._file, stimulus)

    def _present_stimulus(self, stimulus: Stimulus) -> float:
        self.silence()
        check_made_for(self._file, stimulus, f"the stimulus of {stimulus.texture}")
        sound, compensated = self.parts.sound, stimulus.vibrator_sha256 is not None
        start_s = self._started(
            lambda: sound.play_signal(stimulus.samples_g, compensated=compensated)
        )
        self._signal_end_s = 0.0
        return self._begin(
            "virtual", stimulus.texture, start_s=start_s, model_sha256=stimulus.sha256
        )

    def strongest_g(self, burst: ToneBurst) -> float:
        """The highest amplitude of such a burst within the limits, compensation included."""
        return self.parts.sound.largest_factor(self._samples(replace(burst, amplitude_g=1.0)))

    def _samples(self, burst: ToneBurst) -> Floats:
        made = tone_burst(
            burst.frequency_hz,
            burst.amplitude_g,
            duration_s=burst.duration_s,
            rate_hz=self._file.output_rate_hz,
        )
        return made.samples_g

    def _started(self, play: Callable[[], Presented]) -> float:
        """Play, and say when the first sample left; a fault where nothing plays any more."""
        try:
            presented = play()
            self._playing = presented.presentation
            return presented.time_s
        except SoundLost as lost:
            self._playing = 0
            self._fail(str(lost))
            return now_s()

    @property
    def _device(self) -> ForceHand | None:
        """What pushes; None of a rig without a force device."""
        reader = self.parts.reader
        return reader if isinstance(reader, ForceHand) else None

    def arm(self) -> None:
        """Let the force device push; a fault where it has one still."""
        if (device := self._device) is not None:
            self._try(device.arm)

    def _show_wall(self, texture: str) -> None:
        """Render the wall under a virtual surface; a fault where the device is not armed."""
        device, walls = self._device, self._walls
        if device is not None and walls is not None:
            self._try(lambda: device.show(walls.of(texture)))

    def _try(self, push: Callable[[], None]) -> None:
        try:
            push()
        except InputError as fault:
            self._fail(str(fault))

    def present_real(self, texture: str) -> float:
        """Fall silent, so that only the real surface is felt; returns since when."""
        self.silence()
        self._playing = 0
        return self._begin("real", texture, start_s=now_s())

    def _begin(self, surface: Surface, texture: str, *, start_s: float, **of: Any) -> float:
        self._presentations += 1
        own_s = start_s - self._opened_s
        self._now = PresentationRecord(
            number=self._presentations,
            surface=surface,
            texture=texture,
            start_s=own_s,
            end_s=own_s,
            **of,
        )
        if self.parts.pen is not None:
            self.parts.pen.begin(start_s)
        self.parts.journal.begin(surface, self._presentations, start_s=start_s)
        return own_s

    def silence(self) -> None:
        """Fade to silence; returns when it has left. What was presented has ended.

        The wall of a force device ramps out.
        """
        if (device := self._device) is not None:
            device.hide()
        counted = self.parts.sound.silence()
        self._notice()
        if self._now is None:
            return
        if self.parts.pen is not None:
            self.parts.pen.end()
        journal = self.parts.journal
        played = journal.take_played(self._playing)
        end_s = played.end_s if isfinite(played.end_s) else now_s()
        journal.end(end_s)
        self._ended.append(
            replace(
                self._now,
                end_s=end_s - self._opened_s,
                counters=counted.counters if counted and self._playing else RenderCounters(),
                played_s=played.frames / self._file.output_rate_hz,
                dose_g2_s=played.square_sum_g2 / self._file.output_rate_hz,
                weighted_dose_g2_s=played.weighted_square_sum_g2 / self._file.output_rate_hz,
                peak_g=played.peak_g,
                misses=played.misses,
                stale_blocks=played.stale,
            )
        )
        self._now = None
        if played.stale:
            self._fail(
                f"expected a reading of the hand within {OLDEST_READING_S * 1e3:g} ms, got none in "
                f"{played.stale} blocks, in which nothing was felt; check what reads the hand."
            )

    # --- What it reports --------------------------------------------------------------------

    def read(self) -> RigReading:
        """The hand as it is now; at rest in the air where nothing is read."""
        parts = self.parts
        self._notice()
        latest = parts.live.latest()
        speed, force = 0.0, 0.0
        if latest is not None and not latest["flags"] & GONE:
            speed, force = (
                float(np.nan_to_num(latest[name])) for name in ("speed_mm_s", "force_n")
            )
        return RigReading(
            time_s=self.now_s(),
            speed_mm_s=abs(speed),
            force_n=force,
            button=parts.journal.take_pressed(),
            simulated=self.simulated,
        )

    def health(self) -> RigHealth:
        """How its parts are now."""
        parts = self.parts
        parts.journal.look()
        latest = parts.live.latest()
        age_s = inf if latest is None else now_s() - float(latest["time_s"])
        problems = []
        if age_s > OLDEST_READING_S or (latest is not None and latest["flags"] & GONE):
            problems.append("expected readings of the hand, got none; plug its device in again.")
        if self._file.latency is None:
            problems.append(
                "expected a measured latency, got none; measure it (tactileq rig latency)."
            )
        device = self._device
        if device is not None and device.status.state in (State.RELEASING, State.FAULT):
            problems.append(f"the force device has let go: {device.status.sentence}")
        return RigHealth(
            hand_age_s=age_s,
            output_latency_s=parts.sound.latency_s,
            misses=parts.journal.misses,
            stale_blocks=parts.journal.stale,
            problems=tuple(problems),
        )

    def take_faults(self) -> tuple[Fault, ...]:
        """What went wrong since the last call."""
        parts = self.parts
        self._notice()
        parts.journal.look()
        if parts.journal.lost > self._lost:
            self._fail(
                f"expected every reading and block to be kept, got {parts.journal.lost} lost so "
                "far; close other programs.",
                invalidates=False,
            )
            self._lost = parts.journal.lost
        if parts.pen is not None and parts.pen.lost and not self._pen_lost:
            self._fail(
                f"expected the accelerometer at the pen to go on, got: {parts.pen.lost}; nothing "
                "more is recorded from it in this session.",
                invalidates=False,
            )
            self._pen_lost = True
        taken, self._faults = tuple(self._faults), []
        return taken

    def _notice(self) -> None:
        for sentence in (*self.parts.sound.faults(), *self.parts.reader.faults()):
            self._fail(sentence)

    def _fail(self, sentence: str, *, invalidates: bool = True) -> None:
        self._faults.append(Fault(self.now_s(), sentence, invalidates=invalidates))

    def take_history(self) -> HandRows:
        """What the hand did since the last call; NaN where nothing measures it."""
        return self.parts.journal.take_rows()

    def take_presentations(self) -> tuple[PresentationRecord, ...]:
        """The presentations that ended since the last call."""
        taken, self._ended = tuple(self._ended), []
        return taken

    def take_acceleration(self) -> tuple[Acceleration, ...]:
        """What was measured at the pen during presentations since the last call."""
        pen = self.parts.pen
        return () if pen is None else pen.take(self._opened_s)


def _wait_for_reading(live: Live) -> None:
    end_s = now_s() + FIRST_READING_S
    while live.latest() is None:
        if now_s() > end_s:
            raise InputError(
                f"expected a reading of the hand within {FIRST_READING_S:g} s, got none; check its "
                "device (tactileq rig check)."
            )
        sleep(0.005)
