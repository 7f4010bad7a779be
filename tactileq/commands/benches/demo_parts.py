"""What both demos share: models of recorded textures, and the people who are asked."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tactileq.analysis.textures.results import TextureResult
    from tactileq.experiments.observers.psychometrics import Psychometrics
    from tactileq.experiments.study.models import ModelSets
    from tactileq.modeling import TextureModel, Threshold

JOBS = 2
# Points by which simulated participants rate simplified models lower; no points elsewhere. So many
# that the tests find them in 39 of 40 simulations (12 points: in 32).
PLANTED_TEXTURE, PLANTED_POINTS = "PVC", -15.0


def demo_population(textures: Sequence[str]) -> Psychometrics:
    """People to whom simplified models differ in the magnitude of one texture, and nowhere else."""
    from tactileq.experiments.observers.psychometrics import RATED_SCALES, Psychometrics

    planted = {texture: dict.fromkeys(RATED_SCALES, 0.0) for texture in textures}
    planted[PLANTED_TEXTURE]["magnitude_similarity"] = PLANTED_POINTS
    return Psychometrics(planted=planted)


def modelled(
    name: str, folder: Path, *, threshold: Threshold, truth: TextureModel
) -> TextureResult:
    """Model and simplify the recordings of a texture in the folder."""
    from tactileq.analysis.textures.results import TextureResult
    from tactileq.modeling import RecordingSet, fit_texture
    from tactileq.modeling import simplify as drop_layers
    from tactileq.modeling.files.writing import file_stem
    from tactileq.modeling.perception.verdicts import ENDING

    records = RecordingSet.load(folder / "recordings" / file_stem(name))
    full = fit_texture(records)
    simplification = drop_layers(full, threshold)
    full.save(folder / "models" / f"{file_stem(name)}.json")
    simplification.model.save(folder / "simplified" / f"{file_stem(name)}.json")
    simplification.save(folder / "simplified" / f"{file_stem(name)}{ENDING}")
    return TextureResult(records, full, simplification, truth)


def presented(made: Sequence[TextureResult]) -> tuple[ModelSets, dict[str, TextureModel]]:
    """What the virtual surfaces present, and the truth behind the real ones, by texture."""
    from tactileq.experiments.study.models import ModelSets

    models = ModelSets(
        sets={
            "full": {r.texture: r.model for r in made},
            "simplified": {r.texture: r.simplification.model for r in made},
        }
    )
    return models, {r.texture: r.truth for r in made if r.truth is not None}
