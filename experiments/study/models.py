"""The models that a study presents: a full and a simplified one of every texture."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from experiments.study.design import ModelKind
from modeling import InputError, TextureModel


@dataclass(frozen=True, kw_only=True)
class ModelSets:
    """Full and simplified models by the name of their texture."""

    full: Mapping[str, TextureModel]
    simplified: Mapping[str, TextureModel]

    def of(self, texture: str, kind: ModelKind) -> TextureModel:
        """The model of one texture."""
        return (self.full if kind == "full" else self.simplified)[texture]

    def require(self, textures: Sequence[str]) -> None:
        """Refuse a study with textures that have no model.

        Raises
        ------
        InputError
            Naming the textures and the kind of model that they lack.
        """
        for kind, models in (("full", self.full), ("simplified", self.simplified)):
            missing = [texture for texture in textures if texture not in models]
            if missing:
                raise InputError(
                    f"expected a {kind} model of each texture of the study, got none of "
                    f"{', '.join(missing)}; record and model what is missing, "
                    "or remove it from the study."
                )
