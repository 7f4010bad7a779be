"""Steps of `tactileq model` and `tactileq simplify`: many textures at once, and their pictures."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from concurrent.futures import BrokenExecutor
from dataclasses import dataclass
from functools import partial
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING

from steps import (
    check_own_model,
    clipping_warnings,
    progress,
    sentence_of,
    simulated_note,
    write_provenance,
)

if TYPE_CHECKING:
    from analysis.findings import Findings
    from modeling import RecordingSet, Simplification, TextureModel


@dataclass(frozen=True)
class Source:
    """One texture in one folder of recordings."""

    folder: Path
    texture: str


@dataclass(frozen=True)
class Outcome:
    """What modelling one texture led to.

    Parameters
    ----------
    what : str
        The texture and its folder.
    notes, warnings : tuple of str
        Lines to print when it went well.
    error : str
        One sentence when it did not; empty otherwise.
    """

    what: str
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    error: str = ""


def model_textures(
    folders: Sequence[Path], out: Path, *, estimator: str, plot: bool, jobs: int | None
) -> None:
    """Model every texture in these folders, some at a time, and tell of each in order.

    One that cannot be modelled is named with its reason and does not stop the others.

    Parameters
    ----------
    folders : sequence of Path
        Recording sets, or folders of them.
    out : Path
        Where the files go; a texture's are written once it is modelled.
    estimator : str
    plot : bool
        Also draw each model's layers over its grid.
    jobs : int, optional
        Textures at a time, in processes of their own; as many as there are cores without it. The
        files do not depend on it.

    Raises
    ------
    ValueError
        Before any work where two textures would share a file, or other files are in the way; at
        the end where a texture could not be modelled.
    """
    sources, unreadable = _sources_in(folders)
    _require_own_files(sources, out)
    done = _model_all(sources, out, estimator=estimator, plot=plot, jobs=jobs)
    outcomes = [*unreadable, *done]
    failed = [outcome for outcome in outcomes if outcome.error]
    if len(outcomes) == len(failed) == 1:
        raise ValueError(failed[0].error)
    for outcome in outcomes:
        _tell(outcome)
    if failed:
        raise ValueError(
            f"expected {len(outcomes)} textures that can be modelled, got {len(failed)} that "
            f"cannot ({'; '.join(outcome.what for outcome in failed)}); correct them and model "
            "them again."
        )


def _model_all(
    sources: Sequence[Source], out: Path, *, estimator: str, plot: bool, jobs: int | None
) -> list[Outcome]:
    """Outcomes in the order of the sources, with a progress bar."""
    from joblib import Parallel, cpu_count, delayed

    if not sources:
        return []
    outcomes: list[Outcome] = []
    work = delayed(partial(_model_one, out=out, estimator=estimator, plot=plot))
    parallel = Parallel(n_jobs=min(jobs or cpu_count(), len(sources)), return_as="generator")
    with progress("Finding layers, fitting", len(sources)) as advance:
        try:
            for source, outcome in zip(sources, parallel(map(work, sources)), strict=True):
                outcomes.append(outcome)
                advance(source.texture)
        except BrokenExecutor:
            raise ValueError(
                "expected every process to end by itself, got one that the system stopped, "
                "perhaps for want of memory; run again with a smaller --jobs."
            ) from None
    return outcomes


def _model_one(source: Source, *, out: Path, estimator: str, plot: bool) -> Outcome:
    """Load, model and write one texture; what is wrong with it becomes its outcome's error."""
    from threadpoolctl import threadpool_limits

    from analysis.findings import find_in, save_findings
    from modeling import RecordingSet

    what = f"{source.texture} in {source.folder}"
    try:
        # One thread each: sums must not depend on how many cores a process finds.
        with threadpool_limits(limits=1):
            records = RecordingSet.load(source.folder, texture=source.texture)
            found = find_in(records, estimator=estimator)
            start = save_findings(found, out, plot=plot)
            write_provenance(
                Path(f"{start}_provenance.json"),
                "model",
                {"estimator": estimator},
                inputs=[source.folder],
            )
    except (ValueError, OSError, MemoryError) as error:
        return Outcome(what, error=sentence_of(error))
    notes = (*_rate_notes(records), *_told(found, start, plot=plot))
    return Outcome(what, notes=notes, warnings=tuple(clipping_warnings(records)))


def _tell(outcome: Outcome) -> None:
    for warning in outcome.warnings:
        print(warning, file=sys.stderr)
    for note in outcome.notes:
        print(note)
    if outcome.error:
        print(f"error: {outcome.what}: {outcome.error}", file=sys.stderr)


def _rate_notes(records: RecordingSet) -> list[str]:
    """A note where the data's rate is lower than the model's would be."""
    from modeling.spectra import MODEL_RATE_HZ

    rate_hz = min(r.rate_hz for r in records.recordings)
    if rate_hz >= MODEL_RATE_HZ:
        return []
    return [
        f"note: {records.texture}: the data's rate of {rate_hz:g} Hz becomes the model's; the "
        f"band from {rate_hz / 2:g} to {MODEL_RATE_HZ / 2:g} Hz is lost."
    ]


def _told(found: Findings, start: Path, *, plot: bool) -> list[str]:
    """What was found and where it is, with the conditions that were interpolated."""
    from modeling import missing_conditions

    name, model = found.texture, found.model
    lines = [f"{name}: layers of each recording in {start}_layers.tsv, {start}_spectra.png"]
    if model is None:
        return [*lines, f"no full model of {found.why_not}"]
    inherited = int(model.inherited.any(axis=2).sum())
    unresolved = int(model.unresolved.any(axis=2).sum())
    lines.append(
        f"{name}{simulated_note(model)}: {model.n_layers} layers, {model.n_parameters} numbers "
        f"per condition; some layer inherited its frequency in {inherited} and was not resolved "
        f"in {unresolved} of {model.noise_gains.size} conditions: {start}.json"
    )
    if plot:
        lines.append(f"{name}: layers over the grid in {start}_layers.png")
    if missing := missing_conditions(model):
        names = "; ".join(f"{speed:g} mm/s at {force:g} N" for speed, force in missing)
        lines.append(f"{name}: interpolated for want of a recording: {names}")
    return lines


def recording_folders(folder: Path) -> list[Path]:
    """The folder itself where it is a recording set, else its sub-folders that are, by name."""
    from modeling.recording import is_recording_set

    if is_recording_set(folder) or not folder.is_dir():
        return [folder]
    below = sorted(path for path in folder.iterdir() if path.is_dir() and is_recording_set(path))
    return below or [folder]


def _sources_in(folders: Iterable[Path]) -> tuple[list[Source], list[Outcome]]:
    """All textures in these folders, and the folders whose list cannot be read."""
    from modeling.recording import textures_in

    sources: list[Source] = []
    unreadable: list[Outcome] = []
    for folder in (found for given in folders for found in recording_folders(given)):
        try:
            # A list without lines names no texture: loading it will say so.
            names = textures_in(folder) or (folder.name,)
        except (ValueError, OSError) as error:
            unreadable.append(Outcome(str(folder), error=sentence_of(error)))
            continue
        sources += [Source(folder, name) for name in names]
    return sources, unreadable


def _require_own_files(sources: Iterable[Source], out: Path) -> None:
    """Refuse textures whose files would overwrite each other's or another command's."""
    from modeling.files import file_stem

    taken: dict[str, Source] = {}
    for source in sources:
        stem = file_stem(source.texture)
        if stem in taken:
            other = taken[stem]
            raise ValueError(
                "expected each texture once, with names that differ in letters or digits, got "
                f"{other.texture!r} in {other.folder} and {source.texture!r} in {source.folder}; "
                "rename one, or model them one by one with different --out."
            )
        taken[stem] = source
        check_own_model(out / stem, "model")


def tell_verdicts(result: Simplification) -> None:
    """Print what became of each layer and why, and what the threshold is."""
    for verdict in result.layers:
        line = f"layer {verdict.layer}: {verdict.verdict}, {verdict.reason}"
        if not isnan(verdict.distance_db):  # where a threshold is known
            line += (
                f"; {verdict.distance_db:+.1f} dB at {verdict.worst_speed_mm_s:g} mm/s, "
                f"{verdict.worst_force_n:g} N ({verdict.worst_frequency_hz:.0f} Hz)"
            )
        print(line)
    print(f"threshold: {result.threshold.name} ({result.threshold.caveat})")


def draw_condition(
    full: TextureModel,
    result: Simplification,
    start: Path,
    *,
    recordings: Path | None,
    speed: float | None,
    force: float | None,
) -> None:
    """Draw spectra, layers and threshold of one condition (PAPER fig. 6), beside its recording.

    Writes `start`_threshold.png. Without speed (mm/s) or force (N) it is the fastest and strongest
    condition, of the recordings if there are any, else of the grid.
    """
    from analysis.comparison import compare_condition, compare_spectra
    from analysis.figures import figure_spectra_and_threshold
    from analysis.findings import DOTS_PER_INCH
    from analysis.sections import reference_condition
    from analysis.tables import TextureResult

    if recordings is None:
        fastest, strongest = float(full.speeds_mm_s[-1]), float(full.forces_n[-1])
        compare = partial(compare_condition, full, result)
    else:
        texture = TextureResult(_recordings_of(full.texture, recordings), full, result)
        fastest, strongest = reference_condition(texture)
        compare = partial(compare_spectra, texture)
    shown = compare(
        speed_mm_s=fastest if speed is None else speed,
        force_n=strongest if force is None else force,
    )
    start.parent.mkdir(parents=True, exist_ok=True)
    picture = figure_spectra_and_threshold(shown)
    picture.savefig(f"{start}_threshold.png", dpi=DOTS_PER_INCH)


def _recordings_of(texture: str, folder: Path) -> RecordingSet:
    """The recordings of one texture in a folder, or in the sub-folder that holds them."""
    from modeling import RecordingSet
    from modeling.recording import textures_in

    for found in recording_folders(folder):
        if texture in textures_in(found):
            return RecordingSet.load(found, texture=texture)
    raise ValueError(
        f"expected recordings of {texture!r} in {folder}, got none; give the folder that the model "
        "came from."
    )
