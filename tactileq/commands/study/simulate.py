"""tactileq simulate: the whole study with simulated participants."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from tactileq.commands.study.session import models_of_study
from tactileq.options import (
    Data,
    Models,
    SceneModels,
    Seed,
    Simplified,
    StudyFile,
    ThresholdName,
)
from tactileq.printing import print_models, progress
from tactileq.results import CommandRun

if TYPE_CHECKING:
    from tactileq.experiments.observers.psychometrics import Psychometrics
    from tactileq.experiments.study.models import ModelSets
    from tactileq.experiments.study.study import Study
    from tactileq.modeling import TextureModel, Threshold
    from tactileq.rig.shared.interface import TextureRig


def simulate(
    models: Models = None,
    simplified: Simplified = None,
    scene: SceneModels = None,
    data: Data = Path("data"),
    study: StudyFile = None,
    threshold: ThresholdName = "codec",
    seed: Seed = 0,
) -> None:
    """Run the whole study with simulated participants of known truth.

    The planted textures of the same names take the place of the real surfaces.

    Example: tactileq simulate --models models --simplified simplified --data data
    """
    from tactileq.experiments.sessions.kept.data_set import require_rule
    from tactileq.experiments.study.study import Study
    from tactileq.modeling import Threshold
    from tactileq.modeling.files.provenance import provenance_text
    from tactileq.modeling.files.writing import write_text
    from tactileq.stimuli.planted.textures import TEXTURES, planted_texture

    ran = CommandRun("simulate")
    ran.reads(study, Threshold.file_of(threshold))
    plan = Study.load(study)
    require_rule(data, plan)
    if unknown := [name for name in plan.textures if name not in TEXTURES]:
        raise ValueError(
            f"expected a study of the planted textures {', '.join(TEXTURES)}, which take the place "
            f"of the real surfaces, got {', '.join(unknown)}; test people with tactileq session."
        )
    real = {name: planted_texture(name) for name in plan.textures}
    sets, sources = models_of_study(
        plan, study, models=models, simplified=simplified, scene=scene, reads=ran.reads
    )
    sets.require(plan)
    felt_above = Threshold.named(threshold)
    run_study(
        plan,
        real=real,
        models=sets,
        data=data,
        threshold=felt_above,
        seed=seed,
        sources=sources,
    )
    note = data / "sourcedata" / "simulate_provenance.json"
    settings = {
        "study": plan.to_dict(),
        "study_sha256": plan.sha256,
        "models_sha256": sets.sha256(plan.textures),
        "threshold": threshold,
        "threshold_sha256": felt_above.sha256,
        **_scene_settings(sets),
    }
    write_text(note, provenance_text(ran.provenance(settings, seed=seed)))
    print(f"simulated answers: {data}")


def _scene_settings(sets: ModelSets) -> dict[str, object]:
    """What a provenance says of the scene whose models a study presents; nothing without one."""
    if sets.scene is None:
        return {}
    return {"scene": sets.scene.scene, "scene_sha256": sets.scene.scene_sha256}


def run_study(
    plan: Study,
    *,
    real: Mapping[str, TextureModel],
    models: ModelSets,
    data: Path,
    threshold: Threshold,
    seed: int,
    psychometrics: Psychometrics | None = None,
    sources: Mapping[str, str] | None = None,
    rig: TextureRig | None = None,
) -> None:
    """Simulate all participants of a study with a progress bar, by default at `SimulatedRig`."""
    from tactileq.experiments.observers.whole_study import simulate_study
    from tactileq.rig.desk.twin import SimulatedRig

    print_models(models, plan.textures)
    sessions = sum(task.participants * plan.sessions(name) for name, task in plan.tasks.items())
    with progress("Simulated participants", sessions) as advance:
        simulate_study(
            plan,
            real=real,
            models=models,
            rig=SimulatedRig(real, seed=seed) if rig is None else rig,
            data_folder=data,
            seed=seed,
            threshold=threshold,
            psychometrics=psychometrics,
            sources=sources,
            progress=lambda done, total, name: advance(name),
        )
