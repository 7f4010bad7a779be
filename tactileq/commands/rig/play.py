"""tactileq rig play: a tone burst, or a file of a stimulus set, at a resting hand."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tactileq.modeling.errors import counted
from tactileq.options import RigPath

if TYPE_CHECKING:
    from tactileq.rig.shared.interface import PreparedSignal
    from tactileq.rig.shared.setup.rig_file import RigFile


def rig_play(
    rig: RigPath,
    stimuli: Annotated[
        Path | None, typer.Option("--set", help="Folder from tactileq stimuli.")
    ] = None,
    which: Annotated[
        str | None, typer.Option("--file", help="Name or SHA-256 of a file in the set.")
    ] = None,
    tone_hz: Annotated[
        float | None, typer.Option("--tone", help="Frequency of a sinusoid to play instead, Hz.")
    ] = None,
    amplitude_g: Annotated[
        float, typer.Option("--amplitude", help="Amplitude of the sinusoid at the pen, g.")
    ] = 0.1,
    duration_s: Annotated[
        float, typer.Option("--duration", help="Duration of the sinusoid, s.")
    ] = 1.0,
    times: Annotated[int, typer.Option(min=1, max=1000, help="Number of repetitions.")] = 1,
) -> None:
    """Play a calibrated tone burst, or a file of a stimulus set, at a resting hand.

    Example: tactileq rig play --rig rig.toml --tone 250 --amplitude 0.1

    Example: tactileq rig play --rig rig.toml --set stimuli-set --file canvas_full_1.wav
    """
    from tactileq.rig.shared.setup.rig_file import RigFile

    loaded = RigFile.load(rig)
    signal = chosen_signal(
        loaded, stimuli, which, tone_hz, amplitude_g=amplitude_g, duration_s=duration_s
    )
    play(loaded, signal, times=times)
    simulated = "simulated " if signal.simulated else ""
    seconds = signal.samples_g.size / signal.rate_hz
    print(
        f"{simulated}signal of {seconds:.3g} s played {counted(times, 'time')} on {loaded.rig.name}"
    )


def chosen_signal(
    rig: RigFile,
    stimuli: Path | None,
    which: str | None,
    tone_hz: float | None,
    *,
    amplitude_g: float,
    duration_s: float,
) -> PreparedSignal:
    """The signal that the options name, fit for the rig.

    Raises
    ------
    ValueError
        For neither or both; another rate than the card's; another vibrator than the rig's.
    """
    from tactileq.rig.desk.stimuli import check_made_for
    from tactileq.rig.devices.sound.signals import stimulus, tone_burst

    if (tone_hz is None) == (stimuli is None) or (stimuli is None) != (which is None):
        raise ValueError(
            "expected a tone (--tone) or a file of a set (--set and --file), got neither or both; "
            "give one."
        )
    if tone_hz is not None:
        return tone_burst(tone_hz, amplitude_g, duration_s=duration_s, rate_hz=rig.output_rate_hz)
    assert stimuli is not None
    assert which is not None
    signal = stimulus(stimuli, which)
    check_made_for(rig, signal, which)
    return signal


def play(rig: RigFile, signal: PreparedSignal, *, times: int) -> None:
    """Play a signal `times` times in succession."""
    from tactileq.printing import progress
    from tactileq.rig.desk.lock import rig_locked
    from tactileq.rig.desk.parts import vibration_output
    from tactileq.rig.shared.live.memory import Live

    compensated = signal.vibrator_sha256 is not None
    with rig_locked(rig.rig.name), Live.create() as live:
        sound = vibration_output(rig, live)
        sound.checked(signal.samples_g, compensated=compensated)  # before anything is opened
        with sound, progress("Playing", times) as advance:
            for _ in range(times):
                sound.play_signal(signal.samples_g, compensated=compensated, wait=True)
                advance("")
        for fault in sound.faults():
            typer.echo(f"warning: {fault}", err=True)
