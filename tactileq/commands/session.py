"""tactileq session: one participant's session at the console."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from modeling.files.answer_tables import ANSWER_TABLES
from tactileq.options import Data, Models, SceneModels, Simplified, StudyFile
from tactileq.telling import share_of, tell_controls

if TYPE_CHECKING:
    TaskName = str
    from experiments.console.console import Console
    from experiments.study.models import ModelSets
    from experiments.study.study import Study
    from rig.interface import TextureRig
else:
    TaskName = Literal[tuple(ANSWER_TABLES)]


def session(
    task: Annotated[TaskName, typer.Option(help="Which evaluation.")],
    subject: Annotated[int, typer.Option(min=1, help="Number of the participant.")],
    models: Models = Path("models"),
    simplified: Simplified = None,
    scene: SceneModels = None,
    data: Data = Path("data"),
    number: Annotated[int, typer.Option("--session", min=1, help="Which day.")] = 1,
    study: StudyFile = None,
    rig: Annotated[
        Path | None, typer.Option(help="Rig file (TOML); the simulated rig without it.")
    ] = None,
    override: Annotated[
        str | None,
        typer.Option(help="Reason to use a rig of a latency above 40 ms; it is stored."),
    ] = None,
    fullscreen: Annotated[bool, typer.Option(help="Fill the screen.")] = False,
    screen: Annotated[int, typer.Option(help="Which screen, from 0.")] = 0,
) -> None:
    """Run one participant's session at the console.

    A trial in which the rig fails is stored, marked and repeated once at the end of its phase.

    Example: tactileq session --task absolute --subject 1 --rig rig.toml --data data
    """
    from experiments.sessions.trial_loop import run_session
    from experiments.study.study import Study
    from experiments.tasks import task_named
    from modeling.files.provenance import write_provenance

    plan = Study.load(study)
    sets, inputs = models_to_compare(models, simplified, scene)
    sets.require(plan)
    tell_controls(sets, plan.textures)
    device, rig_files, rig_settings = rig_of(plan, sets, rig=rig, override=override)
    if device.simulated:
        print("note: the rig is simulated; its data are marked so.")
    with open_console(fullscreen=fullscreen, screen=screen) as console:
        result = run_session(
            task_named(task),
            plan,
            subject=subject,
            session=number,
            models=sets,
            rig=device,
            respondent=console,
            data_folder=data,
        )
    note = data / "sourcedata" / f"{result.path.stem.removesuffix('_beh')}_provenance.json"
    settings = {
        "task": task,
        "study_sha256": plan.sha256,
        "models_sha256": sets.sha256(plan.textures),
        **scene_settings(sets),
        **rig_settings,
    }
    write_provenance(note, "session", settings, inputs=[*inputs, *rig_files])
    if result.invalid:
        print(f"note: the rig failed in {result.invalid} trials; the log says how.")
    print(f"{'completed' if result.completed else 'ended early'}: {result.path}")


def rig_of(
    plan: Study, sets: ModelSets, *, rig: Path | None, override: str | None
) -> tuple[TextureRig, list[Path], dict[str, object]]:
    """The rig that a session presents on, its files, and what a provenance says of it.

    Parameters
    ----------
    plan : Study
        With what it requires of a rig.
    sets : ModelSets
        What is presented.
    rig : Path, optional
        A rig file; the simulated rig without it.
    override : str, optional
        Reason to use a rig that is too slow.

    Raises
    ------
    InputError
        For a rig file that is none, and for a rig that does not do for this study.
    """
    from modeling.checks import check_name
    from rig.desk.checks import Requirements, check_models
    from rig.desk.desk_rig import DeskRig
    from rig.setup.rig_file import RigFile
    from rig.twin import SimulatedRig

    if override is not None:
        check_name("the reason of --override", override)
    if rig is None:
        if override is not None:
            raise ValueError("expected --rig with --override, got none; name the rig file.")
        return SimulatedRig(), [], {}
    file = RigFile.load(rig)
    wanted = Requirements(
        calibration_days=plan.calibration_days, measured_force=plan.measured_force
    )
    device = DeskRig(file, requirements=wanted, override=override)
    check_models(
        file, [models[texture] for models in sets.sets.values() for texture in plan.textures]
    )
    return device, [rig, *file.files], {"rig_sha256": file.sha256, "override": override}


def models_to_compare(
    models: Path, simplified: Path | None, scene: Path | None
) -> tuple[ModelSets, list[Path]]:
    """Full models and those that a study compares them with, and all that was read for them.

    The latter are simplified ones, or those of a scene; a scene file is compiled.
    """
    from experiments.study.models import ModelSets
    from modeling.models.loading import load_models
    from modeling.scenes.loading import scene_files, scene_models

    full = load_models(models)
    if scene is None:
        fewer = simplified or Path("simplified")
        return ModelSets(sets={"full": full, "simplified": load_models(fewer)}), [models, fewer]
    if simplified is not None:
        raise ValueError(
            f"expected simplified models or a scene, got both ({simplified} and {scene}); remove "
            "--simplified or --scene."
        )
    files = scene_files(scene)
    with share_of("Compiling the scene") as tell:
        least = scene_models(scene, full, progress=tell)
    return ModelSets(sets={"full": full, "simplified": least}), [models, *files]


def scene_settings(sets: ModelSets) -> dict[str, object]:
    """What a provenance says of the scene whose models a study presents; nothing without one."""
    if sets.scene is None:
        return {}
    return {"scene": sets.scene.scene, "scene_sha256": sets.scene.scene_sha256}


def open_console(*, fullscreen: bool, screen: int) -> Console:
    """The console's window; where there is no screen, one sentence instead of a traceback."""
    from experiments.console.console import Console
    from modeling import InputError

    try:
        return Console(fullscreen=fullscreen, screen=screen)
    except InputError:
        raise
    except Exception as error:  # whatever the window system raises means the same to a user
        raise ValueError(
            f"expected a screen for the console, got {error or type(error).__name__}; start a "
            "graphical session (or Xvfb) and set DISPLAY."
        ) from error
