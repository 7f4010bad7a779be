"""tactileq record: recordings of planted textures, in silico."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tactileq.options import Seed
from tactileq.telling import progress


def record(
    folder: Annotated[Path, typer.Argument(help="New folder for the recordings.")],
    texture: Annotated[str, typer.Option(help="Planted texture, such as canvas.")],
    rate_hz: Annotated[float, typer.Option("--rate", help="Sampling rate in Hz.")] = 22704.0,
    duration_s: Annotated[float, typer.Option("--duration", help="Seconds per record.")] = 1.0,
    seed: Seed = 0,
) -> None:
    """Record a planted texture in silico, 7 speeds x 7 forces; no device is driven yet.

    Example: tactileq record recordings/canvas --texture canvas
    """
    from modeling.files.folders import folder_behind, replace_folder
    from modeling.files.provenance import write_provenance
    from stimuli.planted.textures import planted_texture, record_texture

    folder_behind(folder)
    if folder.exists() and (folder.is_file() or any(folder.iterdir())):
        raise ValueError(f"expected a new folder, got {folder}, which exists; choose another name.")
    truth = planted_texture(texture)
    with progress(f"Recording {texture} in silico", 1) as advance:
        records = record_texture(truth, rate_hz=rate_hz, duration_s=duration_s, seed=seed)
        settings = {"texture": texture, "rate_hz": rate_hz, "duration_s": duration_s}
        with replace_folder(folder) as fresh:
            records.save(fresh)
            write_provenance(fresh / "provenance.json", "record", settings, seed=seed)
        advance("")
    print(f"{len(records)} simulated recordings of {texture} in {folder}")
