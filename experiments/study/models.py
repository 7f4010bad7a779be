"""The models that a study presents: a full and a simplified one of every texture."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from experiments.study.design import MODELS, ModelKind
from modeling import InputError, TextureModel
from modeling.models.compiled_for import CompiledFor
from modeling.models.loading import Layered


@dataclass(frozen=True, kw_only=True)
class ModelSets:
    """Full and simplified models by the name of their texture.

    In the place of simplified ones may stand those of a compiled scene.
    """

    full: Mapping[str, TextureModel]
    simplified: Mapping[str, Layered]

    @property
    def scene(self) -> CompiledFor | None:
        """What the simplified models say of the scene that they were compiled for, if they were."""
        notes = (model.compiled_for for model in self.simplified.values())
        return next((note for note in notes if note), None)

    def of(self, texture: str, kind: ModelKind) -> Layered:
        """The model of one texture."""
        return (self.full if kind == "full" else self.simplified)[texture]

    def sha256(self, textures: Sequence[str]) -> dict[str, dict[str, str]]:
        """SHA-256 of the models of each texture, by which a session names what it presented."""
        return {
            texture: {kind: self.of(texture, kind).sha256 for kind in MODELS}
            for texture in textures
        }

    def identical(self, textures: Sequence[str]) -> tuple[str, ...]:
        """The textures whose simplified model is the full one: controls, nothing to compare."""
        return tuple(name for name in textures if self.full[name] == self.simplified[name])

    def require(self, textures: Sequence[str]) -> None:
        """Refuse a study with textures that have no model, or without two models to compare.

        Raises
        ------
        InputError
            Naming the textures and the kind of model that they lack; or where the simplified model
            of every texture is the full one.
        """
        for kind, models in (("full", self.full), ("simplified", self.simplified)):
            missing = [texture for texture in textures if texture not in models]
            if missing and kind == "simplified" and self.scene:
                raise InputError(
                    f"expected each texture of the study in the scene {self.scene.scene}, got none "
                    f"of {', '.join(missing)}; add what is missing to the scene, or remove it from "
                    "the study."
                )
            if missing:
                raise InputError(
                    f"expected a {kind} model of each texture of the study, got none of "
                    f"{', '.join(missing)}; record and model what is missing, "
                    "or remove it from the study."
                )
        if len(self.identical(textures)) == len(textures):
            raise InputError(
                "expected a simplified model that differs from the full one for some texture of "
                "the study, got identical ones for all, so that there is nothing to compare; "
                "simplify with another threshold or margin, or add other textures."
            )
