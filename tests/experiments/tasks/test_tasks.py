"""The tasks: what each presents, asks and stores."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from typing import Any

import pytest

from tactileq.experiments.sessions.loop.trial_loop import People, run_trials
from tactileq.experiments.sessions.store.interface import MemoryStore
from tactileq.experiments.study.models import ModelSets
from tactileq.experiments.study.study import Study
from tactileq.experiments.study.task_plan import TaskPlan
from tactileq.experiments.tasks import plan_session, task_named
from tactileq.modeling import InputError
from tactileq.modeling.files.answer_tables import ANSWER_TABLES
from tests.experiments.scripted import Ready, Scripted
from tests.refusals import refused


def run(task: str, study: Study, models: ModelSets, rig: Any) -> MemoryStore:
    """One session of a task, answered by rote."""
    store = MemoryStore()
    plan = plan_session(study, task=task, subject=1, session=1)
    people = People(respondent=Scripted(), experimenter=Ready())
    run_trials(plan, task_named(task), models=models, rig=rig, people=people, store=store)
    return store


@pytest.mark.parametrize("task", ["absolute", "relative", "oddity"])
def test_every_answer_has_the_columns_of_its_table(
    task: str, study: Study, models: ModelSets, rig: Any
) -> None:
    for row in run(task, with_oddity(study), models, rig).rows:
        assert list(row) == [c.name for c in ANSWER_TABLES[task].columns if not c.optional]


def with_oddity(study: Study) -> Study:
    plan = TaskPlan(participants=2, schedule="interleaved", repeats=6)
    return replace(study, tasks={**study.tasks, "oddity": plan})


def test_an_absolute_answer_is_the_rating_of_its_trial(
    study: Study, models: ModelSets, rig: Any
) -> None:
    trials = plan_session(study, task="absolute", subject=1, session=1).trials
    for row, trial in zip(run("absolute", study, models, rig).rows, trials, strict=True):
        assert row["first_surface"] == trial.first_surface
        assert row["virtual_texture"] == trial.virtual_texture
        assert (row["magnitude_similarity"], row["frequency_similarity"]) == (70.0, 30.5)
        assert row["toggles"] == 2


def test_each_absolute_trial_presents_its_own_surfaces_in_its_own_order(
    study: Study, models: ModelSets, rig: Any
) -> None:
    run("absolute", study, models, rig)
    wanted: list[tuple[str, object]] = [("silence", None)]
    for trial in plan_session(study, task="absolute", subject=1, session=1).trials:
        real = ("real", trial.texture)
        virtual = ("virtual", models.of(trial.virtual_texture, trial.model))
        first, second = (real, virtual) if trial.first_surface == "real" else (virtual, real)
        wanted += [first, second, first, ("silence", None)]
    assert rig.notes == [*wanted, ("silence", None)]


def test_an_anchor_presents_another_textures_reference_model(
    study: Study, models: ModelSets, rig: Any
) -> None:
    plan = replace(study.plan_of("absolute"), anchors={"canvas": "PVC"})
    study = replace(study, tasks={**study.tasks, "absolute": plan})
    store = run("absolute", study, models, rig)
    (anchor,) = [row for row in store.rows if row["virtual_texture"] != row["texture"]]
    assert (anchor["texture"], anchor["virtual_texture"], anchor["model"]) == (
        "canvas",
        "PVC",
        "full",
    )
    shown = [event for event in store.events if event["event"] == "presented"]
    assert len(shown) == 3 * len(store.rows)
    assert ("virtual", models.of("PVC", "full")) in rig.notes


def test_a_relative_answer_is_what_was_behind_the_button(
    study: Study, models: ModelSets, rig: Any
) -> None:
    trials = plan_session(study, task="relative", subject=1, session=1).trials
    stored = run("relative", study, models, rig).rows
    for row, trial in zip(stored, trials, strict=True):
        assert row["layout"] == "|".join(trial.layout)
        assert row["answer"] == trial.layout[1]
        assert row["correct"] == int(trial.layout[1] == trial.texture)
        assert (row["presses"], row["response_time_s"]) == (len(trial.layout), 3.25)
    presented = [note for note in rig.notes if note[0] != "silence"][:4]
    first = trials[0]
    layout = [models.of(texture, first.model) for texture in first.layout]
    assert presented == [("real", first.texture), *(("virtual", model) for model in layout)]


def test_an_oddity_trial_has_one_odd_model_behind_each_button_equally_often(
    study: Study, models: ModelSets, rig: Any
) -> None:
    study = with_oddity(study)
    trials = plan_session(study, task="oddity", subject=1, session=1).trials
    main = [trial for trial in trials if trial.phase == "main"]
    cells = Counter((t.texture, t.model, t.odd_position) for t in main)
    assert set(cells.values()) == {1}
    assert len(cells) == len(study.textures) * 2 * 3
    for trial in trials:
        assert trial.layout[trial.odd_position - 1] == trial.model
        assert Counter(trial.layout)[trial.model] == 1
    for row, trial in zip(run("oddity", study, models, rig).rows, trials, strict=True):
        assert row["answer"] == 2
        assert row["correct"] == int(trial.odd_position == 2)
    first = [models.of(trials[0].texture, name) for name in trials[0].layout]
    shown = [note for note in rig.notes if note[0] != "silence"]
    assert shown[:4] == [("virtual", model) for model in (first[0], *first)]


def test_a_catch_trial_presents_another_texture_as_the_odd_one(
    study: Study, models: ModelSets, rig: Any
) -> None:
    plan = TaskPlan(
        participants=2,
        schedule="interleaved",
        repeats=2,
        catch={"canvas": "PVC"},
        catch_trials=4,
        models=("full", "simplified"),
    )
    study = replace(study, tasks={**study.tasks, "oddity": plan})
    trials = plan_session(study, task="oddity", subject=1, session=1).trials
    store = run("oddity", study, models, rig)
    shown = [note for note in rig.notes if note[0] == "virtual"]
    caught = 0
    for place, (row, trial) in enumerate(zip(store.rows, trials, strict=True)):
        assert list(row) == [column.name for column in ANSWER_TABLES["oddity"].columns]
        textures = [trial.texture] * 3
        if row["odd_texture"] != row["texture"]:
            caught += 1
            assert {row["texture"], row["odd_texture"]} == {"canvas", "PVC"}
            assert row["layout"] == "full|full|full"
            textures[row["odd_position"] - 1] = row["odd_texture"]
        felt = [models.of(*one) for one in zip(textures, trial.layout, strict=True)]
        # The first one with the page, then each once.
        assert shown[4 * place : 4 * place + 4] == [("virtual", m) for m in (felt[0], *felt)]
        assert row["correct"] == int(row["answer"] == row["odd_position"])
    assert caught == 4


def test_every_declared_table_has_its_task_and_another_name_is_refused() -> None:
    for name in ANSWER_TABLES:
        assert task_named(name).name == name
    with refused(InputError, expected=["task", *ANSWER_TABLES], got="'os'"):
        task_named("os")
