"""Commands about rendering: stimulus sets, vibrators, exports and the render bench."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rendering_steps import (
    bench_rendering_into,
    export_c_header,
    export_peq_json,
    export_wav_file,
    identify_from,
    recipe_from,
    render_stimuli,
)

exports = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,
    help="Give a model to other programs.",
)
benches = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,
    help="Time what runs beside what would run instead.",
)

Out = Annotated[Path, typer.Option("--out", help="Where the results go.")]
Seed = Annotated[int, typer.Option(min=0, max=2**31, help="Seed of everything that is random.")]
ModelFile = Annotated[Path, typer.Argument(metavar="MODEL", help="A model file (JSON).")]
VibratorFile = Annotated[
    Path | None,
    typer.Option("--vibrator", help="File from tactileq vibrator: compensate its resonance."),
]


def stimuli(
    named: Annotated[
        list[Path],
        typer.Argument(metavar="SET.toml|MODEL…", help="A recipe, or model files (JSON)."),
    ],
    out: Out = Path("stimuli-set"),
    speed: Annotated[list[float] | None, typer.Option(help="mm/s; may be repeated. [150]")] = None,
    force: Annotated[list[float] | None, typer.Option(help="N; may be repeated. [1.5]")] = None,
    rate_hz: Annotated[
        float | None, typer.Option("--rate", help="Sampling rate in Hz. [48000]")
    ] = None,
    duration_s: Annotated[
        float | None, typer.Option("--duration", help="Seconds per file. [1]")
    ] = None,
    seed: Annotated[
        int | None, typer.Option(min=0, max=2**31, help="Seed of the noise. [0]")
    ] = None,
    vibrator: VibratorFile = None,
) -> None:
    """Render a set of stimuli to WAV files, with a manifest and a picture of all spectra.

    A recipe (TOML) names models, trajectories (constant speed, or a hand's as CSV), seeds, rates,
    24-bit or float samples, the level (as modelled, one RMS, or matched in loudness) and the
    vibrator that plays it, for which it then holds the drive. The set holds its own recipe.toml
    with copies of the models, from which it can be made again bit for bit.

    Start from docs/stimuli.toml. A recipe needs version = 1; a name under [set]; for each model, or
    folder of them, a path under [[model]]; for each stroke under [[trajectory]] speed_mm_s and
    force_n, or a file (CSV: time_s, speed_mm_s, force_n).

    The options are for model files without a recipe; there the manifest's column model holds the
    folder that each model came from, and samples are g.

    Example: tactileq stimuli set.toml --out stimuli-set

    Example: tactileq stimuli models/*.json simplified/*.json --speed 150 --force 1.5
    """
    recipe = recipe_from(
        named,
        out,
        speeds=speed,
        forces=force,
        rate_hz=rate_hz,
        duration_s=duration_s,
        seed=seed,
        vibrator=vibrator,
    )
    render_stimuli(recipe, out, inputs=[path for path in named if path.suffix == ".toml"])


def vibrator(
    test: Annotated[Path, typer.Argument(metavar="TEST", help="WAV: drive, acceleration.")],
    out: Annotated[Path, typer.Option("--out", help="File of what is found.")] = Path(
        "vibrator.json"
    ),
    plot: Annotated[
        Path | None, typer.Option("--plot", help="PNG: response before and after, coherence.")
    ] = None,
    simulated: Annotated[
        bool, typer.Option("--simulated", help="The test was simulated: say so wherever it goes.")
    ] = False,
) -> None:
    """Identify a vibrator from a white-noise test, to compensate its resonance.

    TEST has two channels recorded at once, the drive and the acceleration, for 8.25 s at least. A
    poor coherence of the two is refused. What is found goes into a recipe (vibrator under [set]) or
    to --vibrator of tactileq stimuli, export wav and export c.

    Example: tactileq vibrator white-noise.wav --out vibrator.json --plot vibrator.png
    """
    identify_from(test, out, plot=plot, simulated=simulated)


@exports.command("c")
def export_c(
    model_file: ModelFile,
    out: Annotated[Path | None, typer.Option("--out", help="Header. [TEXTURE.h]")] = None,
    rate_hz: Annotated[
        float | None, typer.Option("--rate", help="Output rate in Hz; the model's without it.")
    ] = None,
    single: Annotated[bool, typer.Option("--single", help="Single precision.")] = False,
    seed: Seed = 0,
    vibrator: VibratorFile = None,
    peak: Annotated[float | None, typer.Option("--peak", help="Largest sample, g.")] = None,
    rms: Annotated[float | None, typer.Option("--rms", help="Largest running RMS, g.")] = None,
    duration_s: Annotated[
        float | None, typer.Option("--duration", help="Longest vibration without a pause, s.")
    ] = None,
) -> None:
    """Write a model and the renderer as one C99 header that needs nothing else.

    A comment on top of it shows a whole program. In double precision it renders what this program
    renders, bit for bit. Without --peak, --rms and --duration it has no limits.

    Example: tactileq export c models/canvas.json --rate 48000 --peak 5 --out canvas.h
    """
    export_c_header(
        model_file,
        out,
        rate_hz=rate_hz,
        seed=seed,
        single=single,
        vibrator=vibrator,
        limits={"peak": peak, "rms": rms, "duration_s": duration_s},
    )


@exports.command("wav")
def export_wav(
    model_file: ModelFile,
    speed: Annotated[float, typer.Option("--speed", help="mm/s.")],
    force: Annotated[float, typer.Option("--force", help="N.")],
    duration_s: Annotated[float, typer.Option("--duration", help="Seconds.")] = 1.0,
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
    speed: Annotated[float | None, typer.Option("--speed", help="With --force: mm/s.")] = None,
    force: Annotated[float | None, typer.Option("--force", help="With --speed: N.")] = None,
    out: Annotated[Path | None, typer.Option("--out", help="File. [TEXTURE_peq.json]")] = None,
) -> None:
    """Write a model's equalizer as JSON: one condition, or all of the grid.

    Each condition has its noise gain and its layers with frequency, bandwidth, gain and the
    coefficients of a biquad; the file says what the numbers mean.

    Example: tactileq export json models/canvas.json --speed 150 --force 1 --out canvas_peq.json
    """
    export_peq_json(model_file, out, speed=speed, force=force)


@benches.command("render")
def bench_render(
    out: Out = Path("bench-render"),
    quick: Annotated[bool, typer.Option("--quick", help="Measure briefly and roughly.")] = False,
    plot: Annotated[bool, typer.Option("--plot", help="Draw the times.")] = False,
) -> None:
    """Time rendering per sample beside other filters in C and scipy's sosfilt, noise included.

    Writes times.tsv, layers.tsv and aims.tsv, with --plot also rendering.png. The machine should
    have nothing else to do.

    Example: tactileq bench render --plot
    """
    bench_rendering_into(out, quick=quick, plot=plot)
