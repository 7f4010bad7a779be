"""The parts of an archive beside its data: only what is listed, written anew from what was read.

So nothing comes along that nobody reads: hidden and foreign files, what links lead to, comments, a
microphone's channel, what recorders note in WAV files. docs/method/publishing.md#listed
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from pathlib import Path


def write_models(place: Path, target: Path, *, textures: Collection[str]) -> Iterator[Path]:
    """The models of these textures in a folder, and why layers were dropped; what was written.

    Raises
    ------
    InputError
        For a file of models that is none.
    """
    from tactileq.modeling import Simplification
    from tactileq.modeling.files.places import matching
    from tactileq.modeling.models.loading import load_model, models_in
    from tactileq.modeling.perception.verdicts import ENDING

    for path in models_in(place)[0]:
        if (model := load_model(path)).texture in textures:
            model.save(target / path.name)
            yield target / path.name
    for path in matching(place, f"*{ENDING}"):
        if (verdicts := Simplification.load(path)).model.texture in textures:
            verdicts.save(target / path.name)
            yield target / path.name


def write_recordings(place: Path, target: Path, *, textures: Collection[str]) -> Iterator[Path]:
    """The recordings of these textures that can be used, as CSV; what was written.

    Raises
    ------
    InputError
        For a texture of which none can be used.
    """
    from tactileq.modeling.files.places import matching
    from tactileq.modeling.files.writing import file_stem
    from tactileq.printing import usable_recordings

    for texture in sorted(textures):
        own, folder = place / file_stem(texture), target / file_stem(texture)
        if own.is_dir():  # else nobody answered about it, or the analysis says that it is missing
            usable_recordings(own, texture).save(folder)
            yield from matching(folder, "*")


def write_stimuli(place: Path, target: Path) -> Iterator[Path]:
    """The files that the manifest of a stimulus set lists, and its recipe; what was written.

    Raises
    ------
    InputError
        For a folder without a manifest, a file that is not there, and a link to one elsewhere.
    """
    from tactileq.modeling.files.folders import listed_file
    from tactileq.modeling.files.hashes import sha256_of_file
    from tactileq.modeling.files.stimulus_table import MANIFEST, STIMULUS_COLUMNS
    from tactileq.modeling.files.tables import read_cells
    from tactileq.modeling.files.wav import samples_only
    from tactileq.modeling.files.writing import write_bytes
    from tactileq.stimuli.sets.manifest import write_manifest
    from tactileq.stimuli.sets.sources import RECIPE

    rows = []
    for _, row in read_cells(place / MANIFEST, STIMULUS_COLUMNS):
        path, copy = listed_file(place, row["file"], index_name=MANIFEST), target / row["file"]
        _check_within(path, place)
        write_bytes(copy, samples_only(path.read_bytes(), path))
        rows.append({**row, "sha256": sha256_of_file(copy)})
        yield copy
    yield from write_manifest(target, rows)
    if (place / RECIPE).is_file():
        yield from _write_recipe(place / RECIPE, target)


def _write_recipe(place: Path, target: Path) -> Iterator[Path]:
    """A recipe and the sources that it names."""
    from tactileq.modeling.files.writing import write_bytes
    from tactileq.stimuli.sets.recipe import Recipe
    from tactileq.stimuli.sets.sources import RECIPE, VIBRATOR, load_sources, recipe_of_copies

    recipe = Recipe.load(place)
    copied, originals = recipe_of_copies(recipe, load_sources(recipe))
    hands = {entry.file for entry in copied.trajectories}
    made = {Path(RECIPE): copied.to_toml().encode()}
    for copy, original in originals.items():
        if isinstance(original, bytes):  # of a model
            made[copy] = original
        elif copy == VIBRATOR:
            made[copy] = original.read_bytes()  # JSON, in which a reader refuses unknown keys
        else:
            made[copy] = _hand(original) if copy in hands else _threshold(original)
    for name, data in made.items():
        write_bytes(target / name, data)
        yield target / name


def _hand(path: Path) -> bytes:
    from tactileq.modeling.files.others.declared import declared_text
    from tactileq.modeling.recordings.trajectory import TRAJECTORY_COLUMNS

    return declared_text(path, TRAJECTORY_COLUMNS, what="a trajectory", separator=",").encode()


def _threshold(path: Path) -> bytes:
    """With its source and its caveat, which are part of its hash."""
    from tactileq.modeling import Threshold
    from tactileq.modeling.files.others.declared import declared_text
    from tactileq.modeling.perception.thresholds import THRESHOLD_COLUMNS

    stated = Threshold.load(path)
    notes = f"# source: {stated.source}\n# caveat: {stated.caveat}\n"
    return (notes + declared_text(path, THRESHOLD_COLUMNS, what="thresholds")).encode()


def _check_within(path: Path, folder: Path) -> None:
    """Refuse a file to which only a link leads."""
    from tactileq.modeling import InputError

    if not path.resolve().is_relative_to(folder.resolve()):
        raise InputError(
            f"expected a file in {folder} at {path}, got a link to {path.resolve()}; put the file "
            "itself there."
        )
