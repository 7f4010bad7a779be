"""Modelling many textures at once, each in a process of its own."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import BrokenExecutor
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tactileq.modeling.errors import counted
from tactileq.printing import (
    clipping_warnings,
    left_out_warnings,
    progress,
    sentence_of,
    simulated_note,
)
from tactileq.results import CommandRun, FileResults
from tactileq.workers import working

if TYPE_CHECKING:
    from tactileq.analysis.spectra.findings import Findings
    from tactileq.modeling import RecordingSet
    from tactileq.modeling.models.fit_summary import FitSummary


@dataclass(frozen=True)
class TextureSource:
    """One texture in one folder of recordings."""

    folder: Path
    texture: str


@dataclass(frozen=True)
class TextureOutcome:
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


@dataclass(frozen=True)
class _Made:
    """What a process returns for one texture; its files are written by the parent process.

    Parameters
    ----------
    files : mapping of str to bytes
        By the ending of their names.
    provenance : mapping
        Of the files; empty without them.
    """

    outcome: TextureOutcome
    files: Mapping[str, bytes] = field(default_factory=dict)
    provenance: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class HowToModel:
    """What `tactileq model` was asked for.

    Parameters
    ----------
    layers : int, optional
        Their number; chosen without it.
    keep_hum, check, alone, plot : bool
        Leave mains hum in; leave conditions out and predict them; find the layers of each
        recording by itself; draw pictures.
    """

    estimator: str = "joint"
    layers: int | None = None
    keep_hum: bool = False
    check: bool = False
    alone: bool = False
    plot: bool = False


def model_textures(
    folders: Sequence[Path], out: Path, *, how: HowToModel, jobs: int | None
) -> list[TextureOutcome]:
    """Model every texture in these folders, some at a time; what came of each, in order.

    One that cannot be modelled does not stop the others.

    Parameters
    ----------
    folders : sequence of Path
        Recording sets, or folders of them.
    out : Path
        Where the files go; a texture's are written once it is modelled.
    jobs : int, optional
        Textures at a time, in processes of their own; as many as there are cores without it. The
        files do not depend on it.

    Raises
    ------
    ValueError
        Before any work where two textures would share a file, or other files are in the way.
    """
    sources, unreadable = _sources_in(folders)
    places = _places_of(sources, out)
    return [*unreadable, *_model_all(places, out, how=how, jobs=jobs)]


def _model_all(
    places: Mapping[TextureSource, FileResults], out: Path, *, how: HowToModel, jobs: int | None
) -> list[TextureOutcome]:
    """Outcomes in the order of the sources, with a progress bar."""
    sources = list(places)
    outcomes: dict[int, TextureOutcome] = {}
    work = partial(_model_one, out=out, how=how)
    with progress("Finding layers, fitting", len(sources)) as advance:
        try:
            with working(work, sources, jobs=jobs) as results:
                for number, made in results:
                    source = sources[number]
                    outcomes[number] = _write(made, _start(source, out), places[source])
                    advance(source.texture)
        except BrokenExecutor:
            raise ValueError(
                "expected every process to finish, got one that the system stopped, perhaps "
                "because memory ran out; run again with a smaller --jobs."
            ) from None
    return [outcomes[number] for number in range(len(sources))]


def _start(source: TextureSource, out: Path) -> Path:
    """What the names of a texture's files begin with."""
    from tactileq.modeling.files.writing import file_stem

    return out / file_stem(source.texture)


def _write(made: _Made, start: Path, results: FileResults) -> TextureOutcome:
    """Write a texture's files, all or none; what is wrong becomes the outcome's error."""
    if made.outcome.error:
        return made.outcome
    contents = {Path(f"{start}{ending}"): data for ending, data in made.files.items()}
    try:
        results.write(contents, made.provenance)
    except (ValueError, OSError) as error:
        return TextureOutcome(made.outcome.what, error=sentence_of(error))
    return made.outcome


def _model_one(source: TextureSource, *, out: Path, how: HowToModel) -> _Made:
    """Load and model one texture; what is wrong with it becomes its outcome's error."""
    from tactileq.analysis.spectra.findings import find_in, findings_files
    from tactileq.modeling.recordings.recording_set import load_usable
    from tactileq.modeling.threads import one_linear_algebra_thread

    what = f"{source.texture} in {source.folder}"
    try:
        # One thread each: sums must not depend on the number of cores.
        with one_linear_algebra_thread():
            ran = CommandRun("model")
            ran.reads(source.folder)
            records, unusable = load_usable(source.folder, texture=source.texture)
            found = find_in(
                records,
                estimator=how.estimator,
                layers=how.layers,
                keep_hum=how.keep_hum,
                check=how.check,
                alone=how.alone,
            )
            files = findings_files(found, plot=how.plot)
            settings = {
                "estimator": how.estimator,
                "layers": how.layers,
                "keep_hum": how.keep_hum,
                "left_out": list(unusable),
            }
            provenance = ran.provenance(settings)
    except (ValueError, OSError, MemoryError) as error:
        return _Made(TextureOutcome(what, error=sentence_of(error)))
    notes = (*_rate_notes(records), *_findings(found, _start(source, out), plot=how.plot))
    warnings = (
        *left_out_warnings(source.texture, unusable),
        *clipping_warnings(records),
        *_mended(found),
        *_doubts(found),
    )
    outcome = TextureOutcome(what, notes=notes, warnings=warnings)
    return _Made(outcome, files, provenance)


def _doubts(found: Findings) -> list[str]:
    """What the estimator warns of."""
    fit = None if found.model is None else found.model.fit
    return [] if fit is None else [f"warning: {found.texture}: {w}." for w in fit.warnings]


def _mended(found: Findings) -> list[str]:
    """One sentence for each thing that was corrected in recordings, and for silent ones."""
    by_note: dict[str, list[str]] = {}
    for recording, spectrum in found.measured:
        notes = spectrum.notes if spectrum.magnitude.any() else ("silent: left out",)
        for note in notes:
            by_note.setdefault(note, []).append(recording.describe())
    return [
        f"warning: {where[0]}{f' and {len(where) - 1} more' * (len(where) > 1)}: {note}."
        for note, where in by_note.items()
    ]


def _rate_notes(records: RecordingSet) -> list[str]:
    """A note where the data's rate is lower than the model's would be."""
    from tactileq.modeling.recordings.spectrum import MODEL_RATE_HZ

    rate_hz = min(r.rate_hz for r in records.recordings if r.force_n > 0)
    if rate_hz >= MODEL_RATE_HZ:
        return []
    return [
        f"note: {records.texture}: the data's rate of {rate_hz:g} Hz becomes the model's; the "
        f"band from {rate_hz / 2:g} to {MODEL_RATE_HZ / 2:g} Hz is missing."
    ]


def _findings(found: Findings, start: Path, *, plot: bool) -> list[str]:
    """What was found and where it is, with the conditions that were interpolated."""
    from tactileq.analysis.textures.between import FIELD_OF_SPECTRA, sentence, worth_recording
    from tactileq.modeling import missing_conditions
    from tactileq.modeling.models.own_peaks import own_peaks

    name, model = found.texture, found.model
    lines = (
        [f"{name}: layers of each recording by itself in {start}_alone.tsv"] if found.alone else []
    )
    if model is None:
        return [*lines, f"no full model of {found.why_not}"]
    peaks = own_peaks(model)
    filling = int((~peaks.is_peak).sum())
    filled = f", {filling} of them without a peak of {'its' if filling == 1 else 'their'} own"
    conditions, unknown = model.noise_gains.size, int(model.not_identifiable.any(axis=2).sum())
    lines.append(
        f"{name}{simulated_note(model)}: {counted(model.n_layers, 'layer')}"
        f"{filled * bool(filling)}, {counted(model.n_parameters, 'number')} per condition; a "
        f"layer's frequency is inherited from other conditions in "
        f"{int(model.inherited.any(axis=2).sum())}, its width or level not resolved in "
        f"{int(model.unresolved.any(axis=2).sum())} and not identifiable in {unknown} of "
        f"{counted(conditions, 'condition')}: {start}.json"
    )
    if model.fit is not None:
        lines.append(f"{name}: {_nearness(model.fit)}")
    lines.append(f"{name}: layers over the grid in {start}_layers.tsv")
    lines.append(f"{name}: fit to its recordings: {sentence(found.quality)}")
    if found.left_out is not None:
        lines.append(f"{name}: conditions left out and predicted: {sentence(found.left_out)}")
        if (without := found.left_out_without_layers) is not None and len(without):
            lines.append(f"{name}: the same by {FIELD_OF_SPECTRA}, no layers: {sentence(without)}")
        if more := worth_recording(found.left_out):
            near = "; ".join(f"{speed:.4g} mm/s at {force:.3g} N" for speed, force in more)
            lines.append(
                f"{name}: predicted more than twice as badly as the median: {near}; "
                "tactileq record --audio --more asks for conditions near them"
            )
    for axis, unit in ((model.speeds_mm_s, "mm/s"), (model.forces_n, "N")):
        if axis.size == 1:
            other = "speeds" if unit == "mm/s" else "forces"
            lines.append(
                f"note: {name}: recorded at {axis[0]:g} {unit} only; the model says nothing about "
                f"other {other}."
            )
    if plot:
        lines.append(f"{name}: figures in {start}_spectra.png and {start}_layers.png")
    if missing := missing_conditions(model):
        names = "; ".join(f"{speed:g} mm/s at {force:g} N" for speed, force in missing)
        lines.append(f"{name}: interpolated, because there is no recording: {names}")
    return lines


def _nearness(fit: FitSummary) -> str:
    """What is expected of a model's distance, and what other numbers of layers would change."""
    others = ", ".join(
        f"{counted(int(number), 'layer')} {distance:.2f} dB"
        for number, distance in sorted(fit.by_layers_db.items(), key=lambda item: int(item[0]))
    )
    text = (
        f"expected distance from the true spectra {fit.distance_db:.2f} dB at conditions, "
        f"{fit.with_blends_db:.2f} dB with the blends between them (at worst "
        f"{fit.blend_defect_db:.1f} dB from their conditions)"
    )
    return f"{text}; by --layers instead {others}" if others else text


def _sources_in(folders: Iterable[Path]) -> tuple[list[TextureSource], list[TextureOutcome]]:
    """All textures in these folders, and the folders whose list cannot be read."""
    from tactileq.modeling.recordings.recording_set import recording_folders, textures_in

    sources: list[TextureSource] = []
    unreadable: list[TextureOutcome] = []
    for folder in (found for given in folders for found in recording_folders(given)):
        try:
            # A list without lines names no texture: loading it will say so.
            names = textures_in(folder) or (folder.name,)
        except (ValueError, OSError) as error:
            unreadable.append(TextureOutcome(str(folder), error=sentence_of(error)))
            continue
        sources += [TextureSource(folder, name) for name in names]
    return sources, unreadable


def _places_of(sources: Iterable[TextureSource], out: Path) -> dict[TextureSource, FileResults]:
    """Where each texture's files go; refuses what would overwrite another's or a command's."""
    from tactileq.analysis.spectra.findings import FILE_ENDINGS

    taken: dict[Path, TextureSource] = {}
    places = {}
    for source in sources:
        start = _start(source, out)
        if start in taken:
            other = taken[start]
            raise ValueError(
                "expected each texture once, with names that differ in letters or digits, got "
                f"{other.texture!r} in {other.folder} and {source.texture!r} in {source.folder}; "
                "rename one, or model them one by one with different --out."
            )
        taken[start] = source
        places[source] = FileResults(
            [Path(f"{start}{ending}") for ending in FILE_ENDINGS],
            "model",
            note=Path(f"{start}_provenance.json"),
            texture=source.texture,
        )
    return places
