"""Opens the rig for a visitor: that of a rig file, or the devices of any computer."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from math import inf
from pathlib import Path

from tactileq.experiments.feel.live_rig import MASKING_LEVEL, LiveRig
from tactileq.experiments.feel.view import short
from tactileq.modeling import Compensation, InputError, Limits, Vibrator, compensation_for
from tactileq.rig.desk.checks import HIGHEST_LATENCY_MS
from tactileq.rig.desk.lock import rig_locked
from tactileq.rig.desk.parts import hand_reader, vibration_output
from tactileq.rig.desk.walls import Walls, check_walls, usual_wall
from tactileq.rig.devices.hand.reader import HandReader
from tactileq.rig.devices.hand.settings import HandSettings
from tactileq.rig.devices.sound.devices import SoundDevice, find_device
from tactileq.rig.devices.sound.output import SoundOutput
from tactileq.rig.devices.sound.supervision import SoundLost
from tactileq.rig.shared.live.memory import Live
from tactileq.rig.shared.setup.rig_file import RigFile

BLOCK = 256
PIXELS_PER_MM = 3.78  # of a screen with 96 dots per inch
FORCE_N = 1.5
# A window draws some twenty pictures a second at least, and knows of its pointer as often.
POINTER_DELAY_S = 0.05
FULLSCALE_PER_G = 1 / 3
PEAK_G = 3.0
NO_SOUND = "no sound device: nothing is played"


@contextmanager
def desk(path: Path) -> Iterator[LiveRig]:
    """The rig of a rig file, which no other program uses at the same time.

    Raises
    ------
    InputError
        For a rig file that is none, a part that is not there, or a rig in use.
    """
    rig = RigFile.load(path)
    wall = None
    if rig.force_device is not None:
        wall = usual_wall(rig)
        check_walls(rig, Walls(usual=wall))
    with ExitStack() as opened:
        opened.enter_context(rig_locked(rig.rig.name))
        live = opened.enter_context(Live.create())
        hand = opened.enter_context(hand_reader(rig, live))
        try:
            sound = opened.enter_context(vibration_output(rig, live, hand=hand))
        except SoundLost as lost:
            raise InputError(str(lost)) from None
        felt = LiveRig(
            live,
            hand,
            sound,
            pointed=rig.hand.kind == "window",
            masking_level=rig.sound.masking_level or MASKING_LEVEL,
            notes=notes_on(rig),
            wall=wall,
        )
        felt.arm()
        yield felt


def notes_on(rig: RigFile) -> tuple[str, ...]:
    """What a visitor should know of a rig: what is simulated, assumed, or too late."""
    scale = (rig.output_v, rig.vibrator.g_per_volt)
    late = rig.latency is not None and rig.latency.p95_ms.value > HIGHEST_LATENCY_MS
    notes = {
        "simulated hand": rig.hand.kind == "scripted",
        "simulated force device": (rig.force_device is not None and rig.force_device.simulated)
        or (rig.own_device is not None and rig.own_device.simulated),
        "force commanded, not sensed": rig.force_device is not None,
        "simulated sound card": rig.sound.simulated,
        "force assumed": not rig.hand.measures_force,
        "level not calibrated": any(figure.assumed for figure in scale),
        f"later than {HIGHEST_LATENCY_MS:g} ms, which changes textures": late,
    }
    return tuple(note for note, holds in notes.items() if holds)


@contextmanager
def demonstration(vibrator: Vibrator | None = None) -> Iterator[LiveRig]:
    """The window's pointer as the hand, and the system's usual sound device where there is one.

    Parameters
    ----------
    vibrator : Vibrator, optional
        Compensate its resonance.
    """
    settings = HandSettings(
        kind="window",
        counts_per_mm=PIXELS_PER_MM,
        filter_delay_s=POINTER_DELAY_S,
        assumed_force_n=FORCE_N,
    )
    pointer = f"hand: mouse pointer ({PIXELS_PER_MM:g} px/mm, {FORCE_N:g} N assumed)"
    with ExitStack() as opened:
        live = opened.enter_context(Live.create())
        sound, sound_note = _usual_sound(live, vibrator, opened)
        hand = opened.enter_context(HandReader(live, settings))
        yield LiveRig(live, hand, sound, pointed=True, notes=(pointer, sound_note))


def _usual_sound(
    live: Live, vibrator: Vibrator | None, opened: ExitStack
) -> tuple[SoundOutput | None, str]:
    """The open sound output, None if none can be opened, and the note about it for visitors."""
    try:
        device = find_device(None, "output")
    except InputError:
        return None, NO_SOUND
    sound = _sound_on(device, live, vibrator)
    try:
        opened.enter_context(sound)
    except (InputError, SoundLost):
        return None, NO_SOUND
    return sound, f"sound: {short(device.name, 24)}, not calibrated"


def _sound_on(device: SoundDevice, live: Live, vibrator: Vibrator | None) -> SoundOutput:
    two = device.outputs > 1
    return SoundOutput(
        live,
        device=device.name,
        rate_hz=device.rate_hz,
        block=BLOCK,
        channels=2 if two else 1,
        masking_channel=1 if two else None,
        fullscale_per_g=FULLSCALE_PER_G,
        limits=Limits(peak=PEAK_G, rms=1.0, duration_s=inf),
        compensation=_compensation(vibrator, device.rate_hz),
    )


def _compensation(vibrator: Vibrator | None, rate_hz: float) -> Compensation | None:
    return None if vibrator is None else compensation_for(vibrator, rate_hz=rate_hz)
