"""Sessions in memory: the answers that a study on disk would have, whoever works on them."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tactileq.experiments.observers.in_memory import simulate_sessions
from tactileq.experiments.observers.percepts import Perception
from tactileq.experiments.observers.psychometrics import Psychometrics
from tactileq.experiments.study.models import ModelSets
from tactileq.experiments.study.study import Study
from tactileq.experiments.study.task_plan import TaskPlan
from tactileq.modeling import InputError, TextureModel, Threshold
from tactileq.modeling.files.answer_tables import ANSWER_TABLES
from tests.refusals import refused


@pytest.fixture
def simulate(
    study: Study, truths: dict[str, TextureModel], models: ModelSets, threshold: Threshold
) -> Any:
    def run(of: Study = study, **more: Any) -> Any:
        perception = Perception(of, real=truths, models=models, threshold=threshold)
        parts = {"psychometrics": Psychometrics(), "seed": 3, "models": models, **more}
        return simulate_sessions(of, perception=perception, **parts)

    return run


def test_every_trial_of_every_session_is_answered(simulate: Any, study: Study) -> None:
    answers = simulate()
    assert list(answers) == ["absolute", "relative"]
    assert len(answers["absolute"]) == 3 * (1 + 3 * 2)
    assert len(answers["relative"]) == 4 * 2 * (1 + 3 * 2)
    for task, rows in answers.items():
        columns = [column.name for column in ANSWER_TABLES[task].columns]
        assert all(set(columns) <= set(row) for row in rows)
        assert all(row["simulated"] and row["valid"] == 1 for row in rows)
        main = [row for row in rows if row["phase"] == "main"]
        assert len(set(Counter((row["texture"], row["model"]) for row in main).values())) == 1
    days = Counter((row["participant"], row["session"]) for row in answers["relative"])
    assert set(days) == {(subject, day) for subject in (1, 2, 3, 4) for day in (1, 2)}


def test_no_answer_depends_on_the_number_of_workers(simulate: Any) -> None:
    alone = simulate()
    assert simulate(workers=2) == alone


def test_careless_people_and_people_who_differ_are_planned_for_by_seed(simulate: Any) -> None:
    planted = {"MDF": {"magnitude_similarity": 0.0, "choice": 0.0}}
    population = Psychometrics(planted=planted, careless=0.5, effect_sd=5.0)
    found = simulate(psychometrics=population)
    assert found == simulate(psychometrics=population, workers=2)
    assert found != simulate(psychometrics=Psychometrics(planted=planted))


def test_no_answer_depends_on_who_else_takes_part(simulate: Any) -> None:
    everybody = simulate()["relative"]
    third = simulate(subjects=[3], tasks=["relative"])
    assert third == {"relative": [row for row in everybody if row["participant"] == 3]}


def test_a_seed_fixes_every_answer(simulate: Any) -> None:
    assert simulate() == simulate()
    assert simulate() != simulate(seed=4)


def test_more_may_take_part_than_are_planned(simulate: Any) -> None:
    rows = simulate(subjects=range(1, 31), tasks=["absolute"])["absolute"]
    assert {row["participant"] for row in rows} == set(range(1, 31))


def test_the_odd_one_is_sought_in_the_same_way(simulate: Any, study: Study) -> None:
    oddity = TaskPlan(participants=4, schedule="interleaved", repeats=6)
    rows = simulate(replace(study, tasks={**study.tasks, "oddity": oddity}))["oddity"]
    assert len(rows) == 4 * (2 + 3 * 6)
    assert {row["odd_position"] for row in rows} == {1, 2, 3}


def test_a_difference_and_an_equality_are_found_in_the_answers(simulate: Any, study: Study) -> None:
    """Of 200 people, who rate each texture once with each model."""
    planted = {"MDF": {"magnitude_similarity": -12.0}, "PVC": {"magnitude_similarity": 0.0}}
    rows = simulate(
        psychometrics=Psychometrics(planted=planted), subjects=range(1, 201), tasks=["absolute"]
    )["absolute"]
    for texture, effect in (("MDF", -12.0), ("PVC", 0.0)):
        by_model = {
            model: np.array(
                [
                    row["magnitude_similarity"]
                    for row in rows
                    if (row["texture"], row["model"], row["phase"]) == (texture, model, "main")
                ]
            )
            for model in ("full", "simplified")
        }
        difference = by_model["simplified"] - by_model["full"]
        error = difference.std() / np.sqrt(200)
        assert abs(difference.mean() - effect) < 4 * error
        assert error < 1.5


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        ({"seed": -1}, "seed"),
        ({"workers": 0}, "workers"),
        ({"subjects": [0]}, "subject"),
        ({"tasks": ["smell"]}, "smell"),
        ({"psychometrics": Psychometrics(planted={"cork": {"choice": 1.0}})}, "cork"),
    ],
)
def test_what_cannot_be_is_refused(simulate: Any, wrong: dict[str, Any], told: str) -> None:
    with refused(InputError, names=told):
        simulate(**wrong)
