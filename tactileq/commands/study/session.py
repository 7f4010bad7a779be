"""tactileq session: one participant's session at the console."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from tactileq.modeling.errors import counted
from tactileq.modeling.files.answer_tables import ANSWER_TABLES
from tactileq.options import Data, Models, SceneModels, Simplified, StudyFile
from tactileq.printing import print_foreign_models, share_of

if TYPE_CHECKING:
    TaskName = str
    from tactileq.experiments.console.console import Console
    from tactileq.experiments.console.languages import Texts
    from tactileq.experiments.study.models import ModelSets
    from tactileq.experiments.study.study import Study
    from tactileq.rig.shared.interface import TextureRig
else:
    TaskName = Literal[tuple(ANSWER_TABLES)]


def session(
    task: Annotated[TaskName, typer.Option(help="Task of the session.")],
    subject: Annotated[int, typer.Option(min=1, help="Number of the participant.")] = 1,
    models: Models = None,
    simplified: Simplified = None,
    scene: SceneModels = None,
    data: Data = Path("data"),
    number: Annotated[
        int, typer.Option("--session", min=1, help="Number of the session (day).")
    ] = 1,
    study: StudyFile = None,
    rig: Annotated[
        Path | None, typer.Option(help="Rig file (TOML); by default the simulated rig.")
    ] = None,
    resume: Annotated[
        bool, typer.Option(help="Continue a session that was aborted or interrupted.")
    ] = False,
    pilot: Annotated[bool, typer.Option(help="Mark all answers as pilot data.")] = False,
    language: Annotated[
        str,
        typer.Option(help="Language of the participant's screen; by default the study's first."),
    ] = "",
    override: Annotated[
        str | None,
        typer.Option(
            help="Reason to continue although a rule is broken, such as a rig with a latency "
            "above 40 ms or a second session on the same date; it is stored."
        ),
    ] = None,
    selftest: Annotated[
        bool,
        typer.Option(help="Only check that screen, rig and disk are fast enough for a session."),
    ] = False,
    fullscreen: Annotated[bool, typer.Option(help="Fill the screen.")] = False,
    screen: Annotated[int, typer.Option(help="Number of the screen, from 0.")] = 0,
) -> None:
    """Run one participant's session at the console; the experimenter sits at this terminal.

    The terminal asks for samples by their tray. A session that was aborted or interrupted continues
    with --resume. A trial in which the rig fails is stored, marked and repeated once at the end of
    its phase.

    Example: tactileq session --task absolute --subject 1 --rig rig.toml --data data
    """
    from tactileq.commands.study.experimenter import Terminal
    from tactileq.experiments.console.languages import texts_of_study
    from tactileq.experiments.sessions.bids.export import export_session
    from tactileq.experiments.sessions.kept.data_set import require_rule
    from tactileq.experiments.sessions.kept.log import SEAL_WRITTEN
    from tactileq.experiments.sessions.kept.overrides import Overrides
    from tactileq.experiments.sessions.loop.people import ConsentRefused
    from tactileq.experiments.sessions.loop.running import (
        Circumstances,
        require_ready,
        run_session,
    )
    from tactileq.experiments.sessions.loop.trial_loop import People
    from tactileq.experiments.study.study import Study
    from tactileq.experiments.tasks import task_named

    plan = Study.load(study)
    require_rule(data, plan)
    texts = texts_of_study(plan)
    sets, sources = models_of_study(plan, study, models=models, simplified=simplified, scene=scene)
    if resume and not language:
        language = _language_of(data, task=task, subject=subject, session=number)
    circumstances = Circumstances(
        pilot=pilot,
        language=language,
        override=override,
        tell=print,
        resume=resume,
        sources=sources,
        texts={name: of_language.by_key for name, of_language in texts.items()},
    )
    sets.require(plan, allow=Overrides(override).allow)
    print_foreign_models(sets, plan.textures)
    device = rig_of(plan, sets, rig=rig, override=override)
    if selftest:
        print_timings(sets, device, plan=plan, data=data, fullscreen=fullscreen, screen=screen)
        return
    asked: dict[str, Any] = {
        "subject": subject,
        "session": number,
        "models": sets,
        "rig": device,
        "data_folder": data,
        "circumstances": circumstances,
    }
    # Before the window: nobody is to sit down at a session that cannot begin.
    require_ready(task_named(task), plan, simulated=False, **asked)
    stamp = ", ".join(["pilot"] * pilot + ["simulated rig"] * device.simulated)
    if device.simulated:
        print("note: the rig is simulated; its data are marked as simulated.")
    read = texts[plan.language_of_session(language)]
    with open_console(read, stamp=stamp, fullscreen=fullscreen, screen=screen) as console:
        try:
            result, manifest = run_session(
                task_named(task),
                plan,
                people=People(respondent=console, experimenter=Terminal()),
                **asked,
            )
        except ConsentRefused:
            print("consent refused: nobody was enrolled, the slot is free; only the count is kept.")
            return
    export_session(data, manifest)
    if result.seal:
        print(f"seal of this session, for the checklist: {result.seal[-SEAL_WRITTEN:]}")
    if result.invalid:
        print(f"note: the rig failed in {counted(result.invalid, 'trial')}; the log says how.")
    if result.completed:
        print(f"completed: {manifest.parent}")
    else:
        left = f"{result.answered} of {result.planned} trials answered, training included"
        print(f"ended early ({result.reason}), {left}; continue with --resume: {manifest.parent}")


def _language_of(data: Path, *, task: str, subject: int, session: int) -> str:
    """The language in which a session began; empty where there is none yet."""
    from tactileq.experiments.sessions.kept.files import SessionFiles
    from tactileq.experiments.sessions.kept.manifest import SessionManifest

    files = SessionFiles(root=data, task=task, subject=subject, session=session)
    return SessionManifest.load(files.manifest).language if files.manifest.exists() else ""


def rig_of(plan: Study, sets: ModelSets, *, rig: Path | None, override: str | None) -> TextureRig:
    """The rig that a session presents on.

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
        For an invalid rig file, and for a rig that does not meet the study's requirements.
    """
    from tactileq.experiments.study.rigs import presented_of, requirements_of, walls_of
    from tactileq.rig.desk.checks import check_models
    from tactileq.rig.desk.desk_rig import DeskRig
    from tactileq.rig.desk.twin import SimulatedRig
    from tactileq.rig.shared.setup.rig_file import RigFile

    presented = presented_of(plan, sets)
    if rig is None:
        return SimulatedRig()
    file = RigFile.load(rig)
    wanted, walls = requirements_of(plan), walls_of(plan, file)
    device = DeskRig(file, requirements=wanted, override=override, walls=walls)
    check_models(file, presented)
    return device


def models_of_study(
    plan: Study,
    study: Path | None,
    *,
    models: Path | None,
    simplified: Path | None,
    scene: Path | None,
    reads: Callable[..., None] = lambda *paths: None,
) -> tuple[ModelSets, dict[str, str]]:
    """The sets of models of a study, and where each came from.

    `models` replaces the study's first set, `simplified` or `scene` its second one. `reads` is
    called with what is read, before it is.
    """
    from tactileq.experiments.study.models import load_model_sets
    from tactileq.modeling.scenes.compiled import FILE as SCENE

    if simplified is not None and scene is not None:
        raise ValueError(
            f"expected simplified models or a scene, got both ({simplified} and {scene}); remove "
            "--simplified or --scene."
        )
    if scene is not None and scene.is_dir() and not (scene / SCENE).is_file():
        raise ValueError(
            f"expected a compiled scene at {scene}, got a folder without {SCENE}; compile one with "
            "tactileq scene, or name models with --simplified."
        )
    given = dict(zip(plan.models, (models, simplified or scene), strict=False))
    overriding = {name: place for name, place in given.items() if place is not None}
    folder = Path() if study is None else study.parent
    places = {name: overriding.get(name, folder / place) for name, place in plan.models.items()}
    sources = {name: str(place) for name, place in places.items()}
    load = partial(load_model_sets, plan, folder, overriding=overriding, reads=reads)
    if not any(place.suffix == ".toml" for place in places.values()):
        return load(), sources
    with share_of("Compiling the scene") as advance:
        return load(progress=advance), sources


def open_console(texts: Texts, *, stamp: str, fullscreen: bool, screen: int) -> Console:
    """The console's window with what the participant reads."""
    from tactileq.experiments.console.console import Console

    return Console(texts=texts, stamp=stamp, fullscreen=fullscreen, screen=screen)


def print_timings(
    sets: ModelSets,
    device: TextureRig,
    *,
    plan: Study,
    data: Path,
    fullscreen: bool,
    screen: int,
) -> None:
    """Time screen, rig and disk, and print them beside their limits.

    Raises
    ------
    InputError
        If one of them is too slow.
    """
    from rich.console import Console as Paper
    from rich.table import Table

    from tactileq.experiments.console.selftest import time_flips, time_presentations, time_syncs
    from tactileq.modeling import InputError

    models = [sets.of(texture, name) for name in sets.names for texture in plan.textures]
    timings = [
        time_flips(screen=screen, fullscreen=fullscreen),
        time_presentations(device, models),
        time_syncs(data),
    ]
    table = Table("", "", "median", "99th percentile", "limit", "")
    for timing in timings:
        numbers = (timing.median_ms, timing.p99_ms, timing.limit_ms)
        cells = [f"{number:.1f} ms" for number in numbers]
        table.add_row(timing.name, timing.meaning, *cells, "ok" if timing.within else "too slow")
    Paper().print(table)
    if device.simulated:
        print("note: the rig is simulated; its times say nothing about a real rig.")
    if slow := [timing.name for timing in timings if not timing.within]:
        raise InputError(
            f"expected {', '.join(slow)} within the limit, got longer; close other programs, "
            "or use another screen, rig or disk."
        )
