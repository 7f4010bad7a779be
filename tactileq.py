"""The front door: a command line that parses, calls and prints; rooms load when needed."""

from __future__ import annotations

import sys
from functools import partial
from pathlib import Path
from typing import Annotated, Literal

import typer

from modeling_steps import HowToModel, draw_condition, model_textures, tell_verdicts
from rendering_commands import ModelFile, Out, Seed, benches, exports, stimuli, vibrator
from rendering_steps import demo_recipe, render_set
from steps import (
    add_to_set,
    check_own_model,
    check_own_results,
    demo_texture,
    labels_of,
    load_models,
    open_console,
    progress,
    results_of_study,
    run_study,
    sentence_of,
    share_of,
    simplification_shown,
    simulated_note,
    study_from,
    tell_beyond_hull,
    threshold_named,
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
app.add_typer(exports, name="export")
app.add_typer(benches, name="bench")

Estimator = Annotated[
    Literal["joint", "paper", "paper-consistent"], typer.Option(help="How layers are found.")
]
ThresholdName = Annotated[
    str, typer.Option("--threshold", help="codec, pen-hold, mobile, or a TSV file of your own.")
]
Criterion = Annotated[
    Literal["energy", "paper-fft", "paper-gain"],
    typer.Option(help="Which amplitude is compared with the threshold."),
]
Margin = Annotated[float, typer.Option(help="How far below threshold a layer must be, in dB.")]
HoldAbove = Annotated[
    bool,
    typer.Option(
        "--hold-above/--known-only",
        help="Above the threshold's table hold its last level as a lower bound, or know nothing.",
    ),
]
StudyFile = Annotated[
    Path | None, typer.Option("--study", help="Study file (TOML); the paper's design without it.")
]
Models = Annotated[Path, typer.Option("--models", help="Folder of full models.")]
Simplified = Annotated[Path, typer.Option("--simplified", help="Folder of simplified models.")]
Data = Annotated[Path, typer.Option("--data", help="Folder of the study's answers.")]

SurfaceName = Annotated[
    str | None, typer.Option("--texture", help="Name of the surface; the name of --out without it.")
]
SpeedOfAll = Annotated[float | None, typer.Option("--speed", help="Speed of all files, mm/s.")]
ForceOfAll = Annotated[float | None, typer.Option("--force", help="Force of all files, N.")]
LabelTable = Annotated[
    Path | None, typer.Option("--labels", help="TSV: file, speed_mm_s, force_n (texture, repeat).")
]

REPORT_CONTENTS = {"report.html", "tables", "figures", "provenance.json"}
DEMO_CONTENTS = REPORT_CONTENTS | {"recordings", "models", "simplified", "stimuli", "data"}


def main() -> None:
    """Run the command line; bad input ends with one sentence and exit code 1."""
    try:
        app(standalone_mode=True)
        return
    except (ValueError, OSError, MemoryError) as error:  # InputError is a ValueError
        sentence = sentence_of(error)
    print(f"error: {sentence}", file=sys.stderr)
    raise SystemExit(1)


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

    if not duration_s > 0:
        raise ValueError(f"expected a duration above 0 s, got {duration_s:g}; give a longer one.")
    if folder.exists() and (folder.is_file() or any(folder.iterdir())):
        raise ValueError(f"expected a new folder, got {folder}, which exists; choose another name.")
    truth = planted_texture(texture)
    with progress(f"Recording {texture} in silico", 1) as advance:
        records = record_texture(truth, rate_hz=rate_hz, duration_s=duration_s, seed=seed)
        records.save(folder)
        advance("")
    settings = {"texture": texture, "rate_hz": rate_hz, "duration_s": duration_s}
    write_provenance(folder / "provenance.json", "record", settings, seed=seed)
    print(f"{len(records)} simulated recordings of {texture} in {folder}")


@imports.command("wav")
def import_wav(
    files: Annotated[list[Path], typer.Argument(help="Mono WAV files.")],
    out: Out = Path("recordings"),
    texture: SurfaceName = None,
    speed: SpeedOfAll = None,
    force: ForceOfAll = None,
    labels: LabelTable = None,
    g_per_fullscale: Annotated[
        float | None, typer.Option(help="Acceleration of a full-scale sample, g.")
    ] = None,
) -> None:
    """Add WAV recordings to a recording set.

    Example: tactileq import wav *.wav --labels labels.tsv --texture oak --g-per-fullscale 16
    """
    from rig.importing import import_wav as read
    from rig.importing import usable

    named = labels_of(files, labels, texture=texture or out.name, speed=speed, force=force)
    records, refused = usable(partial(read, g_per_fullscale=g_per_fullscale), files, named)
    settings = {"g_per_fullscale": g_per_fullscale, "labels": str(labels)}
    add_to_set(out, records, "import wav", settings=settings, files=files, left_out=refused)


@imports.command("csv")
def import_csv(
    files: Annotated[list[Path], typer.Argument(help="CSV files with a header line.")],
    out: Out = Path("recordings"),
    texture: SurfaceName = None,
    speed: SpeedOfAll = None,
    force: ForceOfAll = None,
    labels: LabelTable = None,
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
    from rig.importing import usable

    named = labels_of(files, labels, texture=texture or out.name, speed=speed, force=force)
    read_one = partial(read, axis=axis, unit=unit, rate_hz=rate_hz)
    records, refused = usable(read_one, files, named)
    settings = {"axis": axis, "unit": unit, "rate_hz": rate_hz, "labels": str(labels)}
    add_to_set(out, records, "import csv", settings=settings, files=files, left_out=refused)


@imports.command("hatt")
def import_hatt(
    files: Annotated[list[Path], typer.Argument(help="Models_....xml of the toolkit.")],
    out: Out = Path("recordings"),
    speed: Annotated[list[float] | None, typer.Option(help="mm/s; may be repeated.")] = None,
    force: Annotated[list[float] | None, typer.Option(help="N; may be repeated.")] = None,
    rate_hz: Annotated[
        float | None, typer.Option("--rate", help="Sampling rate in Hz; the file's without it.")
    ] = None,
    duration_s: Annotated[float, typer.Option("--duration", help="Seconds per record.")] = 10.0,
    seed: Seed = 0,
) -> None:
    """Add simulated recordings from models of the Penn Haptic Texture Toolkit.

    Without --speed and --force: 50 to 350 mm/s x 0.5 to 3.5 N, 7 x 7. Conditions beyond a file's
    models are left out, so that they count as holes. The toolkit is not included.

    Example: tactileq import hatt "Models_Canvas 1.xml" Models_MDF.xml --out recordings/hatt
    """
    from modeling import RecordingSet
    from rig.hatt import load_hatt

    speeds = speed or [50.0 * step for step in range(1, 8)]
    forces = force or [0.5 * step for step in range(1, 8)]
    textures = [load_hatt(file) for file in files]
    made = []
    with progress("Synthesising", len(textures)) as advance:
        for texture in textures:
            made.append(
                texture.recordings(
                    speeds, forces, duration_s=duration_s, rate_hz=rate_hz, seed=seed
                )
            )
            advance(texture.material)
    records = RecordingSet(record for of_texture in made for record in of_texture)
    settings = {"speeds_mm_s": speeds, "forces_n": forces, "duration_s": duration_s, "seed": seed}
    add_to_set(out, records, "import hatt", settings=settings, files=files)
    for texture in textures:
        tell_beyond_hull(texture, [(v, f) for v in speeds for f in forces])


@app.command()
def model(
    folders: Annotated[
        list[Path],
        typer.Argument(metavar="FOLDER…", help="Folders of recordings, or a folder of them."),
    ],
    out: Out = Path("models"),
    estimator: Estimator = "joint",
    layers: Annotated[
        int | None, typer.Option(min=1, help="Number of layers; chosen without it (joint).")
    ] = None,
    check: Annotated[
        bool, typer.Option("--check", help="Leave conditions out and foretell them.")
    ] = False,
    alone: Annotated[
        bool, typer.Option("--alone", help="Find the layers of each recording by itself, too.")
    ] = False,
    keep_hum: Annotated[
        bool, typer.Option("--keep-hum", help="Leave hum of the mains in the recordings.")
    ] = False,
    plot: Annotated[
        bool, typer.Option("--plot", help="Draw some spectra, and the layers over the grid.")
    ] = False,
    jobs: Annotated[
        int | None, typer.Option(min=1, help="Textures at a time; one per core without it.")
    ] = None,
) -> None:
    """Fit a model of each texture over its grid of speeds and forces.

    Writes TEXTURE.json, TEXTURE_layers.tsv and TEXTURE_spectra.tsv, with --check TEXTURE_check.tsv,
    with --alone TEXTURE_alone.tsv, with --plot TEXTURE_spectra.png and TEXTURE_layers.png. A
    recording that cannot be used is left out, and a texture that cannot be modelled does not stop
    the others.

    Example: tactileq model recordings/* --out models --check
    """
    how = HowToModel(
        estimator, layers=layers, keep_hum=keep_hum, check=check, alone=alone, plot=plot
    )
    model_textures(folders, out, how=how, jobs=jobs)


@app.command()
def simplify(
    model_file: ModelFile,
    out: Annotated[Path, typer.Option("--out", help="Folder.")] = Path("simplified"),
    threshold: ThresholdName = "codec",
    criterion: Criterion = "energy",
    margin_db: Margin = 0.0,
    hold_above: HoldAbove = True,
    plot: Annotated[
        bool, typer.Option("--plot", help="Draw spectra, layers and threshold of one condition.")
    ] = False,
    recordings: Annotated[
        Path | None, typer.Option(help="With --plot: recordings to draw the model beside.")
    ] = None,
    speed: Annotated[float | None, typer.Option(help="With --plot: mm/s, else fastest.")] = None,
    force: Annotated[float | None, typer.Option(help="With --plot: N, else strongest.")] = None,
) -> None:
    """Drop the layers that nobody can feel, with a reason for each.

    Writes TEXTURE.json and TEXTURE_layers.tsv, with --plot also TEXTURE_threshold.png.

    Example: tactileq simplify models/canvas.json --threshold pen-hold --margin-db 3 --plot
    """
    from analysis.tables import simplification_table
    from modeling import TextureModel
    from modeling import simplify as drop_layers
    from modeling.files import file_stem, write_text

    full = TextureModel.load(model_file)
    start = out / file_stem(full.texture)
    check_own_model(start, "simplify")
    result = drop_layers(
        full,
        threshold_named(threshold),
        criterion=criterion,
        margin_db=margin_db,
        hold_above=hold_above,
    )
    if plot:
        draw_condition(full, result, start, recordings=recordings, speed=speed, force=force)
    elif (recordings, speed, force) != (None, None, None):
        raise ValueError(
            "expected --plot with --recordings, --speed or --force, got none; add --plot."
        )
    result.model.save(f"{start}.json")
    table = simplification_table(result)
    write_text(f"{start}_layers.tsv", table.to_csv(sep="\t", index=False, na_rep="n/a"))
    tell_verdicts(result)
    settings = {
        "threshold": threshold,
        "criterion": criterion,
        "margin_db": margin_db,
        "hold_above": hold_above,
    }
    provenance = Path(f"{start}_provenance.json")
    write_provenance(provenance, "simplify", settings, inputs=[model_file])
    print(f"{full.n_layers} layers to {result.model.n_layers}{simulated_note(full)}: {start}.json")


app.command()(stimuli)
app.command()(vibrator)


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
    from experiments.models import ModelSets
    from experiments.simulate import PROTOCOLS
    from rig.twin import SimulatedRig

    plan = study_from(study)
    sets = ModelSets(full=load_models(models), simplified=load_models(simplified))
    sets.require(plan.textures)
    print("note: the rig is the simulated one; its data are marked simulated.")
    with open_console(fullscreen=fullscreen, screen=screen) as console:
        result = PROTOCOLS[task](
            plan,
            subject=subject,
            session=number,
            models=sets,
            rig=SimulatedRig(),
            respondent=console,
            data_folder=data,
        )
    note = data / "sourcedata" / f"{result.path.stem.removesuffix('_beh')}_provenance.json"
    write_provenance(note, "session", {"task": task}, inputs=[models, simplified])
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
    from stimuli.planted import TEXTURES, planted_texture

    plan = study_from(study)
    if unknown := [name for name in plan.textures if name not in TEXTURES]:
        raise ValueError(
            f"expected a study of the planted textures {', '.join(TEXTURES)}, which stand for the "
            f"real surfaces here, got {', '.join(unknown)}; run people with tactileq session."
        )
    real = {name: planted_texture(name) for name in plan.textures}
    full, fewer = load_models(models), load_models(simplified)
    run_study(
        plan,
        real=real,
        full=full,
        simplified=fewer,
        data=data,
        threshold=threshold_named(threshold),
        seed=seed,
    )
    note = data / "sourcedata" / "simulate_provenance.json"
    settings = {"study": plan.to_dict(), "threshold": threshold}
    write_provenance(note, "simulate", settings, seed=seed, inputs=[models, simplified])
    print(f"simulated answers: {data}")


@app.command()
def analyze(
    data: Annotated[Path, typer.Argument(help="Folder of the study's answers.")],
    out: Out = Path("analysis-results"),
    recordings: Annotated[
        Path | None, typer.Option(help="Folder of recording sets, one folder per texture.")
    ] = None,
    models: Annotated[Path | None, typer.Option(help="Folder of full models.")] = None,
    simplified: Annotated[Path | None, typer.Option(help="Folder of simplified models.")] = None,
    threshold: ThresholdName = "codec",
    criterion: Criterion = "energy",
    margin_db: Margin = 0.0,
    hold_above: HoldAbove = True,
    seed: Seed = 0,
) -> None:
    """Test the answers and write report.html with its tables and figures.

    With --recordings, --models and --simplified the report also tells how good and how small the
    models are; the threshold's options must be those of tactileq simplify.

    Example: tactileq analyze data --recordings recordings --models models --simplified simplified
    """
    from analysis.load import load_responses
    from analysis.report import write_report
    from modeling.files import replace_folder

    check_own_results(out, "analyze", contents=REPORT_CONTENTS)
    responses = load_responses(data)
    folders = (recordings, models, simplified)
    results = []
    if recordings is not None and models is not None and simplified is not None:
        results = results_of_study(
            responses,
            recordings=recordings,
            full=load_models(models),
            shown=load_models(simplified),
            verdict=partial(
                simplification_shown,
                threshold=threshold_named(threshold),
                criterion=criterion,
                margin_db=margin_db,
                hold_above=hold_above,
            ),
        )
    elif folders != (None, None, None):
        raise ValueError(
            "expected --recordings, --models and --simplified together, got only some of them; "
            "give all three or none."
        )
    settings = {
        "threshold": threshold,
        "criterion": criterion,
        "margin_db": margin_db,
        "hold_above": hold_above,
    }
    inputs = [path for path in (data, *folders) if path is not None]
    with replace_folder(out) as fresh, share_of("Reporting") as tell:
        provenance = write_provenance(
            fresh / "provenance.json", "analyze", settings, seed=seed, inputs=inputs
        )
        write_report(
            fresh / "report.html",
            responses=responses,
            textures=results,
            provenance=provenance,
            seed=seed,
            progress=tell,
        )
    for warning in responses.warnings:
        print(f"warning: {warning}", file=sys.stderr)
    print((out / "report.html").resolve())


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

    check_own_results(out, "demo", contents=DEMO_CONTENTS)
    plan = study_from(None)
    threshold = threshold_named("codec")
    print("A study in silico: simulated surfaces, simulated participants, the real program.")
    with replace_folder(out) as fresh:
        with progress("Recording, modeling, simplifying", len(TEXTURES)) as advance:
            record = partial(demo_texture, folder=fresh, threshold=threshold, seed=seed)
            results = []
            for result in Parallel(n_jobs=2, return_as="generator")(
                delayed(record)(name) for name in TEXTURES
            ):
                results.append(result)
                advance(result.texture)
        render_set(demo_recipe(fresh, seed=seed), fresh / "stimuli")
        full = {r.texture: r.model for r in results}
        fewer = {r.texture: r.simplification.model for r in results}
        real = {r.texture: r.truth for r in results if r.truth is not None}
        run_study(
            plan,
            real=real,
            full=full,
            simplified=fewer,
            data=fresh / "data",
            threshold=threshold,
            seed=seed,
        )
        settings = {
            "estimators": [m.estimator for m in (results[0].model, *results[0].other_estimates)],
            "threshold": threshold.name,
            "criterion": results[0].simplification.criterion,
            "margin_db": results[0].simplification.margin_db,
            "study": plan.to_dict(),
        }
        provenance = write_provenance(fresh / "provenance.json", "demo", settings, seed=seed)
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
