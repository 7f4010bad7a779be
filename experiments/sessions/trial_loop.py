"""The one loop of all tasks: mount the sample, present, ask, fall silent, store.

A trial in which the rig failed is stored, marked as not valid, and repeated once at the end of its
phase (docs/method/protocols.md#faults).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import groupby
from pathlib import Path

from experiments.sessions.order import draw_session
from experiments.sessions.store import SessionStore
from experiments.sessions.strokes import outside_grid, told_of
from experiments.sessions.surfaces import Respondent, SessionAborted, Surfaces
from experiments.sessions.task import Task
from experiments.study.design import Trial
from experiments.study.models import ModelSets
from experiments.study.study import Study
from rig.interface import Fault, TextureRig

STROKES_TITLE = "Your strokes"
FAULT_TITLE = "Please call the experimenter"
FAULT_NOTE = "The rig failed in this trial."


@dataclass(frozen=True, kw_only=True)
class SessionResult:
    """How a session ended: `answered` of `planned` trials are in the file at `path`.

    Repeated trials count among both. `invalid` of the answers are to trials in which the rig
    failed.
    """

    path: Path
    planned: int
    answered: int
    invalid: int = 0

    @property
    def completed(self) -> bool:
        """Whether every planned trial was answered, and every invalid one repeated."""
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
        Presents the surfaces; opened here before anything is written, silent and closed
        afterwards, whatever happens.
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
        If a model is missing, the session has been run before, or the rig cannot be opened.
    StoreError
        If the disk does not take the answers.
    """
    models.require(study)
    plan = draw_session(study, task, subject=subject, session=session, slot=subject)
    rig.open()
    try:
        with SessionStore.create(
            data_folder,
            plan=plan,
            columns={column.name: column.sidecar() for column in task.columns},
            description=task.description,
            models=models.sha256(study.textures),
            simulated_participant=respondent.simulated,
            simulated_rig=rig.simulated,
            rig=rig.stated,
        ) as store:
            return run_trials(
                plan.trials, task, models=models, rig=rig, respondent=respondent, store=store
            )
    finally:
        rig.close()


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
    running = _Running(task, models=models, rig=rig, respondent=respondent, store=store)
    try:
        rig.silence()
        store.log("session started", f"{len(trials)} trials planned")
        running.run(trials)
        store.log("session ended", f"{running.answered} trials answered")
        # Everything is answered: leaving the last page with Escape is not an abort.
        with suppress(SessionAborted):
            respondent.announce(*task.texts["closing"])
    except SessionAborted:
        running.log_faults("when aborted")
        store.log("session aborted", f"{running.answered} trials answered")
    except BaseException as error:
        # The log must not hide what went wrong, for instance when the disk is full.
        with suppress(OSError):
            store.log("session broken off", f"{type(error).__name__}: {error}")
        raise
    finally:
        rig.silence()
    return SessionResult(
        path=store.path,
        planned=len(trials) + running.to_repeat,
        answered=running.answered,
        invalid=running.invalid,
    )


class _Running:
    """A session that goes on: what takes part in it, and how far it has come."""

    def __init__(
        self,
        task: Task,
        *,
        models: ModelSets,
        rig: TextureRig,
        respondent: Respondent,
        store: SessionStore,
    ) -> None:
        self._task, self._models, self._rig = task, models, rig
        self._respondent, self._store = respondent, store
        self.answered = 0
        self.invalid = 0
        self.to_repeat = 0

    def run(self, trials: Sequence[Trial]) -> None:
        """All phases, each announced and with its invalid trials once more at its end."""
        number = len(trials)
        for phase, group in groupby(trials, key=lambda trial: trial.phase):
            self._respondent.announce(*self._task.texts[phase])
            self._store.log("phase started", phase)
            failed = [trial for trial in group if not self._run_trial(trial)]
            for trial in failed:
                number += 1
                self._run_trial(replace(trial, trial=number), repeats=trial.trial)

    def _run_trial(self, trial: Trial, *, repeats: int | None = None) -> bool:
        """One trial from mounting to storing; whether it is valid."""
        rig = self._rig
        self._mount(trial)
        self.log_faults(f"before trial {trial.trial}")
        rig.take_history()
        rig.take_presentations()
        rig.take_acceleration()
        surfaces = Surfaces(
            rig, texture=trial.texture, models=self._task.virtual(self._models, trial)
        )
        self._task.begin(trial, surfaces)
        if surfaces.first_sample_s is not None:
            first = f"first sample {surfaces.first_sample_s:.4f} s after opening"
            self._store.log("surfaces presented", f"trial {trial.trial}, {first}")
        answer = self._task.ask(self._respondent, trial, surfaces)
        rig.silence()
        faults = self.log_faults(f"trial {trial.trial}")
        valid = not any(fault.invalidates for fault in faults)
        self._store.append(self._row(trial, answer, valid=valid, repeats=repeats))
        self.answered += 1
        self.invalid += not valid
        self.to_repeat += not valid and repeats is None
        self._trace(trial, faults)
        if not valid:
            told = next(fault.told for fault in faults if fault.invalidates)
            self._respondent.announce(FAULT_TITLE, f"{FAULT_NOTE}\n{told}")
        return valid

    def _mount(self, trial: Trial) -> None:
        label = f"trial {trial.trial}, tray {trial.tray}"
        self._store.log("mount requested", label)
        self._respondent.confirm_mount(trial.tray)
        self._store.log("mount confirmed", label)

    def log_faults(self, when: str) -> tuple[Fault, ...]:
        """Take the rig's faults, and log them."""
        faults = self._rig.take_faults()
        for fault in faults:
            self._store.log("fault", f"{when}, {fault.time_s:.4f} s after opening: {fault.told}")
        return faults

    def _row(
        self, trial: Trial, answer: Mapping[str, object], *, valid: bool, repeats: int | None
    ) -> dict[str, object]:
        return {
            "trial": trial.trial,
            "phase": trial.phase,
            "texture": trial.texture,
            "model": trial.model,
            "tray": trial.tray,
            **answer,
            "valid": int(valid),
            "repeats": repeats,
            "simulated": self._respondent.simulated or self._rig.simulated,
        }

    def _trace(self, trial: Trial, faults: Sequence[Fault]) -> None:
        """Store what the hand did and felt; tell the participant who mostly stroked outside."""
        rows, shown = self._rig.take_history(), self._rig.take_presentations()
        self._store.trace(trial.trial, rows, presentations=shown, faults=faults)
        self._store.acceleration(trial.trial, self._rig.take_acceleration())
        told = told_of(outside_grid(rows, shown))
        if told is not None:
            self._store.log("hand outside the grid", f"trial {trial.trial}: {told}")
            self._respondent.announce(STROKES_TITLE, told)
