"""tactileq scene: the cheapest models that keep a scene's bound."""

from __future__ import annotations

from collections.abc import Sequence
from math import acos
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Annotated

import typer

from tactileq.modeling.errors import counted
from tactileq.options import Out, Seed
from tactileq.own_results import check_own_results
from tactileq.printing import progress, simulated_note

if TYPE_CHECKING:
    from tactileq.modeling import CompiledScene, Renderer
    from tactileq.modeling.hand import Hand
    from tactileq.modeling.scenes.compiled import CompiledTexture, Measured

WINDOWS = 60
TURNS = 5


def scene(
    scene_file: Annotated[Path, typer.Argument(metavar="SCENE.toml", help="A scene file.")],
    models: Annotated[
        Path | None,
        typer.Option(
            "--models", help="Folder of full models; by default the scene's, or else models/."
        ),
    ] = None,
    out: Out = Path("scene"),
    seed: Seed = 0,
) -> None:
    """Compile a scene: the cheapest model of each texture that keeps the scene's bound.

    A scene (TOML) names textures, the speeds and forces of the hand, the actuator's band and
    limits, a threshold, a bound on the error and a budget; start from the examples in
    modeling/scenes/shipped. Required: version = 1; a name under [scene]; speed_mm_s and force_n
    under [hand].

    Writes TEXTURE.json (the cheapest model), scene.json, before_after.tsv (layers, numbers, bytes,
    operations, each error with the place where it is largest), steps.tsv (what each step saves),
    tradeoff.png and SCENE.h (all textures and the renderer in C99, licensed like the headers of
    tactileq export c). The times per sample shown are measured on this machine.

    Example: tactileq scene scene.toml --models models --out scene
    """
    from tactileq.modeling import Scene, compile_scene
    from tactileq.modeling.files.folders import replace_folder
    from tactileq.modeling.files.hashes import sha256_of_paths
    from tactileq.modeling.files.provenance import provenance_of, seal_folder
    from tactileq.modeling.rendering.compiled import is_compiled
    from tactileq.modeling.scenes.loading import full_models

    seen = check_own_results(out, "scene")
    asked = Scene.load(scene_file)
    inputs = sha256_of_paths([*asked.files, models or asked.models or Path("models")])
    _, full = full_models(asked, models or asked.models or Path("models"))
    with progress("Compiling the scene", len(asked.textures or full)) as advance:
        compiled = compile_scene(asked, full, progress=advance)
    settings = {
        "scene": asked.to_dict(),
        "scene_sha256": asked.sha256,
        "full_sha256": {each.texture: each.full.sha256 for each in compiled.textures},
    }
    with replace_folder(out, seen) as fresh:
        write_scene(compiled, fresh, seed=seed)
        seal_folder(fresh, provenance_of("scene", settings, seed=seed, inputs=inputs))
    for texture in compiled.textures:
        print_texture(texture)
        if is_compiled():
            print_in_motion(texture, compiled, seed=seed)
    if not is_compiled():
        print("note: without the compiled kernel no strokes are rendered for timing and checking.")
    print(
        f"{asked.name}: {compiled.bytes_before} → {compiled.bytes_after} bytes, at most "
        f"{compiled.operations_before:.1f} → {compiled.operations_after:.1f} operations per "
        f"sample: {out / 'before_after.tsv'}"
    )


def write_scene(compiled: CompiledScene, folder: Path, *, seed: int) -> None:
    """Write the models of a compiled scene, its tables, its figure and its C header."""
    from tactileq.analysis.columns import table_bytes
    from tactileq.analysis.page.saving import picture_bytes
    from tactileq.analysis.spectra.figures.scenes import figure_tradeoff
    from tactileq.analysis.textures.scenes import before_after_table, steps_table
    from tactileq.modeling.files.writing import file_stem

    compiled.save(folder)
    (folder / "before_after.tsv").write_bytes(table_bytes(before_after_table(compiled)))
    (folder / "steps.tsv").write_bytes(table_bytes(steps_table(compiled)))
    (folder / "tradeoff.png").write_bytes(picture_bytes(figure_tradeoff(compiled)))
    if len({texture.plan.rate_hz for texture in compiled.textures}) > 1:
        print("note: no C header: models of different rates need a rate_hz under [actuator].")
        return
    name = f"{file_stem(compiled.scene.name)}.h"
    (folder / name).write_text(header_of(compiled, name, seed=seed), encoding="utf-8")


def header_of(compiled: CompiledScene, name: str, *, seed: int) -> str:
    """All textures of a scene as one header in C, in single precision where all may be."""
    from tactileq.stimuli.exports.scene_header import scene_header

    scene = compiled.scene
    bound = ", ".join(f"{measure} {value:g}" for measure, value in scene.bound.to_dict().items())
    note = (
        f"Compiled for the scene with SHA-256 {scene.sha256}; bound: {bound}. Beyond the scene the "
        "nearest edge is rendered, and samples are counted (above_grid, below_grid)."
    )
    return scene_header(name, scene.name, compiled.rendered, seed=seed, note=note)


def print_texture(texture: CompiledTexture) -> None:
    """Print what a texture was reduced to, what it costs, and how close it is to the bound."""
    from tactileq.analysis.textures.scenes import driven_by
    from tactileq.modeling.scenes.cost import stored_numbers

    full, model, plan = texture.full, texture.model, texture.plan
    before, after = texture.before, texture.after
    print(
        f"{texture.texture}{simulated_note(full)}: {full.n_layers} → "
        f"{counted(model.n_layers, 'layer')}, "
        f"{stored_numbers(full)} → {counted(stored_numbers(model), 'number')}, "
        f"{before.bytes} → {after.bytes} "
        f"bytes, {before.operations:.1f} → {after.operations:.1f} operations per sample"
    )
    update_ms = 1e3 * plan.update_samples / plan.rate_hz
    print(
        f"  {driven_by(texture)}, an update every {update_ms:g} ms, "
        f"{'single' if plan.single else 'double'} precision; worst {worst_of(texture.measures)}"
    )


def worst_of(measures: Sequence[Measured]) -> str:
    """The measure that is closest to its bound, and where."""
    worst = max(measures, key=_share)
    return f"{worst.measure} {worst.worst:.4g} (bound {worst.bound:g}) at {worst.place}"


def _share(measured: Measured) -> float:
    """Of the bound; of a GFC that of the angle whose cosine it is."""
    worst, bound = measured.worst, measured.bound
    if measured.measure == "gfc30":
        worst, bound = acos(worst), acos(bound)
    return worst / bound if bound else 0.0


def print_in_motion(texture: CompiledTexture, compiled: CompiledScene, *, seed: int) -> None:
    """Render random strokes: print the times per sample, and how often the bound is kept."""
    from tactileq.modeling import Renderer
    from tactileq.modeling.scenes.strokes import random_stroke, windows_kept

    plan = texture.full_plan
    full = Renderer(texture.full, rate_hz=plan.rate_hz, update_samples=plan.update_samples)
    least = texture.renderer()
    hand = random_stroke(
        texture.full, compiled.scene.hand, round(plan.rate_hz), rate_hz=plan.rate_hz, seed=seed
    )
    before, after = (ns_per_sample(renderer, hand) for renderer in (full, least))
    windows = windows_kept(texture, compiled.scene, count=WINDOWS, seed=seed)
    print(
        f"  on this machine {before:.1f} → {after:.1f} ns per sample; along a random "
        "stroke the bound is kept "
        f"in {windows.kept} of {windows.of} windows of 1 s"
    )


def ns_per_sample(renderer: Renderer, hand: Hand) -> float:
    """How long this machine takes to render a sample of a stroke, the fastest of several runs."""
    import numpy as np

    vibration = np.empty(hand.speed_mm_s.size, dtype=renderer.plan.precision)
    taken = []
    for _ in range(TURNS):
        began = perf_counter()
        renderer.render(*hand, out=vibration)
        taken.append(perf_counter() - began)
    return 1e9 * min(taken) / vibration.size
