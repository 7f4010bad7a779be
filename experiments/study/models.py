"""The models that a study presents: two or more named sets, one model of every texture each."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import NoReturn

from tactileq.experiments.study.study import Study
from tactileq.modeling import InputError, TextureModel
from tactileq.modeling.checks import check_keys
from tactileq.modeling.files.stimulus_table import MANIFEST as STIMULI
from tactileq.modeling.models.compiled_for import CompiledFor
from tactileq.modeling.models.loading import load_any_models
from tactileq.modeling.models.loading import made_from as model_made_from
from tactileq.modeling.reprs import one_line
from tactileq.modeling.scenes.compiled import FILE as SCENE
from tactileq.modeling.scenes.loading import scene_files, scene_models
from tactileq.rig.devices.sound.signals import stimuli_of_surfaces
from tactileq.rig.shared.interface import Presentable, Stimulus

# What may continue where a reason is given: what it is, and the sentence against it, unfinished.
Allow = Callable[[str, str], None]


def refuse(what: str, sentence: str) -> NoReturn:
    """Allow no override."""
    raise InputError(f"{sentence}.")


@dataclass(frozen=True, kw_only=True)
class ModelSets:
    """Models by the name of their set and of their texture; the first set is the reference.

    Parameters
    ----------
    sets : mapping of name to mapping of texture to model
    """

    sets: Mapping[str, Mapping[str, Presentable]]

    __repr__ = one_line

    @property
    def names(self) -> tuple[str, ...]:
        """Of the sets, the reference first."""
        return tuple(self.sets)

    @property
    def scene(self) -> CompiledFor | None:
        """What the models say of a scene that they were compiled for, if some were."""
        every = (model for models in self.sets.values() for model in models.values())
        notes = (getattr(model, "compiled_for", None) for model in every)
        return next((note for note in notes if note), None)

    @property
    def stimuli(self) -> tuple[Stimulus, ...]:
        """All files of stimulus sets among them."""
        every = (shown for models in self.sets.values() for shown in models.values())
        return tuple(shown for shown in every if isinstance(shown, Stimulus))

    def of(self, texture: str, name: str) -> Presentable:
        """The model of one texture in one set."""
        return self.sets[name][texture]

    def sha256(self, textures: Sequence[str]) -> dict[str, dict[str, str]]:
        """SHA-256 of the models of each texture, by which a session names what it presented."""
        return {
            texture: {name: self.of(texture, name).sha256 for name in self.sets}
            for texture in textures
        }

    def identical(
        self, textures: Sequence[str], names: Sequence[str] | None = None
    ) -> tuple[str, ...]:
        """The textures whose models are equal in all (or these) sets: nothing to compare."""
        every = tuple(names or self.names)
        equal = self.equal_models(textures, every)
        return tuple(texture for texture, groups in equal.items() if groups == (every,))

    def equal_models(
        self, textures: Sequence[str], names: Sequence[str] | None = None
    ) -> dict[str, tuple[tuple[str, ...], ...]]:
        """Of all (or these) sets those whose models of a texture are equal, group by group.

        Returns
        -------
        dict
            Texture to groups of two names at least; without textures that have none.
        """
        found = {}
        for texture in textures:
            groups: list[list[str]] = []
            for name in names or self.names:
                model = self.of(texture, name)
                equal = [group for group in groups if self.of(texture, group[0]) == model]
                if equal:
                    equal[0].append(name)
                else:
                    groups.append([name])
            if several := tuple(tuple(group) for group in groups if len(group) > 1):
                found[texture] = several
        return found

    def exchanged(self, textures: Sequence[str]) -> tuple[tuple[str, str, str], ...]:
        """Textures whose model in one set was made from the one in a later set: both sets' names.

        The first is the set that should come later.
        """
        return tuple(
            (texture, earlier, later)
            for texture in textures
            for earlier, later in combinations(self.names, 2)
            if model_sha256(self.of(texture, later)) in made_from(self.of(texture, earlier))
        )

    def of_others(self, textures: Sequence[str]) -> tuple[tuple[str, str], ...]:
        """Textures and sets whose model says that it was made from one that no set holds."""
        return tuple(
            (texture, name)
            for texture in textures
            for name in self.names
            if (sources := made_from(self.of(texture, name)))
            and not sources & {model_sha256(self.of(texture, other)) for other in self.names}
        )

    def require(self, study: Study, *, allow: Allow = refuse) -> None:
        """Refuse a study with textures that have no model, or without models to compare.

        Parameters
        ----------
        allow : callable
            Called with what may be overridden ("exchanged models") and the error against it.

        Raises
        ------
        InputError
            Naming textures and sets: of missing models; where the models of all textures are equal;
            where a model was made from one of a later set.
        """
        self._require_all(study)
        for task in study.tasks:
            if len(self.identical(study.textures, study.models_of(task))) == len(study.textures):
                raise InputError(
                    f"expected a {study.models_of(task)[1]} model that differs from the "
                    f"{study.models_of(task)[0]} one for some texture of the study, got identical "
                    "ones for all, so that there is nothing to compare; simplify with another "
                    "threshold or margin, or add other textures."
                )
        if exchanged := self.exchanged(study.textures):
            texture, earlier, later = exchanged[0]
            allow(
                "exchanged models",
                "expected models to be made from those of a set that is named before theirs, got "
                f"the {earlier} model of {texture}, made from the {later} one; swap the two sets",
            )

    def _require_all(self, study: Study) -> None:
        for name in study.models:
            models = self.sets.get(name, {})
            missing = [texture for texture in study.textures if texture not in models]
            notes = [getattr(model, "compiled_for", None) for model in models.values()]
            scene = next((note.scene for note in notes if note), None)
            if missing and scene:
                raise InputError(
                    f"expected each texture of the study in the scene {scene}, got none "
                    f"of {', '.join(missing)}; add what is missing to the scene, or remove it from "
                    "the study."
                )
            if missing:
                raise InputError(
                    f"expected a {name} model of each texture of the study, got none of "
                    f"{', '.join(missing)}; record and model what is missing, "
                    "or remove it from the study."
                )


def made_from(shown: Presentable) -> frozenset[str]:
    """SHA-256 of the models that a model, or that of a stimulus, says it was made from."""
    return shown.made_from if isinstance(shown, Stimulus) else model_made_from(shown)


def model_sha256(shown: Presentable) -> str:
    """SHA-256 of a model, or of that of a stimulus."""
    return shown.model_sha256 if isinstance(shown, Stimulus) else shown.sha256


def load_model_sets(
    study: Study,
    folder: str | Path,
    *,
    overriding: Mapping[str, Path] | None = None,
    reads: Callable[..., None] = lambda *paths: None,
    progress: Callable[[float, str], None] = lambda share, texture: None,
) -> ModelSets:
    """The sets of models of a study.

    Parameters
    ----------
    folder : path
        What the study's paths are relative to: the folder of its file.
    overriding : mapping of set to path, optional
        Other places than the study's; relative to where the program runs.
    reads : callable
        Called with files and folders before they are read.
    progress : callable
        Called with the share that is done, and the last texture, when a scene is compiled.

    Raises
    ------
    InputError
        For a set that the study does not name, for a place without models, and for what
        `tactileq.modeling.scenes.loading.scene_models` refuses.
    """
    given = dict(overriding or {})
    check_keys(given, tuple(study.models), where="the sets of models of the study")
    sets: dict[str, Mapping[str, Presentable]] = {}
    for name, stated in study.models.items():
        place = given.get(name, Path(folder) / stated)
        reference = next(iter(sets.values()), None)
        reads(place)
        try:
            if place.suffix == ".toml":
                reads(*scene_files(place, with_models=_grids(reference) is None))
            sets[name] = _models_at(place, reference, study, name=name, progress=progress)
        except InputError as error:
            raise InputError(f"models {name}: {error}") from None
    return ModelSets(sets=sets)


def _models_at(
    place: Path,
    reference: Mapping[str, Presentable] | None,
    study: Study,
    *,
    name: str,
    progress: Callable[[float, str], None],
) -> Mapping[str, Presentable]:
    """The models of a folder or a scene, or the files of a stimulus set.

    Of a scene those that belong to the reference's; of a stimulus set those labelled as the set.
    """
    if (place / STIMULI).is_file():
        return stimuli_of_surfaces(place, label=name, textures=study.textures)
    if place.suffix == ".toml" or (place / SCENE).is_file():
        full = _grids(reference)
        return scene_models(place, full, progress=progress)
    if not place.is_dir():
        raise InputError(
            f"expected a folder of models or a scene at {place}, got none; make it, or correct the "
            "place under [models]."
        )
    return load_any_models(place)


def _grids(models: Mapping[str, Presentable] | None) -> Mapping[str, TextureModel] | None:
    """Those that a scene can be compiled from; None where there are others among them."""
    grids = {name: m for name, m in (models or {}).items() if isinstance(m, TextureModel)}
    return grids if grids and len(grids) == len(models or {}) else None
