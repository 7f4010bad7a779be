"""Observers to verdicts in memory: sizes, effects, and the same table whoever works on it."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pandas as pd
import pytest

from tactileq.analysis.answers.loading import load_responses
from tactileq.analysis.labels import ALL_TEXTURES
from tactileq.analysis.power.power import EVERY_TEXTURE, POWER_COLUMNS, judged_claims
from tactileq.analysis.statistics.caveats import WITHHELD
from tactileq.analysis.statistics.compared_answers import claim_values
from tactileq.analysis.statistics.equivalence import (
    DIFFERENT,
    EQUIVALENT,
    INCONCLUSIVE,
    WITHIN_BOUNDS,
)
from tactileq.analysis.statistics.participants.posterior import Effort
from tactileq.analysis.statistics.verdicts import people_data
from tactileq.benches.power.in_memory import (
    SimulatedStudy,
    people_of,
    planned_for,
    responses_of,
    simulated_verdicts,
)
from tactileq.benches.validation.procedures import cells, simulate_cell
from tactileq.commands.study.chances import chances
from tactileq.commands.study.power import planted_effects, sizes_of
from tactileq.experiments.observers.in_memory import simulate_sessions
from tactileq.experiments.observers.whole_study import simulate_study
from tactileq.experiments.study.models import ModelSets
from tactileq.experiments.study.study import Study
from tactileq.experiments.study.task_plan import TaskPlan
from tactileq.modeling import InputError, Threshold, simplify
from tactileq.modeling.files.claims import ClaimSection, PlanSection
from tactileq.rig.desk.twin import SimulatedRig
from tactileq.stimuli.planted.textures import planted_texture
from tactileq.workers import working
from tests.refusals import refused

TEXTURES = ("canvas", "PVC")
RATED = ClaimSection(
    name="rated the same",
    task="absolute",
    measure="magnitude_similarity",
    models=("full", "simplified"),
    bounds=(-7.5, 7.5),
    test="equivalence",
)
BRIEF = Effort(chains=1, warm_up=20, steps=40, every=2)
ODD = replace(RATED, name="no odd one", task="oddity", measure="correct", bounds=(-0.2, 0.2))


@pytest.fixture(scope="module")
def study() -> Study:
    return Study(
        name="Two textures",
        seed=5,
        textures=TEXTURES,
        trays={"canvas": "A", "PVC": "B"},
        tasks={
            "absolute": TaskPlan(
                participants=4, schedule="interleaved", anchors={"canvas": "PVC"}, repeats=2
            ),
            "oddity": TaskPlan(participants=4, schedule="interleaved", repeats=6),
        },
        plan=PlanSection(claims=(RATED, ODD)),
    )


@pytest.fixture(scope="module")
def models() -> ModelSets:
    truths = {texture: planted_texture(texture) for texture in TEXTURES}
    codec = Threshold.named("codec")
    fewer = {
        texture: simplify(model, codec, criterion="paper-fft").model
        for texture, model in truths.items()
    }
    return ModelSets(sets={"full": truths, "simplified": fewer})


def people(study: Study, models: ModelSets, *, most: int, points: float = 0.0) -> SimulatedStudy:
    planted = planted_effects([f"magnitude_similarity={points:g}"], TEXTURES)
    return people_of(planned_for(study, [most]), models, threshold="codec", planted=planted)


def by_model(study: Study, *claims: ClaimSection) -> Study:
    """The study with enough people for the model of the participants, which decides."""
    eight = {task: replace(plan, participants=8) for task, plan in study.tasks.items()}
    return replace(study, tasks=eight, plan=PlanSection(claims=claims, rule="hierarchical"))


def chance(table: pd.DataFrame, claim: str, texture: str, *, n: int, verdict: str) -> float:
    rows = table[(table["claim"] == claim) & (table["texture"] == texture)]
    (row,) = rows[(rows["n"] == n) & (rows["verdict"] == verdict)]["chance"]
    return float(row)


def test_any_number_of_workers_gives_the_same_tables(study: Study, models: ModelSets):
    who = people(study, models, most=8)
    tables = [chances(who, (4, 8), simulations=2, seed=3, jobs=jobs) for jobs in (1, 2)]
    assert tables[0].equals(tables[1])
    assert list(tables[0]) == [column.name for column in POWER_COLUMNS]
    work = partial(simulate_cell, simulations=40, seed=7)
    rows = cells(["TOST, no guard on ends"], sizes=[8])
    found = []
    for jobs in (1, 2):
        with working(work, rows, jobs=jobs) as done:
            found.append(dict(done))
    assert found[0] == found[1]


def test_the_rule_of_the_plan_decides_with_any_number_of_workers(study: Study, models: ModelSets):
    who = people(by_model(study, RATED, ODD), models, most=10)
    tables = [
        chances(who, (8, 10), simulations=2, seed=3, jobs=jobs, effort=BRIEF) for jobs in (1, 2)
    ]
    assert tables[0].equals(tables[1])
    table = tables[0]
    places = {ALL_TEXTURES, *TEXTURES, EVERY_TEXTURE}
    for claim in (RATED, ODD):
        of_claim = table[table["claim"] == claim.name]
        assert set(of_claim["texture"]) == places
        overall = of_claim[of_claim["texture"] == ALL_TEXTURES]
        assert list(overall.groupby("n")["hits"].sum()) == [2, 2]


def test_a_planted_difference_is_found_by_the_model(study: Study, models: ModelSets):
    for points, found in ((0.0, {EQUIVALENT, INCONCLUSIVE}), (-25.0, {DIFFERENT})):
        who = people(by_model(study, RATED), models, most=16, points=points)
        table = chances(
            who, (16,), simulations=3, seed=1, jobs=1, effort=replace(BRIEF, warm_up=100, steps=100)
        )
        overall = table[table["texture"] == ALL_TEXTURES]
        assert set(overall["verdict"][overall["hits"] >= 1]) <= found


def test_claims_are_sampled_together_as_they_are_planned(study: Study, models: ModelSets):
    frequency = replace(RATED, name="frequency", measure="frequency_similarity")
    tight = replace(RATED, name="tight", bounds=(-2.0, 2.0))
    who = people(by_model(study, RATED, frequency, tight), models, most=10, points=-25.0)
    rows = simulate_sessions(
        who.study,
        models=who.models,
        perception=who.perception,
        psychometrics=who.psychometrics,
        seed=1,
        tasks=who.tasks,
    )
    by_size = {n: responses_of(who, rows, n=n) for n in (8, 10)}
    judged = judged_claims(by_size, rng=np.random.default_rng(2), effort=BRIEF)
    means = {key: one.summary.mean for key, one in judged.items()}
    assert set(means) == {(one, n) for one in (RATED.name, "frequency", "tight") for n in (8, 10)}
    for n in (8, 10):
        assert means[RATED.name, n] < -15 < means["frequency", n]
        assert means["tight", n] == pytest.approx(means[RATED.name, n], abs=6)
    none = replace(by_size[10], plan=replace(by_size[10].plan, rule="tests"))
    assert judged_claims({10: none}, rng=np.random.default_rng(2)) == {}
    # What is left out of the larger study leaves the answers of a smaller one.
    first, small = (people_data(by_size[n], by_size[n].plan.claims[0]) for n in (10, 8))
    assert first is not None
    assert small is not None
    np.testing.assert_array_equal(first.studies.values[:, :8], small.studies.values)
    np.testing.assert_array_equal(first.studies.trends[:, :, :8], small.studies.trends)
    np.testing.assert_array_equal(first.studies.anchors[:, :8], small.studies.anchors)


def test_a_first_answer_comes_before_all_simulations_are_done(
    study: Study, models: ModelSets, monkeypatch: pytest.MonkeyPatch
) -> None:
    who, sizes = people(study, models, most=6), (4, 6)
    heard: list[tuple[pd.DataFrame, float]] = []
    monkeypatch.setattr("tactileq.commands.study.chances.FIRST_ANSWER_S", 0.0)

    def run(simulations: int) -> pd.DataFrame:
        def hear(table: pd.DataFrame, left_s: float) -> None:
            heard.append((table, left_s))

        return chances(who, sizes, simulations=simulations, seed=1, jobs=1, first=hear)

    run(3)
    ((table, left_s),) = heard
    pd.testing.assert_frame_equal(table, run(2))
    assert left_s > 0
    monkeypatch.setattr("tactileq.commands.study.chances.FIRST_ANSWER_S", 3600.0)
    run(3)
    assert len(heard) == 1


def test_the_first_n_are_a_study_planned_for_n(study: Study, models: ModelSets):
    larger = simulated_verdicts(people(study, models, most=8), (4, 8), 0, seed=2)
    smaller = simulated_verdicts(people(study, models, most=4), (4,), 0, seed=2)
    assert [one for one in larger if one.n == 4] == smaller
    assert {one.texture for one in smaller} == {ALL_TEXTURES, *TEXTURES, EVERY_TEXTURE}
    assert {one.claim for one in smaller} == {RATED.name, ODD.name}


def test_a_planted_difference_is_found_and_none_is_called_equivalent(
    study: Study, models: ModelSets
):
    tables = {
        points: chances(
            people(study, models, most=12, points=points), (4, 12), simulations=8, seed=1, jobs=1
        )
        for points in (0.0, -25.0)
    }
    known = {"texture": ALL_TEXTURES, "n": 12, "claim": RATED.name}
    assert chance(tables[0.0], **known, verdict="equivalent") > 0.7
    assert chance(tables[-25.0], **known, verdict="different") > 0.7
    of_four = chance(tables[0.0], RATED.name, ALL_TEXTURES, n=4, verdict="inconclusive")
    assert of_four > chance(tables[0.0], **known, verdict="inconclusive")
    # Nothing in this task shows that a difference would have been felt.
    odd = tables[0.0][(tables[0.0]["claim"] == ODD.name) & (tables[0.0]["hits"] > 0)]
    assert WITHHELD in set(odd["verdict"])
    assert not {EQUIVALENT, WITHIN_BOUNDS} & set(odd["verdict"])


def test_without_anchors_equalities_are_counted_as_withheld(study: Study, models: ModelSets):
    bare = replace(study.plan_of("absolute"), anchors={})
    plain = replace(study, plan=PlanSection(claims=(RATED,)), tasks={"absolute": bare})
    table = chances(people(plain, models, most=12), (12,), simulations=6, seed=1, jobs=1)
    known = {"texture": ALL_TEXTURES, "n": 12, "claim": RATED.name}
    assert chance(table, **known, verdict=WITHHELD) > 0.6
    assert not {EQUIVALENT, WITHIN_BOUNDS} & set(table[table["hits"] > 0]["verdict"])


def test_with_catch_trials_an_equality_of_the_odd_one_can_be_concluded(
    study: Study, models: ModelSets
):
    caught = replace(study.plan_of("oddity"), catch={"canvas": "PVC"}, catch_trials=6)
    tasks = {"absolute": study.plan_of("absolute"), "oddity": caught}
    with_catch = replace(study, plan=PlanSection(claims=(ODD,)), tasks=tasks)
    planted = [f"{scale}=0" for scale in ("magnitude_similarity", "frequency_similarity")]
    who = people_of(
        planned_for(with_catch, [12]),
        models,
        threshold="codec",
        planted=planted_effects(planted, TEXTURES),
    )
    table = chances(who, (12,), simulations=6, seed=1, jobs=1)
    verdicts = set(table[table["hits"] > 0]["verdict"])
    assert EQUIVALENT in verdicts
    assert WITHHELD not in verdicts


def test_answers_in_memory_are_those_of_the_disk(tmp_path, study: Study, models: ModelSets):
    who = people(study, models, most=4)
    parts = {"models": models, "psychometrics": who.psychometrics, "seed": 9}
    rows = simulate_sessions(who.study, perception=who.perception, **parts)
    real = {texture: planted_texture(texture) for texture in TEXTURES}
    simulate_study(
        who.study,
        real=real,
        rig=SimulatedRig(real, seed=9),
        data_folder=tmp_path / "data",
        threshold=Threshold.named("codec"),
        **parts,
    )
    stored = load_responses(tmp_path / "data")
    kept = responses_of(who, {task: rows[task] for task in who.tasks}, n=4)
    assert kept.plan.claims == stored.plan.claims
    assert kept.unfinished == stored.unfinished == ()
    assert {task: kept.planned[task] for task in who.tasks} == {
        task: stored.planned[task] for task in who.tasks
    }
    assert len(kept.anchors["absolute"]) == len(stored.anchors["absolute"]) == 4
    for claim in kept.plan.claims:
        tables = []
        for responses in (kept, stored):
            values = claim_values(responses, claim)
            numbers = values.table[["reference", "other"]].reset_index(drop=True)
            tables.append((numbers, values.share_at_ends))
        pd.testing.assert_frame_equal(tables[0][0], tables[1][0], atol=1e-9)
        assert tables[0][1] == tables[1][1]


@pytest.mark.parametrize(
    ("text", "sizes"),
    [("8,24,8", (8, 16, 24)), ("8,23,8", (8, 16)), ("[36,8]", (8, 36)), ("20", (20,))],
)
def test_sizes_are_a_range_or_a_list(text: str, sizes: tuple[int, ...]):
    assert sizes_of(text) == sizes


@pytest.mark.parametrize("text", ["", "8,24", "8;24;8", "1,9,2", "8,24,0", "24,8,4", "[]", "[8,a]"])
def test_other_sizes_are_refused(text: str):
    with refused(ValueError, expected=["participants", 2, 9999], got=[repr(text), "--subjects"]):
        sizes_of(text)


def test_effects_are_planted_in_one_texture_or_in_all():
    assert planted_effects(["choice=-2", "PVC:magnitude_similarity=3.5"], TEXTURES) == {
        "canvas": {"choice": -2.0},
        "PVC": {"choice": -2.0, "magnitude_similarity": 3.5},
    }
    assert planted_effects([], TEXTURES) == {}


@pytest.mark.parametrize(
    "text", ["choice", "choice=", "choice=far", "loudness=3", "silk:choice=3", "=3", "PVC=3"]
)
def test_other_effects_are_refused(text: str):
    with refused(
        ValueError, expected=["--effect", *TEXTURES, "magnitude_similarity"], got=repr(text)
    ):
        planted_effects([text], TEXTURES)


def test_what_cannot_be_planned_is_refused(study: Study, models: ModelSets):
    with refused(ValueError, expected=["claims", "[[plan.claims]]"], got="none"):
        planned_for(replace(study, plan=PlanSection()), [4])
    by_day = {**study.tasks, "absolute": TaskPlan(participants=4, schedule="by-day")}
    with refused(InputError, expected=["even", "by-day", "[absolute]"], got=7):
        planned_for(replace(study, tasks=by_day), [4, 7])
    rule = replace(
        study, plan=PlanSection(claims=(RATED,), rule="hierarchical"), tasks=by_model(study).tasks
    )
    with refused(ValueError, expected=[8, "participants", "hierarchical"], got=[6, "--subjects"]):
        planned_for(rule, [6, 12])
    with refused(InputError, expected=["magnitude_similarity", "canvas"], got=200.0):
        people(study, models, most=4, points=200.0)
    trays = {"silk": "A", "PVC": "B"}
    silk = replace(study, textures=tuple(trays), trays=trays, tasks={}, plan=PlanSection())
    with refused(ValueError, expected=["planted", "aluminum", "wall paper"], got="silk"):
        people_of(silk, models, threshold="codec", planted={})
