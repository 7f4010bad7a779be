"""tactileq demo: the whole study in silico."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tactileq.commands.benches.demo_benches import Benches, begun_scenes, reported
from tactileq.commands.benches.demo_parts import JOBS, demo_population, modelled, presented
from tactileq.commands.models.stimuli import render_set
from tactileq.commands.results.analyze import read_answers
from tactileq.commands.study.simulate import run_study
from tactileq.options import Out, Seed
from tactileq.printing import progress, share_of
from tactileq.results import FolderResults
from tactileq.workers import mapping

if TYPE_CHECKING:
    from tactileq.analysis.page.sections import Mapped, Section
    from tactileq.analysis.textures.results import TextureResult
    from tactileq.modeling import ARModel, Threshold
    from tactileq.stimuli.sets.recipe import Recipe


def demo(
    out: Out = Path("demo"),
    seed: Seed = 1,
    device: Annotated[
        bool,
        typer.Option(
            "--device",
            help="On simulated devices: a recorder records, hands stroke the cable device's wall.",
        ),
    ] = False,
) -> None:
    """The whole study in silico: record, model, simplify, render, ask, analyze.

    With --device everything goes through the firmware of the recorder and of the cable device, in
    virtual time: fewer participants, whose simulated hands really move.

    Example: tactileq demo --out demo
    """
    if device:
        from tactileq.commands.benches.demo_device import demo_on_devices

        demo_on_devices(out, seed)
        return
    from tactileq.experiments.study.study import Study
    from tactileq.modeling import Threshold
    from tactileq.modeling.threads import one_linear_algebra_thread
    from tactileq.stimuli.planted.textures import TEXTURES

    written = FolderResults(out, "demo")
    provenance: dict[str, Any] = {}
    plan = Study.load()
    # Of the shipped tables the one by which most simulated textures have a layer to drop.
    threshold = Threshold.named("mobile")
    print("A study in silico: simulated surfaces, simulated participants, the real program.")
    # Every core has a process of its own to do.
    alone = one_linear_algebra_thread()
    with written.folder(provenance) as fresh, mapping(jobs=JOBS) as mapped, alone:
        record = partial(demo_texture, folder=fresh, threshold=threshold, seed=seed)
        with progress("Recording, modeling, simplifying", len(TEXTURES)) as advance:
            recorded, benches = mapped(record, TEXTURES), Benches.begun(mapped)
            made = list(reported(recorded, advance, _texture))
        # Other processes check the models while this one presents them.
        checked, scenes = mapped(with_checks, made), begun_scenes(mapped, made)
        render_set(demo_recipe(fresh, seed=seed), fresh / "stimuli")
        models, real = presented(made)
        population = demo_population(plan.textures)
        run_study(
            plan,
            real=real,
            models=models,
            data=fresh / "data",
            threshold=threshold,
            seed=seed,
            psychometrics=population,
        )
        with progress("Predicting conditions that were left out", len(made)) as advance:
            results, rivals = zip(*reported(checked, advance, lambda c: c[0].texture), strict=True)
        settings = {
            "estimators": [m.estimator for m in (results[0].model, *results[0].other_estimates)],
            "threshold": threshold.name,
            "threshold_sha256": threshold.sha256,
            "study_sha256": plan.sha256,
            "models_sha256": models.sha256(plan.textures),
            "criterion": results[0].simplification.criterion,
            "margin_db": results[0].simplification.margin_db,
            "study": plan.to_dict(),
            "planted": population.planted,
        }
        provenance |= written.provenance(settings, seed=seed)
        write_demo_report(
            fresh,
            results,
            benches=benches.sections(scenes, rivals, mapped=mapped),
            provenance=provenance,
            planted=population.planted,
            seed=seed,
            mapped=mapped,
        )
    print((out / "report.html").resolve())


def demo_recipe(folder: Path, *, seed: int) -> Recipe:
    """One second of every full and simplified model of the demo at 150 mm/s and 1.5 N."""
    from tactileq.stimuli.sets.recipe import ModelEntry, Recipe, TrajectoryEntry

    models = {"full": folder / "models", "simplified": folder / "simplified"}
    return Recipe(
        name="demo",
        models=tuple(ModelEntry(path, label) for label, path in models.items()),
        trajectories=(TrajectoryEntry.constant(150.0, 1.5),),
        seeds=(seed,),
    )


def demo_texture(name: str, folder: Path, *, threshold: Threshold, seed: int) -> TextureResult:
    """Record, model and simplify one planted texture; everything goes by way of the disk."""
    from tactileq.modeling.files.writing import file_stem
    from tactileq.stimuli.planted.textures import RECORDER_RATE_HZ, planted_texture, record_texture

    truth = planted_texture(name, rate_hz=RECORDER_RATE_HZ)
    record_texture(truth, seed=seed).save(folder / "recordings" / file_stem(name))
    return modelled(name, folder, threshold=threshold, truth=truth)


def with_checks(result: TextureResult) -> tuple[TextureResult, ARModel]:
    """The result with what its model is judged by, and an AR model of the same recordings.

    That is the paper's own model, and conditions left out.
    """
    from tactileq.analysis.textures.between import RIVAL_ORDER, left_out_by_model
    from tactileq.modeling.fitting.autoregressive import fit_ar_spectra
    from tactileq.modeling.fitting.conditions import recording_spectra
    from tactileq.modeling.fitting.texture import fit_spectra

    measured = recording_spectra(result.recordings)
    checked = replace(
        result,
        other_estimates=(fit_spectra(measured, estimator="paper"),),
        left_out=left_out_by_model(measured, result.model),
    )
    return checked, fit_ar_spectra(measured, order=RIVAL_ORDER)


def write_demo_report(
    folder: Path,
    results: Sequence[TextureResult],
    *,
    benches: Sequence[Section],
    provenance: Mapping[str, object],
    planted: Mapping[str, Mapping[str, float]],
    seed: int,
    mapped: Mapped,
) -> None:
    """The report of everything in the demo's folder, with a progress bar."""
    from tactileq.analysis.answers.hand import load_hand
    from tactileq.analysis.report.report import write_report

    responses = read_answers({"": folder / "data"}, ())
    with share_of("Analyzing") as advance:
        write_report(
            folder / "report.html",
            responses=responses,
            textures=results,
            hand=load_hand(folder / "data", responses.answers),
            benches=benches,
            provenance=provenance,
            planted=planted,
            seed=seed,
            progress=advance,
            mapped=mapped,
        )


def _texture(result: TextureResult) -> str:
    return result.texture
