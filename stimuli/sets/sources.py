"""What a recipe names: models, hands, a threshold and a vibrator, read, checked and copied."""

from __future__ import annotations

import hashlib
import os
import shutil
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from math import ceil
from pathlib import Path

import numpy as np

from tactileq.modeling import InputError, Scene, Threshold, Vibrator, compensation_for
from tactileq.modeling.errors import shown
from tactileq.modeling.files.values import NameOrFile
from tactileq.modeling.files.writing import file_stem, write_text
from tactileq.modeling.models.loading import AnyModel, load_model, models_in
from tactileq.modeling.recordings.trajectory import Trajectory, load_trajectory
from tactileq.modeling.scenes.loading import scene_models
from tactileq.stimuli.sets.recipe import ModelEntry, Recipe, SetLevel, TrajectoryEntry

FOLDER = "sources"
RECIPE = "recipe.toml"
VIBRATOR = Path(FOLDER, "vibrator.json")


@dataclass(frozen=True, eq=False)
class LabelledModel:
    """A model, its label in the set, and the file that it came from.

    Of a scene that was compiled for the set, the one that it would have.
    """

    label: str
    model: AnyModel
    file: bytes

    @property
    def sha256(self) -> str:
        """Of the file."""
        return hashlib.sha256(self.file).hexdigest()


@dataclass(frozen=True, eq=False)
class Sources:
    """Everything that a recipe names, in the recipe's order.

    `passed_over`: JSON files in its folders of models that say they are something else.
    """

    models: tuple[LabelledModel, ...]
    trajectories: tuple[Trajectory, ...]
    threshold: Threshold | None
    vibrator: Vibrator | None
    vibrator_sha256: str | None
    passed_over: tuple[Path, ...]


def load_sources(recipe: Recipe) -> Sources:
    """Read what a recipe names.

    Raises
    ------
    InputError
        For a file that is missing or no model (trajectory, threshold, vibrator), two models of one
        texture under one label, a rate below a model's, a trajectory shorter than a sample, a model
        in arbitrary units in a set that is to be matched in loudness, or a vibrator that cannot be
        compensated at a rate, or not within the time to settle.
    """
    models, passed_over = _models_of(recipe)
    _check_models(models, recipe)
    trajectories = tuple(
        trajectory_of(entry, duration_s=recipe.duration_s) for entry in recipe.trajectories
    )
    for trajectory in trajectories:
        _check_lasts(trajectory, recipe)
    vibrator = None if recipe.vibrator is None else Vibrator.load(recipe.vibrator)
    if vibrator is not None:
        _check_compensated(vibrator, recipe)
    named_threshold = recipe.level.threshold
    return Sources(
        models=models,
        trajectories=trajectories,
        threshold=None if named_threshold is None else Threshold.named(named_threshold),
        vibrator=vibrator,
        vibrator_sha256=None if recipe.vibrator is None else _sha256(recipe.vibrator),
        passed_over=passed_over,
    )


def _models_of(recipe: Recipe) -> tuple[tuple[LabelledModel, ...], tuple[Path, ...]]:
    """The models of the recipe, and what its folders hold besides; a file that it names is one."""
    found: list[LabelledModel] = []
    passed_over: list[Path] = []
    for entry in recipe.models:
        if entry.scene is not None:
            least = scene_models(entry.scene).values()
            found += [LabelledModel(entry.label, m, m.to_json().encode()) for m in least]
            continue
        place = entry.place
        paths, others = models_in(place) if os.path.isdir(place) else ([place], [])
        found += [LabelledModel(entry.label, load_model(p), p.read_bytes()) for p in paths]
        passed_over += others
    return tuple(found), tuple(passed_over)


def files_behind(recipe: Recipe) -> list[Path]:
    """Every file or folder that a recipe rests on: what it names, and what its scenes name."""
    scenes = (Scene.load(e.scene) for e in recipe.models if e.scene and not os.path.isdir(e.scene))
    named = [place for scene in scenes for place in (*scene.files, scene.models) if place]
    return list(dict.fromkeys([*recipe.files(), *named]))


def trajectory_of(entry: TrajectoryEntry, *, duration_s: float) -> Trajectory:
    """What a recipe's entry stands for; `duration_s` is that of constant ones."""
    if entry.file is not None:
        return load_trajectory(entry.file, name=entry.name)
    speed, force = (
        np.full(2, value, dtype=np.float64) for value in (entry.speed_mm_s, entry.force_n)
    )
    return Trajectory(entry.name, np.array([0.0, duration_s]), speed, force)


def _sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _check_models(models: Sequence[LabelledModel], recipe: Recipe) -> None:
    names = [f"{labelled.model.texture} ({labelled.label})" for labelled in models]
    _check_distinct(names, what="model of each texture under each label")
    for labelled, name in zip(models, names, strict=True):
        _check_fits(labelled.model, name, recipe)


def _check_fits(model: AnyModel, name: str, recipe: Recipe) -> None:
    slowest = min(recipe.rates_hz)
    if slowest < model.rate_hz:
        raise InputError(
            f"expected a rendering rate of at least the model's {model.rate_hz:g} Hz for {name}, "
            f"got {slowest} Hz; a lower one would lose part of the vibration."
        )
    if recipe.level.mode == "loudness" and model.unit != "g":
        raise InputError(
            f"expected models in g to match loudness, got the unit {shown(model.unit)} for {name}; "
            "calibrate its recordings, or match RMS levels."
        )


def _check_lasts(trajectory: Trajectory, recipe: Recipe) -> None:
    slowest = min(recipe.rates_hz)
    if round(trajectory.duration_s * slowest) < 1:
        raise InputError(
            f"expected a trajectory of at least one sample at {slowest} Hz, got "
            f"{trajectory.duration_s:g} s in {shown(trajectory.name)}; check that its "
            "times are in seconds."
        )


def _check_compensated(vibrator: Vibrator, recipe: Recipe) -> None:
    needed_s = max(
        compensation_for(vibrator, rate_hz=rate_hz).settling_s for rate_hz in recipe.rates_hz
    )
    if needed_s > recipe.settling_s:
        raise InputError(
            f"expected settling_s of at least {ceil(needed_s * 100) / 100:g} under [set], in which "
            f"the compensation of {recipe.vibrator} settles, got {recipe.settling_s:g}; raise it."
        )


def _check_distinct(names: Iterable[str], *, what: str) -> None:
    seen: set[str] = set()
    for name in names:
        if name in seen:
            raise InputError(f"expected one {what}, got two of {name}; remove or rename one.")
        seen.add(name)


def recipe_of_copies(recipe: Recipe, sources: Sources) -> tuple[Recipe, dict[Path, Path | bytes]]:
    """The recipe with copies of all that it names in the folder `sources`; what they are copies of.

    That is a file, or of models what is in it.

    Rendering from that recipe gives the same set, wherever the folder is moved and whatever
    becomes of the originals.

    Raises
    ------
    InputError
        If two sources would have one name.
    """
    models = {labelled: _copy_of_model(labelled) for labelled in sources.models}
    hands = [_copy_of_trajectory(entry) for entry in recipe.trajectories]
    named = recipe.level.threshold.file if recipe.level.threshold else None
    threshold = Path(FOLDER, file_stem(named.name)) if named else None
    vibrator = None if recipe.vibrator is None else VIBRATOR
    pairs: list[tuple[object, object]] = [(copy, m.file) for m, copy in models.items()]
    pairs += [(copy.file, t.file) for t, copy in zip(recipe.trajectories, hands, strict=True)]
    pairs += [(threshold, named), (vibrator, recipe.vibrator)]
    copies = [(a, b) for a, b in pairs if isinstance(a, Path) and isinstance(b, Path | bytes)]
    _check_distinct((copy.name for copy, _ in copies), what="name for each source")
    copied = replace(
        recipe,
        models=tuple(ModelEntry(copy, labelled.label) for labelled, copy in models.items()),
        trajectories=tuple(hands),
        level=recipe.level if threshold is None else _naming(recipe.level, threshold),
        vibrator=vibrator,
    )
    return copied, dict(copies)


def _naming(level: SetLevel, threshold: Path) -> SetLevel:
    return replace(level, threshold=NameOrFile(threshold.as_posix()))


def copy_sources(recipe: Recipe, sources: Sources, *, folder: Path) -> None:
    """Copy all sources into `folder`/sources, and beside it the recipe that names the copies."""
    copied, originals = recipe_of_copies(recipe, sources)
    (folder / FOLDER).mkdir()
    for copy, original in originals.items():
        if isinstance(original, bytes):
            (folder / copy).write_bytes(original)
        else:
            shutil.copyfile(original, folder / copy)
    write_text(folder / RECIPE, copied.to_toml())


def _copy_of_model(labelled: LabelledModel) -> Path:
    return Path(FOLDER, file_stem(f"{labelled.model.texture}_{labelled.label}") + ".json")


def _copy_of_trajectory(entry: TrajectoryEntry) -> TrajectoryEntry:
    if entry.file is None:
        return entry
    return replace(entry, file=Path(FOLDER, file_stem(entry.name) + ".csv"))
