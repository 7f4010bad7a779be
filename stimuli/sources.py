"""What a recipe names: models, hand trajectories and a threshold, read, checked and copied."""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

from modeling import ARModel, InputError, RegressedModel, TextureModel, Threshold
from modeling.files import file_stem, write_text
from stimuli.recipe import ModelEntry, Recipe, TrajectoryEntry
from stimuli.trajectories import Trajectory

AnyModel = TextureModel | RegressedModel | ARModel
FOLDER = "sources"
RECIPE = "recipe.toml"
_KINDS: tuple[type[AnyModel], ...] = (TextureModel, RegressedModel, ARModel)


@dataclass(frozen=True, eq=False)
class LabelledModel:
    """A model, its label in the set, and the file that it came from."""

    label: str
    model: AnyModel
    path: Path
    sha256: str


@dataclass(frozen=True, eq=False)
class Sources:
    """Everything that a recipe names, in the recipe's order."""

    models: tuple[LabelledModel, ...]
    trajectories: tuple[Trajectory, ...]
    threshold: Threshold | None


def load_model(path: Path) -> AnyModel:
    """A saved model of any kind, by the format that the file states."""
    try:
        stated = json.loads(path.read_text(encoding="utf-8")).get("format")
    except (OSError, ValueError, AttributeError):
        stated = None  # `TextureModel.load` says what is wrong with the file
    kinds = {kind.FORMAT: kind for kind in _KINDS}
    return kinds.get(stated, TextureModel).load(path)


def load_sources(recipe: Recipe) -> Sources:
    """Read what a recipe names.

    Raises
    ------
    InputError
        For a file that is missing or no model (trajectory, threshold), two models of one texture
        under one label, a rate below a model's, or a model in arbitrary units in a set that is to
        be matched in loudness.
    """
    models = tuple(
        _labelled(path, entry.label) for entry in recipe.models for path in _files(entry)
    )
    names = [f"{m.model.texture} ({m.label})" for m in models]
    _check_distinct(names, what="model of each texture under each label")
    for labelled, name in zip(models, names, strict=True):
        _check_fits(labelled.model, name, recipe)
    trajectories = tuple(
        Trajectory.of(entry, duration_s=recipe.duration_s) for entry in recipe.trajectories
    )
    return Sources(models, trajectories, _threshold(recipe.level.threshold))


def model_files(recipe: Recipe) -> list[tuple[Path, str]]:
    """Every model's file with its label; folders are searched for `*.json`, in order of name."""
    return [(path, entry.label) for entry in recipe.models for path in _files(entry)]


def _labelled(path: Path, label: str) -> LabelledModel:
    model = load_model(path)
    return LabelledModel(label, model, path, hashlib.sha256(path.read_bytes()).hexdigest())


def _files(entry: ModelEntry) -> list[Path]:
    if not entry.path.is_dir():
        return [entry.path]
    found = sorted(p for p in entry.path.glob("*.json") if not p.name.endswith("provenance.json"))
    if not found:
        raise InputError(
            f"expected model files in {entry.path}, got none; fit or simplify some first."
        )
    return found


def _threshold(named: str | Path | None) -> Threshold | None:
    if named is None:
        return None
    return Threshold.load(named) if isinstance(named, Path) else Threshold.shipped(named)


def _check_fits(model: AnyModel, name: str, recipe: Recipe) -> None:
    slowest = min(recipe.rates_hz)
    if slowest < model.rate_hz:
        raise InputError(
            f"expected a rendering rate of at least the model's {model.rate_hz:g} Hz for {name}, "
            f"got {slowest} Hz; a lower one would lose part of the vibration."
        )
    if recipe.level.mode == "loudness" and model.unit != "g":
        raise InputError(
            f"expected models in g to match loudness, got the unit {model.unit!r} for {name}; "
            "calibrate its recordings, or match RMS levels."
        )


def _check_distinct(names: Iterable[str], *, what: str) -> None:
    seen: set[str] = set()
    for name in names:
        if name in seen:
            raise InputError(f"expected one {what}, got two of {name}; remove or rename one.")
        seen.add(name)


def copy_sources(recipe: Recipe, sources: Sources, *, folder: Path) -> str:
    """Copy all sources into `folder`/sources, and beside it a recipe that names the copies.

    Rendering from that recipe gives the same set, wherever the folder is moved and whatever
    becomes of the originals. Returns the recipe's text.

    Raises
    ------
    InputError
        Where two sources would have one name.
    """
    (folder / FOLDER).mkdir()
    models = {labelled: _copy_of_model(labelled) for labelled in sources.models}
    hands = [_copy_of_trajectory(entry) for entry in recipe.trajectories]
    named = recipe.level.threshold
    threshold = Path(FOLDER, file_stem(named.name)) if isinstance(named, Path) else named
    pairs: list[tuple[object, object]] = [(m.path, copy) for m, copy in models.items()]
    pairs += [(t.file, copy.file) for t, copy in zip(recipe.trajectories, hands, strict=True)]
    pairs.append((named, threshold))
    copies = [(a, b) for a, b in pairs if isinstance(a, Path) and isinstance(b, Path)]
    _check_distinct((copy.name for _, copy in copies), what="name for each source")
    for path, copy in copies:
        shutil.copyfile(path, folder / copy)
    copied = replace(
        recipe,
        models=tuple(ModelEntry(copy, labelled.label) for labelled, copy in models.items()),
        trajectories=tuple(hands),
        level=replace(recipe.level, threshold=threshold),
    )
    write_text(folder / RECIPE, copied.to_toml())
    return copied.to_toml()


def _copy_of_model(labelled: LabelledModel) -> Path:
    return Path(FOLDER, file_stem(f"{labelled.model.texture}_{labelled.label}") + ".json")


def _copy_of_trajectory(entry: TrajectoryEntry) -> TrajectoryEntry:
    if entry.file is None:
        return entry
    return replace(entry, file=Path(FOLDER, file_stem(entry.name) + ".csv"))
