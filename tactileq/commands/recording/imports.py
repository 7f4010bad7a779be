"""tactileq import: recordings that other equipment made."""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from tactileq.modeling.errors import counted, shown
from tactileq.options import Out, Seed
from tactileq.printing import clipping_warnings, progress
from tactileq.results import CommandRun

if TYPE_CHECKING:
    from tactileq.modeling import RecordingSet
    from tactileq.rig.recording.importing.files import Imported
    from tactileq.rig.recording.importing.hatt import HattTexture
    from tactileq.rig.recording.importing.hatt_grid import ToolkitGrid
    from tactileq.rig.recording.importing.labels import Label

imports = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,
    help="Import recordings made with other equipment.",
)
SurfaceName = Annotated[
    str | None, typer.Option("--texture", help="Name of the surface; by default the name of --out.")
]
SpeedOfAll = Annotated[float | None, typer.Option("--speed", help="Speed of all files, mm/s.")]
ForceOfAll = Annotated[float | None, typer.Option("--force", help="Force of all files, N.")]
LabelTable = Annotated[
    Path | None,
    typer.Option(
        "--labels",
        help="TSV: file, speed_mm_s, force_n (texture, repeat; for WAV g_per_fullscale, channel).",
    ),
]
Yes = Annotated[
    bool,
    typer.Option("--yes", help="Import implausible values, too, with a warning."),
]
# This many names of files are listed; the rest are counted.
MOST_NAMES = 5


@imports.command("wav")
def import_wav(
    files: Annotated[list[Path], typer.Argument(help="WAV files.")],
    out: Out = Path("recordings"),
    texture: SurfaceName = None,
    speed: SpeedOfAll = None,
    force: ForceOfAll = None,
    labels: LabelTable = None,
    g_per_fullscale: Annotated[
        float | None, typer.Option(help="Acceleration of a full-scale sample, g.")
    ] = None,
    channel: Annotated[
        int | None,
        typer.Option(min=1, help="Number of the channel, from 1, of files with several."),
    ] = None,
    yes: Yes = False,
) -> None:
    """Add WAV recordings to a recording set, which keeps copies of the files.

    Example: tactileq import wav *.wav --labels labels.tsv --texture oak --g-per-fullscale 16
    """
    from tactileq.rig.recording.importing.files import import_wav_file, usable

    ran = CommandRun("import wav")
    ran.reads(*files, labels)
    named = labels_of(files, labels, texture=texture or out.name, speed=speed, force=force)
    read = partial(import_wav_file, g_per_fullscale=g_per_fullscale, channel=channel)
    records, refused = usable(read, files, named)
    settings = {"g_per_fullscale": g_per_fullscale, "channel": channel, "labels": str(labels)}
    add_to_set(out, records, ran, settings=settings, left_out=refused, yes=yes)


@imports.command("csv")
def import_csv(
    files: Annotated[list[Path], typer.Argument(help="CSV files with a header line.")],
    out: Out = Path("recordings"),
    texture: SurfaceName = None,
    speed: SpeedOfAll = None,
    force: ForceOfAll = None,
    labels: LabelTable = None,
    axis: Annotated[
        Literal["x", "y", "z", "dft321"] | None,
        typer.Option(help="Axis, or all axes reduced to one."),
    ] = None,
    unit: Annotated[str | None, typer.Option(help="Unit: g, mg, m/s2, V, mV or arbitrary.")] = None,
    rate_hz: Annotated[
        float | None,
        typer.Option("--rate", help="Sampling rate in Hz; by default from the time column."),
    ] = None,
    mv_per_g: Annotated[
        float | None,
        typer.Option("--mv-per-g", help="Sensitivity of the accelerometer, for logs in volts."),
    ] = None,
    time_column: Annotated[
        str | None, typer.Option("--time-column", help="Name of the time column.")
    ] = None,
    columns: Annotated[
        list[str] | None,
        typer.Option(
            "--map",
            help="Meaning of the columns: time=Zeit,z=Beschl_Z, or a TOML file with these; "
            "repeatable.",
        ),
    ] = None,
    yes: Yes = False,
) -> None:
    """Add CSV recordings (time and one or three axes) to a recording set.

    Unevenly spaced samples, such as a phone's, are resampled at even intervals, unless --rate
    states that they are even. Where times leave a gap or jump back, the longest part is taken.
    Times since 1970 may be in s, ms, us or ns; for other times the header names the unit.

    Example: tactileq import csv run1.csv --speed 100 --force 1 --texture oak --axis dft321 --unit g

    Example: tactileq import csv *.csv --labels labels.tsv --map time=Zeit,z=Kanal_1 --mv-per-g 100
    """
    from tactileq.modeling.files.others.roles import is_file_of_roles
    from tactileq.rig.recording.importing.csv_columns import parse_columns
    from tactileq.rig.recording.importing.files import import_csv_file, usable

    role_of = parse_columns(columns or ())
    if time_column is not None:
        if "time" in role_of:
            raise ValueError(
                f"expected the column of times once, got --time-column {time_column} and --map "
                f"{' '.join(columns or ())}; leave one out."
            )
        role_of["time"] = time_column

    ran = CommandRun("import csv")
    ran.reads(*files, labels, *map(Path, filter(is_file_of_roles, columns or ())))
    named = labels_of(files, labels, texture=texture or out.name, speed=speed, force=force)
    read = partial(
        import_csv_file, axis=axis, unit=unit, rate_hz=rate_hz, mv_per_g=mv_per_g, named=role_of
    )
    records, refused = usable(read, files, named)
    settings = {
        "axis": axis,
        "unit": unit,
        "rate_hz": rate_hz,
        "mv_per_g": mv_per_g,
        "columns": role_of,
        "labels": str(labels),
    }
    add_to_set(out, records, ran, settings=settings, left_out=refused, yes=yes)


@imports.command("hatt")
def import_hatt(
    files: Annotated[
        list[Path], typer.Argument(help="Models_....xml of the toolkit, or folders of them.")
    ],
    out: Out = Path("recordings"),
    speed: Annotated[list[float] | None, typer.Option(help="Speed, mm/s; repeatable.")] = None,
    force: Annotated[list[float] | None, typer.Option(help="Force, N; repeatable.")] = None,
    own_conditions: Annotated[
        bool,
        typer.Option(
            "--own-conditions", help="No grid: the scattered conditions of each file's models."
        ),
    ] = False,
    rate_hz: Annotated[
        float | None, typer.Option("--rate", help="Sampling rate in Hz; by default the file's.")
    ] = None,
    duration_s: Annotated[float, typer.Option("--duration", help="Seconds per record.")] = 10.0,
    seed: Seed = 0,
    yes: Yes = False,
) -> None:
    """Add simulated recordings from models of the Penn Haptic Texture Toolkit.

    By default a grid of 7 x 7 spans the range of each file's models: from the lowest speed and
    force with vibration to the highest. Conditions outside the hull of the models are left out, so
    that they count as missing. With --own-conditions there is one recording for each model with
    vibration, at its own speed and force. The toolkit is not included.

    Example: tactileq import hatt "Models_Canvas 1.xml" Models_MDF.xml --out recordings/hatt

    Example: tactileq import hatt "Models_Canvas 1.xml" --speed 100 --speed 200 --force 1 --force 2
    """
    from tactileq.rig.recording.importing.files import Imported
    from tactileq.rig.recording.importing.hatt_grid import spanning_grid
    from tactileq.rig.recording.importing.hatt_reader import load_hatt
    from tactileq.rig.recording.importing.plausible import doubts_about

    if own_conditions and (speed or force):
        raise ValueError(
            "expected the grid of --speed and --force or --own-conditions, got both; leave one out."
        )
    files = [file for given in files for file in models_of_the_toolkit(given)]
    ran = CommandRun("import hatt")
    ran.reads(*files)
    textures = [load_hatt(file) for file in files]
    check_one_file_each(files, [texture.material for texture in textures])
    grids = [
        None
        if own_conditions
        else spanning_grid(texture, speeds_mm_s=speed or None, forces_n=force or None)
        for texture in textures
    ]
    made = []
    with progress("Synthesising", len(textures)) as advance:
        for texture, grid in zip(textures, grids, strict=True):
            made.append(
                synthesised(texture, grid, duration_s=duration_s, rate_hz=rate_hz, seed=seed)
            )
            advance(texture.material)
    records = [
        Imported(record, doubts=doubts_about(record, record.describe(), unit="m/s2"))
        for of_texture in made
        for record in of_texture
    ]
    settings = {
        "speeds_mm_s": speed,
        "forces_n": force,
        "own_conditions": own_conditions,
        "grids": {
            texture.material: {"speeds_mm_s": grid.speeds.values, "forces_n": grid.forces.values}
            for texture, grid in zip(textures, grids, strict=True)
            if grid is not None
        },
        "duration_s": duration_s,
        "seed": seed,
    }
    add_to_set(out, records, ran, settings=settings, yes=yes)
    print_conditions(made, grids)


def check_one_file_each(files: Sequence[Path], materials: Sequence[str]) -> None:
    """Refuse two files of one texture: their conditions would be mixed in one model."""
    first: dict[str, Path] = {}
    for file, material in zip(files, materials, strict=True):
        if material in first:
            raise ValueError(
                f"expected one file per texture, got {first[material]} and {file}, both of "
                f"{shown(material)}; leave one out."
            )
        first[material] = file


def synthesised(
    texture: HattTexture,
    grid: ToolkitGrid | None,
    *,
    duration_s: float,
    rate_hz: float | None,
    seed: int,
) -> RecordingSet:
    """Recordings of one texture over a grid or, without one, at its own conditions."""
    if grid is None:
        return texture.own_recordings(duration_s=duration_s, rate_hz=rate_hz, seed=seed)
    return texture.recordings(
        grid.speeds.values, grid.forces.values, duration_s=duration_s, rate_hz=rate_hz, seed=seed
    )


def models_of_the_toolkit(given: Path) -> list[Path]:
    """A file itself, or the Models_….xml anywhere in a folder, by name."""
    if not given.is_dir():
        return [given]
    found = sorted(given.rglob("Models_*.xml"))
    if not found:
        raise ValueError(
            f"expected files Models_….xml of the toolkit in {given}, got none; name the folder of "
            "its models."
        )
    return found


def labels_of(
    files: Sequence[Path],
    table: Path | None,
    *,
    texture: str,
    speed: float | None,
    force: float | None,
) -> list[Label]:
    """Labels of the files from a table, or the same speed and force for all of them."""
    from tactileq.rig.recording.importing.labels import Label, labels_from_table

    if table is not None:
        if speed is not None or force is not None:
            raise ValueError(
                "expected labels from --labels or from --speed and --force, got both; give one."
            )
        labels, unused = labels_from_table(table, files, texture=texture)
        if unused:
            print(f"note: rows of {table} for files that were not given: {_first_of(unused)}")
        return labels
    if speed is None or force is None:
        raise ValueError(
            "expected the speed and force of the files, got "
            f"--speed {speed} and --force {force}; give both, or --labels with a TSV."
        )
    return [Label(texture, speed, force) for _ in files]


def _first_of(names: Sequence[str]) -> str:
    """The first few of some names, and how many more there are."""
    more = f" and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else ""
    return ", ".join(names[:MOST_NAMES]) + more


def add_to_set(
    out: Path,
    new: Sequence[Imported],
    ran: CommandRun,
    *,
    settings: Mapping[str, object],
    left_out: Sequence[str] = (),
    yes: bool = False,
) -> None:
    """Add imported recordings to those that `out` already holds.

    `ran`: what was read. `left_out`: a sentence for each file that could not be used.
    Implausible values are refused or, if `yes`, warned about. Warnings are written into the
    provenance.
    """
    from tactileq.modeling import RecordingSet
    from tactileq.modeling.files.places import locked
    from tactileq.modeling.files.provenance import PROVENANCE_NAME, provenance_text
    from tactileq.modeling.recordings.appending import staged

    doubts = [doubt for one in new for doubt in one.doubts]
    if doubts and not yes:
        raise ValueError(several(doubts))
    records = RecordingSet(one.recording for one in new)
    names = [Path(path).name for path in ran.inputs]
    for sentence in (
        *alike([f"warning: imported anyway: {doubt}" for doubt in doubts], names),
        *alike(clipping_warnings(records), names),
        *alike([f"warning: {sentence}" for one in new for sentence in one.warnings], names),
        *alike([f"warning: left out: {sentence}" for sentence in left_out], names),
    ):
        print(sentence, file=sys.stderr)
    note = out / PROVENANCE_NAME
    notes = [*(sentence for one in new for sentence in one.warnings), *left_out]
    taken = {name: said for name, said in (("doubts", doubts), ("notes", notes)) if said}
    provenance = ran.provenance({**settings, **taken})
    # Only quick work is done under the lock, while another import into the same set has to wait.
    with staged(out, records, [one.source for one in new]) as ready, locked(out):
        provenance["settings"]["added to"] = imports_before(note)
        count = ready.add({PROVENANCE_NAME: provenance_text(provenance).encode()})
    if any(record.unit == "arbitrary" for record in records):
        print(
            "note: the unit is arbitrary, so models cannot be simplified; give --g-per-fullscale "
            "(WAV) or --unit (CSV)."
        )
    rates = sorted({f"{record.rate_hz:g}" for record in records})
    if left_out:
        print(f"note: {len(left_out)} of {counted(len(new) + len(left_out), 'file')} left out")
    print(f"{counted(len(new), 'recording')} added at {', '.join(rates)} Hz, {count} in {out}")


def alike(sentences: Sequence[str], names: Sequence[str]) -> list[str]:
    """The first sentence of each kind, with the names of the files that the others are about.

    Sentences of one kind differ only in numbers and in these names of files.
    """
    if not sentences:
        return []
    files = "|".join(map(re.escape, sorted(names, key=len, reverse=True)))
    kinds: dict[str, list[str]] = {}
    for sentence in sentences:
        kind = re.sub(r"[-+]?\d[\d.]*(?:e[-+]?\d+)?", "0", re.sub(files, "", sentence))
        kinds.setdefault(kind, []).append(sentence)
    return [_with_others(one, names) for one in kinds.values()]


def _with_others(sentences: Sequence[str], names: Sequence[str]) -> str:
    if len(sentences) == 1:
        return sentences[0]
    others = [next((name for name in names if name in one), "") for one in sentences[1:]]
    named = [name for name in others if name][:MOST_NAMES]
    more = ", …" if len(others) > len(named) else ""
    which = f": {', '.join(named)}{more}" if named else ""
    return f"{sentences[0].removesuffix('.')} ({len(others)} more like it{which})."


def several(sentences: Sequence[str]) -> str:
    """The first of some sentences, and how many more there are."""
    more = f" ({len(sentences) - 1} more like it)" if len(sentences) > 1 else ""
    return f"{sentences[0].removesuffix('.')}{more}."


def imports_before(provenance: Path) -> list[dict[str, Any]]:
    """The imports so far that a set's provenance lists, in order, as a flat list.

    Nested, each would be indented deeper with every import.
    """
    from tactileq.modeling.files.documents import read_json_object

    entry: Any = None
    if provenance.is_file():
        entry = read_json_object(provenance, advice="remove the file")
    history: list[dict[str, Any]] = []
    while isinstance(entry, dict):
        settings = entry.get("settings")
        earlier = settings.pop("added to", None) if isinstance(settings, dict) else None
        history.insert(0, entry)
        if isinstance(earlier, list):
            return [*earlier, *history]
        entry = earlier  # older sets nest each import within the next one
    return history


def print_conditions(made: Sequence[RecordingSet], grids: Sequence[ToolkitGrid | None]) -> None:
    """Report which conditions were taken: a line for each of the first textures, then their sum."""
    for records, grid in list(zip(made, grids, strict=True))[:MOST_NAMES]:
        phrase = own_range(records) if grid is None else grid.describe()
        print(f"{records.texture}: {phrase}")
    kept, others = sum(map(len, made[MOST_NAMES:])), grids[MOST_NAMES:]
    if others:
        nodes = sum(len(grid.conditions) for grid in others if grid is not None)
        what = f"{kept} of {counted(nodes, 'node')}" if nodes else counted(kept, "own condition")
        print(f"{counted(len(others), 'more texture')}: {what}; provenance.json lists grids")
    if any(grid is not None and grid.inside < len(grid.conditions) for grid in grids):
        print("note: nodes outside the hull of a file's models, or silent there, are left out")


def own_range(records: RecordingSet) -> str:
    """One phrase: how many conditions, over what range."""
    speeds, forces = zip(*(record.condition for record in records), strict=True)
    return (
        f"{counted(len(records), 'own condition')}, {min(speeds):.4g} to {max(speeds):.4g} mm/s "
        f"x {min(forces):.4g} to {max(forces):.4g} N"
    )
