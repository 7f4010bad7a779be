"""tactileq rig twin: a rig in silico behind an audio server, with its rig file."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tactileq.interruption import Interrupted
from tactileq.options import RigPath

if TYPE_CHECKING:
    from tactileq.rig.devices.simulated.card import SimulatedCard


def rig_twin(
    rig: RigPath = Path("rig.toml"),
    vibrator: Annotated[
        Path | None,
        typer.Option("--simulated", help="File (TOML) that describes the simulated vibrator."),
    ] = None,
) -> None:
    """Run a simulated vibrator and accelerometer, and write the rig file that uses them.

    It needs a running JACK server, which may have no sound card. Until Ctrl-C, every command with
    this rig file, in another terminal, plays on it and records from it; a scripted hand strokes.
    All data from it are marked as simulated.

    Example: tactileq rig twin --rig twin.toml
    """
    from tactileq.rig.devices.simulated.card import SimulatedCard
    from tactileq.rig.devices.simulated.vibrator import SimulatedTransducers

    if rig.exists():
        raise ValueError(f"expected a new rig file, got {rig}, which exists; choose another name.")
    truth = SimulatedTransducers() if vibrator is None else SimulatedTransducers.load(vibrator)
    with SimulatedCard(truth) as card:
        _write_rig_file(rig, card)
        print(
            f"simulated vibrator on the sound device {card.name}: {rig}; Ctrl-C ends it", flush=True
        )
        try:
            while card.runs:
                time.sleep(0.2)
        except Interrupted as end:
            if end.signal_name != "SIGINT":
                raise
            end.accept()
            return
    raise ValueError(
        "expected the simulated vibrator to run, got its end; check that the JACK server runs."
    )


def _write_rig_file(path: Path, card: SimulatedCard) -> None:
    """The shipped rig file with this card and a scripted hand."""
    from tactileq.modeling.files.writing import write_text
    from tactileq.rig.devices.sound.devices import find_device
    from tactileq.rig.shared.setup.figures import Figure
    from tactileq.rig.shared.setup.rig_file import SHIPPED_RIG_FILE, RigFile

    rate_hz = find_device(card.name, "output").rate_hz
    scale = Figure(card.vibrator.sensor_fullscale_g, "g", True, "of the simulated accelerometer")
    write_text(path, SHIPPED_RIG_FILE.read_text(encoding="utf-8"))
    RigFile.updated(
        path,
        {
            "rig.name": "simulated rig",
            "sound.device": card.name,
            "sound.rate_hz": rate_hz,
            "sound.simulated": True,
            "vibrator.g_per_volt": Figure(
                card.vibrator.g_per_fullscale, "g/V", True, "of the simulated vibrator"
            ),
            "hand.kind": "scripted",
            "accelerometer.device": card.name,
            "accelerometer.rate_hz": rate_hz,
            "accelerometer.g_per_fullscale": scale,
        },
    )
