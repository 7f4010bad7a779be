"""Orders of trials: uniform, balanced, reproducible."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import replace
from itertools import permutations, product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from experiments.study.design import fisher_yates, models_of_session
from experiments.study.study import Study
from experiments.study.task_plan import TaskPlan
from experiments.tasks import plan_session
from modeling import InputError


class Draws:
    """A generator that gives prepared numbers, and insists on the range they are drawn from."""

    def __init__(self, numbers: tuple[int, ...]) -> None:
        self.numbers = list(numbers)

    def integers(self, low: int, high: int) -> int:
        number = self.numbers.pop(0)
        assert low == 0
        assert 0 <= number < high == len(self.numbers) + 2
        return number


@pytest.mark.parametrize("n", [3, 4])
def test_fisher_yates_reaches_every_order_exactly_once(n: int) -> None:
    sequences = list(product(*(range(size) for size in range(n, 1, -1))))
    orders = [tuple(fisher_yates(range(n), Draws(draws))) for draws in sequences]
    assert len(sequences) == math.factorial(n)
    assert sorted(orders) == sorted(permutations(range(n)))


def test_fisher_yates_is_uniform_for_seven() -> None:
    """Item-by-position counts of random permutations: (n−1)/n·X² is χ² with (n−1)² dof."""
    n, repeats = 7, 7000
    counts = np.zeros((n, n))
    for seed in range(repeats):
        counts[np.arange(n), fisher_yates(range(n), np.random.default_rng(seed))] += 1
    expected = repeats / n
    statistic = (n - 1) / n * ((counts - expected) ** 2 / expected).sum()
    assert 0.001 < stats.chi2.sf(statistic, (n - 1) ** 2) < 0.999


def test_fisher_yates_leaves_its_input_alone() -> None:
    items = [1, 2, 3, 4, 5]
    fisher_yates(items, np.random.default_rng(0))
    assert items == [1, 2, 3, 4, 5]


def shipped(**changes: object) -> Study:
    return replace(Study.load(), **changes)


def test_shipped_study_is_the_papers() -> None:
    study = Study.load()
    assert len(study.textures) == 7
    assert study.repeats == 3
    assert study.plan("absolute") == TaskPlan(participants=20, schedule="interleaved")
    assert study.plan("relative") == TaskPlan(participants=24, schedule="by-day")


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**40), pairs=st.integers(1, 15))
def test_by_day_is_counterbalanced_exactly(seed: int, pairs: int) -> None:
    study = shipped(
        seed=seed, tasks={"relative": TaskPlan(participants=2 * pairs, schedule="by-day")}
    )
    first, second = (
        [
            models_of_session(study, task="relative", subject=subject, session=session)
            for subject in range(1, 2 * pairs + 1)
        ]
        for session in (1, 2)
    )
    assert Counter(first) == {("full",): pairs, ("simplified",): pairs}
    assert all({*a, *b} == {"full", "simplified"} for a, b in zip(first, second, strict=True))


def test_who_begins_with_which_model_cannot_be_told_from_the_number() -> None:
    study = shipped(tasks={"relative": TaskPlan(participants=400, schedule="by-day")})
    odd = [
        models_of_session(study, task="relative", subject=subject, session=1)
        for subject in range(1, 401, 2)
    ]
    assert 70 < odd.count(("full",)) < 130


@settings(max_examples=40, deadline=None)
@given(
    seed=st.integers(0, 2**60),
    count=st.integers(2, 12),
    repeats=st.integers(1, 4),
    schedule=st.sampled_from(["by-day", "interleaved"]),
    data=st.data(),
)
def test_every_session_holds_what_the_study_asks_for(
    seed: int, count: int, repeats: int, schedule: str, data: st.DataObject
) -> None:
    textures = tuple(f"t{index}" for index in range(count))
    plan = TaskPlan(participants=6, schedule=schedule)
    study = Study(
        name="any",
        seed=seed,
        textures=textures,
        trays={name: name.upper() for name in textures},
        repeats=repeats,
        training_trials=data.draw(st.integers(0, count)),
        tasks={"absolute": plan, "relative": plan},
    )
    task = data.draw(st.sampled_from(["absolute", "relative"]))
    subject, session = data.draw(st.integers(1, 6)), data.draw(st.integers(1, plan.sessions))
    trials = plan_session(study, task=task, subject=subject, session=session).trials
    models = models_of_session(study, task=task, subject=subject, session=session)
    main = [trial for trial in trials if trial.phase == "main"]
    times = repeats if task == "relative" else 1
    wanted = {(texture, model): times for texture in textures for model in models}
    assert Counter((trial.texture, trial.model) for trial in main) == wanted
    assert [trial.trial for trial in trials] == list(range(1, len(trials) + 1))
    assert [t.phase for t in trials[: study.training_trials]] == ["training"] * (
        len(trials) - len(main)
    )
    assert all(trial.tray == trial.texture.upper() for trial in trials)
    assert {trial.model for trial in trials} <= set(models)
    if task == "relative":
        assert all(sorted(trial.layout) == sorted(textures) for trial in trials)
    else:
        firsts = Counter(trial.first_surface for trial in main)
        assert abs(firsts["real"] - firsts["virtual"]) == len(main) % 2


def test_an_order_follows_from_study_seed_subject_session_and_task() -> None:
    study = shipped(tasks={"absolute": TaskPlan(participants=20, schedule="by-day")})
    keys = [
        (chosen, task, subject, session)
        for chosen in (study, replace(study, seed=2))
        for task in ("absolute", "relative")
        for subject in (1, 2)
        for session in (1, 2)
    ]
    orders = [
        plan_session(s, task=task, subject=subject, session=session).trials
        for s, task, subject, session in keys
    ]
    again = [
        plan_session(s, task=task, subject=subject, session=session).trials
        for s, task, subject, session in keys
    ]
    assert orders == again
    sequences = {tuple((trial.texture, trial.trial) for trial in order) for order in orders}
    assert len(sequences) == len(keys)


def test_layouts_are_drawn_anew_for_each_trial() -> None:
    trials = plan_session(shipped(), task="relative", subject=1, session=1).trials
    assert len({trial.layout for trial in trials}) > len(trials) - 3


@pytest.mark.parametrize(
    ("task", "subject", "session"),
    [("absolute", 0, 1), ("absolute", 21, 1), ("absolute", 1, 2), ("relative", 1, 3)],
)
def test_sessions_that_the_study_has_not_are_refused(task: str, subject: int, session: int) -> None:
    with pytest.raises(InputError, match="expected a whole number"):
        plan_session(shipped(), task=task, subject=subject, session=session)
