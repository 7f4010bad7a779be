"""Whether a rig can play prepared signals: their rate, their vibrator, its limits."""

from __future__ import annotations

import hashlib

from modeling import InputError
from modeling.files.reading import read_bytes
from rig.desk.parts import sound_output
from rig.interface import PreparedSignal, Stimulus
from rig.live.memory import Live
from rig.setup.rig_file import RigFile


def check_stimulus(rig: RigFile, stimulus: Stimulus) -> None:
    """Refuse a stimulus that a rig cannot play; needs no device.

    Raises
    ------
    InputError
        As `check_made_for`, and for one beyond the rig's limits.
    """
    check_made_for(rig, stimulus)
    with Live.create() as live:
        sound = sound_output(rig, live)
        try:
            sound.checked(stimulus.samples_g, compensated=stimulus.vibrator_sha256 is not None)
        except InputError as error:
            raise InputError(f"the stimulus of {stimulus.texture}: {error}") from None


def check_made_for(rig: RigFile, signal: PreparedSignal, which: str = "") -> None:
    """Refuse a signal at another rate than the card's, or for another vibrator than the rig's.

    Parameters
    ----------
    rig : RigFile
    signal : PreparedSignal
    which : str
        What to call it; a stimulus is called after its texture.

    Raises
    ------
    InputError
    """
    if isinstance(signal, Stimulus):
        which = f"the stimulus of {signal.texture}"
    if signal.rate_hz != rig.sound.rate_hz:
        raise InputError(
            f"expected a file at {rig.sound.rate_hz:g} Hz, the rate of the card, got {which} at "
            f"{signal.rate_hz:g} Hz; make the set with that rate_hz."
        )
    wanted = signal.vibrator_sha256
    if wanted is not None and wanted != _own_vibrator(rig):
        raise InputError(
            f"expected a file for the vibrator of {rig.path}, got {which}, which is compensated "
            "for another one; make the set with the rig's vibrator, or without any."
        )


def _own_vibrator(rig: RigFile) -> str | None:
    """SHA-256 of the file of the rig's vibrator, None where it names none."""
    file = rig.vibrator.file
    if file is None:
        return None
    return hashlib.sha256(read_bytes(rig.path.parent / file, "the vibrator")).hexdigest()
