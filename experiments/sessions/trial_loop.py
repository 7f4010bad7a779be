"""The one loop of all tasks: mount the sample, present, ask, store, fall silent."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from experiments.sessions.order import draw_session
from experiments.sessions.store import SessionStore
from experiments.sessions.surfaces import Respondent, SessionAborted, Surfaces
from experiments.sessions.task import Task
from experiments.study.design import Trial
from experiments.study.models import ModelSets
from experiments.study.study import Study
from rig.interface import TextureRig


@dataclass(frozen=True, kw_only=True)
class SessionResult:
    """How a session ended: `answered` of `planned` trials are in the file at `path`."""

    path: Path
    planned: int
    answered: int

    @property
    def completed(self) -> bool:
        """Whether every planned trial was answered."""
        return self.answered == self.planned


def run_session(
    task: Task,
    study: Study,
    *,
    subject: int,
    session: int,
    models: ModelSets,
    rig: TextureRig,
    respondent: Respondent,
    data_folder: str | Path,
) -> SessionResult:
    """Run one session of a task and store it.

    Parameters
    ----------
    task : Task
    study : Study
    subject, session : int
        From 1; with the study's seed they fix the order of the trials.
    models : ModelSets
        Full and simplified model of every texture of the study.
    rig : TextureRig
        Presents the surfaces; silent afterwards, whatever happens.
    respondent : Respondent
        The console, or a simulated participant.
    data_folder : path
        Root of the data set.

    Returns
    -------
    SessionResult
        Not completed if the participant ended it early.

    Raises
    ------
    InputError
        If a model is missing or the session has been run before.
    StoreError
        If the disk does not take the answers.
    """
    models.require(study.textures)
    plan = draw_session(study, task, subject=subject, session=session)
    with SessionStore.create(
        data_folder,
        plan=plan,
        columns={column.name: column.sidecar() for column in task.columns},
        description=task.description,
        models=models.sha256(study.textures),
        simulated_participant=respondent.simulated,
        simulated_rig=rig.simulated,
    ) as store:
        return run_trials(
            plan.trials, task, models=models, rig=rig, respondent=respondent, store=store
        )


def run_trials(
    trials: Sequence[Trial],
    task: Task,
    *,
    models: ModelSets,
    rig: TextureRig,
    respondent: Respondent,
    store: SessionStore,
) -> SessionResult:
    """Run all trials of a session; the rig is silent afterwards, whatever happens.

    Parameters
    ----------
    trials : sequence
        In the order of the session's plan.
    task : Task
    models : ModelSets
    rig, respondent, store
        What presents, who answers, where the answers go.

    Returns
    -------
    SessionResult
        Also after an abort by the respondent; any other exception is logged and passed on.
    """
    answered = 0
    try:
        rig.silence()
        store.log("session started", f"{len(trials)} trials planned")
        for trial in _announced(trials, task, respondent=respondent, store=store):
            row = _run_trial(
                trial, task, models=models, rig=rig, respondent=respondent, store=store
            )
            store.append(row)
            answered += 1
            rig.silence()
        store.log("session ended", f"{answered} trials answered")
        # Everything is answered: leaving the last page with Escape is not an abort.
        with suppress(SessionAborted):
            respondent.announce(*task.texts["closing"])
    except SessionAborted:
        store.log("session aborted", f"{answered} trials answered")
    except BaseException as error:
        # The log must not hide what went wrong, for instance when the disk is full.
        with suppress(OSError):
            store.log("session broken off", f"{type(error).__name__}: {error}")
        raise
    finally:
        rig.silence()
    return SessionResult(path=store.path, planned=len(trials), answered=answered)


def _announced(
    trials: Sequence[Trial],
    task: Task,
    *,
    respondent: Respondent,
    store: SessionStore,
) -> Iterable[Trial]:
    """The trials, each phase announced before its first one."""
    phase = None
    for trial in trials:
        if trial.phase != phase:
            phase = trial.phase
            respondent.announce(*task.texts[phase])
            store.log("phase started", phase)
        yield trial


def _run_trial(
    trial: Trial,
    task: Task,
    *,
    models: ModelSets,
    rig: TextureRig,
    respondent: Respondent,
    store: SessionStore,
) -> dict[str, object]:
    label = f"trial {trial.trial}, tray {trial.tray}"
    store.log("mount requested", label)
    respondent.confirm_mount(trial.tray)
    store.log("mount confirmed", label)
    surfaces = Surfaces(rig, texture=trial.texture, models=task.virtual(models, trial))
    task.begin(trial, surfaces)
    answer = task.ask(respondent, trial, surfaces)
    return {
        "trial": trial.trial,
        "phase": trial.phase,
        "texture": trial.texture,
        "model": trial.model,
        "tray": trial.tray,
        **answer,
        "simulated": respondent.simulated or rig.simulated,
    }
