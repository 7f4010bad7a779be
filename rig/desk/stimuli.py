"""Whether a rig can play prepared signals: their rate, their vibrator, its limits."""

from __future__ import annotations

from tactileq.modeling import InputError
from tactileq.rig.desk.parts import vibration_output
from tactileq.rig.shared.interface import PreparedSignal, Stimulus
from tactileq.rig.shared.live.memory import Live
from tactileq.rig.shared.setup.rig_file import RigFile


def check_stimulus(rig: RigFile, stimulus: Stimulus) -> None:
    """Refuse a stimulus that a rig cannot play; needs no device.

    Raises
    ------
    InputError
        As `check_made_for`, and for one beyond the rig's limits.
    """
    which = f"the stimulus of {stimulus.texture}"
    check_made_for(rig, stimulus, which)
    with Live.create() as live:
        sound = vibration_output(rig, live)
        try:
            sound.checked(stimulus.samples_g, compensated=stimulus.vibrator_sha256 is not None)
        except InputError as error:
            raise InputError(f"{which}: {error}") from None


def check_made_for(rig: RigFile, signal: PreparedSignal, which: str) -> None:
    """Refuse a signal at another rate than the output's, or for another vibrator than the rig's.

    Parameters
    ----------
    which : str
        What to call it.

    Raises
    ------
    InputError
    """
    if signal.rate_hz != rig.output_rate_hz:
        plays = "the card" if rig.renderer is None else "the device"
        raise InputError(
            f"expected a file at {rig.output_rate_hz:g} Hz, the rate of {plays}, got {which} at "
            f"{signal.rate_hz:g} Hz; make the set with that rate_hz."
        )
    wanted = signal.vibrator_sha256
    if wanted is not None and wanted != rig.vibrator_sha256:
        raise InputError(
            f"expected a file for the vibrator of {rig.path}, got {which}, which is compensated "
            "for another one; make the set with the rig's vibrator, or without any."
        )
