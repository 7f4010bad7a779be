"""The threshold task on the loop of all tasks: what is presented, stored, and taken up again."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from typing import Any

import pytest

from tactileq.experiments.sessions.loop.agenda import Agenda
from tactileq.experiments.sessions.loop.trial_loop import People, SessionResult, run_trials
from tactileq.experiments.sessions.store.interface import MemoryStore
from tactileq.experiments.study.models import ModelSets
from tactileq.experiments.study.study import Study
from tactileq.experiments.study.task_plan import TaskPlan
from tactileq.experiments.tasks import plan_session
from tactileq.experiments.tasks.threshold import (
    DURATION_S,
    FREQUENCIES_HZ,
    PRACTICE_HZ,
    TASK,
    ThresholdTrial,
)
from tactileq.experiments.tasks.threshold_posterior import LEVELS_DB, answers_of, estimate
from tactileq.modeling import InputError
from tactileq.modeling.files.answer_tables import ANSWER_TABLES
from tactileq.rig.desk.twin import SimulatedRig
from tactileq.rig.shared.interface import ToneBurst
from tests.experiments.scripted import Ready
from tests.experiments.tasks.planted_threshold import Feeling
from tests.refusals import refused

PLANTED_DB = (-35.0, -33.0, -37.0, -42.0, -44.0, -31.0, -18.0, -6.0)


@pytest.fixture
def study(study: Study) -> Study:
    """With a short threshold task."""
    plan = TaskPlan(participants=4, schedule="interleaved", repeats=3, training_trials=2)
    return replace(study, tasks={**study.tasks, "threshold": plan})


class Noting(SimulatedRig):
    """A twin that notes its bursts and allows some amplitude at most."""

    def __init__(self, highest_g: float = 5.0) -> None:
        super().__init__()
        self.highest_g = highest_g
        self.bursts: list[ToneBurst] = []

    def strongest_g(self, burst: ToneBurst) -> float:
        assert burst.duration_s == DURATION_S
        return self.highest_g

    def present_signal(self, burst: ToneBurst) -> float:
        self.bursts.append(burst)
        return super().present_signal(burst)


def run(
    study: Study,
    respondent: Any,
    *,
    rig: Any = None,
    models: ModelSets,
    agenda: Agenda | None = None,
    store: MemoryStore | None = None,
) -> tuple[SessionResult, MemoryStore]:
    store = store or MemoryStore()
    plan = plan_session(study, task="threshold", subject=1, session=1)
    people = People(respondent=respondent, experimenter=Ready())
    result = run_trials(
        plan, TASK, models=models, rig=rig or Noting(), people=people, store=store, agenda=agenda
    )
    return result, store


# --- The plan -------------------------------------------------------------------------------


@pytest.mark.parametrize("repeats", [1, 5, 40])
def test_each_round_has_all_frequencies_and_intervals_are_balanced(
    study: Study, repeats: int
) -> None:
    plan = replace(study.plan_of("threshold"), repeats=repeats)
    study = replace(study, tasks={**study.tasks, "threshold": plan})
    trials: Any = plan_session(study, task="threshold", subject=2, session=1).trials
    training, main = trials[:2], trials[2:]
    assert {trial.phase for trial in training} == {"training"}
    assert {trial.frequency_hz for trial in training} <= set(PRACTICE_HZ)
    rounds = [main[i : i + 8] for i in range(0, len(main), 8)]
    assert len(rounds) == repeats
    assert all({t.frequency_hz for t in one} == set(FREQUENCIES_HZ) for one in rounds)
    assert len({tuple(t.frequency_hz for t in one) for one in rounds}) > repeats / 2
    counts = Counter((t.frequency_hz, t.interval) for t in main)
    for frequency_hz in FREQUENCIES_HZ:
        assert abs(counts[frequency_hz, 1] - counts[frequency_hz, 2]) == repeats % 2
    assert Counter(t.interval for t in main) == {1: 4 * repeats, 2: 4 * repeats}
    assert all(t.amplitude_g is None and t.tray == "" and t.texture == "n/a" for t in trials)


def test_the_layout_says_where_the_tone_is() -> None:
    trial = ThresholdTrial(
        trial=1, phase="main", texture="n/a", model="n/a", tray="", frequency_hz=20.0, interval=2
    )
    assert trial.layout == ("silence", "tone")
    assert replace(trial, interval=1).layout == ("tone", "silence")


def test_by_day_is_refused(study: Study) -> None:
    plan = replace(study.plan_of("threshold"), schedule="by-day")
    with refused(InputError, expected=["interleaved", "threshold"], got="by-day"):
        replace(study, tasks={**study.tasks, "threshold": plan})


# --- The loop -------------------------------------------------------------------------------


def test_each_interval_is_felt_once_and_the_answer_is_stored(
    study: Study, models: ModelSets
) -> None:
    rig, person = Noting(), Feeling(PLANTED_DB)
    result, store = run(study, person, rig=rig, models=models)
    assert result.completed
    assert result.answered == len(store.rows) == 2 + 24
    columns = [column.name for column in ANSWER_TABLES["threshold"].columns]
    assert all(list(row) == columns for row in store.rows)
    assert len(rig.bursts) == 2 * len(person.felt)  # the third and fourth press only selected
    for trial, row, first, second in zip(
        person.felt, store.rows, rig.bursts[::2], rig.bursts[1::2], strict=True
    ):
        amplitudes_g = [first.amplitude_g, second.amplitude_g]
        assert amplitudes_g[trial.interval - 1] == row["amplitude_g"]
        assert amplitudes_g[2 - trial.interval] == 0.0
        assert first.frequency_hz == second.frequency_hz == row["frequency_hz"]
        assert row["correct"] == int(row["answer"] == row["interval"] == trial.interval)
        assert row["highest_g"] == 5.0
        assert (row["texture"], row["model"], row["tray"]) == ("n/a", "n/a", "")
    shown = [event for event in store.events if event["event"] == "presented"]
    assert [event["index"] for event in shown] == [0, 1] * len(person.felt)
    assert not [event for event in store.events if "mount" in str(event["event"])]


def test_practice_is_well_felt_and_tells_nothing(study: Study, models: ModelSets) -> None:
    person = Feeling(PLANTED_DB)
    run(study, person, models=models)
    practice, main = person.felt[:2], person.felt[2:]
    assert [t.amplitude_g for t in practice] == pytest.approx([10**-0.5] * 2)
    first = {t.frequency_hz: t for t in reversed(main)}
    assert len({first[f].amplitude_g for f in FREQUENCIES_HZ}) == 1  # nothing is known before


def test_nothing_stronger_than_the_rig_allows_is_presented(study: Study, models: ModelSets) -> None:
    rig = Noting(highest_g=0.05)
    run(study, Feeling([20.0] * 8), rig=rig, models=models)  # feels nothing of it
    strongest_g = max(burst.amplitude_g for burst in rig.bursts)
    assert 0.03 < strongest_g <= 0.05


def test_a_session_that_is_taken_up_again_asks_what_it_would_have_asked(
    study: Study, models: ModelSets
) -> None:
    whole = Feeling(PLANTED_DB, seed=4)
    _, store = run(study, whole, models=models)
    trials = plan_session(study, task="threshold", subject=1, session=1).trials
    done = 15
    agenda = Agenda(
        training=(),
        main=tuple(trials[done:]),
        next_number=len(trials) + 1,
        run=2,
        rows=tuple(store.rows[:done]),
    )
    rest = Feeling(PLANTED_DB, seed=4)
    rest._rng.random(done)  # what was answered before
    run(study, rest, models=models, agenda=agenda)
    assert rest.felt == whole.felt[done:]


def test_answers_while_the_rig_failed_do_not_count_and_are_asked_again(
    study: Study, models: ModelSets
) -> None:
    class Unlucky(Feeling):
        def choose(self, trial: ThresholdTrial, surfaces: Any) -> Any:
            if trial.trial == 5:
                rig.break_down("the card is gone")
            return super().choose(trial, surfaces)

    rig = Noting()
    result, store = run(study, Unlucky(PLANTED_DB), rig=rig, models=models)
    assert (result.answered, result.invalid) == (27, 1)
    lost, again = store.rows[4], store.rows[-1]
    assert (lost["valid"], again["repeats"], again["valid"]) == (0, 5, 1)
    assert lost["frequency_hz"] == again["frequency_hz"]
    assert lost["interval"] == again["interval"]
    assert len(answers_of(store.rows)) == 24


def test_a_session_leads_to_the_thresholds_that_its_rows_hold(
    study: Study, models: ModelSets
) -> None:
    """That they are near the planted ones is in test_threshold_posterior and the study."""
    _, store = run(study, Feeling(PLANTED_DB, seed=1), models=models)
    answers = answers_of(store.rows)
    assert {a.level_db for a in answers} <= set(LEVELS_DB)
    found = [estimate(answers, frequency_hz) for frequency_hz in FREQUENCIES_HZ]
    assert [one.trials for one in found] == [3] * 8
    assert [one.slope for one in found] == pytest.approx([found[0].slope] * 8)  # of the person
