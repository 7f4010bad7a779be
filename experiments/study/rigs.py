"""What a study requires of a rig, and why its sessions refuse one."""

from __future__ import annotations

from datetime import date

from tactileq.experiments.study.models import ModelSets
from tactileq.experiments.study.study import Study
from tactileq.modeling import InputError
from tactileq.rig.desk.checks import Requirements, refusals
from tactileq.rig.desk.walls import Walls, usual_wall
from tactileq.rig.shared.interface import Presentable
from tactileq.rig.shared.setup.rig_file import RigFile


def requirements_of(study: Study) -> Requirements:
    """What its file says."""
    return Requirements(
        calibration_days=study.calibration_days, measured_force=study.measured_force
    )


def walls_of(study: Study, rig: RigFile) -> Walls | None:
    """What a force device renders; None for a study that does not say.

    Raises
    ------
    InputError
        For a study that does, and a rig without such a device.
    """
    if study.wall is None:
        return None
    wall, by_texture = study.wall.walls(usual_wall(rig))
    return Walls(usual=wall, by_texture=by_texture)


def presented_of(study: Study, models: ModelSets) -> list[Presentable]:
    """All that is presented in some session."""
    return [models.of(texture, name) for name in models.names for texture in study.textures]


def refusals_of(study: Study, models: ModelSets, rig: RigFile, *, today: date) -> dict[str, str]:
    """Why its sessions refuse a rig, by what it is about; empty for one that they accept."""
    try:
        walls, refused = walls_of(study, rig), {}
    except InputError as error:
        walls, refused = None, {"wall": str(error)}
    presented = presented_of(study, models)
    return refused | refusals(
        rig, requirements_of(study), today=today, walls=walls, presented=presented
    )
