"""The one loop of all tasks: mount the sample, present, ask, fall silent, store.

A trial in which the rig failed is stored, marked as not valid, and repeated once at the end of its
phase (docs/method/protocols.md#faults). Training goes on until the hand strokes as the models were
recorded (docs/method/protocols.md#training).
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from statistics import median

from tactileq.experiments.sessions.kept.strokes import OFTEN, advice_on, beyond_edge, outside_grid
from tactileq.experiments.sessions.loop.agenda import Agenda
from tactileq.experiments.sessions.loop.people import (
    Experimenter,
    Intake,
    ProgressReport,
    Respondent,
    SessionAborted,
)
from tactileq.experiments.sessions.loop.surfaces import Surfaces
from tactileq.experiments.sessions.loop.task import Task
from tactileq.experiments.sessions.store.exposure import EXPOSURE, Exposure
from tactileq.experiments.sessions.store.interface import Store
from tactileq.experiments.study.design import SessionPlan, Trial
from tactileq.experiments.study.models import ModelSets
from tactileq.rig.shared.interface import Fault, HandRows, PresentationRecord, TextureRig


@dataclass(frozen=True, kw_only=True)
class SessionResult:
    """How a session ended: `answered` of `planned` trials, repeated ones counted among both.

    `invalid` of the answers are to trials in which the rig failed. Training trials that were not
    needed are not planned. `seal` is that of the last line of the log; empty where an earlier
    version began it.
    """

    planned: int
    answered: int
    invalid: int = 0
    completed: bool = True
    reason: str = ""
    seal: str = ""


@dataclass(frozen=True, kw_only=True)
class People:
    """Who takes part beside the rig."""

    respondent: Respondent
    experimenter: Experimenter


def run_trials(
    plan: SessionPlan,
    task: Task,
    *,
    models: ModelSets,
    rig: TextureRig,
    people: People,
    store: Store,
    intake: Intake | None = None,
    agenda: Agenda | None = None,
    pilot: bool = False,
    exposed_g2_s: float = 0.0,
) -> SessionResult:
    """Run all trials of a session that are open; the rig is silent afterwards, whatever happens.

    Parameters
    ----------
    rig : TextureRig
        Opened already.
    people : People
        Who answers, and who mounts the samples.
    store : Store
        Where the answers go.
    intake : Intake, optional
        What is asked before the first trial.
    agenda : Agenda, optional
        What is left of a session that was begun before; all of it without.
    pilot : bool
        Whether the answers do not count.
    exposed_g2_s : float
        Weighted vibration that the participant had that day
        (`tactileq.experiments.sessions.store.exposure`).

    Returns
    -------
    SessionResult
        Also where the participant or the experimenter ended the session; any other exception is
        logged once the rig is silent, and passed on.
    """
    agenda = agenda or Agenda.whole(plan.trials)
    running = _Running(
        plan,
        task,
        models=models,
        rig=rig,
        people=people,
        store=store,
        agenda=agenda,
        pilot=pilot,
        exposure=Exposure(exposed_g2_s, rig.highest_exposure_m_s2),
    )
    try:
        rig.silence()
        people.respondent.hear(running.note, people.experimenter.page)
        if intake is not None:
            answers = people.respondent.welcome(intake)
            store.log("welcome", consent=intake.consent, answers=dict(answers))
        rig.arm()
        running.run()
    except SessionAborted as aborted:
        faults = running.fall_silent()
        store.finish("aborted", aborted.reason, by=aborted.by)
        running.keep_broken_off(faults)
        return running.result(completed=False, reason=aborted.reason)
    except BaseException as error:
        faults = running.fall_silent()
        # The log must not hide what went wrong, for instance a full disk.
        with suppress(OSError):
            status, reason, by = _ending_of(error)
            store.finish(status, reason, by=by)
        running.keep_broken_off(faults)
        raise
    running.fall_silent()
    store.finish("complete", "all trials answered", by="program")
    # Everything is answered: leaving the last page is not an abort.
    with suppress(SessionAborted):
        people.respondent.announce(f"{task.name}.closing")
    return running.result(completed=True)


def _ending_of(error: BaseException) -> tuple[str, str, str]:
    """Status, reason and by whom, of a session that an exception ends."""
    name = str(getattr(error, "signal_name", type(error).__name__))
    if isinstance(error, SystemExit | KeyboardInterrupt):
        return "aborted", name, "signal"
    return "crashed", f"{name}: {error}", "program"


class _Running:
    """A session that continues: what takes part in it, and how far it has come."""

    def __init__(
        self,
        plan: SessionPlan,
        task: Task,
        *,
        models: ModelSets,
        rig: TextureRig,
        people: People,
        store: Store,
        agenda: Agenda,
        pilot: bool,
        exposure: Exposure,
    ) -> None:
        self._exposure = exposure
        self._plan, self._task, self._models = plan, task, models
        self._rig, self._store, self._agenda = rig, store, agenda
        self._respondent, self._experimenter = people.respondent, people.experimenter
        self._planned = plan.study.plan_of(task.name)
        self._pilot = pilot
        self._rows: list[Mapping[str, object]] = list(agenda.rows)
        self._next_number = agenda.next_number
        self._at: int | None = None  # the trial that runs now
        self._presents = False  # whether its surfaces are presented, so that the hand counts
        self._durations_s: list[float] = []
        self._inside = True
        self._mains = sum(trial.phase == "main" for trial in plan.trials)
        self._mains_done = self._mains - len(agenda.main)
        self._owed = len(agenda.owed)

    def run(self) -> None:
        """Training, then the main trials; each with its invalid trials once more at its end."""
        if self._agenda.training or self._owed_of("training"):
            self._announce("training", again=self._agenda.training_again)
            self._train(self._agenda.training)
        self._announce("main", again=self._mains_done > 0)
        failed = self._owed_of("main")
        for number, trial in enumerate(self._agenda.main):
            if number and self._planned.break_after and number % self._planned.break_after == 0:
                self._rest()
            if not self._run_trial(trial):
                failed.append(trial)
        self._repeat(failed)

    def result(self, *, completed: bool, reason: str = "") -> SessionResult:
        """How it ended, or how far it came."""
        open_trials = self._mains - self._mains_done
        return SessionResult(
            planned=len(self._rows) + open_trials + self._owed,
            answered=len(self._rows),
            invalid=sum(not row["valid"] for row in self._rows),
            completed=completed,
            reason=reason,
        )

    def note(self, event: str, **fields: object) -> None:
        """Log an event with the trial in which it happened, if it did in one."""
        where = {} if self._at is None else {"trial": self._at}
        self._store.log(event, **where, **fields)

    def fall_silent(self) -> list[Fault]:
        """Silence the rig, and log its faults; what fails in that hides nothing else."""
        faults: list[Fault] = []
        self._at_any_rate(self._rig.silence)
        self._at_any_rate(lambda: faults.extend(self.log_faults()))
        return faults

    def keep_broken_off(self, faults: Sequence[Fault]) -> None:
        """Store what the hand did and felt in a trial that has no answer, once the end is logged.

        That takes longer than the line in the log, which a second signal must not prevent.
        """
        if self._presents and self._at is not None:
            at = self._at
            self._at_any_rate(lambda: self._keep(at, faults))

    def _at_any_rate(self, end: Callable[[], object]) -> None:
        """Do what ends a session; where it fails, that is logged, and hides nothing else."""
        try:
            end()
        except Exception as error:
            with suppress(OSError):
                self._store.log("fault", told=f"{type(error).__name__}: {error}")

    def log_faults(self) -> tuple[Fault, ...]:
        """Take the rig's faults, and log them."""
        faults = self._rig.take_faults()
        for fault in faults:
            self.note(
                "fault", told=fault.sentence, time_s=fault.time_s, invalidates=fault.invalidates
            )
        return faults

    def _announce(self, phase: str, *, again: bool) -> None:
        self._store.log("phase", phase=phase, again=again)
        self._respondent.announce(f"{self._task.name}.{phase}")

    def _train(self, trials: Sequence[Trial]) -> None:
        """As many trials as are planned at least, and on until the strokes are as recorded."""
        failed = self._owed_of("training")
        inside = False
        done = self._agenda.trained
        for trial in trials:
            if done >= self._planned.training_trials and inside:
                break
            valid = self._run_trial(trial, again=self._agenda.training_again)
            inside = self._inside
            done += 1
            if not valid:
                failed.append(trial)
        self._repeat(failed)
        self._store.log("training_over", inside=inside, trials=done)

    def _repeat(self, failed: Sequence[Trial]) -> None:
        for trial in failed:
            self._owed -= 1
            self._run_trial(trial, again=True, last=True)

    def _owed_of(self, phase: str) -> list[Trial]:
        """Trials that the rig failed in before this run, and that were not repeated yet."""
        return [trial for trial in self._agenda.owed if trial.phase == phase]

    def _rest(self) -> None:
        self._store.log("break_began")
        self._respondent.rest()
        self._store.log("break_ended")

    def _run_trial(self, trial: Trial, *, again: bool = False, last: bool = False) -> bool:
        """One trial from mounting to storing; whether it is valid.

        `again` means that its number stands in the file already: it gets the next free one. A
        `last` one is not repeated should the rig fail in it.
        """
        repeats = trial.trial if again else None
        if again:
            trial = replace(trial, trial=self._next_number)
            self._next_number += 1
        if excess := self._exposure.excess:
            raise SessionAborted(excess, by="program")
        self._at = trial.trial
        began_s = time.monotonic()
        self._experimenter.report(self._progress(trial))
        if self._task.mounts:
            self._mount(trial)
        else:
            self._experimenter.go_on()
            if not self._experimenter.ready():  # the session is to be stopped
                self._respondent.wait(self._experimenter.ready)
        self._respondent.progress(self._mains_done, self._mains)
        if self._task.adapt is not None:
            trial = self._task.adapt(trial, self._rows, self._rig)
        answer = self._ask(trial)
        faults = self.log_faults()
        valid = not any(fault.invalidates for fault in faults)
        row = self._row(trial, answer, valid=valid, repeats=repeats)
        self._store.answer(trial.trial, row)
        self._experimenter.answered()
        self._rows.append(row)
        self._owed += not valid and not last
        self._mains_done += trial.phase == "main" and not again
        self._trace(trial, faults)
        self._durations_s.append(time.monotonic() - began_s)
        self._at = None
        if not valid:
            self._call(next(fault.sentence for fault in faults if fault.invalidates))
        return valid

    def _ask(self, trial: Trial) -> Mapping[str, object]:
        """Present the surfaces and get the answer; silent afterwards."""
        rig = self._rig
        self.log_faults()
        rig.take_history()
        rig.take_presentations()
        rig.take_acceleration()
        self._presents = True
        surfaces = Surfaces(
            rig,
            texture=trial.texture,
            models=self._task.virtual(self._models, trial),
            begin=lambda of: self._task.begin(trial, of),
            note=self.note,
            feel_all=self._planned.feel_all or self._task.feel_all,
        )
        answer = self._task.ask(self._respondent, trial, surfaces)
        rig.silence()
        if not surfaces.started:
            raise RuntimeError(f"expected trial {trial.trial} to be started, got an answer before.")
        return answer

    def _mount(self, trial: Trial) -> None:
        self.note("mount_requested", tray=trial.tray)
        self._experimenter.ask_mount(trial.tray)
        self._respondent.wait(self._experimenter.ready)
        self.note("mount_confirmed", tray=trial.tray)

    def _progress(self, trial: Trial) -> ProgressReport:
        left = None
        if self._durations_s:
            left = median(self._durations_s) * (self._mains - self._mains_done) / 60.0
        return ProgressReport(
            phase=trial.phase,
            done=self._mains_done,
            of=self._mains,
            minutes_left=left,
            problems=self._rig.health().problems,
        )

    def _call(self, sentence: str) -> None:
        """Call the experimenter, whom the participant waits for, and go on once they confirm."""
        self._experimenter.call(sentence)
        self._respondent.wait(self._experimenter.ready)
        self._rig.arm()  # they have confirmed: a force device may push again

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
            "run": self._agenda.run,
            "valid": int(valid),
            "repeats": repeats,
            "pilot": self._pilot,
            "simulated": self._respondent.simulated or self._rig.simulated,
        }

    def _trace(self, trial: Trial, faults: Sequence[Fault]) -> None:
        """Store what the hand did and felt; advise a participant who mostly stroked outside."""
        rows, shown = self._keep(trial.trial, faults)
        advice = advice_on(outside_grid(rows, shown))
        self._inside = advice is None
        if advice is not None:
            page, percent = advice
            self.note("outside", advice=page, percent=percent)
            self._respondent.announce(page, percent=percent)
        beyond = beyond_edge(rows)
        if beyond > OFTEN:
            percent = round(100 * beyond)
            self.note("outside", advice="strokes.beyond_edge", percent=percent)
            self._respondent.announce("strokes.beyond_edge", percent=percent)

    def _keep(
        self, trial: int, faults: Sequence[Fault]
    ) -> tuple[HandRows, tuple[PresentationRecord, ...]]:
        """Store what the rig has kept of a trial, and return it; it is kept once."""
        self._presents = False
        rows, shown = self._rig.take_history(), self._rig.take_presentations()
        weighted_g2_s = sum(one.weighted_dose_g2_s for one in shown)
        if weighted_g2_s > 0:
            self._exposure.add(weighted_g2_s)
            a8_m_s2 = self._exposure.a8_m_s2
            self.note(EXPOSURE, weighted_g2_s=weighted_g2_s, a8_m_s2=a8_m_s2)
        self._store.trace(trial, rows, presentations=shown, faults=faults)
        self._store.acceleration(trial, self._rig.take_acceleration())
        return rows, shown
