"""Orders of trials: uniform, balanced, reproducible."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable
from dataclasses import replace
from itertools import permutations, product
from random import Random
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from tactileq.experiments.study.design import (
    Occasion,
    SessionPlan,
    Trial,
    dealt,
    fisher_yates,
    models_of_session,
)
from tactileq.experiments.study.study import Study
from tactileq.experiments.study.task_plan import TaskPlan
from tactileq.experiments.tasks import plan_session
from tactileq.modeling import InputError
from tactileq.modeling.files.claims import PlanSection
from tactileq.modeling.files.hashes import sha256_of_values
from tests.refusals import refused

SEEDS = range(200)
THREE = {"full": "models", "paper": "paper", "simplified": "simplified"}


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


@given(n=st.integers(1, 9), count=st.integers(0, 30), seed=st.integers(0, 2**40))
def test_items_are_dealt_equally_often(n: int, count: int, seed: int) -> None:
    found = Counter(dealt(range(n), count, np.random.default_rng(seed)))
    assert found.total() == count
    assert {found[item] for item in range(n)} <= {count // n, -(-count // n)}


def shipped(**changes: object) -> Study:
    return replace(Study.load(), **changes)


def tiny(*, textures: int, plan: TaskPlan, seed: int = 1, **changes: object) -> Study:
    names = tuple(f"t{index}" for index in range(textures))
    planned = replace(plan, training_trials=0, most_training_trials=0)
    return Study(
        name="tiny",
        seed=seed,
        textures=names,
        trays={name: name.upper() for name in names},
        **{"tasks": {"absolute": planned}, "models": THREE, **changes},
    )


def main_of(study: Study, task: str, slot: int, session: int = 1) -> list[Trial]:
    trials = plan_session(study, task=task, subject=slot, session=session).trials
    return without_anchors(trials)


def without_anchors(trials: Iterable[Trial]) -> list[Trial]:
    """The main trials, but those beside another texture's model."""
    return [
        trial
        for trial in trials
        if trial.phase == "main"
        and getattr(trial, "virtual_texture", trial.texture) == trial.texture
    ]


def firsts(trials: list[Trial]) -> dict[str, str]:
    found: dict[str, str] = {}
    for trial in trials:
        found.setdefault(trial.texture, trial.model)
    return found


def test_shipped_study_is_the_papers() -> None:
    study = Study.load()
    assert len(study.textures) == 7
    assert study.models_of("absolute") == study.models_of("relative") == ("full", "simplified")
    wanted = TaskPlan(participants=20, schedule="interleaved", models=("full", "simplified"))
    anchors = {"wall paper": "aluminum", "canvas": "PVC"}  # the paper has none
    assert study.plan_of("absolute") == replace(wanted, anchors=anchors)
    by_day = replace(wanted, participants=24, schedule="by-day", repeats=3)
    assert study.plan_of("relative") == by_day
    assert (study.sessions("absolute"), study.sessions("relative")) == (1, 2)


# --- Balance of the paper's study, over 200 seeds ---------------------------------------------


def test_by_day_exactly_half_begin_with_each_model() -> None:
    for seed in SEEDS:
        study = shipped(seed=seed)
        days = [
            [
                models_of_session(study, task="relative", slot=slot, session=session)
                for session in (1, 2)
            ]
            for slot in range(1, 25)
        ]
        assert Counter(first for first, _ in days) == {("full",): 12, ("simplified",): 12}
        assert all(first != second for first, second in days)


@pytest.fixture(scope="module")
def ratings() -> list[list[list[Trial]]]:
    """Main trials of the absolute task, by seed and slot."""
    studies = [shipped(seed=seed) for seed in SEEDS]
    return [[main_of(study, "absolute", slot) for slot in range(1, 21)] for study in studies]


def test_interleaved_each_model_of_a_texture_is_first_for_exactly_half(
    ratings: list[list[list[Trial]]],
) -> None:
    for sessions in ratings:
        found = [firsts(trials) for trials in sessions]
        for texture in found[0]:
            assert sum(first[texture] == "full" for first in found) == 10
        within = [list(first.values()).count("full") for first in found]
        assert set(within) <= {3, 4}
        assert sum(within) == 70


def test_the_real_surface_is_first_in_exactly_half(ratings: list[list[list[Trial]]]) -> None:
    for sessions in ratings:
        real = Counter(
            (trial.texture, trial.model)
            for trials in sessions
            for trial in trials
            if trial.first_surface == "real"
        )
        assert set(real.values()) == {10}
        assert len(real) == 14
        assert all(
            Counter(trial.first_surface for trial in trials) == {"real": 7, "virtual": 7}
            for trials in sessions
        )


def test_each_button_is_right_exactly_as_often_as_textures_repeat() -> None:
    for seed in SEEDS[:60]:
        study = shipped(seed=seed)
        for slot in (1, 2, 24):
            trials = main_of(study, "relative", slot)
            right = Counter(trial.layout.index(trial.texture) for trial in trials)
            assert right == dict.fromkeys(range(7), 3)


# --- Other designs ------------------------------------------------------------------------------


@settings(max_examples=40, deadline=None)
@given(
    seed=st.integers(0, 2**60),
    count=st.integers(2, 4),
    blocks=st.integers(1, 5),
    by_day=st.booleans(),
)
def test_as_many_begin_with_each_of_several_models(
    seed: int, count: int, blocks: int, by_day: bool
) -> None:
    names = {f"m{index}": f"place {index}" for index in range(count)}
    schedule = "by-day" if by_day else "interleaved"
    plan = TaskPlan(participants=count * blocks, schedule=schedule, models=tuple(names))
    study = tiny(textures=5, plan=plan, seed=seed, models=names)
    slots = range(1, count * blocks + 1)
    if by_day:
        rows = [
            tuple(
                models_of_session(study, task="absolute", slot=slot, session=session)[0]
                for session in range(1, count + 1)
            )
            for slot in slots
        ]
        assert all(sorted(row) == sorted(names) for row in rows)
        for session in range(count):
            assert Counter(row[session] for row in rows) == dict.fromkeys(names, blocks)
        return
    found = [firsts(main_of(study, "absolute", slot)) for slot in slots]
    for texture in study.textures:
        assert Counter(first[texture] for first in found) == dict.fromkeys(names, blocks)
    for first in found:
        assert {list(first.values()).count(name) for name in names} <= {5 // count, -(-5 // count)}


@pytest.mark.parametrize("participants", [1, 3, 19])
def test_an_odd_number_of_participants_is_one_apart(participants: int) -> None:
    plan = TaskPlan(participants=participants, schedule="interleaved")
    for seed in range(20):
        study = shipped(seed=seed, tasks={"absolute": plan}, plan=PlanSection())
        sessions = [main_of(study, "absolute", slot) for slot in range(1, participants + 1)]
        for texture in study.textures:
            full = sum(firsts(trials)[texture] == "full" for trials in sessions)
            assert full in (participants // 2, participants - participants // 2)
            real = sum(
                trial.first_surface == "real"
                for trials in sessions
                for trial in trials
                if (trial.texture, trial.model) == (texture, "full")
            )
            assert real in (participants // 2, participants - participants // 2)


def test_who_begins_with_which_model_cannot_be_told_from_the_number() -> None:
    study = shipped(tasks={"relative": TaskPlan(participants=400, schedule="by-day")})
    odd = [
        models_of_session(study, task="relative", slot=slot, session=1) for slot in range(1, 401, 2)
    ]
    assert 70 < odd.count(("full",)) < 130  # 30 is 4.2 standard deviations of 200 fair coins


def test_with_an_even_number_of_repeats_each_surface_is_first_equally_often_in_each_cell() -> None:
    plan = TaskPlan(participants=2, schedule="interleaved", repeats=4)
    for seed in range(20):
        trials = main_of(tiny(textures=3, plan=plan, seed=seed), "absolute", 1)
        cells = Counter((trial.texture, trial.model, trial.first_surface) for trial in trials)
        assert len(trials) == 24
        assert set(cells.values()) == {2}
        assert len(cells) == 12


def test_a_replacement_takes_over_the_cells_of_the_slot_with_other_shuffles() -> None:
    study = shipped()
    gone, new = (
        plan_session(study, task="absolute", subject=subject, session=1, slot=4)
        for subject in (4, 31)
    )
    first, second = (without_anchors(plan.trials) for plan in (gone, new))
    assert firsts(first) == firsts(second)
    assert {(t.texture, t.model, t.first_surface) for t in first} == {
        (t.texture, t.model, t.first_surface) for t in second
    }
    assert [(t.texture, t.model) for t in first] != [(t.texture, t.model) for t in second]
    days = [
        [
            plan_session(study, task="relative", subject=subject, session=day, slot=9).trials
            for day in (1, 2)
        ]
        for subject in (9, 40)
    ]
    models = [[trials[0].model for trials in each] for each in days]
    assert models[0] == models[1]
    assert days[0][0] != days[1][0]


# --- Uniform among what the design allows ------------------------------------------------------


def test_orders_are_uniform_among_those_that_the_design_allows() -> None:
    """Two textures, two models: one begins with each, so 4!/4 orders for each of two starts."""
    plan = TaskPlan(participants=2, schedule="interleaved")
    counts: Counter[tuple[tuple[str, str], ...]] = Counter()
    for seed in range(2400):
        trials = main_of(tiny(textures=2, plan=plan, seed=seed), "absolute", 1)
        counts[tuple((trial.texture, trial.model) for trial in trials)] += 1
    allowed = {
        order
        for order in permutations(product(("t0", "t1"), ("full", "paper")))
        if sorted(dict(reversed(order)).values()) == ["full", "paper"]
    }
    assert len(allowed) == 12
    assert set(counts) == allowed
    assert stats.chisquare([counts[order] for order in allowed]).pvalue > 0.001


def test_layouts_are_uniform_for_three_textures() -> None:
    """First trial of a session of three textures: 3 textures × 3! layouts."""
    plan = TaskPlan(participants=2, schedule="by-day", models=("full", "paper"))
    counts: Counter[tuple[str, ...]] = Counter()
    for seed in range(1800):
        study = tiny(textures=3, plan=plan, seed=seed, tasks={"relative": plan})
        trial = main_of(study, "relative", 1)[0]
        counts[trial.texture, *trial.layout] += 1
    assert len(counts) == 18
    assert stats.chisquare(list(counts.values())).pvalue > 0.001


# --- What every session holds --------------------------------------------------------------------


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
    training = data.draw(st.integers(0, 3))
    plan = TaskPlan(
        participants=6,
        schedule=schedule,
        repeats=repeats,
        training_trials=training,
        most_training_trials=training + data.draw(st.integers(0, 40)),
    )
    study = Study(
        name="any",
        seed=seed,
        textures=textures,
        trays={name: name.upper() for name in textures},
        tasks={"absolute": plan, "relative": plan},
    )
    task = data.draw(st.sampled_from(["absolute", "relative"]))
    session = data.draw(st.integers(1, study.sessions(task)))
    subject, slot = data.draw(st.integers(1, 9999)), data.draw(st.integers(1, 6))
    trials = plan_session(study, task=task, subject=subject, session=session, slot=slot).trials
    models = models_of_session(study, task=task, slot=slot, session=session)
    main = [trial for trial in trials if trial.phase == "main"]
    wanted = {(texture, model): repeats for texture in textures for model in models}
    assert Counter((trial.texture, trial.model) for trial in main) == wanted
    assert [trial.trial for trial in trials] == list(range(1, len(trials) + 1))
    practice = trials[: plan.most_training_trials]
    assert [trial.phase for trial in practice] == ["training"] * (len(trials) - len(main))
    assert all(trial.tray == trial.texture.upper() for trial in trials)
    assert {trial.model for trial in trials} <= set(models)
    if task == "relative":
        assert all(sorted(trial.layout) == sorted(textures) for trial in trials)
        right = Counter(trial.layout.index(trial.texture) for trial in main)
        assert right == dict.fromkeys(range(count), repeats * len(models))
    else:
        within = Counter(trial.first_surface for trial in main)
        assert abs(within["real"] - within["virtual"]) == len(main) % 2
        assert all(trial.virtual_texture == trial.texture for trial in trials)


def test_anchors_come_once_in_each_session_at_any_place() -> None:
    plan = TaskPlan(
        participants=20, schedule="interleaved", anchors={"canvas": "PVC", "MDF": "leather"}
    )
    places: Counter[int] = Counter()
    for seed in range(60):
        study = shipped(seed=seed, tasks={"absolute": plan})
        trials = plan_session(study, task="absolute", subject=1, session=1).trials
        anchors = [trial for trial in trials if trial.virtual_texture != trial.texture]
        found = {(t.texture, t.virtual_texture, t.model, t.phase, t.tray) for t in anchors}
        assert found == {
            ("canvas", "PVC", "full", "main", "B"),
            ("MDF", "leather", "full", "main", "A"),
        }
        assert sorted(trial.first_surface for trial in anchors) == ["real", "virtual"]
        assert len(trials) == 2 + 14 + 2
        places.update(trial.trial - 2 for trial in anchors)
    assert set(places) == set(range(1, 17))


def without_numbers(trials: Iterable[Any]) -> list[Any]:
    return [replace(trial, trial=0) for trial in trials]


NAMES = Study.load().textures


@settings(max_examples=50)
@given(
    st.integers(0, 2**40),
    st.sampled_from(["interleaved", "by-day"]),
    st.dictionaries(st.sampled_from(NAMES), st.integers(1, 6), min_size=1),
    st.randoms(use_true_random=False),
)
def test_anchors_leave_the_rest_as_it_is_and_no_order_of_theirs_matters(
    seed: int, schedule: Any, steps: dict[str, int], shuffled: Random
) -> None:
    """Between the anchors stands exactly the balanced order that there is without any."""
    anchors = {name: NAMES[(NAMES.index(name) + step) % 7] for name, step in steps.items()}
    plan = TaskPlan(participants=20, schedule=schedule, repeats=2)
    anchored = shipped(seed=seed, tasks={"absolute": replace(plan, anchors=anchors)})
    order = list(anchors.items())
    shuffled.shuffle(order)
    same = shipped(seed=seed, tasks={"absolute": replace(plan, anchors=dict(order))})
    plain = shipped(seed=seed, tasks={"absolute": plan})
    assert anchored.sha256 == same.sha256
    for session in range(1, plain.sessions("absolute") + 1):
        of: dict[str, Any] = {"task": "absolute", "subject": 3, "session": session, "slot": 2}
        trials = plan_session(anchored, **of).trials
        assert trials == plan_session(same, **of).trials
        rest = [trial for trial in trials if trial.virtual_texture == trial.texture]
        assert without_numbers(rest) == without_numbers(plan_session(plain, **of).trials)
        assert [trial.trial for trial in trials] == list(range(1, len(trials) + 1))
        found = [trial for trial in trials if trial.virtual_texture != trial.texture]
        assert sorted((t.texture, t.virtual_texture) for t in found) == sorted(anchors.items())
        assert {(t.phase, t.model) for t in found} == {("main", "full")}  # whatever the day
        first = Counter(trial.first_surface for trial in found)
        assert abs(first["real"] - first["virtual"]) <= 1


@pytest.mark.long("counts places in thousands of orders")
def test_every_place_among_the_others_is_as_likely_for_an_anchor() -> None:
    plan = TaskPlan(participants=20, schedule="interleaved", anchors={"canvas": "PVC"})
    places: Counter[int] = Counter()
    for seed in range(600):
        study = shipped(seed=seed, tasks={"absolute": plan})
        trials = plan_session(study, task="absolute", subject=1, session=1).trials
        (anchor,) = [trial for trial in trials if trial.virtual_texture != trial.texture]
        places[anchor.trial - 2] += 1
    assert set(places) == set(range(1, 16))
    assert stats.chisquare(list(places.values())).pvalue > 0.001


def odd_ones(study: Study, slot: int = 1, subject: int = 1) -> list[Any]:
    trials = plan_session(study, task="oddity", subject=subject, session=1, slot=slot).trials
    return list(trials)


def test_orders_of_the_oddity_task_are_those_of_earlier_versions() -> None:
    """The hash was computed before there were catch trials."""
    trays = {"canvas": "A", "MDF": "B", "PVC": "C"}
    oddity = TaskPlan(participants=6, schedule="interleaved", repeats=6)
    study = Study(
        name="Before", seed=11, textures=tuple(trays), trays=trays, tasks={"oddity": oddity}
    )
    orders = [
        plan_session(study, task="oddity", subject=subject, session=1).to_dict()
        for subject in range(1, 7)
    ]
    assert sha256_of_values({"orders": orders}) == (
        "829afbbac3ad1bab00913449f20cfd32a394a54b3f543f2362456b15d3b061b1"
    )


@settings(max_examples=50)
@given(
    st.integers(0, 2**40),
    st.integers(1, 20),
    st.dictionaries(st.sampled_from(NAMES), st.integers(1, 6), min_size=1),
    st.randoms(use_true_random=False),
)
def test_catch_trials_are_balanced_and_leave_the_rest_as_it_is(
    seed: int, count: int, steps: dict[str, int], shuffled: Random
) -> None:
    catch = {name: NAMES[(NAMES.index(name) + step) % 7] for name, step in steps.items()}
    order = list(catch.items())
    shuffled.shuffle(order)
    plan = TaskPlan(participants=6, schedule="interleaved", repeats=2)
    caught, same, plain = (
        shipped(seed=seed, tasks={"oddity": replace(plan, **said)})
        for said in (
            {"catch": catch, "catch_trials": count},
            {"catch": dict(order), "catch_trials": count},
            {"catch_trials": 0},
        )
    )
    over: Counter[int] = Counter()
    for slot in (1, 2, 3):
        trials = odd_ones(caught, slot, 4)
        assert trials == odd_ones(same, slot, 4)
        assert [trial.trial for trial in trials] == list(range(1, len(trials) + 1))
        rest = [replace(trial, odd_texture="") for trial in trials if not trial.is_catch]
        assert without_numbers(rest) == without_numbers(odd_ones(plain, slot, 4))
        found = [trial for trial in trials if trial.is_catch]
        assert len(found) == count
        assert {(t.phase, t.model, *t.layout) for t in found} == {("main", *["full"] * 4)}
        assert all(t.tray == caught.trays[t.texture] for t in found)
        known = [frozenset(pair) for pair in catch.items()]
        pairs = Counter(frozenset((t.texture, t.odd_texture)) for t in found)
        assert set(pairs) <= set(known)
        if len(set(known)) == len(known):
            assert {pairs[pair] for pair in known} <= {count // len(known), -(-count // len(known))}
        positions = Counter(trial.odd_position for trial in found)
        assert {positions[button] for button in (1, 2, 3)} <= {count // 3, -(-count // 3)}
        swapped = sum(catch.get(t.texture) == t.odd_texture for t in found)
        if not any(catch.get(other) == name for name, other in catch.items()):
            assert abs(2 * swapped - count) <= 1
        over += positions
    assert set(over.values()) == {count}


@pytest.mark.long("counts places in thousands of orders")
def test_every_place_among_the_others_is_as_likely_for_a_catch_trial() -> None:
    plan = TaskPlan(
        participants=6,
        schedule="interleaved",
        repeats=2,
        catch={"canvas": "PVC"},
        catch_trials=1,
    )
    places: Counter[int] = Counter()
    for seed in range(600):
        trials = odd_ones(shipped(seed=seed, tasks={"oddity": plan}))
        (caught,) = [trial for trial in trials if trial.is_catch]
        places[caught.trial - 2] += 1
    assert set(places) == set(range(1, 16))
    assert stats.chisquare(list(places.values())).pvalue > 0.001


def test_six_catch_trials_of_two_pairs_hold_every_button_with_either_surface() -> None:
    plan = TaskPlan(participants=8, schedule="interleaved", repeats=6)
    study = shipped(tasks={**Study.load().tasks, "oddity": plan})
    for slot in range(1, 9):
        found = [trial for trial in odd_ones(study, slot, slot) if trial.is_catch]
        assert len(found) == 6
        catch = study.plan_of("oddity").catch
        of = {frozenset(pair): set() for pair in catch.items()}
        for trial in found:
            of[frozenset((trial.texture, trial.odd_texture))].add(trial.odd_position)
        assert set(map(len, of.values())) == {3}
        assert len({(t.odd_position, t.texture in catch) for t in found}) == 6


def test_an_order_follows_from_study_seed_subject_session_slot_and_task() -> None:
    study = shipped(tasks={"absolute": TaskPlan(participants=20, schedule="by-day")})
    keys = [
        (chosen, task, subject, session, slot)
        for chosen in (study, replace(study, seed=2))
        for task in ("absolute", "relative")
        for subject in (1, 2)
        for session in (1, 2)
        for slot in (1, 2)
    ]

    def order(key: tuple[Study, str, int, int, int]) -> SessionPlan:
        chosen, task, subject, session, slot = key
        return plan_session(chosen, task=task, subject=subject, session=session, slot=slot)

    orders = [order(key) for key in keys]
    assert orders == [order(key) for key in keys]
    sequences = {tuple((t.texture, t.model, t.trial) for t in plan.trials) for plan in orders}
    assert len(sequences) == len(keys)


def test_layouts_are_drawn_anew_for_each_trial() -> None:
    trials = plan_session(shipped(), task="relative", subject=1, session=1).trials
    assert len({trial.layout for trial in trials}) > len(trials) - 3


def test_blocks_share_their_numbers_and_deal_each_place_once() -> None:
    study = shipped()
    found = [
        Occasion.of(study, task="absolute", subject=1, session=1, slot=slot).block(4, "rows")
        for slot in range(1, 9)
    ]
    drawn = [int(rng.integers(2**60)) for rng, _ in found]
    assert len(set(drawn[:4])) == len(set(drawn[4:])) == 1
    assert drawn[0] != drawn[4]
    for block in (found[:4], found[4:]):
        assert sorted(place for _, place in block) == [0, 1, 2, 3]
    occasion = Occasion.of(study, task="absolute", subject=1, session=1, slot=1)
    assert int(occasion.block(4, "other")[0].integers(2**60)) != drawn[0]


@pytest.mark.parametrize(
    ("task", "subject", "session", "slot", "expected", "got"),
    [
        ("absolute", 0, 1, 1, "subject", 0),
        ("absolute", 10_000, 1, 1, "subject", 10000),
        ("absolute", 21, 1, None, ["slot", 1, 20], 21),
        ("absolute", 1, 1, 0, "slot", 0),
        ("absolute", 1, 2, 1, ["session", 1], 2),
        ("relative", 1, 3, 1, ["session", 1, 2], 3),
    ],
)
def test_sessions_that_the_study_has_not_are_refused(
    task: str, subject: int, session: int, slot: int | None, expected: object, got: int
) -> None:
    with refused(InputError, expected=expected, got=got):
        plan_session(shipped(), task=task, subject=subject, session=session, slot=slot)


def test_a_plan_as_plain_values_says_all_of_it() -> None:
    plan = plan_session(shipped(), task="relative", subject=31, session=2, slot=4)
    values = plan.to_dict()
    assert Study.from_dict(values["study"]) == plan.study
    assert [values[name] for name in ("task", "subject", "session", "slot")] == [
        *("relative", 31, 2, 4)
    ]
    assert len(values["trials"]) == 23
    assert values["trials"][5]["layout"] == plan.trials[5].layout
