"""The front door: a command line that parses, calls and prints; rooms load when needed."""

from __future__ import annotations

import sys
from math import isnan
from pathlib import Path
from typing import Annotated, Literal

import typer

from steps import (
    add_to_set,
    demo_texture,
    fit_or_tell,
    labels_of,
    load_models,
    progress,
    run_study,
    save_and_tell,
    share_of,
    stem,
    study_from,
    threshold_named,
    warn_of_clipping,
    write_provenance,
)

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    help="Record a surface, keep what a finger can feel, render it, and find out with people "
    "whether anybody can tell the difference.",
)
imports = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,
    help="Take in recordings that other equipment made.",
)
app.add_typer(imports, name="import")

Out = Annotated[Path, typer.Option("--out", help="Where the results go.")]
Seed = Annotated[int, typer.Option(min=0, max=2**31, help="Seed of everything that is random.")]
Estimator = Annotated[
    Literal["paper", "paper-consistent"], typer.Option(help="How layers are found.")
]
ThresholdName = Annotated[
    str, typer.Option("--threshold", help="codec, pen-hold, or a TSV file of your own.")
]
Criterion = Annotated[
    Literal["energy", "paper-fft", "paper-gain"],
    typer.Option(help="Which amplitude is compared with the threshold."),
]
Margin = Annotated[float, typer.Option(help="How far below threshold a layer must be, in dB.")]
StudyFile = Annotated[
    Path | None, typer.Option("--study", help="Study file (TOML); the paper's design without it.")
]
Models = Annotated[Path, typer.Option("--models", help="Folder of full models.")]
Simplified = Annotated[Path, typer.Option("--simplified", help="Folder of simplified models.")]
Data = Annotated[Path, typer.Option("--data", help="Folder of the study's answers.")]

DEMO_CONTENTS = {
    *("recordings", "models", "simplified", "stimuli", "data", "tables", "figures"),
    *("report.html", "provenance.json"),
}


def main() -> None:
    """Run the command line; bad input ends with one sentence and exit code 1."""
    try:
        app(standalone_mode=True)
    except (ValueError, OSError) as error:
        # InputError is a ValueError, StoreError an OSError; both carry their own sentence.
        print(f"error: {error}", file=sys.stderr)
        raise SystemExit(1) from None


# --- From recordings to models ----------------------------------------------------------------


@app.command()
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
    from stimuli.planted import planted_texture, record_texture

    records = record_texture(
        planted_texture(texture), rate_hz=rate_hz, duration_s=duration_s, seed=seed
    )
    records.save(folder)
    write_provenance(
        folder / "provenance.json", "record", {"texture": texture, "rate_hz": rate_hz}, seed=seed
    )
    print(f"{len(records)} simulated recordings of {texture} in {folder}")


@imports.command("wav")
def import_wav(
    files: Annotated[list[Path], typer.Argument(help="Mono WAV files.")],
    out: Out = Path("recordings"),
    texture: Annotated[str | None, typer.Option(help="Name of the surface.")] = None,
    speed: Annotated[float | None, typer.Option(help="Speed of all files, mm/s.")] = None,
    force: Annotated[float | None, typer.Option(help="Force of all files, N.")] = None,
    labels: Annotated[
        Path | None, typer.Option(help="TSV: file, speed_mm_s, force_n (texture, repeat).")
    ] = None,
    g_per_fullscale: Annotated[
        float | None, typer.Option(help="Acceleration of a full-scale sample, g.")
    ] = None,
) -> None:
    """Add WAV recordings to a recording set.

    Example: tactileq import wav *.wav --labels labels.tsv --texture oak --g-per-fullscale 16
    """
    from rig.importing import import_wav as read

    records = read(
        files, labels_of(files, labels, texture, speed, force), g_per_fullscale=g_per_fullscale
    )
    settings = {"g_per_fullscale": g_per_fullscale, "labels": str(labels)}
    add_to_set(out, records, "import wav", settings=settings, files=files)


@imports.command("csv")
def import_csv(
    files: Annotated[list[Path], typer.Argument(help="CSV files with a header line.")],
    out: Out = Path("recordings"),
    texture: Annotated[str | None, typer.Option(help="Name of the surface.")] = None,
    speed: Annotated[float | None, typer.Option(help="Speed of all files, mm/s.")] = None,
    force: Annotated[float | None, typer.Option(help="Force of all files, N.")] = None,
    labels: Annotated[
        Path | None, typer.Option(help="TSV: file, speed_mm_s, force_n (texture, repeat).")
    ] = None,
    axis: Annotated[
        Literal["x", "y", "z", "dft321"] | None, typer.Option(help="Axis, or all as one.")
    ] = None,
    unit: Annotated[str | None, typer.Option(help="g, mg, m/s2 or arbitrary.")] = None,
    rate_hz: Annotated[
        float | None, typer.Option("--rate", help="Sampling rate in Hz; else from the time.")
    ] = None,
) -> None:
    """Add CSV recordings (time and one or three axes) to a recording set.

    Example: tactileq import csv run1.csv --speed 100 --force 1 --texture oak --axis dft321 --unit g
    """
    from rig.importing import import_csv as read

    records = read(
        files,
        labels_of(files, labels, texture, speed, force),
        axis=axis,
        unit=unit,
        rate_hz=rate_hz,
    )
    settings = {"axis": axis, "unit": unit, "rate_hz": rate_hz, "labels": str(labels)}
    add_to_set(out, records, "import csv", settings=settings, files=files)


@app.command()
def model(
    folder: Annotated[Path, typer.Argument(help="Folder of recordings.")],
    out: Out = Path("models"),
    estimator: Estimator = "paper-consistent",
) -> None:
    """Find the layers of every recording and fit a model of each texture over its grid.

    Writes TEXTURE.json, layers.tsv, spectra.tsv and TEXTURE_spectra.png.

    Example: tactileq model recordings/canvas --out models
    """
    from analysis.comparison import spectrum_panels
    from analysis.figures import figure_spectra
    from analysis.recordings import layers_table, spectra_table
    from modeling import RecordingSet, TextureModel
    from modeling.files import write_text
    from modeling.spectra import MODEL_RATE_HZ

    records = RecordingSet.load(folder)
    warn_of_clipping(records)
    rate_hz = min(r.rate_hz for r in records.recordings)
    if rate_hz < MODEL_RATE_HZ:
        print(
            f"note: the data's rate of {rate_hz:g} Hz becomes the model's; the band from "
            f"{rate_hz / 2:g} to {MODEL_RATE_HZ / 2:g} Hz is lost."
        )
    layers = layers_table(records, estimator=estimator)
    spectra = spectra_table(records)
    models: list[TextureModel] = []
    shortfalls: list[str] = []
    with progress("Fitting", len(records.textures)) as advance:
        for texture in records.textures:
            models += fit_or_tell(records.of_texture(texture), estimator, shortfalls)
            advance(texture)
    out.mkdir(parents=True, exist_ok=True)
    for name, table in (("layers", layers), ("spectra", spectra)):
        write_text(out / f"{name}.tsv", table.to_csv(sep="\t", index=False, na_rep="n/a"))
    for texture in records.textures:
        picture = out / f"{stem(texture)}_spectra.png"
        panels = spectrum_panels(records.of_texture(texture), estimator=estimator)
        figure_spectra(panels).savefig(picture, dpi=110)
        print(f"spectra of {texture}: {picture}")
    for fitted in models:
        save_and_tell(fitted, out)
    print(f"layers of each recording: {out / 'layers.tsv'}")
    for shortfall in shortfalls:
        print(f"no full model of {shortfall}")
    write_provenance(out / "provenance.json", "model", {"estimator": estimator}, inputs=[folder])


@app.command()
def simplify(
    model_file: Annotated[Path, typer.Argument(metavar="MODEL", help="A model file (JSON).")],
    out: Annotated[Path, typer.Option("--out", help="Folder.")] = Path("simplified"),
    threshold: ThresholdName = "codec",
    criterion: Criterion = "energy",
    margin_db: Margin = 0.0,
) -> None:
    """Drop the layers that nobody can feel, with a reason for each.

    Example: tactileq simplify models/canvas.json --threshold pen-hold --margin-db 3
    """
    from analysis.tables import simplification_table
    from modeling import TextureModel
    from modeling import simplify as drop_layers
    from modeling.files import write_text

    full = TextureModel.load(model_file)
    result = drop_layers(full, threshold_named(threshold), criterion=criterion, margin_db=margin_db)
    path = out / f"{stem(full.texture)}.json"
    if path.resolve() == model_file.resolve():
        raise ValueError(f"expected --out to be another folder than {model_file.parent}; name one.")
    result.model.save(path)
    table = simplification_table(result)
    write_text(
        out / f"{stem(full.texture)}_layers.tsv", table.to_csv(sep="\t", index=False, na_rep="n/a")
    )
    for verdict in result.layers:
        line = f"layer {verdict.layer}: {verdict.verdict}, {verdict.reason}"
        if not isnan(verdict.distance_db):  # where a threshold is known
            line += (
                f"; {verdict.distance_db:+.1f} dB at {verdict.worst_speed_mm_s:g} mm/s, "
                f"{verdict.worst_force_n:g} N ({verdict.worst_frequency_hz:.0f} Hz)"
            )
        print(line)
    print(f"threshold: {result.threshold.name} ({result.threshold.caveat})")
    settings = {"threshold": threshold, "criterion": criterion, "margin_db": margin_db}
    write_provenance(
        out / f"{stem(full.texture)}_provenance.json", "simplify", settings, inputs=[model_file]
    )
    print(f"{full.n_layers} layers to {result.model.n_layers}: {path}")


@app.command()
def stimuli(
    models: Annotated[list[Path], typer.Argument(help="Model files (JSON).")],
    out: Out = Path("stimuli-set"),
    speed: Annotated[list[float] | None, typer.Option(help="mm/s; may be repeated.")] = None,
    force: Annotated[list[float] | None, typer.Option(help="N; may be repeated.")] = None,
    rate_hz: Annotated[float, typer.Option("--rate", help="Sampling rate in Hz.")] = 48000.0,
    duration_s: Annotated[float, typer.Option("--duration", help="Seconds per file.")] = 1.0,
    seed: Seed = 0,
) -> None:
    """Render models to WAV files (samples in g) with a manifest.

    The manifest's column model holds the folder that each model came from.

    Example: tactileq stimuli models/*.json simplified/*.json --speed 150 --force 1.5
    """
    from modeling import TextureModel
    from stimuli.sets import write_set

    chosen = [(path.resolve().parent.name, TextureModel.load(path)) for path in models]
    conditions = [(v, f) for v in speed or [150.0] for f in force or [1.5]]
    with progress("Rendering", len(chosen) * len(conditions)) as advance:
        manifest = write_set(
            out,
            chosen,
            conditions=conditions,
            rate_hz=rate_hz,
            duration_s=duration_s,
            seed=seed,
            progress=advance,
        )
    write_provenance(
        out / "provenance.json", "stimuli", {"rate_hz": rate_hz}, seed=seed, inputs=models
    )
    print(f"{len(manifest)} files: {out / 'manifest.tsv'}")


# --- From models to answers, and to the verdict -----------------------------------------------


@app.command()
def session(
    task: Annotated[Literal["absolute", "relative"], typer.Option(help="Which evaluation.")],
    subject: Annotated[int, typer.Option(min=1, help="Number of the participant.")],
    models: Models = Path("models"),
    simplified: Simplified = Path("simplified"),
    data: Data = Path("data"),
    number: Annotated[int, typer.Option("--session", min=1, help="Which day.")] = 1,
    study: StudyFile = None,
    fullscreen: Annotated[bool, typer.Option(help="Fill the screen.")] = False,
    screen: Annotated[int, typer.Option(help="Which screen, from 0.")] = 0,
) -> None:
    """Run one participant's session at the console, with the simulated rig.

    Example: tactileq session --task absolute --subject 1 --data data
    """
    from experiments.console import Console
    from experiments.models import ModelSets
    from experiments.simulate import PROTOCOLS
    from rig.twin import SimulatedRig

    plan = study_from(study)
    sets = ModelSets(full=load_models(models), simplified=load_models(simplified))
    sets.require(plan.textures)
    print("note: the rig is the simulated one; its data are marked simulated.")
    with Console(fullscreen=fullscreen, screen=screen) as console:
        result = PROTOCOLS[task](
            plan,
            subject=subject,
            session=number,
            models=sets,
            rig=SimulatedRig(),
            respondent=console,
            data_folder=data,
        )
    print(f"{'completed' if result.completed else 'ended early'}: {result.path}")


@app.command()
def simulate(
    models: Models = Path("models"),
    simplified: Simplified = Path("simplified"),
    data: Data = Path("data"),
    study: StudyFile = None,
    threshold: ThresholdName = "codec",
    seed: Seed = 0,
) -> None:
    """Run the whole study with simulated participants of known truth.

    What stands for the real surfaces are the planted textures of the same names.

    Example: tactileq simulate --models models --simplified simplified --data data
    """
    from stimuli.planted import planted_texture

    plan = study_from(study)
    real = {name: planted_texture(name) for name in plan.textures}
    full, fewer = load_models(models), load_models(simplified)
    run_study(plan, real, full, fewer, data, threshold_named(threshold), seed)
    print(f"simulated answers: {data}")


@app.command()
def analyze(
    data: Annotated[Path, typer.Argument(help="Folder of the study's answers.")],
    out: Out = Path("analysis-results"),
    recordings: Annotated[
        Path | None, typer.Option(help="Folder of recording sets, one folder per texture.")
    ] = None,
    models: Annotated[Path | None, typer.Option(help="Folder of full models.")] = None,
    threshold: ThresholdName = "codec",
    criterion: Criterion = "energy",
    margin_db: Margin = 0.0,
    seed: Seed = 0,
) -> None:
    """Test the answers and write report.html with its tables and figures.

    With --recordings and --models the report also tells how good and how small the models are.

    Example: tactileq analyze data --recordings recordings --models models --out results
    """
    from analysis.load import load_responses
    from analysis.report import write_report
    from analysis.tables import TextureResult
    from modeling import RecordingSet
    from modeling import simplify as drop_layers

    if (recordings is None) != (models is None):
        raise ValueError("expected --recordings and --models together, got one; give both.")
    responses = load_responses(data)
    results = []
    if recordings is not None and models is not None:
        level = threshold_named(threshold)
        for full in load_models(models).values():
            records = RecordingSet.load(recordings / stem(full.texture))
            fewer = drop_layers(full, level, criterion=criterion, margin_db=margin_db)
            results.append(TextureResult(records.of_texture(full.texture), full, fewer))
    settings = {"threshold": threshold, "criterion": criterion, "margin_db": margin_db}
    inputs = [path for path in (data, recordings, models) if path is not None]
    provenance = write_provenance(
        out / "provenance.json", "analyze", settings, seed=seed, inputs=inputs
    )
    with share_of("Reporting") as tell:
        path = write_report(
            out / "report.html",
            responses=responses,
            textures=results,
            provenance=provenance,
            seed=seed,
            progress=tell,
        )
    for warning in responses.warnings:
        print(f"warning: {warning}", file=sys.stderr)
    print(path.resolve())


@app.command()
def demo(out: Out = Path("demo"), seed: Seed = 1) -> None:
    """The whole study in silico: record, model, simplify, render, ask, analyze.

    Example: tactileq demo --out demo
    """
    from joblib import Parallel, delayed

    from analysis.load import load_responses
    from analysis.report import write_report
    from modeling.files import replace_folder
    from stimuli.planted import TEXTURES
    from stimuli.sets import write_set

    if out.exists() and not {path.name for path in out.iterdir()} <= DEMO_CONTENTS:
        raise ValueError(
            f"expected a new folder or an earlier demo, got {out} with other files in it; "
            "choose another one."
        )
    plan = study_from(None)
    threshold = threshold_named("codec")
    print("A study in silico: simulated surfaces, simulated participants, the real program.")
    with replace_folder(out) as fresh:
        with progress("Recording, modeling, simplifying", len(TEXTURES)) as advance:
            jobs = (delayed(demo_texture)(name, fresh, seed) for name in TEXTURES)
            results = []
            for result in Parallel(n_jobs=2, return_as="generator")(jobs):
                results.append(result)
                advance(result.texture)
        full = {r.texture: r.model for r in results}
        fewer = {r.texture: r.simplification.model for r in results}
        real = {r.texture: r.truth for r in results}
        labelled = [("full", m) for m in full.values()] + [
            ("simplified", m) for m in fewer.values()
        ]
        with progress("Rendering stimuli", len(labelled)) as advance:
            write_set(
                fresh / "stimuli",
                labelled,
                conditions=[(150.0, 1.5)],
                rate_hz=48000.0,
                duration_s=1.0,
                seed=seed,
                progress=advance,
            )
        run_study(plan, real, full, fewer, fresh / "data", threshold, seed)
        provenance = write_provenance(
            fresh / "provenance.json", "demo", {"threshold": threshold.name}, seed=seed
        )
        with share_of("Analyzing") as tell:
            write_report(
                fresh / "report.html",
                responses=load_responses(fresh / "data"),
                textures=results,
                provenance=provenance,
                seed=seed,
                progress=tell,
            )
    print((out / "report.html").resolve())


if __name__ == "__main__":
    main()
