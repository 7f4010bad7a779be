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
    from analysis.load import Responses
    from analysis.tables import TextureResult
    from experiments.console import Console
    from experiments.study import Study
    from modeling import RecordingSet, Simplification, TextureModel, Threshold
    from modeling.simplification import CriterionName
    from rig.hatt import HattTexture
    from rig.importing import Label
    from stimuli.sources import AnyModel


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


def sentence_of(error: Exception) -> str:
    """What a user is told of an error: one sentence, never a traceback."""
    # A StoreError carries its own sentence, the system's errors only a number and a word.
    if isinstance(error, OSError) and error.errno is not None and error.filename is not None:
        return (
            f"expected to read or write {error.filename}, got {error.strerror!r}; check the "
            "path, its permissions and the space on the disk."
        )
    if isinstance(error, MemoryError):
        return "expected a task that fits the memory, got a larger one; ask for less at once."
    return str(error)


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


def check_own_results(out: Path, command: str, *, contents: set[str]) -> None:
    """Refuse to replace a folder unless an earlier run of the same command made all of it."""
    from modeling.files import folder_behind

    folder_behind(out)
    if not out.exists() or (out.is_dir() and not any(out.iterdir())):
        return
    foreign = "a file"
    if out.is_dir():
        marker = out / "provenance.json"
        maker = _read_object(marker).get("command") if marker.is_file() else None
        others = sorted({path.name for path in out.iterdir()} - contents)
        if maker == f"tactileq {command}" and not others:
            return
        foreign = f"a folder with other files in it ({(others or ['not made by this command'])[0]})"
    raise ValueError(
        f"expected a new folder or earlier results of tactileq {command} at {out}, got {foreign}; "
        "choose another folder with --out."
    )


def check_own_model(start: Path, command: str) -> None:
    """Refuse to put one command's model in the place of another's (full beside simplified).

    `start` is the model's path without its ending.
    """
    marker = Path(f"{start}_provenance.json")
    made = Path(f"{start}.json").exists() and marker.is_file()
    if made and _read_object(marker).get("command") != f"tactileq {command}":
        raise ValueError(
            f"expected a folder without models of another command, got {start}.json made by "
            f"{_read_object(marker).get('command')}; choose another folder with --out."
        )


def check_own_file(out: Path, command: str) -> Path:
    """Refuse to replace a file that is not the same command's; where its provenance goes."""
    marker = Path(f"{out}_provenance.json")
    maker = _read_object(marker).get("command") if marker.is_file() else None
    if out.exists() and maker != f"tactileq {command}":
        raise ValueError(
            f"expected a new file or an earlier result of tactileq {command} at {out}, got "
            "something else; choose another name."
        )
    return marker


def tell_beyond_hull(texture: HattTexture, conditions: Sequence[tuple[float, float]]) -> None:
    """Say which conditions a toolkit's texture does not tell of, and so have no recording."""
    inside = set(texture.conditions_inside(conditions))
    outside = [condition for condition in conditions if condition not in inside]
    if outside:
        names = "; ".join(f"{speed:g} mm/s at {force:g} N" for speed, force in outside)
        print(
            f"note: {texture.material}: {len(outside)} of {len(conditions)} conditions lie beyond "
            f"its models, or are silent there, and are left out: {names}"
        )


def usable_recordings(folder: Path, texture: str) -> RecordingSet:
    """The recordings of one texture; what cannot be used is told and left out."""
    from modeling.recording import load_usable

    records, unusable = load_usable(folder, texture=texture)
    for sentence in unusable:
        print(f"warning: {texture}: left out: {sentence}", file=sys.stderr)
    return records


def results_of_study(
    responses: Responses,
    *,
    recordings: Path,
    full: Mapping[str, TextureModel],
    shown: Mapping[str, TextureModel],
    verdict: Callable[[TextureModel, TextureModel | None], Simplification],
) -> list[TextureResult]:
    """Recordings, models and verdicts of every texture that was asked about."""
    from analysis.between import left_out_by_model
    from analysis.tables import TextureResult
    from modeling.files import file_stem
    from modeling.fitting import recording_spectra

    asked = dict.fromkeys([*responses.absolute["texture"], *responses.relative["texture"]])
    missing = [texture for texture in asked if texture not in full]
    if missing:
        raise ValueError(
            f"expected a model of each texture in the answers, got none of {', '.join(missing)}; "
            "give the folder of the models that were presented."
        )
    results = []
    for texture in asked:
        records = usable_recordings(recordings / file_stem(texture), texture)
        model = full[texture]
        left_out = left_out_by_model(recording_spectra(records), model)
        simplified = verdict(model, shown.get(texture))
        results.append(TextureResult(records, model, simplified, left_out=left_out))
    return results


def _read_object(path: Path) -> dict[str, Any]:
    try:
        values = json.loads(path.read_text(encoding="utf-8"))
    except ValueError:
        values = None
    if not isinstance(values, dict):
        raise ValueError(f"expected a JSON object in {path}, got something else; remove the file.")
    return values


def labels_of(
    files: Sequence[Path],
    table: Path | None,
    *,
    texture: str,
    speed: float | None,
    force: float | None,
) -> list[Label]:
    """Labels of the files from a table, or the same speed and force for all of them."""
    from rig.importing import Label, labels_from_table

    if table is not None:
        if speed is not None or force is not None:
            raise ValueError(
                "expected labels from --labels or from --speed and --force, got both; give one."
            )
        return labels_from_table(table, files, texture=texture)
    if speed is None or force is None:
        raise ValueError(
            "expected the speed and force of the files, got "
            f"--speed {speed} and --force {force}; give both, or --labels with a TSV."
        )
    return [Label(texture, speed, force) for _ in files]


def add_to_set(
    out: Path,
    new: RecordingSet,
    command: str,
    *,
    settings: Mapping[str, object],
    files: Sequence[Path],
    left_out: Sequence[str] = (),
) -> None:
    """Save imported recordings, together with those that `out` already holds.

    `left_out`: a sentence for each file that could not be used.
    """
    from modeling import RecordingSet
    from modeling.recording import INDEX_NAME

    warn_of_clipping(new)
    for sentence in left_out:
        print(f"warning: left out: {sentence}", file=sys.stderr)
    known = RecordingSet.load(out).recordings if (out / INDEX_NAME).is_file() else ()
    earlier = out / "provenance.json"
    before = _read_object(earlier) if earlier.is_file() else None
    everything = RecordingSet([*known, *new.recordings])
    everything.save(out)
    write_provenance(earlier, command, {**settings, "added to": before}, inputs=files)
    if any(r.unit == "arbitrary" for r in new.recordings):
        print(
            "note: the unit is arbitrary, so models cannot be simplified; give --g-per-fullscale "
            "(WAV) or --unit (CSV)."
        )
    rates = sorted({f"{r.rate_hz:g}" for r in new.recordings})
    if left_out:
        print(f"note: {len(left_out)} of {len(files)} files left out")
    print(f"{len(new)} recordings added at {', '.join(rates)} Hz, {len(everything)} in {out}")


def warn_of_clipping(records: RecordingSet) -> None:
    """Name every clipped recording and the share of it that is clipped."""
    for warning in clipping_warnings(records):
        print(warning, file=sys.stderr)


def clipping_warnings(records: RecordingSet) -> list[str]:
    """One sentence for every clipped recording."""
    return [
        f"warning: {recording.describe()} is clipped in {recording.clipped_share:.2%} of its "
        "samples; its level is too low."
        for recording in records.recordings
        if recording.clipped_share > 0
    ]


def simulated_note(model: AnyModel) -> str:
    """What a printed line says of a model that nobody recorded."""
    return " (simulated)" if model.simulated else ""


def threshold_named(name: str) -> Threshold:
    """A threshold that comes along, by name, or a user's own, by the path of its TSV."""
    from modeling import Threshold

    return Threshold.load(name) if Path(name).suffix else Threshold.shipped(name)


def study_from(path: Path | None) -> Study:
    """The study of this file, or the paper's."""
    from experiments.study import Study

    return Study.load(path) if path is not None else Study.load()


def load_models(folder: Path) -> dict[str, TextureModel]:
    """All models of a folder by the name of their texture; two of one texture are refused."""
    from modeling import TextureModel
    from stimuli.sources import is_something_else

    paths = sorted(p for p in folder.glob("*.json") if not p.name.endswith("provenance.json"))
    paths = [path for path in paths if not is_something_else(path)]
    if not paths:
        raise ValueError(f"expected model files in {folder}, got none; fit or simplify some first.")
    models: dict[str, TextureModel] = {}
    for path in paths:
        fitted = TextureModel.load(path)
        if fitted.texture in models:
            raise ValueError(
                f"expected one model of each texture in {folder}, got two of {fitted.texture!r}; "
                f"move {path.name} or the other one away."
            )
        models[fitted.texture] = fitted
    return models


def simplification_shown(
    full: TextureModel,
    shown: TextureModel | None,
    *,
    threshold: Threshold,
    criterion: CriterionName,
    margin_db: float,
    hold_above: bool,
) -> Simplification:
    """The verdicts behind the simplified model that people felt; refused where they differ."""
    from modeling import simplify

    verdicts = simplify(
        full, threshold, criterion=criterion, margin_db=margin_db, hold_above=hold_above
    )
    if verdicts.model != shown:
        raise ValueError(
            f"expected the simplified model of {full.texture} to be the one that {threshold.name}, "
            f"{criterion} and {margin_db:g} dB give, got "
            f"{'another' if shown else 'none'}; give the --threshold, --criterion, "
            "--margin-db and --known-only that it was made with."
        )
    return verdicts


def open_console(*, fullscreen: bool, screen: int) -> Console:
    """The console's window; where there is no screen, one sentence instead of a traceback."""
    from experiments.console import Console

    try:
        return Console(fullscreen=fullscreen, screen=screen)
    except Exception as error:  # whatever the window system raises means the same to a user
        raise ValueError(
            f"expected a screen for the console, got {error or type(error).__name__}; start a "
            "graphical session (or Xvfb) and set DISPLAY."
        ) from error


def run_study(
    plan: Study,
    *,
    real: Mapping[str, TextureModel],
    full: Mapping[str, TextureModel],
    simplified: Mapping[str, TextureModel],
    data: Path,
    threshold: Threshold,
    seed: int,
) -> None:
    """Simulate all participants of a study at the simulated rig, with a progress bar."""
    from experiments.simulate import simulate_study
    from rig.twin import SimulatedRig

    sessions = plan.absolute.participants * plan.absolute.sessions
    sessions += plan.relative.participants * plan.relative.sessions
    with progress("Simulated participants", sessions) as advance:
        simulate_study(
            plan,
            real=real,
            full=full,
            simplified=simplified,
            rig=SimulatedRig(real, seed=seed),
            data_folder=data,
            seed=seed,
            threshold=threshold,
            progress=lambda done, total, name: advance(name),
        )


def demo_texture(name: str, folder: Path, *, threshold: Threshold, seed: int) -> TextureResult:
    """Record, model and simplify one planted texture; everything goes by way of the disk."""
    from analysis.between import left_out_by_model
    from analysis.tables import TextureResult
    from modeling import RecordingSet
    from modeling import simplify as drop_layers
    from modeling.files import file_stem
    from modeling.fitting import fit_spectra, recording_spectra
    from stimuli.planted import planted_texture, record_texture

    truth = planted_texture(name)
    place = folder / "recordings" / file_stem(name)
    record_texture(truth, seed=seed).save(place)
    records = RecordingSet.load(place)
    measured = recording_spectra(records)
    full = fit_spectra(measured)
    simplification = drop_layers(full, threshold)
    full.save(folder / "models" / f"{file_stem(name)}.json")
    simplification.model.save(folder / "simplified" / f"{file_stem(name)}.json")
    others = (fit_spectra(measured, estimator="paper"),)
    left_out = left_out_by_model(measured, full)
    return TextureResult(records, full, simplification, truth, others, left_out)
