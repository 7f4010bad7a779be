"""Steps of the rendering commands: stimulus sets, vibrators, exports and the render bench."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from steps import (
    check_own_file,
    check_own_results,
    progress,
    simulated_note,
    write_provenance,
)

if TYPE_CHECKING:
    from analysis.rendering import RenderingBench
    from analysis.vibrator import CompensatedVibrator
    from stimuli.recipe import Recipe
    from stimuli.sources import Sources


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
    from analysis.figures_vibrator import figure_vibrator
    from analysis.findings import DOTS_PER_INCH
    from analysis.vibrator import compensated
    from modeling import identify_vibrator
    from modeling.wav import read_wav_channels

    files = {path: ending for path, ending in ((out, ".json"), (plot, ".png")) if path is not None}
    for path, ending in files.items():
        if path.suffix.lower() != ending:
            raise ValueError(f"expected a name that ends in {ending}, got {path}; rename it.")
    markers = {path: check_own_file(path, "vibrator") for path in files}
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
    shown.vibrator.save(out)
    tell_origin = partial(
        write_provenance,
        command="vibrator",
        settings={"simulated": simulated},
        inputs=[test],
    )
    tell_origin(markers[out])
    if plot is not None:
        plot.parent.mkdir(parents=True, exist_ok=True)
        figure_vibrator(shown).savefig(plot, dpi=DOTS_PER_INCH)
        tell_origin(markers[plot])
    print(f"{_found(shown)}: {out}")


def _found(shown: CompensatedVibrator) -> str:
    """One line on a vibrator's resonance, the test's coherence and what compensation gains."""
    vibrator, before, after = shown.vibrator, shown.flat_before_hz, shown.flat_after_hz
    note = "simulated " if vibrator.simulated else ""
    return (
        f"{note}resonance {vibrator.frequency_hz:.1f} Hz, {vibrator.bandwidth_hz:.1f} Hz wide, "
        f"{vibrator.height:.2f} times the flat part; coherence {vibrator.coherence:.2f}; flat to "
        f"±{shown.within_db:g} dB from {before[0]:.0f} to {before[1]:.0f} Hz, compensated from "
        f"{after[0]:.0f} to {after[1]:.0f} Hz"
    )


def recipe_from(
    named: Sequence[Path],
    out: Path,
    *,
    speeds: Sequence[float] | None,
    forces: Sequence[float] | None,
    rate_hz: float | None,
    duration_s: float | None,
    seed: int | None,
    vibrator: Path | None,
) -> Recipe:
    """The recipe of this file, or the one that model files and options make."""
    from stimuli.recipe import Recipe, TrajectoryEntry, model_entry, whole_or_as_it_is

    recipes = [path for path in named if path.suffix.lower() == ".toml"]
    options = {rate_hz, duration_s, seed, vibrator}
    if recipes:
        if len(named) > 1 or any((speeds, forces)) or options != {None}:
            raise ValueError(
                "expected one recipe and --out, or model files with options, got both; write all "
                f"that {recipes[0]} lacks into it."
            )
        return Recipe.load(recipes[0])
    return Recipe(
        name=out.resolve().name,
        models=tuple(map(model_entry, _models_among(named))),
        trajectories=tuple(
            TrajectoryEntry.constant(v, f) for v in speeds or [150.0] for f in forces or [1.5]
        ),
        rates_hz=(48_000 if rate_hz is None else whole_or_as_it_is(rate_hz),),
        seeds=(seed or 0,),
        duration_s=1.0 if duration_s is None else duration_s,
        vibrator=vibrator,
    )


def _models_among(named: Sequence[Path]) -> list[Path]:
    """Without what else models/*.json names: provenance, vibrators, exported equalizers."""
    from stimuli.sources import is_something_else

    files = [path for path in named if not path.name.endswith("provenance.json")]
    others = [path for path in files if is_something_else(path)]
    tell_passed_over(others)
    return [path for path in files if path not in others]


def tell_passed_over(others: Sequence[Path]) -> None:
    """Name the JSON files among models that hold something else."""
    for path in others:
        print(f"note: {path} says that it is no model and is passed over.")


def render_stimuli(recipe: Recipe, out: Path, *, inputs: Sequence[Path] = ()) -> None:
    """Write a stimulus set with its contact sheet and provenance, and say what it asks beyond."""
    sources, count = render_set(recipe, out)
    settings = {"recipe": recipe.to_toml()}
    inputs = [*inputs, *recipe.files()]
    write_provenance(out / "provenance.json", "stimuli", settings, inputs=inputs)
    tell_passed_over(sources.passed_over)
    tell_beyond_grid(sources)
    print(f"{count} files: {out / 'manifest.tsv'}")


def render_set(recipe: Recipe, out: Path) -> tuple[Sources, int]:
    """Write a stimulus set with its contact sheet, behind a progress bar.

    Returns what it was rendered from and how many files it has.
    """
    from stimuli.sets import CONTACT_SHEET, check_place, stimulus_count, write_set
    from stimuli.sources import load_sources

    # Wrong input is refused before there is a bar, and before what draws is loaded.
    check_place(out)
    sources = load_sources(recipe)
    count = stimulus_count(recipe, sources)
    from analysis.contact_sheet import contact_sheet
    from analysis.figures_stimuli import figure_contact_sheet
    from analysis.findings import DOTS_PER_INCH

    with progress("Rendering stimuli", count) as advance:
        write_set(out, recipe, sources=sources, progress=advance)
    figure_contact_sheet(contact_sheet(out)).savefig(out / CONTACT_SHEET, dpi=DOTS_PER_INCH)
    return sources, count


def tell_beyond_grid(sources: Sources) -> None:
    """Say where a stimulus asks for more than was recorded."""
    for labelled in sources.models:
        model = labelled.model
        fastest, strongest = float(model.speeds_mm_s[-1]), float(model.forces_n[-1])
        for trajectory in sources.trajectories:
            speed, force = trajectory.highest_speed_mm_s, trajectory.highest_force_n
            if speed > fastest or force > strongest:
                print(
                    f"note: {model.texture} ({labelled.label}) was recorded up to {fastest:g} mm/s "
                    f"and {strongest:g} N; {trajectory.name} reaches {speed:g} mm/s and {force:g} "
                    "N, and what lies beyond is rendered as the nearest edge."
                )


def demo_recipe(folder: Path, *, seed: int) -> Recipe:
    """One second of every full and simplified model of the demo at 150 mm/s and 1.5 N."""
    from stimuli.recipe import ModelEntry, Recipe, TrajectoryEntry

    models = {"full": folder / "models", "simplified": folder / "simplified"}
    return Recipe(
        name="demo",
        models=tuple(ModelEntry(path, label) for label, path in models.items()),
        trajectories=(TrajectoryEntry.constant(150.0, 1.5),),
        seeds=(seed,),
    )


def export_c_header(
    model_file: Path,
    out: Path | None,
    *,
    rate_hz: float | None,
    seed: int,
    single: bool,
    vibrator: Path | None,
    limits: Mapping[str, float | None],
) -> None:
    """Write a model and the kernel as one C header, with provenance.

    `limits` are those of `modeling.Limits`, None for none.
    """
    from modeling import Limits, Vibrator, compensation_for
    from modeling.files import file_stem
    from stimuli.exports import write_c_header
    from stimuli.sources import load_model

    model = load_model(model_file)
    target = out or Path(f"{file_stem(model.texture)}.h")
    marker = check_own_file(target, "export c")
    rate_hz = model.rate_hz if rate_hz is None else rate_hz
    compensation, played_by = None, ""
    if vibrator is not None:
        found = Vibrator.load(vibrator)
        compensation = compensation_for(found, rate_hz=rate_hz)
        played_by = f" for a vibrator{' (simulated)' if found.simulated else ''}"
    name = write_c_header(
        target,
        model,
        rate_hz=rate_hz,
        seed=seed,
        single=single,
        limits=Limits(**{what: value for what, value in limits.items() if value is not None}),
        compensation=compensation,
    )
    settings = {"rate_hz": rate_hz, "single": single, "limits": dict(limits)}
    inputs = [path for path in (model_file, vibrator) if path is not None]
    write_provenance(marker, "export c", settings, seed=seed, inputs=inputs)
    print(f"{name}{simulated_note(model)}{played_by}: {target}")


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
    """Write a model's vibration at one speed and force, with provenance, and tell its level."""
    from modeling.files import file_stem
    from stimuli.exports import write_wav
    from stimuli.sources import load_model, load_sources

    model = load_model(model_file)
    target = out or Path(f"{file_stem(model.texture)}.wav")
    marker = check_own_file(target, "export wav")
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
    stimulus = write_wav(target, recipe, sources=sources)
    settings = {"recipe": recipe.to_toml()}
    write_provenance(marker, "export wav", settings, seed=seed, inputs=recipe.files())
    tell_beyond_grid(sources)
    drive = "" if vibrator is None else ", as drive for the vibrator"
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
    from modeling.files import file_stem
    from stimuli.exports import write_peq_json
    from stimuli.sources import load_model

    model = load_model(model_file)
    target = out or Path(f"{file_stem(model.texture)}_peq.json")
    marker = check_own_file(target, "export json")
    count = write_peq_json(target, model, speed_mm_s=speed, force_n=force)
    settings = {"speed_mm_s": speed, "force_n": force}
    write_provenance(marker, "export json", settings, inputs=[model_file])
    conditions = "1 condition" if count == 1 else f"{count} conditions"
    print(f"{conditions} of {model.texture}{simulated_note(model)}: {target}")


BENCH_CONTENTS = {"times.tsv", "layers.tsv", "aims.tsv", "rendering.png", "provenance.json"}


def bench_rendering_into(out: Path, *, quick: bool, plot: bool) -> None:
    """Time the renderer beside its rivals, print and write what was measured."""
    from analysis.figures_rendering import figure_rendering
    from analysis.findings import DOTS_PER_INCH
    from analysis.rendering import PARTS, QUICK, bench_rendering
    from modeling.files import replace_folder

    check_own_results(out, "bench render", contents=BENCH_CONTENTS)
    with progress("Timing", PARTS) as advance:
        bench = bench_rendering(QUICK if quick else None, progress=advance)
    with replace_folder(out) as fresh:
        for name, table in (("times", bench.times), ("layers", bench.sweep), ("aims", bench.aims)):
            table.to_csv(fresh / f"{name}.tsv", sep="\t", index=False)
        if plot:
            figure_rendering(bench).savefig(fresh / "rendering.png", dpi=DOTS_PER_INCH)
        settings = {
            "quick": quick,
            "machine": bench.machine,
            "memory_bytes": bench.memory_bytes,
            "import_s": bench.import_s,
        }
        write_provenance(fresh / "provenance.json", "bench render", settings)
    _tell_bench(bench)
    print(f"{int(bench.aims['met'].sum())} of {len(bench.aims)} aims met: {out / 'aims.tsv'}")


def _tell_bench(bench: RenderingBench) -> None:
    """The tables, in ns per sample, and what else was measured."""
    print(f"{bench.machine}; ns per sample, noise included")
    for table in (bench.filters, bench.blocks):
        print(table.to_string(index=False, float_format="%.2f"), end="\n\n")
    line = bench.line
    print(
        f"kernel: {line.ns_at_none:.2f} ns + {line.ns_per_layer:.2f} ns per layer (R² = "
        f"{line.r_squared:.4f}); {bench.memory_bytes} bytes a stream of 3 layers\n"
        f"rendering in Python, 3 layers: {bench.python_ns:.0f} ns\n"
    )
    aims = bench.aims.assign(met=bench.aims["met"].map({True: "met", False: "not met"}))
    print(aims.to_string(index=False, float_format="%.2f"), end="\n\n")
