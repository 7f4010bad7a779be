"""Parts of a rig that only its calibration needs, as the rig file describes them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

from tactileq.modeling.errors import InputError
from tactileq.rig.desk.lock import rig_locked
from tactileq.rig.desk.parts import hand_settings, input_settings, vibration_output
from tactileq.rig.devices.hand.reader import HandReader
from tactileq.rig.devices.sound.supervision import SoundLost
from tactileq.rig.devices.sound.vibration import VibrationOutput
from tactileq.rig.recording.capture.input import AudioInput
from tactileq.rig.shared.live.memory import Live
from tactileq.rig.shared.setup.rig_file import RigFile

# With these points a pen's "force" is its pressure, as a share of its range.
PRESSURE_ITSELF = ((0.0, 0.0), (1.0, 1.0))


@contextmanager
def opened_sound(
    rig: RigFile, live: Live, *, hand: HandReader | None = None
) -> Iterator[VibrationOutput]:
    """The open output of a rig that no other program uses at the same time.

    Parameters
    ----------
    hand : HandReader, optional
        Of the rig, where it is open already.

    Raises
    ------
    InputError
        For a rig in use, and where nothing can be played, now or later in the block.
    """
    try:
        with rig_locked(rig.rig.name), vibration_output(rig, live, hand=hand) as sound:
            yield sound
    except SoundLost as lost:
        raise InputError(str(lost)) from None


def accelerometer_input(rig: RigFile) -> AudioInput:
    """The accelerometer, not yet open.

    Raises
    ------
    InputError
        If the rig has none.
    """
    section = rig.accelerometer
    if section is None:
        raise InputError(
            f"expected an [accelerometer] in {rig.path}, got none; nothing is calibrated without "
            "one, so fix one to the pen and describe it there."
        )
    return AudioInput(input_settings(section))


def pressure_reader(rig: RigFile, live: Live) -> HandReader:
    """A hand whose force is the pen's pressure, as a share of its range.

    Raises
    ------
    InputError
        For a hand without pressure.
    """
    settings = hand_settings(rig)
    if settings.kind not in ("tablet", "scripted"):
        raise InputError(
            f"expected a pen tablet, got a {settings.kind}, which measures no pressure; a serial "
            "sensor says newtons itself."
        )
    raw = replace(settings, pressure_points=PRESSURE_ITSELF, assumed_force_n=None, contact_n=0.0)
    return HandReader(live, raw)
