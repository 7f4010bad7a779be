"""tactileq scene: the cheapest models that keep a scene's bound."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tactileq.modeling.errors import counted
from tactileq.options import Out, Seed
from tactileq.printing import progress, simulated_note
from tactileq.results import FolderResults

if TYPE_CHECKING:
    from tactileq.modeling import CompiledScene
    from tactileq.modeling.scenes.compiled import CompiledTexture

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
    from tactileq.analysis.spectra.compiled_files import compiled_files
    from tactileq.modeling import Scene, compile_scene
    from tactileq.modeling.rendering.compiled import is_compiled
    from tactileq.modeling.scenes.loading import full_models

    results = FolderResults(out, "scene")
    results.reads(scene_file)
    results.reads(*Scene.load(scene_file).files)
    asked = Scene.load(scene_file)  # what it names is read here, too
    folder = models or asked.models or Path("models")
    results.reads(folder)
    _, full = full_models(asked, folder)
    with progress("Compiling the scene", len(asked.textures or full)) as advance:
        compiled = compile_scene(asked, full, progress=advance)
    settings = {
        "scene": asked.to_dict(),
        "scene_sha256": asked.sha256,
        "full_sha256": {each.texture: each.full.sha256 for each in compiled.textures},
    }
    files = compiled_files(compiled, seed=seed)
    if not any(name.endswith(".h") for name in files):
        print("note: no C header: models of different rates need a rate_hz under [actuator].")
    with results.folder(results.provenance(settings, seed=seed)) as fresh:
        compiled.save(fresh)
        for name, data in files.items():
            (fresh / name).write_bytes(data)
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
    worst = max(texture.measures, key=lambda measured: measured.share)
    print(
        f"  {driven_by(texture)}, an update every {update_ms:g} ms, "
        f"{'single' if plan.single else 'double'} precision; "
        f"worst {worst.measure} {worst.worst:.4g} (bound {worst.bound:g}) at {worst.place}"
    )


def print_in_motion(texture: CompiledTexture, compiled: CompiledScene, *, seed: int) -> None:
    """Render random strokes: print the times per sample, and how often the bound is kept."""
    from tactileq.benches.scenes.in_motion import in_motion

    found = in_motion(texture, compiled.scene, seed=seed)
    print(
        f"  on this machine {found.full_ns:.1f} → {found.least_ns:.1f} ns per sample; along a "
        f"random stroke the bound is kept in {found.windows.kept} of {found.windows.of} windows "
        "of 1 s"
    )
