"""The loop of all tasks: what is presented, asked, stored, and that silence follows."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from tactileq.experiments.sessions.kept.writer import StoreError
from tactileq.experiments.sessions.loop.agenda import Agenda
from tactileq.experiments.sessions.loop.people import Intake, Rating, SessionAborted
from tactileq.experiments.sessions.loop.surfaces import Surfaces
from tactileq.experiments.sessions.loop.trial_loop import People, SessionResult, run_trials
from tactileq.experiments.sessions.store.interface import MemoryStore
from tactileq.experiments.study.models import ModelSets
from tactileq.experiments.study.study import Study
from tactileq.experiments.study.task_plan import TaskPlan
from tactileq.experiments.tasks import plan_session, task_named
from tactileq.modeling import InputError
from tactileq.rig.desk.twin import SimulatedRig
from tactileq.rig.shared.interface import (
    Acceleration,
    Fault,
    HandRows,
    PresentationRecord,
    ToneBurst,
)
from tests.experiments.scripted import Ready, Scripted
from tests.refusals import refused


@dataclass
class Ran:
    """What a session left."""

    result: SessionResult
    store: MemoryStore

    def events(self, name: str) -> list[dict[str, Any]]:
        return [event for event in self.store.events if event["event"] == name]

    @property
    def told(self) -> list[object]:
        return [event["event"] for event in self.store.events]


@pytest.fixture
def run(study: Study, models: ModelSets, rig: Any) -> Callable[..., Ran]:
    """Runs a session in memory; what is not given is well behaved."""

    def session(
        respondent: Any = None, experimenter: Any = None, *, task: str = "absolute", **of: Any
    ) -> Ran:
        store = of.pop("store", None) or MemoryStore()
        plan = plan_session(of.pop("study", study), task=task, subject=1, session=1)
        people = People(respondent=respondent or Scripted(), experimenter=experimenter or Ready())
        used = {"models": models, "rig": rig, **of}
        result = run_trials(plan, task_named(task), people=people, store=store, **used)
        return Ran(result, store)

    return session


def planned(study: Study, **changes: Any) -> Study:
    """The study with another plan of the absolute task."""
    plan = replace(study.plan_of("absolute"), **changes)
    return replace(study, tasks={**study.tasks, "absolute": plan})


# --- Order of what happens ------------------------------------------------------------------


@pytest.mark.parametrize("task", ["absolute", "relative", "oddity"])
def test_every_planned_trial_is_answered_in_its_order(
    run: Callable[..., Ran], study: Study, task: str
) -> None:
    if task == "oddity":
        plan = TaskPlan(participants=2, schedule="interleaved", repeats=6)
        study = replace(study, tasks={**study.tasks, "oddity": plan})
    ran = run(task=task, study=study)
    trials = plan_session(study, task=task, subject=1, session=1).trials
    assert ran.result.completed
    assert (ran.result.answered, ran.result.planned) == (len(trials), len(trials))
    for row, trial in zip(ran.store.rows, trials, strict=True):
        shared = {"trial", "phase", "texture", "model", "tray"}
        assert {name: row[name] for name in shared} == {n: getattr(trial, n) for n in shared}
        assert (row["run"], row["repeats"], row["valid"]) == (1, None, 1)
    assert ran.store.status == "complete"


def test_mounting_is_confirmed_and_the_rig_silent_before_anything_is_presented(
    run: Callable[..., Ran], rig: Any
) -> None:
    class Slow(Ready):
        def ask_mount(self, tray: str) -> None:
            super().ask_mount(tray)
            self.polls = 0
            assert rig.notes[-1] == ("silence", None)

        def ready(self) -> bool:
            self.polls += 1
            return self.polls > 3

    experimenter = Slow()
    ran = run(experimenter=experimenter)
    assert experimenter.trays == [row["tray"] for row in ran.store.rows]
    per_trial = [e for e in ran.told if e in ("mount_requested", "mount_confirmed", "presented")]
    assert per_trial[:3] == ["mount_requested", "mount_confirmed", "presented"]
    assert [event["trial"] for event in ran.events("mount_confirmed")] == list(range(1, 8))


def test_a_task_without_a_real_surface_mounts_nothing(
    run: Callable[..., Ran], study: Study
) -> None:
    plan = TaskPlan(participants=2, schedule="interleaved", repeats=2)
    experimenter = Ready()
    ran = run(
        experimenter=experimenter,
        task="oddity",
        study=replace(study, tasks={**study.tasks, "oddity": plan}),
    )
    assert experimenter.trays == []
    assert "mount_requested" not in ran.told


def test_the_experimenter_is_told_how_far_it_is_and_sees_no_condition(
    run: Callable[..., Ran], study: Study
) -> None:
    experimenter = Ready()
    run(experimenter=experimenter)
    assert [state.done for state in experimenter.told] == [0, 0, 1, 2, 3, 4, 5]
    assert {state.of for state in experimenter.told} == {6}
    assert experimenter.told[0].minutes_left is None
    assert all(state.minutes_left >= 0 for state in experimenter.told[1:])
    shown = repr([experimenter.told, experimenter.trays])
    assert not any(name in shown for name in (*study.textures, *study.models))


def test_the_participant_sees_progress_and_the_texts_of_each_phase(run: Callable[..., Ran]) -> None:
    respondent = Scripted()
    run(respondent)
    assert respondent.heard == ["absolute.training", "absolute.main", "absolute.closing"]
    assert respondent.done == [(0, 6), *((done, 6) for done in range(6))]


def test_what_is_asked_first_is_logged_before_any_trial(run: Callable[..., Ran]) -> None:
    intake = Intake(consent="2026-11", code="TAKI-46", known=False, questions=())
    respondent = Scripted()
    ran = run(respondent, intake=intake)
    assert respondent.asked == [intake]
    assert ran.store.events[0] == {"event": "welcome", "consent": "2026-11", "answers": {}}


def test_breaks_come_after_so_many_main_trials(run: Callable[..., Ran], study: Study) -> None:
    respondent = Scripted()
    ran = run(respondent, study=planned(study, break_after=2))
    assert respondent.rests == 2
    assert (ran.told.count("break_began"), ran.told.count("break_ended")) == (2, 2)
    begun = [
        sum(event["event"] == "mount_confirmed" for event in ran.store.events[:place])
        for place, event in enumerate(ran.store.events)
        if event["event"] == "break_began"
    ]
    assert begun == [3, 5]  # one for training


# --- Presenting -----------------------------------------------------------------------------


def test_nothing_is_presented_before_the_respondent_announces_it(
    run: Callable[..., Ran], rig: Any
) -> None:
    class Late(Scripted):
        def rate(self, trial: Any, surfaces: Surfaces) -> Rating:
            assert rig.notes[-1] == ("silence", None)
            assert not surfaces.started
            surfaces.start()
            surfaces.start()  # only once
            assert rig.notes[-1][0] == trial.first_surface
            assert rig.notes[-2] == ("silence", None)
            return super().rate(trial, surfaces)

    assert run(Late()).result.completed


def test_an_answer_without_a_presentation_is_a_mistake_of_the_program(
    run: Callable[..., Ran],
) -> None:
    class Hasty(Scripted):
        def rate(self, trial: Any, surfaces: Surfaces) -> Rating:
            return Rating(magnitude_similarity=1, frequency_similarity=1, response_time_s=0.0)

    with refused(RuntimeError, expected="trial 1"):
        run(Hasty())


def test_every_presentation_is_logged_with_its_trial(run: Callable[..., Ran]) -> None:
    ran = run(task="relative")
    shown = [event for event in ran.events("presented") if event["trial"] == 1]
    assert [(event["surface"], event.get("index")) for event in shown] == [
        ("real", None),
        ("virtual", 0),
        ("virtual", 1),
        ("virtual", 2),
    ]
    assert all("start_s" in event for event in shown)
    assert [event["index"] for event in ran.events("chosen") if event["trial"] == 1] == [1]


def test_the_experimenter_hears_of_every_answer(run: Callable[..., Ran]) -> None:
    desk = Ready()
    ran = run(experimenter=desk)
    assert desk.answers == ran.result.answered > 0


def test_what_a_respondent_notes_carries_its_trial_or_none(run: Callable[..., Ran]) -> None:
    class Noting(Scripted):
        def announce(self, page: str, **values: object) -> None:
            self.note("stop_asked")

        def rate(self, trial: Any, surfaces: Surfaces) -> Rating:
            surfaces.note("slider", scale="magnitude", value=63.2)
            return super().rate(trial, surfaces)

    ran = run(Noting())
    assert ran.events("slider")[0] == {
        "event": "slider",
        "trial": 1,
        "scale": "magnitude",
        "value": 63.2,
    }
    assert ran.events("stop_asked")[0] == {"event": "stop_asked"}


def quiet(event: str, **fields: object) -> None:
    """Notes nothing."""


def surfaces_of(rig: Any, models: list[Any]) -> Surfaces:
    return Surfaces(rig, texture="PVC", models=models, begin=lambda of: None, note=quiet)


def test_the_rigs_button_toggles_and_old_presses_do_not_count(models: ModelSets, rig: Any) -> None:
    rig.presses = 1
    surfaces = surfaces_of(rig, [models.of("PVC", "full")])
    surfaces.present_real()
    surfaces.follow_rig_button()
    assert surfaces.shows_real
    assert surfaces.switches == 0
    rig.presses = 2
    for _ in range(4):
        surfaces.follow_rig_button()
    assert surfaces.shows_real
    assert surfaces.switches == 2
    assert surfaces.presses == 1


def test_bursts_wait_for_a_press_and_the_next_one_presents_nothing(
    models: ModelSets, rig: Any
) -> None:
    burst = ToneBurst(frequency_hz=100.0, amplitude_g=0.1, duration_s=0.1)
    twin = SimulatedRig()
    twin.open()
    surfaces = surfaces_of(twin, [burst, burst])
    assert surfaces.bursts
    for index in (0, 1, 0):
        surfaces.present_virtual(index)
    assert (surfaces.presses, surfaces.last) == (2, 1)  # nor is it shown as presented
    assert not surfaces_of(rig, [models.of("MDF", "full")]).bursts


def test_toggling_among_several_returns_to_the_one_presented_last(
    models: ModelSets, rig: Any
) -> None:
    several = list(models.sets["full"].values())
    surfaces = surfaces_of(rig, several)
    surfaces.present_real()
    surfaces.toggle()
    assert surfaces.shows_real
    assert surfaces.last is None
    surfaces.present_virtual(2)
    surfaces.toggle()
    surfaces.toggle()
    assert rig.notes[-1] == ("virtual", several[2])
    assert (surfaces.last, surfaces.presses, surfaces.switches) == (2, 2, 3)
    assert surfaces.felt == {2}
    with refused(InputError, expected=["button", 0, 2], got=3):
        surfaces.present_virtual(3)


def test_what_was_felt_last_is_no_choice(models: ModelSets, rig: Any) -> None:
    surfaces = surfaces_of(rig, list(models.sets["full"].values()))
    for index in (0, 1):
        surfaces.present_virtual(index)
    assert surfaces.chosen is None
    surfaces.choose(0)
    surfaces.present_virtual(2)
    assert (surfaces.chosen, surfaces.last) == (0, 2)
    surfaces.choose(2)
    assert (surfaces.chosen, surfaces.presses) == (2, 3)
    for unfelt in (3, -1):
        with refused(InputError, expected="felt", got=unfelt):
            surfaces.choose(unfelt)
    assert surfaces.chosen == 2


def test_a_pause_is_silent_and_changes_no_count(models: ModelSets, rig: Any) -> None:
    surfaces = surfaces_of(rig, [models.of("PVC", "full")])
    surfaces.pause()
    surfaces.resume()
    assert rig.notes == [("silence", None)]  # nothing was presented before
    for present, shown in (
        (surfaces.present_real, "real"),
        (surfaces.present_virtual, "virtual"),
    ):
        present()
        counted = (surfaces.presses, surfaces.switches)
        surfaces.pause()
        assert rig.notes[-1] == ("silence", None)
        surfaces.resume()
        assert rig.notes[-1][0] == shown
        assert (surfaces.presses, surfaces.switches) == counted


@pytest.mark.parametrize(("paused_after_s", "again"), [(0.4, True), (0.8, False)])
def test_a_burst_that_a_pause_cut_off_is_presented_again(
    rig: Any, paused_after_s: float, again: bool
) -> None:
    now = [10.0]
    rig.now_s = lambda: now[0]
    rig.present_signal = lambda shown: rig._note("burst", shown) or now[0]
    burst = ToneBurst(frequency_hz=100.0, amplitude_g=0.1, duration_s=0.7)
    surfaces = surfaces_of(rig, [burst, burst])
    surfaces.present_virtual(0)
    now[0] += paused_after_s
    surfaces.pause()
    now[0] += 5.0
    surfaces.resume()
    assert rig.notes[1:] == [("silence", None), *[("burst", burst)] * again]
    assert (surfaces.presses, surfaces.felt) == (1, {0})


def test_a_response_begins_with_the_first_sample_on_whatever_clock_the_rig_has(
    models: ModelSets, rig: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    host = [100.0]
    monkeypatch.setattr(
        "tactileq.experiments.sessions.loop.surfaces.time.perf_counter", lambda: host[0]
    )
    rig.now_s = lambda: 7.0
    rig.present_real = lambda texture: 6.75  # the first sample left 0.25 s ago
    surfaces = surfaces_of(rig, [models.of("PVC", "full")])
    assert surfaces.response_time_s == 0.0
    surfaces.present_real()
    assert surfaces.first_sample_s == 6.75
    host[0] += 2.0
    assert surfaces.response_time_s == pytest.approx(2.25)
    surfaces.present_virtual()  # a later presentation changes nothing
    assert surfaces.response_time_s == pytest.approx(2.25)


@pytest.mark.parametrize("value", [-0.1, 100.1, float("nan")])
def test_impossible_ratings_are_refused(value: float) -> None:
    with refused(InputError, expected=["magnitude_similarity", 0, 100], got=value):
        Rating(magnitude_similarity=value, frequency_similarity=50.0, response_time_s=1.0)


# --- Ends -----------------------------------------------------------------------------------


@pytest.mark.parametrize("moment", ["wait", "rate", "announce", "welcome"])
@pytest.mark.parametrize("error", [RuntimeError("pen fell"), KeyboardInterrupt(), SystemExit(143)])
def test_the_rig_is_silent_before_the_end_is_logged(
    moment: str, error: BaseException, *, run: Callable[..., Ran], rig: Any
) -> None:
    def fail(*_: object) -> None:
        rig.notes.append(("sound", None))
        raise error

    class Careful(MemoryStore):
        def finish(self, status: str, reason: str = "", *, by: str = "") -> None:
            assert rig.notes[-1] == ("silence", None)
            super().finish(status, reason, by=by)

    respondent, store = Scripted(), Careful()
    setattr(respondent, moment, fail)
    intake = Intake(consent="1", code="TAKI-46", known=False, questions=())
    with pytest.raises(type(error)):
        run(respondent, store=store, intake=intake)
    program = isinstance(error, RuntimeError)
    assert store.status == ("crashed" if program else "aborted")
    assert store.events[-1]["by"] == ("program" if program else "signal")
    assert rig.notes[-1] == ("silence", None)


def test_silence_follows_a_broken_rig(run: Callable[..., Ran], rig: Any) -> None:
    rig.broken = True
    with pytest.raises(RuntimeError, match="vibrator"):
        run()
    assert rig.notes[-1] == ("silence", None)


def test_silence_follows_a_full_disk_and_the_disk_is_blamed(
    run: Callable[..., Ran], rig: Any
) -> None:
    class Full(MemoryStore):
        def answer(self, trial: int, row: Any) -> None:
            raise StoreError("no space")

        def finish(self, status: str, reason: str = "", *, by: str = "") -> None:
            raise StoreError("still no space")

    with pytest.raises(StoreError, match="^no space"):
        run(store=Full())
    assert rig.notes[-1] == ("silence", None)


def test_an_abort_keeps_the_answers_and_says_who_and_why(run: Callable[..., Ran], rig: Any) -> None:
    class Tired(Scripted):
        def wait(self, until: Callable[[], bool]) -> None:
            if self.answered == 2:
                raise SessionAborted("tired")

    ran = run(Tired())
    assert (ran.result.answered, ran.result.planned, ran.result.completed) == (2, 7, False)
    assert len(ran.store.rows) == 2
    assert rig.notes[-1] == ("silence", None)
    assert ran.store.events[-1] == {
        "event": "ended",
        "status": "aborted",
        "reason": "tired",
        "by": "participant",
    }


def test_stopping_on_the_last_page_is_no_abort(run: Callable[..., Ran]) -> None:
    class InAHurry(Scripted):
        def announce(self, page: str, **values: object) -> None:
            if page.endswith("closing"):
                raise SessionAborted

    ran = run(InAHurry())
    assert ran.result.completed
    assert ran.store.status == "complete"


@pytest.mark.parametrize("error", [KeyboardInterrupt(), RuntimeError("the window is gone")])
def test_what_ends_the_last_page_does_not_undo_a_complete_session(
    run: Callable[..., Ran], error: BaseException
) -> None:
    class Gone(Scripted):
        def announce(self, page: str, **values: object) -> None:
            if page.endswith("closing"):
                raise error

    store = MemoryStore()
    with pytest.raises(type(error)):
        run(Gone(), store=store)
    assert [event["status"] for event in store.events if event["event"] == "ended"] == ["complete"]


def test_a_rig_that_cannot_be_silenced_hides_nothing(run: Callable[..., Ran], rig: Any) -> None:
    class Falling(Scripted):
        def rate(self, trial: Any, surfaces: Surfaces) -> Rating:
            rig.silence = fail
            raise RuntimeError("pen fell")

    def fail() -> None:
        raise OSError("no card")

    store = MemoryStore()
    with pytest.raises(RuntimeError, match="pen fell"):
        run(Falling(), store=store)
    told = [event["told"] for event in store.events if event["event"] == "fault"]
    assert told == ["OSError: no card"]
    assert store.events[-1]["reason"] == "RuntimeError: pen fell"


@pytest.mark.parametrize("task", ["absolute", "oddity"])
def test_the_experimenter_can_stop_whether_samples_are_mounted_or_not(
    run: Callable[..., Ran], study: Study, task: str
) -> None:
    class Stopping(Ready):
        def ready(self) -> bool:
            raise SessionAborted("fire alarm", by="experimenter")

    plan = TaskPlan(participants=2, schedule="interleaved", repeats=2)
    study = replace(study, tasks={**study.tasks, "oddity": plan})
    ran = run(experimenter=Stopping(), task=task, study=study)
    assert (ran.result.completed, ran.result.reason) == (False, "fire alarm")
    assert ran.store.rows == []


# --- Faults ---------------------------------------------------------------------------------


class Unlucky(Scripted):
    """In some of whose answers (from 1) the rig fails."""

    def __init__(self, rig: Any, at: set[int], *, invalidates: bool = True) -> None:
        super().__init__()
        self._rig, self._at, self._invalidates = rig, at, invalidates

    def rate(self, trial: Any, surfaces: Surfaces) -> Rating:
        if self.answered + 1 in self._at:
            told = "expected a sound process that plays, got none; it was started again."
            self._rig.faults.append(Fault(1.5, told, self._invalidates))
        return super().rate(trial, surfaces)


def test_trials_in_which_the_rig_failed_are_repeated_once_at_the_end_of_their_phase(
    run: Callable[..., Ran], rig: Any
) -> None:
    # The training trial, the second main trial, and the repeat of the latter.
    experimenter = Ready()
    ran = run(Unlucky(rig, {1, 4, 9}), experimenter)
    assert (ran.result.planned, ran.result.answered, ran.result.invalid) == (9, 9, 3)
    assert ran.result.completed
    stored = ran.store.rows
    assert [(row["trial"], row["phase"], row["valid"], row["repeats"]) for row in stored] == [
        (1, "training", 0, None),
        (8, "training", 1, 1),
        (2, "main", 1, None),
        (3, "main", 0, None),
        *((number, "main", 1, None) for number in (4, 5, 6, 7)),
        (9, "main", 0, 3),
    ]
    for again, before in ((stored[1], stored[0]), (stored[8], stored[3])):
        same = ("texture", "model", "tray", "first_surface")
        assert [again[name] for name in same] == [before[name] for name in same]
    assert len(experimenter.called) == 3
    told = [(event["trial"], event["time_s"]) for event in ran.events("fault")]
    assert told == [(1, 1.5), (3, 1.5), (9, 1.5)]


def test_a_fault_that_changed_nothing_for_the_hand_and_one_between_trials_are_only_logged(
    run: Callable[..., Ran], rig: Any
) -> None:
    class Clumsy(Ready):
        def ask_mount(self, tray: str) -> None:
            rig.faults.append(Fault(0.5, "expected a process, got none.", invalidates=True))

    for people in ((Unlucky(rig, {2}, invalidates=False), Ready()), (Scripted(), Clumsy())):
        ran = run(*people)
        assert {row["valid"] for row in ran.store.rows} == {1}
        assert "fault" in ran.told


# --- Strokes and training -------------------------------------------------------------------


class Stroking(SimulatedRig):
    """Its participant feels each presentation for half a second."""

    def present_model(self, model: Any) -> float:
        return self._felt_for(super().present_model(model))

    def present_real(self, texture: str) -> float:
        return self._felt_for(super().present_real(texture))

    def _felt_for(self, began_s: float) -> float:
        for _ in range(50):
            self.read()
        return began_s


def at_speeds(models: ModelSets, factor: float) -> ModelSets:
    """The models as if they had been recorded at other speeds."""
    sets = {
        name: {t: replace(m, speeds_mm_s=m.speeds_mm_s * factor) for t, m in of.items()}
        for name, of in models.sets.items()
    }
    return ModelSets(sets=sets)


def test_who_strokes_outside_the_models_grid_is_told_after_the_trial(
    run: Callable[..., Ran], models: ModelSets
) -> None:
    respondent = Scripted()
    ran = run(respondent, models=at_speeds(models, 1e-4), rig=Stroking())
    assert respondent.heard.count("strokes.too_fast") == 7
    assert [event["trial"] for event in ran.events("outside")] == list(range(1, 8))


@pytest.mark.parametrize(("factor", "trained"), [(1.0, 1), (1e-4, 4)])
def test_training_goes_on_until_the_strokes_are_as_recorded_or_the_most_are_done(
    run: Callable[..., Ran], study: Study, models: ModelSets, factor: float, trained: int
) -> None:
    ran = run(
        study=planned(study, training_trials=1, most_training_trials=4),
        models=at_speeds(models, factor),
        rig=Stroking(),
    )
    phases = [row["phase"] for row in ran.store.rows]
    assert phases == ["training"] * trained + ["main"] * 6
    (over,) = ran.events("training_over")
    assert (over["trials"], over["inside"]) == (trained, factor == 1.0)
    numbers = [row["trial"] for row in ran.store.rows if row["phase"] == "main"]
    assert numbers == list(range(5, 11))  # the numbers of the plan, whatever training took


def test_training_goes_on_until_a_trial_is_inside(
    run: Callable[..., Ran], study: Study, models: ModelSets
) -> None:
    class Slowing(Stroking):
        """Its hand is too fast for the models of the first two trials."""

        trials = 0

        def take_presentations(self) -> Any:
            records = super().take_presentations()
            if records:
                self.trials += 1
            if self.trials <= 2:
                low = {"speeds_mm_s": (1e-3, 1e-2), "forces_n": (0.1, 9.0)}
                records = tuple(replace(record, **low) for record in records)
            return records

    ran = run(
        study=planned(study, training_trials=1, most_training_trials=6),
        models=models,
        rig=Slowing(),
    )
    assert ran.events("training_over")[0]["trials"] == 3


# --- Going on -------------------------------------------------------------------------------


def test_what_is_left_of_a_session_is_done_with_the_numbers_of_the_plan(
    run: Callable[..., Ran], study: Study
) -> None:
    trials = plan_session(study, task="absolute", subject=1, session=1).trials
    whole = run()
    agenda = Agenda(
        training=(),
        main=trials[4:],
        owed=(trials[2],),
        next_number=8,
        run=2,
        rows=tuple({**row, "valid": int(row["trial"] != 3)} for row in whole.store.rows[:4]),
    )
    ran = run(agenda=agenda)
    assert [(row["trial"], row["repeats"], row["run"]) for row in ran.store.rows] == [
        (5, None, 2),
        (6, None, 2),
        (7, None, 2),
        (8, 3, 2),
    ]
    assert (ran.result.answered, ran.result.planned, ran.result.invalid) == (8, 8, 1)
    assert ran.result.completed


def test_training_comes_again_with_numbers_of_its_own(
    run: Callable[..., Ran], study: Study
) -> None:
    trials = plan_session(study, task="absolute", subject=1, session=1).trials
    before = tuple(run().store.rows[:5])
    agenda = Agenda(
        training=trials[:1],
        training_again=True,
        main=trials[5:],
        next_number=8,
        run=2,
        rows=before,
    )
    ran = run(agenda=agenda)
    assert [(row["trial"], row["phase"], row["repeats"]) for row in ran.store.rows] == [
        (8, "training", 1),
        (6, "main", None),
        (7, "main", None),
    ]
    assert [event["again"] for event in ran.events("phase")] == [True, True]


def test_training_that_the_rig_spoilt_is_repeated_when_the_session_goes_on(
    run: Callable[..., Ran], study: Study
) -> None:
    trials = plan_session(study, task="absolute", subject=1, session=1).trials
    spoilt = {**run().store.rows[0], "valid": 0}
    agenda = Agenda(
        training=(), main=trials[1:], owed=trials[:1], next_number=8, run=2, rows=(spoilt,)
    )
    ran = run(agenda=agenda)
    assert [(row["trial"], row["repeats"]) for row in ran.store.rows][:2] == [(8, 1), (2, None)]
    assert ran.events("training_over")
    assert (ran.result.planned, ran.result.answered) == (8, 8)


def test_training_again_that_the_rig_spoilt_is_counted_and_repeated(
    run: Callable[..., Ran], study: Study, rig: Any
) -> None:
    trials = plan_session(study, task="absolute", subject=1, session=1).trials
    agenda = Agenda(
        training=trials[:1],
        training_again=True,
        main=trials[1:],
        next_number=8,
        run=2,
        rows=tuple(run().store.rows[:1]),
    )
    ran = run(Unlucky(rig, {1}), agenda=agenda)
    assert [(r["trial"], r["repeats"]) for r in ran.store.rows][:3] == [(8, 1), (9, 1), (2, None)]
    assert (ran.result.planned, ran.result.answered) == (9, 9)


# --- Traces ---------------------------------------------------------------------------------


class Keeping(MemoryStore):
    """Keeps traces, too."""

    def __init__(self) -> None:
        super().__init__()
        self.traces: list[Any] = []
        self.faults: list[Any] = []

    def trace(self, trial: int, rows: Any, *, presentations: Any, faults: Any) -> None:
        self.traces.append((trial, rows, presentations))
        self.faults.append([fault.sentence for fault in faults])


def test_the_hands_history_and_the_presentations_of_each_trial_reach_the_store(
    run: Callable[..., Ran],
) -> None:
    store = Keeping()
    run(rig=Stroking(), store=store)
    assert [trial for trial, _, _ in store.traces] == list(range(1, 8))
    for _, rows, presentations in store.traces:
        assert len(presentations) == 3
        assert len(rows) >= 3 * 250
        assert all(0 < b - a < 0.005 for a, b in pairwise(rows.time_s))
        assert min(rows.speed_mm_s) < -200 < 200 < max(rows.speed_mm_s)


def test_what_the_hand_did_while_a_sample_was_mounted_is_of_no_trial(
    run: Callable[..., Ran],
) -> None:
    rig, store = Stroking(), Keeping()
    mounted_s = []

    class Mounting(Scripted):
        def wait(self, until: Callable[[], bool]) -> None:
            for _ in range(50):
                rig.read()
            mounted_s.append(rig.now_s())

    run(Mounting(), rig=rig, store=store)
    for (_, rows, _), moment_s in zip(store.traces, mounted_s, strict=True):
        assert rows.time_s[0] > moment_s


class Leaving(Scripted):
    """Leaves in the third trial, once the first surface has been stroked."""

    error: BaseException = SessionAborted("tired")
    rig: SimulatedRig | None = None

    def rate(self, trial: Any, surfaces: Surfaces) -> Rating:
        if self.answered < 2:
            return super().rate(trial, surfaces)
        surfaces.start()
        surfaces.toggle()
        if self.rig is not None:
            self.rig.break_down("the cable")
        raise self.error


@pytest.mark.parametrize("error", [SessionAborted("tired"), SystemExit(143), OSError("gone")])
def test_the_hand_of_a_trial_that_broke_off_is_kept_once(
    run: Callable[..., Ran], error: BaseException
) -> None:
    store, leaving, rig = Keeping(), Leaving(), Stroking()
    leaving.error, leaving.rig = error, rig
    if isinstance(error, SessionAborted):
        run(leaving, rig=rig, store=store)
    else:
        with pytest.raises(type(error)):
            run(leaving, rig=rig, store=store)
    assert [trial for trial, _, _ in store.traces] == [1, 2, 3]
    _, rows, presentations = store.traces[-1]
    assert len(rows) >= 250
    assert len(presentations) == 2
    assert len(store.rows) == 2
    assert store.faults == [[], [], ["the cable"]]
    assert [event["event"] for event in store.events][-1] == "ended"


def test_a_second_signal_finds_the_end_logged(run: Callable[..., Ran]) -> None:
    class Slow(Keeping):
        def trace(self, trial: int, rows: Any, *, presentations: Any, faults: Any) -> None:
            if len(self.rows) == 2 and self.traces[-1:] and self.traces[-1][0] == 2:
                raise SystemExit(130)  # another one, while the hand is written
            super().trace(trial, rows, presentations=presentations, faults=faults)

    store, leaving = Slow(), Leaving()
    leaving.error = SystemExit(143)
    with pytest.raises(SystemExit, match="130"):
        run(leaving, rig=Stroking(), store=store)
    assert store.status == "aborted"


def test_the_hand_between_trials_is_of_no_trial(run: Callable[..., Ran]) -> None:
    class Waiting(Scripted):
        def wait(self, until: Callable[[], bool]) -> None:
            if self.answered == 2:
                raise SessionAborted("tired")

    store = Keeping()
    run(Waiting(), rig=Stroking(), store=store)
    assert [trial for trial, _, _ in store.traces] == [1, 2]


def test_a_rig_that_has_lost_its_history_hides_no_end(run: Callable[..., Ran]) -> None:
    rig, leaving = Stroking(), Leaving()
    taken = rig.take_history

    def lost() -> Any:
        if len(store.rows) == 2 and leaving.heard:
            raise OSError("the memory is gone")
        return taken()

    store = Keeping()
    run(leaving, rig=rig, store=store)
    rig.take_history = lost  # type: ignore[method-assign]
    store, leaving = Keeping(), Leaving()
    with pytest.raises(OSError, match="memory"):
        run(leaving, rig=rig, store=store)
    assert store.status == "crashed"


def test_what_was_measured_at_the_pen_belongs_to_its_trial(
    run: Callable[..., Ran], rig: Any
) -> None:
    measured = Acceleration(start_s=12.25, rate_hz=48000.0, samples_g=np.zeros(3))
    told = iter([(), (), (measured,), (measured, measured)])  # before and after each trial
    rig.take_acceleration = lambda: next(told, ())

    class Keeping(MemoryStore):
        kept: dict[int, int] = {}  # noqa: RUF012

        def acceleration(self, trial: int, pieces: Any) -> None:
            self.kept[trial] = len(pieces)

    store = Keeping()
    run(store=store)
    assert store.kept == {1: 0, 2: 2, **dict.fromkeys(range(3, 8), 0)}


# --- Force and exposure ---------------------------------------------------------------------


def test_a_force_device_is_armed_at_the_start_and_where_people_have_confirmed_a_fault(
    run: Callable[..., Ran], rig: Any
) -> None:
    class Failing(Scripted):
        def rate(self, trial: Any, surfaces: Surfaces) -> Rating:
            if trial.trial in (2, 3):
                rig.faults.append(Fault(0.0, "it has let go.", invalidates=True))
            armed.append(rig.armed)
            return super().rate(trial, surfaces)

    armed: list[int] = []
    ran = run(Failing())
    assert ran.result.invalid == 2
    # Once before anything; again after each fault, once the experimenter was called; no more.
    assert armed[:4] == [1, 1, 2, 3]
    assert rig.armed == 3


def test_a_days_exposure_ends_the_session_and_is_logged(run: Callable[..., Ran], rig: Any) -> None:
    rig.highest_exposure_m_s2 = 2.5
    dose = 0.4 * (2.5 / 9.80665) ** 2 * 8 * 3600  # of each trial: 40 % of what a day may have
    rig.take_presentations = lambda: (
        PresentationRecord(
            number=1,
            surface="virtual",
            texture="MDF",
            start_s=0.0,
            end_s=1.0,
            weighted_dose_g2_s=dose,
        ),
    )
    ran = run()
    assert ran.result.answered == 3
    assert not ran.result.completed
    assert "2.74 m/s²" in ran.result.reason
    assert [event["a8_m_s2"] for event in ran.events("exposure")] == pytest.approx(
        [2.5 * (0.4 * n) ** 0.5 for n in (1, 2, 3)]
    )
    full = run(exposed_g2_s=3 * dose)  # had it in another session of the day
    assert full.result.answered == 0


def test_who_strokes_beyond_the_edge_is_asked_to_stay_on_the_surface(
    run: Callable[..., Ran], rig: Any
) -> None:
    rows = 10
    beside = np.arange(rows) < 2
    rig.take_history = lambda: HandRows(
        time_s=np.arange(rows) / 500,
        speed_mm_s=np.full(rows, 100.0),
        force_n=np.ones(rows),
        surface=np.full(rows, 2),
        presentation=np.ones(rows, dtype=int),
        force_assumed=np.zeros(rows, dtype=bool),
        depth_mm=np.ones(rows),
        beyond_edge=beside,
    )
    respondent = Scripted()
    ran = run(respondent)
    asked = [e for e in ran.events("outside") if e["advice"] == "strokes.beyond_edge"]
    assert len(asked) == respondent.heard.count("strokes.beyond_edge") == ran.result.answered
    assert {event["percent"] for event in asked} == {20}
