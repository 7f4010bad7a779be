"""The parts of a desk rig, made as its rig file says."""

from __future__ import annotations

from pathlib import Path

from modeling.vibrators.compensation import compensation_for
from rig.capture.input import InputSettings
from rig.hand.settings import HandSettings
from rig.live.memory import Live
from rig.setup.rig_file import RigFile
from rig.setup.sections import AccelerometerSection
from rig.sound.output import SoundOutput


def sound_output(rig: RigFile, live: Live, *, seed: int = 0) -> SoundOutput:
    """What plays, not opened yet.

    Raises
    ------
    InputError
        For limits beyond what the card can play, or a vibrator that cannot be compensated at its
        rate.
    """
    sound, masking = rig.sound, rig.sound.masking_channel
    compensation = None
    if rig.identified is not None:
        compensation = compensation_for(rig.identified, rate_hz=sound.rate_hz)
    return SoundOutput(
        live,
        device=sound.device,
        rate_hz=sound.rate_hz,
        block=sound.block,
        channels=sound.channels,
        vibration_channel=sound.vibration_channel - 1,
        masking_channel=None if masking is None else masking - 1,
        fullscale_per_g=rig.fullscale_per_g,
        limits=rig.safe_limits,
        compensation=compensation,
        seed=seed,
    )


def hand_settings(rig: RigFile) -> HandSettings:
    """What reads the hand."""
    hand = rig.hand
    script = Path(hand.script)
    return HandSettings(
        kind=hand.kind,
        device=hand.device,
        counts_per_mm=None if hand.counts_per_mm is None else hand.counts_per_mm.value,
        filter_delay_s=hand.filter_delay_s.value,
        assumed_force_n=None if hand.assumed_force_n is None else hand.assumed_force_n.value,
        pressure_points=None if hand.pressure_curve is None else hand.pressure_curve.points,
        contact_n=hand.contact_n.value,
        baud=hand.baud,
        grab=hand.grab,
        script=str(rig.path.parent / script) if script.suffix else hand.script,
    )


def input_settings(accelerometer: AccelerometerSection) -> InputSettings:
    """What reads the accelerometer."""
    return InputSettings(
        g_per_fullscale=accelerometer.g_per_fullscale.value,
        device=accelerometer.device,
        channel=accelerometer.channel,
        rate_hz=accelerometer.rate_hz,
    )
