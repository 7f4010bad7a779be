"""The models that a study presents: two or more named sets, one model of every texture each."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NoReturn

from experiments.study.study import Study
from modeling import InputError
from modeling.models.compiled_for import CompiledFor
from modeling.models.loading import AnyModel

Presentable = AnyModel
# What may go on where a reason is given: a word for what, and the sentence that refuses it.
Allow = Callable[[str, str], None]


def refuse(what: str, sentence: str) -> NoReturn:
    """Go on with nothing."""
    raise InputError(sentence)


@dataclass(frozen=True, kw_only=True)
class ModelSets:
    """Models by the name of their set and of their texture; the first set is the reference.

    Parameters
    ----------
    sets : mapping of name to mapping of texture to model
    """

    sets: Mapping[str, Mapping[str, Presentable]]

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
        first, *others = names or self.names
        return tuple(
            texture
            for texture in textures
            if all(self.of(texture, first) == self.of(texture, name) for name in others)
        )

    def exchanged(self, textures: Sequence[str]) -> tuple[tuple[str, str], ...]:
        """Textures whose reference was made from the model of another set, with that set's name."""
        reference, *others = self.names
        return tuple(
            (texture, name)
            for texture in textures
            for name in others
            if self.of(texture, name).sha256 in made_from(self.of(texture, reference))
        )

    def require(self, study: Study, *, allow: Allow = refuse) -> None:
        """Refuse a study with textures that have no model, or without models to compare.

        Parameters
        ----------
        study : Study
        allow : callable
            Told what could go on for a reason ("exchanged models") and the sentence against it.

        Raises
        ------
        InputError
            Naming textures and sets: of missing models; where the models of all textures are equal;
            where the reference was made from another set's model.
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
            texture, name = exchanged[0]
            allow(
                "exchanged models",
                f"expected the reference set {self.names[0]} to hold the models that others were "
                f"made from, got one of {texture} that was made from the one in {name}; exchange "
                "the two sets.",
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


def made_from(model: Presentable) -> set[str]:
    """SHA-256 of the models that a model says it was simplified or compiled from."""
    note = getattr(model, "compiled_for", None)
    stated = {getattr(model, "simplified_from", ""), note.full_sha256 if note else ""}
    return stated - {""}
