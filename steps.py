"""Steps that several commands share: progress, provenance, loading by folder, the demo's parts."""

from __future__ import annotations

import hashlib
import json
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from analysis.tables import TextureResult
    from experiments.study import Study
    from modeling import RecordingSet, TextureModel, Threshold
    from rig.importing import Label


def write_provenance(
    path: Path,
    command: str,
    settings: Mapping[str, object],
    *,
    seed: int | None = None,
    inputs: Sequence[Path] = (),
) -> dict[str, str]:
    """Write what the results came from: versions, seed, settings, hashes of the inputs."""
    from modeling.files import write_text

    libraries = ("tactileq", "numpy", "scipy", "pandas", "pingouin", "psychopy")
    values: dict[str, Any] = {
        "command": f"tactileq {command}",
        "python": sys.version.split()[0],
        "versions": {name: version(name) for name in libraries},
        "settings": dict(settings),
        "seed": seed,
        "inputs_sha256": {str(path): _hash(path) for path in inputs},
    }
    write_text(path, json.dumps(values, indent=2) + "\n")
    return {
        key: value if isinstance(value, str) else json.dumps(value) for key, value in values.items()
    }


def _hash(path: Path) -> str:
    """SHA-256 of a file, or of all files below a folder with their names."""
    digest = hashlib.sha256()
    files = [path] if path.is_file() else sorted(p for p in path.rglob("*") if p.is_file())
    for file in files:
        digest.update(str(file.relative_to(path.parent)).encode())
        digest.update(file.read_bytes())
    return digest.hexdigest()


@contextmanager
def progress(title: str, total: int) -> Iterator[Callable[[str], None]]:
    """A progress bar over countable steps; in a log it is one line at the end."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("{task.fields[item]}"),
    )
    with Progress(*columns) as bar:
        task = bar.add_task(title, total=total, item="")
        yield lambda item: bar.update(task, advance=1, item=item)
        bar.update(task, item="")


@contextmanager
def share_of(title: str) -> Iterator[Callable[[float, str], None]]:
    """A progress bar for work that tells its share done (0–1)."""
    from rich.progress import Progress

    with Progress() as bar:
        task = bar.add_task(title, total=1.0)
        yield lambda share, what: bar.update(task, completed=share)


def stem(texture: str) -> str:
    """A texture's name as a file name."""
    return "".join(c if c.isalnum() or c in "-_." else "-" for c in texture)


def labels_of(
    files: Sequence[Path],
    table: Path | None,
    texture: str | None,
    speed: float | None,
    force: float | None,
) -> list[Label]:
    from rig.importing import Label, labels_from_table

    if table is not None:
        return labels_from_table(table, files, texture=texture)
    if speed is None or force is None:
        raise ValueError(
            "expected the speed and force of the files, got "
            f"--speed {speed} and --force {force}; give both, or --labels with a TSV."
        )
    return [Label(texture or "unnamed", speed, force) for _ in files]


def add_to_set(
    out: Path,
    new: RecordingSet,
    command: str,
    *,
    settings: Mapping[str, object],
    files: Sequence[Path],
) -> None:
    """Save imported recordings, together with those that `out` already holds."""
    from modeling import RecordingSet
    from modeling.recording import INDEX_NAME

    warn_of_clipping(new)
    known = RecordingSet.load(out).recordings if (out / INDEX_NAME).is_file() else ()
    earlier = out / "provenance.json"
    before = json.loads(earlier.read_text(encoding="utf-8")) if earlier.is_file() else None
    everything = RecordingSet([*known, *new.recordings])
    everything.save(out)
    write_provenance(earlier, command, {**settings, "added to": before}, inputs=files)
    if any(r.unit == "arbitrary" for r in new.recordings):
        print("note: the unit is arbitrary (no g per full scale), so models cannot be simplified.")
    print(f"{len(new)} recordings added, {len(everything)} in {out}")


def warn_of_clipping(records: RecordingSet) -> None:
    for recording in records.recordings:
        if recording.clipped_share > 0:
            print(
                f"warning: {recording.describe()} is clipped in {recording.clipped_share:.2%} of "
                "its samples; its level is too low.",
                file=sys.stderr,
            )


def fit_or_tell(records: RecordingSet, estimator: str, shortfalls: list[str]) -> list[TextureModel]:
    """The texture's model; where the grid does not allow one, the reason goes to `shortfalls`."""
    from modeling import GridError, fit_texture

    try:
        return [fit_texture(records, estimator=estimator)]
    except GridError as error:
        shortfalls.append(str(error))
        return []


def save_and_tell(fitted: TextureModel, out: Path) -> None:
    from modeling import missing_conditions

    path = out / f"{stem(fitted.texture)}.json"
    fitted.save(path)
    inherited = int(fitted.inherited.any(axis=2).sum())
    print(
        f"{fitted.texture}: {fitted.n_layers} layers, {fitted.n_parameters} numbers per condition, "
        f"frequencies inherited in {inherited} of {fitted.noise_gains.size} conditions: {path}"
    )
    if missing := missing_conditions(fitted):
        names = "; ".join(f"{speed:g} mm/s at {force:g} N" for speed, force in missing)
        print(f"{fitted.texture}: interpolated for want of a recording: {names}")


def threshold_named(name: str) -> Threshold:
    """A threshold that comes along, by name, or a user's own, by the path of its TSV."""
    from modeling import Threshold

    return Threshold.load(name) if Path(name).suffix else Threshold.shipped(name)


def study_from(path: Path | None) -> Study:
    from experiments.study import Study

    return Study.load(path) if path is not None else Study.load()


def load_models(folder: Path) -> dict[str, TextureModel]:
    from modeling import TextureModel

    paths = sorted(p for p in folder.glob("*.json") if not p.name.endswith("provenance.json"))
    if not paths:
        raise ValueError(f"expected model files in {folder}, got none; fit or simplify some first.")
    models = [TextureModel.load(path) for path in paths]
    return {fitted.texture: fitted for fitted in models}


def run_study(
    plan: Study,
    real: Mapping[str, TextureModel],
    full: Mapping[str, TextureModel],
    fewer: Mapping[str, TextureModel],
    data: Path,
    threshold: Threshold,
    seed: int,
) -> None:
    from experiments.simulate import simulate_study
    from rig.twin import SimulatedRig

    sessions = plan.absolute.participants * plan.absolute.sessions
    sessions += plan.relative.participants * plan.relative.sessions
    with progress("Simulated participants", sessions) as advance:
        simulate_study(
            plan,
            real=real,
            full=full,
            simplified=fewer,
            rig=SimulatedRig(real, seed=seed),
            data_folder=data,
            seed=seed,
            threshold=threshold,
            progress=lambda done, total, name: advance(name),
        )


def demo_texture(name: str, folder: Path, seed: int) -> TextureResult:
    """Record, model and simplify one planted texture; everything goes by way of the disk."""
    from analysis.tables import TextureResult
    from modeling import RecordingSet, Threshold, fit_texture
    from modeling import simplify as drop_layers
    from stimuli.planted import planted_texture, record_texture

    truth = planted_texture(name)
    place = folder / "recordings" / stem(name)
    record_texture(truth, seed=seed).save(place)
    records = RecordingSet.load(place)
    full = fit_texture(records)
    simplification = drop_layers(full, Threshold.shipped("codec"))
    full.save(folder / "models" / f"{stem(name)}.json")
    simplification.model.save(folder / "simplified" / f"{stem(name)}.json")
    others = (fit_texture(records, estimator="paper"),)
    return TextureResult(records, full, simplification, truth, others)
