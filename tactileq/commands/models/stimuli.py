"""tactileq stimuli: sets of stimuli as WAV files."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tactileq.modeling.errors import counted
from tactileq.options import Out, VibratorFile
from tactileq.printing import progress
from tactileq.results import CommandRun

if TYPE_CHECKING:
    from tactileq.stimuli.sets.recipe import Recipe
    from tactileq.stimuli.sets.sources import Sources


def stimuli(
    named: Annotated[
        list[Path],
        typer.Argument(metavar="SET.toml|MODEL…", help="A recipe, or model files (JSON)."),
    ],
    out: Out = Path("stimuli-set"),
    speed: Annotated[
        list[float] | None, typer.Option(help="Speed, mm/s; repeatable. [150]")
    ] = None,
    force: Annotated[list[float] | None, typer.Option(help="Force, N; repeatable. [1.5]")] = None,
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
    24-bit or float samples, the level (as modelled, a common RMS, or matched in loudness) and the
    vibrator that plays it, in which case the files contain the drive signal. The set contains its
    own recipe.toml with copies of the models, from which it can be reproduced bit for bit.

    Start from docs/stimuli.toml. A recipe needs version = 1; a name under [set]; under [[model]], a
    path for each model or folder of models, or a scene (a scene file, or a folder from tactileq
    scene); under [[trajectory]], for each stroke speed_mm_s and force_n, or a file (CSV: time_s,
    speed_mm_s, force_n).

    The options are for model files without a recipe. The manifest's column model then names the
    folder that each model came from, and samples are in g.

    Example: tactileq stimuli set.toml --out stimuli-set

    Example: tactileq stimuli models/*.json simplified/*.json --speed 150 --force 1.5
    """
    ran = CommandRun("stimuli")
    ran.reads(*(path for path in named if path.suffix.lower() == ".toml"), vibrator)
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
    render_stimuli(recipe, out, ran)


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
    from tactileq.modeling.models.loading import models_among
    from tactileq.stimuli.sets.recipe import ModelEntry, Recipe, TrajectoryEntry

    recipes = [path for path in named if path.suffix.lower() == ".toml"]
    options = {rate_hz, duration_s, seed, vibrator}
    if recipes:
        if len(named) > 1 or any((speeds, forces)) or options != {None}:
            raise ValueError(
                "expected one recipe and --out, or model files with options, got both; write the "
                f"options into {recipes[0]}."
            )
        return Recipe.load(recipes[0])
    models, others = models_among(named)
    print_passed_over(others)
    if not models:
        raise ValueError(
            f"expected at least one model, got none in {', '.join(map(str, named))}; give one."
        )
    return Recipe(
        name=Path(os.path.realpath(out)).name,
        models=tuple(map(ModelEntry, models)),
        trajectories=tuple(
            TrajectoryEntry.constant(v, f) for v in speeds or [150.0] for f in forces or [1.5]
        ),
        rates_hz=48_000 if rate_hz is None else rate_hz,  # type: ignore[arg-type] # or one
        seeds=(seed or 0,),
        duration_s=1.0 if duration_s is None else duration_s,
        vibrator=vibrator,
    )


def print_passed_over(others: Sequence[Path]) -> None:
    """Name the JSON files among models that hold something else."""
    for path in others:
        print(f"note: {path} states that it is not a model and is skipped.")


def render_stimuli(recipe: Recipe, out: Path, ran: CommandRun) -> None:
    """Write a stimulus set with its contact sheet and provenance; report what exceeds the grid."""
    from tactileq.modeling.files.provenance import PROVENANCE_NAME, provenance_text
    from tactileq.modeling.files.writing import write_text
    from tactileq.stimuli.sets.sources import files_behind

    ran.reads(*recipe.files())
    ran.reads(*files_behind(recipe))

    def print_run(folder: Path) -> None:
        text = provenance_text(ran.provenance({"recipe": recipe.to_toml()}))
        write_text(folder / PROVENANCE_NAME, text)

    sources, count = render_set(recipe, out, finish=print_run)
    print_passed_over(sources.passed_over)
    print_beyond_grid(sources)
    print(f"{counted(count, 'file')}: {out / 'manifest.tsv'}")


def render_set(
    recipe: Recipe, out: Path, *, finish: Callable[[Path], None] | None = None
) -> tuple[Sources, int]:
    """Write a stimulus set with its contact sheet, behind a progress bar.

    `finish` puts more beside them before the set takes its place.

    Returns what it was rendered from and how many files it has.
    """
    from tactileq.stimuli.sets.sources import load_sources
    from tactileq.stimuli.sets.writing import CONTACT_SHEET, check_place, stimulus_count, write_set

    # Wrong input is refused before there is a bar, and before what draws is loaded.
    check_place(out)
    sources = load_sources(recipe)
    count = stimulus_count(recipe, sources)
    from tactileq.analysis.page.saving import DOTS_PER_INCH, save_figure
    from tactileq.analysis.spectra.contact_sheet import contact_sheet
    from tactileq.analysis.spectra.figures.stimuli import figure_contact_sheet

    def draw(folder: Path) -> None:
        sheet = figure_contact_sheet(contact_sheet(folder))
        save_figure(sheet, folder / CONTACT_SHEET, dpi=DOTS_PER_INCH)
        if finish:
            finish(folder)

    with progress("Rendering stimuli", count) as advance:
        write_set(out, recipe, sources=sources, progress=advance, finish=draw)
    return sources, count


def print_beyond_grid(sources: Sources) -> None:
    """Report where a stimulus goes beyond the recorded grid."""
    for labelled in sources.models:
        model = labelled.model
        fastest, strongest = float(model.speeds_mm_s[-1]), float(model.forces_n[-1])
        for trajectory in sources.trajectories:
            speed, force = trajectory.highest_speed_mm_s, trajectory.highest_force_n
            if speed > fastest or force > strongest:
                done = "compiled" if getattr(model, "compiled_for", None) else "recorded"
                print(
                    f"note: {model.texture} ({labelled.label}) was {done} up to {fastest:g} mm/s "
                    f"and {strongest:g} N; {trajectory.name} reaches {speed:g} mm/s and {force:g} "
                    "N, and everything beyond is rendered as the nearest edge of the grid."
                )
