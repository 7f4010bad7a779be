"""tactileq vibrator: identify a vibrator, to compensate its resonance."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tactileq.results import CommandRun, FileResults

if TYPE_CHECKING:
    from tactileq.analysis.spectra.vibrator import CompensatedVibrator


def vibrator(
    test: Annotated[
        Path,
        typer.Argument(metavar="TEST", help="WAV file with two channels: drive, acceleration."),
    ],
    out: Annotated[Path, typer.Option("--out", help="File for the result (JSON).")] = Path(
        "vibrator.json"
    ),
    plot: Annotated[
        Path | None,
        typer.Option("--plot", help="PNG file: response before and after compensation, coherence."),
    ] = None,
    simulated: Annotated[
        bool, typer.Option("--simulated", help="Mark the result as simulated.")
    ] = False,
) -> None:
    """Identify a vibrator from a white-noise test, to compensate its resonance.

    TEST has two channels recorded simultaneously, the drive and the acceleration, for at least
    8.25 s. A test in which their coherence is poor is refused. Use the result in a recipe (vibrator
    under [set]) or as --vibrator of tactileq stimuli, export wav and export c.

    Example: tactileq vibrator white-noise.wav --out vibrator.json --plot vibrator.png
    """
    identify_from(test, out, plot=plot, simulated=simulated)


def identify_from(test: Path, out: Path, *, plot: Path | None, simulated: bool) -> None:
    """Identify a vibrator from its white-noise test, save it, draw it and say what was found.

    Parameters
    ----------
    test : Path
        WAV of two channels: drive, acceleration.
    out : Path
        A JSON file.
    plot : Path, optional
        A PNG file. Beside either file goes its provenance, by which a later run knows its own.
    simulated : bool
        Whether the test was simulated.
    """
    from tactileq.analysis.page.saving import picture_bytes
    from tactileq.analysis.spectra.figures.vibrator import figure_vibrator
    from tactileq.analysis.spectra.vibrator import compensated
    from tactileq.modeling import identify_vibrator
    from tactileq.modeling.files.wav import read_wav_channels

    files = {path: ending for path, ending in ((out, ".json"), (plot, ".png")) if path is not None}
    for path, ending in files.items():
        if path.suffix.lower() != ending:
            raise ValueError(f"expected a name that ends in {ending}, got {path}; rename it.")
    ran = CommandRun("vibrator")
    results = {path: FileResults([path], ran.command) for path in files}
    ran.reads(test)
    samples, rate_hz = read_wav_channels(test)
    if samples.shape[1] != 2:
        raise ValueError(
            f"expected two channels in {test}, the drive and the acceleration, got "
            f"{samples.shape[1]}; record both at once."
        )
    drive, acceleration = samples.T
    shown = compensated(
        identify_vibrator(drive, acceleration, rate_hz=rate_hz, simulated=simulated)
    )
    contents = {out: shown.vibrator.to_json().encode()}
    if plot is not None:
        contents[plot] = picture_bytes(figure_vibrator(shown))
    provenance = ran.provenance({"simulated": simulated})
    for path, data in contents.items():
        results[path].write({path: data}, provenance)
    print(f"{_found(shown)}: {out}")


def _found(shown: CompensatedVibrator) -> str:
    """One line on a vibrator's resonance, the test's coherence and the effect of compensation."""
    vibrator, before, after = shown.vibrator, shown.flat_before_hz, shown.flat_after_hz
    note = "simulated " if vibrator.simulated else ""
    return (
        f"{note}resonance {vibrator.frequency_hz:.1f} Hz, {vibrator.bandwidth_hz:.1f} Hz wide, "
        f"{vibrator.height:.2f} times the flat part; coherence {vibrator.coherence:.2f}; flat to "
        f"±{shown.within_db:g} dB from {before[0]:.0f} to {before[1]:.0f} Hz, compensated from "
        f"{after[0]:.0f} to {after[1]:.0f} Hz"
    )
