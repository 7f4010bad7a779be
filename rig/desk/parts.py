"""The parts of a desk rig, made as its rig file says."""

from __future__ import annotations

from pathlib import Path

from modeling.vibrators.compensation import compensation_for
from rig.capture.input import InputSettings
from rig.force.hand import ForceHand
from rig.force.settings import ForceSettings, Pose
from rig.hand.reader import HandReader
from rig.hand.settings import HandSettings
from rig.live.memory import Live
from rig.setup.rig_file import RigFile
from rig.setup.sections import AccelerometerSection
from rig.sound.output import SoundOutput

SILENT_S = 0.06  # beyond three blocks: a wall is released where nothing was played for so long


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
        vibrator=rig.identified,
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


def hand_reader(rig: RigFile, live: Live) -> HandReader:
    """What reads the hand, not opened yet; a `ForceHand` where it also pushes."""
    settings = hand_settings(rig)
    force = force_settings(rig)
    return HandReader(live, settings) if force is None else ForceHand(live, settings, force)


def force_settings(rig: RigFile, *, sounds: bool = True) -> ForceSettings | None:
    """The force device in plain numbers; None of a rig without one.

    Parameters
    ----------
    sounds : bool
        Whether the rig also plays: then a wall is released where the sound ends.
    """
    force, pose, device = rig.force_device, rig.pose, rig.own_device
    if force is None:
        return None
    period_s = rig.sound.block / rig.sound.rate_hz
    return ForceSettings(
        library=force.library,
        serial=force.serial,
        address="" if device is None else device.address,
        baud=1_000_000 if device is None else device.baud,
        watched=device is None,  # it watches itself
        rate_hz=force.rate_hz,
        delay_s=rig.hand.filter_delay_s.value,
        contact_n=rig.hand.contact_n.value,
        most_n=force.most_n.value,
        most_n_per_s=force.most_n_per_s.value,
        most_w=force.most_w.value,
        most_mm_s=force.most_mm_s.value,
        late_s=1e-3 * force.late_ms.value,
        frozen_s=1e-3 * force.frozen_ms.value,
        release_s=1e-3 * force.release_ms.value,
        low_mm=force.low_mm,
        high_mm=force.high_mm,
        pose=Pose()
        if pose is None
        else Pose(origin_mm=pose.origin_mm, x=pose.x, y=pose.y, z=pose.z),
        sound_s=SILENT_S + 3 * period_s if sounds else 0.0,
        simulated=rig.simulated,
    )


def input_settings(accelerometer: AccelerometerSection) -> InputSettings:
    """What reads the accelerometer."""
    return InputSettings(
        g_per_fullscale=accelerometer.g_per_fullscale.value,
        device=accelerometer.device,
        channel=accelerometer.channel,
        rate_hz=accelerometer.rate_hz,
    )
