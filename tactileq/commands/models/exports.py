"""tactileq export: models for other programs."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import typer

from tactileq.commands.models.stimuli import print_beyond_grid, recipe_from
from tactileq.modeling.errors import counted
from tactileq.options import ModelFile, Seed, VibratorFile
from tactileq.printing import simulated_note
from tactileq.results import CommandRun, FileResults

exports = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,
    help="Export a model to other programs.",
)


@exports.command("c")
def export_c(
    model_file: ModelFile,
    out: Annotated[Path | None, typer.Option("--out", help="Header file. [TEXTURE.h]")] = None,
    rate_hz: Annotated[
        float | None, typer.Option("--rate", help="Output rate in Hz; by default the model's.")
    ] = None,
    name: Annotated[
        str | None,
        typer.Option(
            "--name", help="Name in C, instead of the texture's; must be unique within a program."
        ),
    ] = None,
    single: Annotated[bool, typer.Option("--single", help="Render in single precision.")] = False,
    seed: Seed = 0,
    vibrator: VibratorFile = None,
    peak: Annotated[float | None, typer.Option("--peak", help="Limit of the peak, g.")] = None,
    rms: Annotated[float | None, typer.Option("--rms", help="Limit of the running RMS, g.")] = None,
    duration_s: Annotated[
        float | None,
        typer.Option("--duration", help="Limit of the vibration's duration without a pause, s."),
    ] = None,
) -> None:
    """Write a model and the renderer as one self-contained C99 header.

    A comment at its top shows a complete program. In double precision it renders what this program
    renders, bit for bit. Without --peak, --rms and --duration it has no limits.

    The header contains the renderer's source, which is licensed under GPL-3.0-or-later: a program
    that includes it can be distributed under that licence only. The model's numbers are your data.

    Example: tactileq export c models/canvas.json --rate 48000 --peak 5 --out canvas.h
    """
    export_c_header(
        model_file,
        out,
        name=name,
        rate_hz=rate_hz,
        seed=seed,
        single=single,
        vibrator=vibrator,
        limits={"peak": peak, "rms": rms, "duration_s": duration_s},
    )


@exports.command("wav")
def export_wav(
    model_file: ModelFile,
    speed: Annotated[float, typer.Option("--speed", help="Speed, mm/s.")],
    force: Annotated[float, typer.Option("--force", help="Force, N.")],
    duration_s: Annotated[float, typer.Option("--duration", help="Duration, s.")] = 1.0,
    rate_hz: Annotated[float, typer.Option("--rate", help="Sampling rate in Hz.")] = 48000.0,
    seed: Seed = 0,
    vibrator: VibratorFile = None,
    out: Annotated[Path | None, typer.Option("--out", help="WAV file. [TEXTURE.wav]")] = None,
) -> None:
    """Write the vibration at one speed and force as a WAV file (32-bit float samples in g).

    Example: tactileq export wav models/canvas.json --speed 150 --force 1 --duration 2 --out x.wav
    """
    export_wav_file(
        model_file,
        out,
        speed=speed,
        force=force,
        rate_hz=rate_hz,
        duration_s=duration_s,
        seed=seed,
        vibrator=vibrator,
    )


@exports.command("json")
def export_json(
    model_file: ModelFile,
    speed: Annotated[
        float | None, typer.Option("--speed", help="With --force: speed, mm/s.")
    ] = None,
    force: Annotated[float | None, typer.Option("--force", help="With --speed: force, N.")] = None,
    out: Annotated[Path | None, typer.Option("--out", help="JSON file. [TEXTURE_peq.json]")] = None,
) -> None:
    """Write a model's equalizer as JSON: one condition, or all conditions of the grid.

    Each condition has its noise gain and its layers with frequency, bandwidth, gain and the
    coefficients of a biquad; the file explains its numbers.

    Example: tactileq export json models/canvas.json --speed 150 --force 1 --out canvas_peq.json
    """
    export_peq_json(model_file, out, speed=speed, force=force)


def export_c_header(
    model_file: Path,
    out: Path | None,
    *,
    name: str | None,
    rate_hz: float | None,
    seed: int,
    single: bool,
    vibrator: Path | None,
    limits: Mapping[str, float | None],
) -> None:
    """Write a model and the kernel as one C header, with provenance.

    `limits` are those of `tactileq.Limits`, None for none.
    """
    from tactileq.modeling import Limits, Vibrator, compensation_for
    from tactileq.modeling.files.writing import file_stem
    from tactileq.modeling.models.loading import load_model
    from tactileq.stimuli.exports.c_header import c_header

    ran = CommandRun("export c")
    ran.reads(model_file, vibrator)
    model = load_model(model_file)
    target = out or Path(f"{file_stem(name or model.texture)}.h")
    results = FileResults([target], ran.command, texture=model.texture)
    rate_hz = model.rate_hz if rate_hz is None else rate_hz
    compensation, played_by = None, ""
    if vibrator is not None:
        found = Vibrator.load(vibrator)
        compensation = compensation_for(found, rate_hz=rate_hz)
        played_by = f" for a vibrator{' (simulated)' if found.simulated else ''}"
    symbol, text = c_header(
        target.name,
        model,
        name=name,
        rate_hz=rate_hz,
        seed=seed,
        single=single,
        limits=Limits(**{what: value for what, value in limits.items() if value is not None}),
        compensation=compensation,
    )
    settings = {"name": name, "rate_hz": rate_hz, "single": single, "limits": dict(limits)}
    results.write({target: text.encode()}, ran.provenance(settings, seed=seed))
    print(f"{symbol}{simulated_note(model)}{played_by}: {target}")


def export_wav_file(
    model_file: Path,
    out: Path | None,
    *,
    speed: float,
    force: float,
    rate_hz: float,
    duration_s: float,
    seed: int,
    vibrator: Path | None,
) -> None:
    """Write a model's vibration at one speed and force, with provenance; print its level."""
    from tactileq.modeling.files.writing import file_stem
    from tactileq.modeling.models.loading import load_model
    from tactileq.stimuli.exports.wav import only_stimulus
    from tactileq.stimuli.sets.sources import load_sources

    ran = CommandRun("export wav")
    ran.reads(model_file, vibrator)
    model = load_model(model_file)
    target = out or Path(f"{file_stem(model.texture)}.wav")
    results = FileResults([target], ran.command, texture=model.texture)
    recipe = recipe_from(
        [model_file],
        target,
        speeds=[speed],
        forces=[force],
        rate_hz=rate_hz,
        duration_s=duration_s,
        seed=seed,
        vibrator=vibrator,
    )
    sources = load_sources(recipe)
    stimulus, data = only_stimulus(recipe, sources)
    settings = {"recipe": recipe.to_toml()}
    results.write({target: data}, ran.provenance(settings, seed=seed))
    print_beyond_grid(sources)
    drive = "" if vibrator is None else ", as drive signal for the vibrator"
    simulated = " (simulated)" if stimulus.simulated == "true" else ""
    print(
        f"{model.texture}{simulated}, {stimulus.duration_s:g} s at {stimulus.rate_hz} "
        f"Hz, {stimulus.level_db:.1f} dB re 1 {stimulus.unit} (RMS), peak {stimulus.peak:.3g} "
        f"{stimulus.unit}{drive}: {target}"
    )


def export_peq_json(
    model_file: Path, out: Path | None, *, speed: float | None, force: float | None
) -> None:
    """Write a model's equalizer at one condition or over its grid as JSON, with provenance."""
    from tactileq.modeling.files.documents import dump_json
    from tactileq.modeling.files.writing import file_stem
    from tactileq.modeling.models.loading import load_model
    from tactileq.stimuli.exports.peq_json import peq_document

    ran = CommandRun("export json")
    ran.reads(model_file)
    model = load_model(model_file)
    target = out or Path(f"{file_stem(model.texture)}_peq.json")
    results = FileResults([target], ran.command, texture=model.texture)
    document = peq_document(model, speed_mm_s=speed, force_n=force)
    count = len(document["conditions"])
    settings = {"speed_mm_s": speed, "force_n": force}
    results.write({target: dump_json(document).encode()}, ran.provenance(settings))
    conditions = counted(count, "condition")
    print(f"{conditions} of {model.texture}{simulated_note(model)}: {target}")
