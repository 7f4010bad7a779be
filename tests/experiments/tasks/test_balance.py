"""The balance of a study's orders, counted, and the page to preregister."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import pytest

from tactileq.experiments.observers.in_memory import simulate_sessions
from tactileq.experiments.observers.percepts import Perception
from tactileq.experiments.observers.psychometrics import Psychometrics
from tactileq.experiments.study.design import SessionPlan
from tactileq.experiments.study.models import ModelSets
from tactileq.experiments.study.study import Study, plan_sha256
from tactileq.experiments.study.task_plan import TaskPlan
from tactileq.experiments.tasks import plan_session
from tactileq.experiments.tasks.balance import balance_of
from tactileq.experiments.tasks.durations import (
    TRIAL_S,
    minutes_of_catch_trials,
    minutes_of_session,
    trials_of_session,
)
from tactileq.experiments.tasks.page import plan_page, proof_of_sensitivity
from tactileq.modeling import InputError, TextureModel, Threshold
from tactileq.modeling.files.answer_tables import ANSWER_TABLES
from tactileq.modeling.files.claims import ClaimSection, PlanSection
from tests.refusals import refused


def test_the_papers_study_is_balanced() -> None:
    study = Study.load()
    found = [(row.least, row.most, row.of) for row in balance_of(study, "absolute")]
    assert found == [(10, 10, 20), (3, 4, 7), (10, 10, 20), (7, 7, 14)]
    found = [(row.least, row.most, row.of) for row in balance_of(study, "relative")]
    assert found == [(12, 12, 24), (3, 3, 21), (144, 144, 1008)]


def test_who_waits_is_told_of_each_order_that_is_drawn(study: Study) -> None:
    told: list[str] = []
    for task in study.tasks:
        before = len(told)
        assert balance_of(study, task, drawn=told.append) == balance_of(study, task)
        sessions = study.plan_of(task).participants * study.sessions(task)
        assert len(told) - before == sessions > 0
    assert len(set(told)) == len(told)


def test_imbalance_is_counted(study: Study) -> None:
    """Three participants, three textures: nobody can get half."""
    rows = balance_of(study, "absolute")
    assert [(row.least, row.most, row.of) for row in rows[:2]] == [(1, 2, 3), (1, 2, 3)]
    assert all(row.most - row.least <= 1 for row in rows)


def test_a_layout_that_does_not_tell_what_is_right_is_not_counted(
    study: Study, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As of buttons that say "same" and "different"."""
    counted = balance_of(study, "relative")

    def with_words(*args: object, **settings: object) -> SessionPlan:
        plan = plan_session(*args, **settings)  # type: ignore[arg-type]
        words = ("same", "different")
        return replace(plan, trials=tuple(replace(each, layout=words) for each in plan.trials))

    monkeypatch.setattr("tactileq.experiments.tasks.balance.plan_session", with_words)
    assert balance_of(study, "relative") == [
        row for row in counted if not row.what.endswith("a button is correct")
    ]
    assert len(counted) > len(balance_of(study, "relative"))


def test_anchors_count_for_nothing(study: Study) -> None:
    plan = replace(study.plan_of("absolute"), anchors={"canvas": "PVC"})
    with_anchor = replace(study, tasks={**study.tasks, "absolute": plan})
    assert trials_of_session(with_anchor, "absolute") == (1, 7)
    for row in balance_of(with_anchor, "absolute"):
        assert row.most - row.least <= 1


def test_catch_trials_count_for_no_balance_but_for_the_time(study: Study) -> None:
    plain = TaskPlan(participants=3, schedule="interleaved", repeats=2, catch_trials=0)
    caught = replace(plain, catch={"canvas": "PVC"}, catch_trials=5)
    bare, longer = (
        replace(study, tasks={**study.tasks, "oddity": plan}) for plan in (plain, caught)
    )
    assert balance_of(longer, "oddity") == balance_of(bare, "oddity")
    assert trials_of_session(bare, "oddity") == (2, 6)
    assert trials_of_session(longer, "oddity") == (2, 11)
    minutes = minutes_of_session(longer, "oddity") - minutes_of_session(bare, "oddity")
    assert minutes == minutes_of_catch_trials(longer, "oddity") == round(5 * TRIAL_S["oddity"] / 60)
    assert minutes_of_catch_trials(bare, "oddity") == 0
    assert minutes_of_catch_trials(longer, "relative") == 0


@pytest.mark.parametrize("repeats", [1, 2])
def test_planned_trials_are_those_that_sessions_run(
    study: Study,
    models: ModelSets,
    truths: dict[str, TextureModel],
    threshold: Threshold,
    repeats: int,
) -> None:
    """Of every task; the odd one out takes even repeats alone."""
    mixed = TaskPlan(participants=1, schedule="interleaved", repeats=repeats, training_trials=3)
    tasks = {
        "absolute": replace(mixed, anchors={"canvas": "PVC"}),
        "relative": replace(mixed, participants=2, schedule="by-day"),
        "oddity": replace(mixed, repeats=2 * repeats),
        "threshold": mixed,
    }
    study = replace(study, tasks=tasks)
    answers = simulate_sessions(
        study,
        models=models,
        perception=Perception(study, real=truths, models=models, threshold=threshold),
        psychometrics=Psychometrics(),
        seed=3,
        subjects=[1],
    )
    assert answers.keys() == set(ANSWER_TABLES)
    for task, rows in answers.items():
        run = Counter((row["session"], row["phase"]) for row in rows)
        training, main = trials_of_session(study, task)
        assert run == {
            (session, phase): count
            for session in range(1, study.sessions(task) + 1)
            for phase, count in (("training", training), ("main", main))
        }


def test_thresholds_are_planned_by_frequencies(study: Study, models: ModelSets) -> None:
    plan = TaskPlan(participants=10, schedule="interleaved", repeats=60, break_after=80)
    study = replace(study, tasks={"threshold": plan})
    assert trials_of_session(study, "threshold") == (2, 480)
    # 482 trials of 5 s, 5 min, and 5 breaks of 2 min.
    assert minutes_of_session(study, "threshold") == round((482 * 5 + 300 + 600) / 60)
    page = plan_page(study, models)
    design, _, _ = page.partition("## Models")
    assert "Each frequency comes 60 times" in design.partition("**Threshold")[2]
    assert "with each model" not in design.partition("**Threshold")[2]
    found = [(row.least, row.most, row.of) for row in balance_of(study, "threshold")]
    assert found == [(240, 240, 480), (2400, 2400, 4800)]


@pytest.mark.parametrize("repeats", [2, 4, 6])
@pytest.mark.parametrize("seed", range(5))
def test_every_button_is_right_equally_often_in_the_oddity_task(
    study: Study, repeats: int, seed: int
) -> None:
    plan = TaskPlan(participants=24, schedule="interleaved", repeats=repeats)
    study = replace(study, seed=seed, textures=("canvas", "MDF"), trays={"canvas": "C", "MDF": "A"})
    study = replace(study, tasks={"oddity": plan})
    *_, within, over = balance_of(study, "oddity")
    assert within.most - within.least <= 1
    assert (over.least, over.most, over.of) == (16 * repeats, 16 * repeats, 48 * repeats)
    cells = Counter(
        (trial.texture, trial.model, trial.layout.index(trial.model))
        for slot in range(1, 25)
        for trial in plan_session(study, task="oddity", subject=slot, session=1).trials
        if trial.phase == "main"
    )
    assert set(cells.values()) == {4 * repeats}
    assert len(cells) == 2 * 2 * 3


def test_minutes_are_those_of_trials_and_breaks() -> None:
    # 2 + 16 trials of 50 s and 5 min, and a break of 2 min after 5, 10 and 15 of 16 trials.
    paper = Study.load()
    assert minutes_of_session(paper, "absolute") == round((18 * 50 + 300) / 60)
    breaks = replace(paper.plan_of("absolute"), break_after=5)
    slower = replace(paper, tasks={"absolute": breaks})
    assert minutes_of_session(slower, "absolute") == round((18 * 50 + 300 + 360) / 60)


@pytest.fixture
def planned(study: Study) -> Study:
    claim = ClaimSection(
        name="as alike",
        task="absolute",
        measure="magnitude_similarity",
        models=("full", "simplified"),
        bounds=(-7.5, 8),
        test="equivalence",
    )
    anchored = TaskPlan(
        participants=4,
        schedule="interleaved",
        training_trials=1,
        most_training_trials=5,
        break_after=4,
        anchors={"canvas": "PVC"},
    )
    plan = PlanSection(
        claims=(claim,), exclusions=("Whoever takes it off.",), highest_share_at_ends=0.3
    )
    return replace(study, plan=plan, tasks={**study.tasks, "absolute": anchored})


def test_the_page_says_all_that_is_fixed(planned: Study, models: ModelSets) -> None:
    page = plan_page(planned, models)
    hashes = models.sha256(planned.textures)
    assert plan_sha256(planned, hashes) in page
    assert all(sha256 in page for named in hashes.values() for sha256 in named.values())
    for told in (
        "simplified minus full. Smallest differences that matter: -7.5 and 8 points",
        "Test of equivalence",
        "Whoever takes it off.",
        "more than 30%",
        "absolute: 4 participants",
        "relative: 4 participants",
        "1 to 5 (until strokes stay inside the grid) for practice",
        "real canvas beside the full model of PVC",
        "A break after every 4 trials",
        "each on a separate day (2 sessions)",
        "No equality unless the anchors are rated lower",
    ):
        assert told in page
    assert plan_page(Study.from_dict(planned.to_dict()), models) == page


def test_each_claim_says_what_its_equality_hangs_on(planned: Study) -> None:
    (rated,) = planned.plan.claims
    chosen, odd = (
        replace(rated, task=task, measure="correct", bounds=(-0.1, 0.1))
        for task in ("relative", "oddity")
    )
    oddity = TaskPlan(participants=3, schedule="interleaved", repeats=2)
    bare = replace(planned.plan_of("absolute"), anchors={})
    study = replace(planned, tasks={**planned.tasks, "absolute": bare, "oddity": oddity})
    assert "anchors are rated lower" in proof_of_sensitivity(planned, rated)
    assert "give it anchors" in proof_of_sensitivity(study, rated)
    assert "full models are recognised" in proof_of_sensitivity(study, chosen)
    assert "No equality in any case" in proof_of_sensitivity(study, odd)
    assert "catch trials" in proof_of_sensitivity(study, odd)  # as advice
    caught = replace(oddity, catch={"canvas": "PVC"}, catch_trials=6)
    study = replace(study, tasks={**study.tasks, "oddity": caught})
    told = proof_of_sensitivity(study, odd)
    for fact in ("above chance", "6 catch trials", "6 minutes of each session"):
        assert fact in told
    assert "in any case" not in told


def test_the_page_states_catch_trials_and_what_they_cost(planned: Study, models: ModelSets) -> None:
    plain = TaskPlan(participants=3, schedule="interleaved", repeats=2)
    caught = replace(plain, catch={"canvas": "PVC"}, catch_trials=4)
    pages = [
        plan_page(replace(planned, tasks={**planned.tasks, "oddity": plan}), models)
        for plan in (plain, caught)
    ]
    for fact in ("4 catch trials", "4 minutes of each session", "canvas and PVC", "full models"):
        assert fact in pages[1]
    assert "catch trials" not in pages[0]


def test_the_page_says_which_rule_decides(planned: Study, models: ModelSets) -> None:
    tested = plan_page(planned, models)
    eight = replace(planned.plan_of("absolute"), participants=8)
    plan = replace(planned.plan, rule="hierarchical")
    modelled = plan_page(
        replace(planned, plan=plan, tasks={**planned.tasks, "absolute": eight}), models
    )
    for fact in ("hierarchical model", "90 %", "95 %", "beside", "days"):
        assert fact in modelled
    assert "hierarchical model" not in tested
    # The tests decide nothing there, so no claim names them as its own.
    assert "Test of equivalence" in tested
    assert "Test of equivalence" not in modelled


def test_the_page_keeps_the_seed_and_names_controls(planned: Study, models: ModelSets) -> None:
    secret = replace(planned, seed=7_422_788_540_163_745, plan=PlanSection())
    same = {**models.sets["simplified"], "MDF": models.sets["full"]["MDF"]}
    page = plan_page(secret, ModelSets(sets={**models.sets, "simplified": same}))
    assert "7422788540163745" not in page
    assert "The models of MDF in full, simplified are equal: a control" in page
    assert "None: all findings are exploratory." in page


def test_what_is_not_planned_has_no_balance(study: Study) -> None:
    with refused(InputError, expected=["absolute", "relative"], got="'oddity'"):
        balance_of(study, "oddity")
