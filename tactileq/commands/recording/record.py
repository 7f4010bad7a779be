"""tactileq record: a surface under a hand or on a recorder, or planted textures in silico."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tactileq.modeling.errors import counted
from tactileq.options import AssumedForce, CountsPerMm, HandDevice, HandKind, OptionalRigPath, Seed
from tactileq.printing import progress


def record(
    folder: Annotated[Path, typer.Argument(help="Folder for the recordings.")],
    texture: Annotated[
        str, typer.Option(help="Name of the surface; in silico a planted texture, such as canvas.")
    ],
    rate_hz: Annotated[
        float | None,
        typer.Option(
            "--rate", help="Sampling rate in Hz; by default the sound card's, in silico 22704."
        ),
    ] = None,
    duration_s: Annotated[float, typer.Option("--duration", help="Seconds per record.")] = 1.0,
    seed: Seed = 0,
    audio: Annotated[
        bool, typer.Option("--audio", help="Record by hand, with an accelerometer at a sound card.")
    ] = False,
    recorder: Annotated[
        str | None,
        typer.Option(
            "--recorder",
            help="Record with a turntable and a contactor: a recorder file (TOML), or simulated.",
        ),
    ] = None,
    rig: OptionalRigPath = None,
    grid: Annotated[
        Path | None,
        typer.Option("--grid", help="Grid (TOML) from tactileq rig range; by default 7 x 7."),
    ] = None,
    more: Annotated[
        bool,
        typer.Option("--more", help="Only conditions that the model of these recordings asks for."),
    ] = False,
    repeat: Annotated[int, typer.Option(min=1, help="Number of the repeat of each condition.")] = 1,
    device: Annotated[
        str | None, typer.Option(help="Input device: its name or a part of it.")
    ] = None,
    channel: Annotated[int | None, typer.Option(min=1, help="Input channel, from 1.")] = None,
    g_per_fullscale: Annotated[
        float | None, typer.Option(help="Acceleration of a full-scale sample, g.")
    ] = None,
    simulated: Annotated[
        bool, typer.Option("--simulated", help="Mark the recordings as simulated.")
    ] = False,
    hand: HandKind = None,
    hand_device: HandDevice = None,
    counts_per_mm: CountsPerMm = None,
    force: AssumedForce = None,
) -> None:
    """Record a surface by hand (--audio), on a recorder (--recorder), or in silico.

    By default 7 speeds x 7 forces. In silico and on a simulated recorder it is a planted texture.

    With --audio you stroke the surface freely; strokes are cut into the conditions of the grid, and
    a map shows which are missing. Ctrl-C ends it; run the command again to continue. --more models
    what is recorded already, and asks for conditions near those that the others predict worst.
    A recorder holds each speed and force by itself, checks both, and records anew what was off.

    Example: tactileq record recordings/oak --audio --texture oak --rig rig.toml --grid grid.toml

    Example: tactileq record recordings/oak --recorder recorder.toml --texture oak

    Example: tactileq record recordings/canvas --texture canvas
    """
    from tactileq.commands.recording.audio import (
        HandOptions,
        HandRecording,
        InputOptions,
        record_by_hand,
    )
    from tactileq.commands.recording.recorder import RecorderRecording, record_on_recorder

    by_hand = HandOptions(hand, hand_device, counts_per_mm, force)
    heard = InputOptions(device, channel, rate_hz if audio else None, g_per_fullscale, simulated)
    if recorder is not None:
        if audio or rig or (by_hand, heard) != (HandOptions(), InputOptions()):
            raise ValueError(
                "expected --recorder without --audio, --rig and options of the hand or the input, "
                "got both; leave them out, the recorder file says what there is."
            )
        options_of_recorder = RecorderRecording(
            texture, duration_s, repeat, grid, rate_hz=rate_hz, more=more, seed=seed
        )
        record_on_recorder(folder, recorder, options_of_recorder)
        return
    if audio:
        options = HandRecording(texture, duration_s, repeat, grid, rig, by_hand, heard, more)
        record_by_hand(folder, options)
        return
    if rig or grid or more or repeat > 1 or (by_hand, heard) != (HandOptions(), InputOptions()):
        raise ValueError(
            "expected --audio with options of the hand, the input, the grid or the repeat, got "
            "those options without it; add --audio (or --recorder, for grid and repeat), or leave "
            "them out to record in silico."
        )
    record_in_silico(folder, texture, rate_hz=rate_hz, duration_s=duration_s, seed=seed)


def record_in_silico(
    folder: Path, texture: str, *, rate_hz: float | None, duration_s: float, seed: int
) -> None:
    """Record a planted texture, 7 speeds x 7 forces."""
    from tactileq.modeling.files.folders import contents_of, folder_behind, replace_folder
    from tactileq.modeling.files.provenance import write_provenance
    from tactileq.stimuli.planted.textures import RECORDER_RATE_HZ, planted_texture, record_texture

    rate_hz = RECORDER_RATE_HZ if rate_hz is None else rate_hz
    folder_behind(folder)
    if contents_of(folder):
        raise ValueError(f"expected a new folder, got {folder}, which exists; choose another name.")
    truth = planted_texture(texture, rate_hz=rate_hz)
    with progress(f"Recording {texture} in silico", 1) as advance:
        records = record_texture(truth, duration_s=duration_s, seed=seed)
        settings = {"texture": texture, "rate_hz": rate_hz, "duration_s": duration_s}
        with replace_folder(folder, {}) as fresh:
            records.save(fresh)
            write_provenance(fresh / "provenance.json", "record", settings, seed=seed)
        advance("")
    print(f"{counted(len(records), 'simulated recording')} of {texture} in {folder}")
