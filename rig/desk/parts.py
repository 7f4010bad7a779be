"""The parts of a desk rig, made as its rig file says."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path

from tactileq.modeling.vibrators.compensation import Compensation, compensation_for
from tactileq.modeling.vibrators.exposure import hand_arm_sections
from tactileq.rig.devices.hand.reader import HandReader
from tactileq.rig.devices.hand.settings import HandSettings
from tactileq.rig.devices.sound.output import SoundOutput
from tactileq.rig.devices.sound.vibration import VibrationOutput
from tactileq.rig.machines.force.hand import ForceHand
from tactileq.rig.machines.force.settings import ForceSettings, Pose, Vibration
from tactileq.rig.recording.capture.input import InputSettings
from tactileq.rig.shared.live.clock import check_clock
from tactileq.rig.shared.live.memory import Live
from tactileq.rig.shared.setup.rig_file import RigFile
from tactileq.rig.shared.setup.sections import AccelerometerSection

# The small force after arming: a hand feels it, and encoders see what it moves. Less than the
# second one moves too little, and a device that pushes no harder hurts nobody.
PROBE_N, LEAST_PROBE_N = 1.0, 0.5
SILENT_S = 0.06  # beyond three blocks: a wall is released where nothing was played for so long


def vibration_output(
    rig: RigFile, live: Live, *, hand: HandReader | None = None, seed: int = 0
) -> VibrationOutput:
    """What plays, not opened yet: the sound card, or a device that renders the texture.

    Parameters
    ----------
    hand : HandReader, optional
        Of this rig, opened by others before this; without it a device is opened and closed with
        this output.

    Raises
    ------
    InputError
        For limits beyond what the card can play, a vibrator that cannot be compensated at its rate,
        or a calibration that no longer fits (`RigFile.check_calibration`).
    """
    rig.check_calibration()
    if rig.renderer is None:
        return sound_output(rig, live, seed=seed)
    from tactileq.rig.machines.device.hand import DeviceHand  # needs the extra rig
    from tactileq.rig.machines.device.sound import DeviceSound

    opens = hand is None
    if hand is None:
        hand = hand_reader(rig, live, seed=seed)
    assert isinstance(hand, DeviceHand)
    masked = None
    if rig.sound.masking_channel is not None:
        masked = partial(sound_output, rig, seed=seed)
    return DeviceSound(
        live,
        hand,
        opens=opens,
        scale=rig.fullscale_per_g,
        limits=rig.safe_limits,
        compensation=_compensation(rig),
        masked=masked,
    )


def _compensation(rig: RigFile) -> Compensation | None:
    if rig.identified is None:
        return None
    return compensation_for(rig.identified, rate_hz=rig.output_rate_hz)


def sound_output(rig: RigFile, live: Live, *, seed: int = 0) -> SoundOutput:
    """The sound card, not opened yet; of a device that renders it plays the masking noise only."""
    sound, masking, plays = rig.sound, rig.sound.masking_channel, rig.renderer is None
    check_clock("a sound card", simulated=sound.simulated)
    return SoundOutput(
        live,
        device=sound.device,
        rate_hz=sound.rate_hz,
        block=sound.block,
        channels=sound.channels,
        vibration_channel=sound.vibration_channel - 1,
        masking_channel=None if masking is None else masking - 1,
        fullscale_per_g=rig.fullscale_per_g if plays else 1.0,
        limits=rig.safe_limits if plays else replace(rig.safe_limits, peak=1.0),
        compensation=_compensation(rig) if plays else None,
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


def hand_reader(rig: RigFile, live: Live, *, seed: int = 0) -> HandReader:
    """What reads the hand, not opened yet; a `ForceHand` where it also pushes."""
    settings = hand_settings(rig)
    force = force_settings(rig, seed=seed)
    if force is None:
        return HandReader(live, settings)
    if rig.own_device is None:
        return ForceHand(live, settings, force)
    from tactileq.rig.machines.device.hand import DeviceHand  # needs the extra rig

    return DeviceHand(live, settings, force)


def force_settings(rig: RigFile, *, sounds: bool = True, seed: int = 0) -> ForceSettings | None:
    """The force device in plain numbers; None of a rig without one.

    Parameters
    ----------
    sounds : bool
        Whether the rig also plays: then a wall is released where the sound ends.
    seed : int
        Of the noise of a device that renders the texture.
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
        answer_s=1e-3 * force.delay_ms.value,
        probe_n=probe_n(force.most_n.value),
        low_mm=force.low_mm,
        high_mm=force.high_mm,
        pose=Pose()
        if pose is None
        else Pose(origin_mm=pose.origin_mm, x=pose.x, y=pose.y, z=pose.z),
        sound_s=SILENT_S + 3 * period_s if sounds and rig.renderer is None else 0.0,
        simulated=rig.simulated,
        vibration=_vibration(rig, seed),
    )


def probe_n(most_n: float) -> float:
    """Of a device that pushes with at most so much; 0 for none."""
    return min(PROBE_N, most_n) if most_n >= LEAST_PROBE_N else 0.0


def _vibration(rig: RigFile, seed: int) -> Vibration | None:
    if rig.renderer is None:
        return None
    return Vibration(
        peak_g=rig.limits.peak_g.value,
        scale=rig.fullscale_per_g,
        weighting=hand_arm_sections(rig.output_rate_hz, vibrator=rig.identified).tobytes(),
        seed=seed,
    )


def input_settings(accelerometer: AccelerometerSection) -> InputSettings:
    """What reads the accelerometer."""
    return InputSettings(
        g_per_fullscale=accelerometer.g_per_fullscale.value,
        device=accelerometer.device,
        channel=accelerometer.channel,
        rate_hz=accelerometer.rate_hz,
    )
