"""StimulusRow sets: WAV files rendered from a recipe, and the manifest that says what they are."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from math import ceil, floor, log10
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from tactileq.modeling import InputError, Threshold, compensation_for
from tactileq.modeling.arrays import Floats
from tactileq.modeling.files.folders import Contents, check_replaceable, replace_folder
from tactileq.modeling.files.places import matching
from tactileq.modeling.files.reading import reason_of
from tactileq.modeling.files.stimulus_table import MANIFEST
from tactileq.modeling.files.writing import file_stem
from tactileq.modeling.perception.sensation_level import SensationLevel, sensation_level
from tactileq.modeling.recordings.trajectory import Trajectory
from tactileq.modeling.seeds import noise_stream
from tactileq.modeling.threads import in_order, usable_cores
from tactileq.stimuli.sets.manifest import (
    COLUMNS_FILE,
    COMPENSATED,
    StimulusRow,
    level_db,
    measured,
    write_manifest,
)
from tactileq.stimuli.sets.recipe import Recipe, SampleFormat, TrajectoryEntry
from tactileq.stimuli.sets.rendering import (
    BITS,
    at_rate,
    highest_peak,
    margin_samples,
    render_with_margins,
    start_sample,
    steady_part,
    wav_bytes,
)
from tactileq.stimuli.sets.sources import (
    FOLDER,
    RECIPE,
    LabelledModel,
    Sources,
    copy_sources,
    load_sources,
    recipe_of_copies,
)

CONTACT_SHEET = "spectra.png"
# All threads together work on this many samples, in at most 0.1 kB each.
SAMPLES_AT_ONCE = 2**24


@dataclass(frozen=True, eq=False)
class _Take:
    """One model on one trajectory with one noise; every rate makes a file of it."""

    source: LabelledModel
    entry: TrajectoryEntry
    trajectory: Trajectory
    seed: int
    stream: int
    settling_s: float

    @property
    def name(self) -> str:
        return f"{self.source.model.texture}_{self.source.label}_{self.entry.name}"

    def render(self) -> Floats:
        """At the model's rate, with margins (`render_with_margins`)."""
        return render_with_margins(
            self.source.model,
            self.trajectory,
            seed=self.seed,
            stream=self.stream,
            settling_s=self.settling_s,
        )

    def steady(self) -> Floats:
        """What its level is measured over, at the model's rate."""
        rate_hz, vibration = self.source.model.rate_hz, self.render()
        start = start_sample(rate_hz, settling_s=self.settling_s)
        return steady_part(vibration[start : vibration.size - margin_samples(rate_hz)], rate_hz)


class _Gain(NamedTuple):
    """What brings a take to its level, and its sensation level then where that was matched."""

    gain_db: float = 0.0
    sensation_level_db: float | None = None
    share_without_threshold: float | None = None


def write_set(
    folder: str | Path,
    recipe: Recipe,
    *,
    sources: Sources | None = None,
    progress: Callable[[str], None] | None = None,
    finish: Callable[[Path], None] | None = None,
) -> tuple[StimulusRow, ...]:
    """Render every model on every trajectory with every seed, at every rate, to a WAV file.

    Beside the files: `manifest.tsv` with `manifest.json`, which describes its columns, and
    `recipe.toml` with copies of all that it names in `sources`, from which the same set is made
    again. The same recipe and sources give the same bytes (with one version of everything on one
    kind of processor; elsewhere the last bit of a sample may differ).

    Parameters
    ----------
    folder : path
        Appears whole or not at all; replaced if it was a stimulus set, refused if it was not
        (`check_place`).
    sources : Sources, optional
        The recipe's, where they are loaded already.
    progress : callable, optional
        Called with the file's name after each file.
    finish : callable, optional
        Called with the complete set before it takes its place, to put its picture and provenance
        beside it.

    Returns
    -------
    tuple of StimulusRow
        The manifest's rows.

    Raises
    ------
    InputError
        For a recipe whose sources cannot be used, a silent stimulus that is to be brought to a
        level, two stimuli of one name, samples beyond what the files' format holds, or a disk
        that takes no more; then nothing is written.
    """
    target = Path(folder)
    seen = check_place(target)
    sources = sources or load_sources(recipe)
    stimuli = []
    try:
        with replace_folder(target, seen) as fresh, closing(rendered(recipe, sources)) as files:
            copy_sources(recipe, sources, folder=fresh)
            for stimulus, data in files:
                _write_new(fresh / stimulus.file, data)
                stimuli.append(stimulus)
                if progress:
                    progress(stimulus.file)
            check_clipping(stimuli)
            write_manifest(fresh, map(vars, stimuli))
            if finish:
                finish(fresh)
    except OSError as error:
        where = "" if error.filename in (None, str(target)) else f" at {error.filename}"
        raise InputError(
            f"expected to write a stimulus set to {target}, got {reason_of(error)}{where}; "
            "check the path, its permissions and the space on the disk."
        ) from None
    return tuple(stimuli)


def check_place(target: Path) -> Contents:
    """Refuse a folder that holds anything but a set: its files and the copies of its sources.

    What is in it is returned, for `replace_folder`.
    """
    own = (RECIPE, COLUMNS_FILE, CONTACT_SHEET, FOLDER)
    seen = check_replaceable(target, index_name=MANIFEST, what="a stimulus set", beside=own)
    if not (target / FOLDER).is_dir():
        return seen
    named = Recipe.load(target / RECIPE).files()
    foreign = sorted(set(matching(target / FOLDER, "*")) - set(named))
    if foreign:
        raise InputError(
            f"expected a new folder or a stimulus set, got {target} with a file in it that its "
            f"recipe does not name ({foreign[0]}); choose another folder."
        )
    return seen


def _write_new(path: Path, data: bytes) -> None:
    if path.exists():
        raise InputError(
            f"expected each stimulus to have a unique name, got {path.name} twice; rename a "
            "texture, label or trajectory."
        )
    path.write_bytes(data)


def stimulus_count(recipe: Recipe, sources: Sources) -> int:
    """How many stimuli a recipe has."""
    takes = len(sources.models) * len(recipe.trajectories) * len(recipe.seeds)
    return takes * len(recipe.rates_hz)


def rendered(recipe: Recipe, sources: Sources) -> Generator[tuple[StimulusRow, bytes]]:
    """Every stimulus of a recipe: its row of the manifest and its WAV file.

    Gains are found before the first, files rendered as they are asked for, by threads that keep a
    little ahead; until it is exhausted, close the generator to end them.

    Raises
    ------
    InputError
        For a silent stimulus that is to be brought to a level.
    """
    takes = list(_takes(recipe, sources))
    gains = _gains(takes, recipe, sources)
    text = recipe_of_copies(recipe, sources)[0].to_toml()
    maker = _FileMaker(recipe, sources, hashlib.sha256(text.encode()).hexdigest())
    pairs = list(zip(takes, gains, strict=True))
    threads = _threads_for(takes, sum(recipe.rates_hz))
    with closing(in_order(lambda pair: maker.files(*pair), pairs, threads=threads)) as made:
        for of_one_take in made:
            yield from of_one_take


def _threads_for(takes: Iterable[_Take], rate_hz: float) -> int:
    """How many threads work on takes at a rate, or at several that add up to it."""
    longest_s = max(take.trajectory.duration_s + take.settling_s for take in takes)
    return thread_count(ceil(longest_s * rate_hz))


def thread_count(samples: int) -> int:
    """How many threads for pieces of work on this many samples each: the usable cores at most.

    One for long pieces, which fill the memory.
    """
    return max(1, min(usable_cores(), SAMPLES_AT_ONCE // max(samples, 1)))


def _takes(recipe: Recipe, sources: Sources) -> Iterator[_Take]:
    for source in sources.models:
        for entry, trajectory in zip(recipe.trajectories, sources.trajectories, strict=True):
            label = "" if recipe.noise == "frozen" else source.label
            # By name, so that a stimulus stays the same when others are added to its set.
            stream = noise_stream(source.model.texture, label, entry.name)
            for seed in recipe.seeds:
                yield _Take(source, entry, trajectory, seed, stream, recipe.settling_s)


def _gains(takes: Sequence[_Take], recipe: Recipe, sources: Sources) -> list[_Gain]:
    """One gain for each take. Rendered for this alone: keeping all takes would fill the memory."""
    if recipe.level.mode == "as modelled":
        return [_Gain() for _ in takes]
    threads = _threads_for(takes, max(take.source.model.rate_hz for take in takes))
    if recipe.level.rms_db is not None:
        wanted_db = recipe.level.rms_db
        return [_Gain(wanted_db - own) for own in in_order(_level_db, takes, threads=threads)]
    assert sources.threshold is not None  # a recipe that matches loudness names one
    loudness = partial(_sensation_level, threshold=sources.threshold)
    found = list(in_order(loudness, takes, threads=threads))
    return _loudness_gains(found, wanted_db=recipe.level.sensation_level_db)


def _level_db(take: _Take) -> float:
    """Refused for silence, which no gain brings to a level."""
    level = level_db(float(np.sqrt(np.mean(take.steady() ** 2))))
    if level == -np.inf:
        raise InputError(
            f"expected vibration to adjust in level, got silence in {take.name}; leave this "
            "stimulus out or render the set as modelled."
        )
    return level


def _sensation_level(take: _Take, *, threshold: Threshold) -> SensationLevel:
    try:
        return sensation_level(take.steady(), take.source.model.rate_hz, threshold=threshold)
    except InputError as error:
        raise InputError(f"{take.name}: {error}") from None


def _loudness_gains(found: Sequence[SensationLevel], *, wanted_db: float | None) -> list[_Gain]:
    """All takes to one sensation level: the wanted one, or the median of what they have."""
    if wanted_db is None:
        wanted_db = float(np.median([sensation.level_db for sensation in found]))
    return [_Gain(wanted_db - s.level_db, wanted_db, s.share_without_threshold) for s in found]


@dataclass(frozen=True)
class _FileMaker:
    """Makes the files of a recipe's takes."""

    recipe: Recipe
    sources: Sources
    recipe_sha256: str

    def files(self, take: _Take, gain: _Gain) -> list[tuple[StimulusRow, bytes]]:
        """The files of one take, one per rate, each with its row of the manifest."""
        with_margins = take.render() * 10 ** (gain.gain_db / 20)
        resampled = partial(
            at_rate,
            with_margins,
            take.source.model.rate_hz,
            duration_s=take.trajectory.duration_s,
            settling_s=take.settling_s,
        )
        made = []
        for rate_hz in self.recipe.rates_hz:
            vibration = resampled(rate_hz=rate_hz)
            written = vibration
            if self.sources.vibrator is not None:
                compensation = compensation_for(self.sources.vibrator, rate_hz=rate_hz)
                written = resampled(rate_hz=rate_hz, compensation=compensation)
            file = self._file_name(take, rate_hz)
            _check_finite(written, file, self.recipe.format)
            data = wav_bytes(written, rate_hz, full_scale_g=self.recipe.level.full_scale_g)
            stimulus = StimulusRow(
                file=file,
                rate_hz=rate_hz,
                duration_s=vibration.size / rate_hz,
                sha256=hashlib.sha256(data).hexdigest(),
                **gain._asdict(),
                **measured(vibration, rate_hz, written=written),
                **self._description(take),
            )
            made.append((stimulus, data))
        return made

    def _file_name(self, take: _Take, rate_hz: int) -> str:
        """Seed and rate stand in the name only where there are several."""
        seed = f"_seed{take.seed}" if len(self.recipe.seeds) > 1 else ""
        rate = f"_{rate_hz}Hz" if len(self.recipe.rates_hz) > 1 else ""
        return file_stem(take.name + seed + rate) + ".wav"

    def _description(self, take: _Take) -> dict[str, Any]:
        """What all files of a take have in common."""
        model, recipe, vibrator = take.source.model, self.recipe, self.sources.vibrator
        threshold = self.sources.threshold
        simulated = model.simulated or (vibrator is not None and vibrator.simulated)
        return {
            "texture": model.texture,
            "model": take.source.label,
            "layers": getattr(model, "n_layers", None),
            "model_rate_hz": model.rate_hz,
            "trajectory": take.entry.name,
            "speed_mm_s": take.entry.speed_mm_s,
            "force_n": take.entry.force_n,
            "seed": take.seed,
            "stream": take.stream,
            # Brought to a level in dB re 1 g, samples are g whatever they were before.
            "unit": "g" if recipe.level.mode == "rms" else model.unit,
            "format": recipe.format,
            "bits": BITS[recipe.format],
            "full_scale_g": recipe.level.full_scale_g,
            "model_sha256": take.source.sha256,
            "recipe_sha256": self.recipe_sha256,
            "threshold_sha256": None if threshold is None else threshold.sha256,
            "vibrator": None if vibrator is None else COMPENSATED,
            "vibrator_sha256": self.sources.vibrator_sha256,
            "simulated": str(simulated).lower(),
        }


def _check_finite(samples: Floats, file: str, sample_format: SampleFormat) -> None:
    """Refuse samples that are not finite in their format; 24-bit ones are checked for clipping."""
    largest = np.finfo(np.float32 if sample_format == "float32" else np.float64).max
    beyond = samples[~(np.abs(samples) <= largest)]  # so is NaN
    if beyond.size:
        raise InputError(
            f"expected samples of at most {largest:.2g} in {file}, as the format {sample_format} "
            f"holds them, got {beyond[0]:.2g}; correct the gains of the model."
        )


def check_clipping(stimuli: Sequence[StimulusRow]) -> None:
    """Refuse a set of 24-bit files of which one does not hold its samples."""
    loudest = max(stimuli, key=lambda stimulus: stimulus.peak)
    full_scale_g = loudest.full_scale_g
    if full_scale_g is not None and loudest.peak > highest_peak(full_scale_g):
        least = _rounded_up(loudest.peak * full_scale_g / highest_peak(full_scale_g))
        raise InputError(
            f"expected samples within the full scale of {full_scale_g:g} g, got a peak of "
            f"{loudest.peak:.4g} g in {loudest.file}; set full_scale_g to {least:g} or more."
        )


def _rounded_up(value: float) -> float:
    """To four significant digits."""
    unit = 10.0 ** (floor(log10(value)) - 3)
    return ceil(value / unit) * unit
