"""tactileq simplify: models without the layers below the detection threshold."""

from __future__ import annotations

from functools import partial
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tactileq.modeling.errors import counted
from tactileq.options import Criterion, HoldAbove, Margin, ModelFile, ThresholdName
from tactileq.printing import simulated_note, usable_recordings
from tactileq.results import CommandRun, FileResults

if TYPE_CHECKING:
    from tactileq.modeling import RecordingSet, Simplification, TextureModel

# Of the names of all files that the command may write, beside their provenance.
ENDINGS = (".json", "_simplification.json", "_layers.tsv", "_threshold.png")


def simplify(
    model_file: ModelFile,
    out: Annotated[Path, typer.Option("--out", help="Folder for the results.")] = Path(
        "simplified"
    ),
    threshold: ThresholdName = "codec",
    criterion: Criterion = "energy",
    margin_db: Margin = 0.0,
    hold_above: HoldAbove = True,
    plot: Annotated[
        bool, typer.Option("--plot", help="Plot spectra, layers and threshold of one condition.")
    ] = False,
    recordings: Annotated[
        Path | None, typer.Option(help="With --plot: recordings to plot beside the model.")
    ] = None,
    speed: Annotated[
        float | None, typer.Option(help="With --plot: speed in mm/s; by default the fastest.")
    ] = None,
    force: Annotated[
        float | None, typer.Option(help="With --plot: force in N; by default the strongest.")
    ] = None,
) -> None:
    """Drop the layers that nobody can feel, with a reason for each.

    Writes TEXTURE.json (the model), TEXTURE_simplification.json (threshold, criterion, margin and
    the verdict on each layer, for tactileq analyze) and TEXTURE_layers.tsv, with --plot also
    TEXTURE_threshold.png.

    Example: tactileq simplify models/canvas.json --threshold pen-hold --margin-db 3 --plot
    """
    from tactileq.analysis.columns import table_bytes
    from tactileq.analysis.textures.results import simplification_table
    from tactileq.modeling import TextureModel, Threshold
    from tactileq.modeling import simplify as drop_layers
    from tactileq.modeling.files.writing import file_stem

    ran = CommandRun("simplify")
    ran.reads(model_file, Threshold.file_of(threshold), recordings if plot else None)
    full = TextureModel.load(model_file)
    start = out / file_stem(full.texture)
    results = FileResults(
        [Path(f"{start}{ending}") for ending in ENDINGS],
        ran.command,
        note=Path(f"{start}_provenance.json"),
        texture=full.texture,
        inputs=[model_file],
    )
    result = drop_layers(
        full,
        Threshold.named(threshold),
        criterion=criterion,
        margin_db=margin_db,
        hold_above=hold_above,
    )
    files = {
        ".json": result.model.to_json().encode(),
        "_simplification.json": result.to_json().encode(),
        "_layers.tsv": table_bytes(simplification_table(result)),
    }
    if plot:
        files["_threshold.png"] = draw_condition(
            full, result, recordings=recordings, speed=speed, force=force
        )
    elif (recordings, speed, force) != (None, None, None):
        raise ValueError(
            "expected --plot with --recordings, --speed or --force, got none; add --plot."
        )
    settings: dict[str, object] = {
        "threshold": threshold,
        "criterion": criterion,
        "margin_db": margin_db,
        "hold_above": hold_above,
    }
    settings |= {"full_sha256": full.sha256, "threshold_sha256": result.threshold.sha256}
    contents = {Path(f"{start}{ending}"): data for ending, data in files.items()}
    results.write(contents, ran.provenance(settings))
    print_verdicts(result)
    if result.identical:
        print(
            f"note: {full.texture}: the simplified model is identical to the full one; there is "
            "nothing to compare, and in a session this texture is a control."
        )
    print(
        f"{counted(full.n_layers, 'layer')} reduced to {result.model.n_layers}"
        f"{simulated_note(full)}: {start}.json"
    )


def print_verdicts(result: Simplification) -> None:
    """Print the verdict on each layer with its reason, and the threshold."""
    for verdict in result.layers:
        line = f"layer {verdict.layer}: {verdict.verdict}, {verdict.reason}"
        if not isnan(verdict.distance_db):  # where a threshold is known
            line += (
                f"; {verdict.distance_db:+.1f} dB at {verdict.worst_speed_mm_s:g} mm/s, "
                f"{verdict.worst_force_n:g} N ({verdict.worst_frequency_hz:.0f} Hz)"
            )
        print(line)
    print(f"threshold: {result.threshold.name} ({result.threshold.caveat})")


def draw_condition(
    full: TextureModel,
    result: Simplification,
    *,
    recordings: Path | None,
    speed: float | None,
    force: float | None,
) -> bytes:
    """Draw spectra, layers and threshold of one condition (PAPER fig. 6), beside its recording.

    Returns a PNG file. Without speed (mm/s) or force (N) it is the fastest and strongest
    condition, of the recordings if there are any, else of the grid.
    """
    from tactileq.analysis.page.saving import picture_bytes
    from tactileq.analysis.spectra.comparison import compare_condition, compare_spectra
    from tactileq.analysis.spectra.figures.spectra import figure_spectra_and_threshold
    from tactileq.analysis.textures.results import TextureResult, reference_condition

    if recordings is None:
        fastest, strongest = float(full.speeds_mm_s[-1]), float(full.forces_n[-1])
        compare = partial(compare_condition, full, result)
    else:
        texture = TextureResult(_recordings_of(full.texture, recordings), full, result)
        fastest, strongest = reference_condition(texture)
        compare = partial(compare_spectra, texture)
    shown = compare(
        speed_mm_s=fastest if speed is None else speed,
        force_n=strongest if force is None else force,
    )
    return picture_bytes(figure_spectra_and_threshold(shown))


def _recordings_of(texture: str, folder: Path) -> RecordingSet:
    """The recordings of one texture in a folder, or in the sub-folder that holds them."""
    from tactileq.modeling.recordings.recording_set import recording_folders, textures_in

    for found in recording_folders(folder):
        if texture in textures_in(found):
            return usable_recordings(found, texture)
    raise ValueError(
        f"expected recordings of {texture!r} in {folder}, got none; give the folder that the model "
        "came from."
    )
