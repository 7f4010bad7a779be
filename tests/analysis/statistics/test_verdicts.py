"""From answers to claims: what is tested, of whom, and what stands against a verdict."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import partial

import numpy as np
import pandas as pd
import pytest

from tactileq.analysis.answers.plan import AnalysisPlan
from tactileq.analysis.answers.responses import PlannedTask, Responses, leave_out
from tactileq.analysis.chapters.claims.answer import answer
from tactileq.analysis.chapters.claims.plan_sentences import methods_paragraph
from tactileq.analysis.chapters.claims.sentences import claim_sentences
from tactileq.analysis.labels import ALL_TEXTURES
from tactileq.analysis.power.power import verdicts
from tactileq.analysis.statistics.caveats import (
    BOUNDS_WITHHELD,
    EQUALITY,
    INTERIM,
    NOT_TESTED,
    SHOWN,
    WITHHELD,
)
from tactileq.analysis.statistics.compared_answers import (
    all_claims,
    chance_of,
    claim_values,
    pairs_of,
)
from tactileq.analysis.statistics.crossover import CONFOUNDED
from tactileq.analysis.statistics.described_verdicts import (
    check_complete,
    incomplete,
    planted_verdicts,
)
from tactileq.analysis.statistics.equivalence import DIFFERENT, EQUIVALENT, WITHIN_BOUNDS
from tactileq.analysis.statistics.verdicts import ClaimFound, claim_caveats, claims_found
from tactileq.modeling import InputError
from tests.analysis.conftest import words_of
from tests.refusals import refused


def rng() -> np.random.Generator:
    return np.random.default_rng(2)


@pytest.fixture
def answers(ratings, choices, plan, anchors) -> Responses:
    return all_answers(ratings, choices, plan, anchors)


def all_answers(ratings, choices, plan, anchors) -> Responses:
    return Responses(
        {"absolute": ratings, "relative": choices},
        simulated_participants=False,
        simulated_rig=False,
        plan=plan,
        anchors=anchors,
    )


def test_planned_claims_come_first_and_what_nobody_planned_is_exploratory(answers, plan):
    assert all_claims(answers) == plan.claims
    fewer = replace(answers, plan=replace(plan, claims=plan.claims[1:2]))
    claims = all_claims(fewer)
    assert [claim.measure for claim in claims] == [
        *("frequency_similarity", "magnitude_similarity", "correct")
    ]
    assert [claim.planned for claim in claims] == [True, False, False]
    assert [claim.bounds for claim in claims[1:]] == [None, None]
    nobody = replace(answers, answers={"absolute": answers.answers["absolute"].iloc[:0]})
    assert all_claims(nobody) == ()


def test_the_planted_difference_is_found_where_it_is(found):
    for one in found[:2]:
        tests = one.tests.set_index("texture")
        assert tests.loc["PVC", "verdict"] == DIFFERENT
        assert tests.loc["PVC", "mean_difference"] == pytest.approx(
            -30, abs=4 * 8 * (2 / 16) ** 0.5
        )  # errors
        others = tests["verdict"].drop(["PVC", ALL_TEXTURES])
        assert DIFFERENT not in set(others)


def test_any_sets_of_models_are_compared_with_the_first_that_was_planned(answers):
    third = answers.answers["relative"][answers.answers["relative"]["model"] == "full"].assign(
        model="AR"
    )
    three = replace(
        answers,
        answers={"relative": pd.concat([answers.answers["relative"], third])},
        planned={"relative": PlannedTask(16, 16, ("simplified", "AR", "full"), 3)},
        plan=AnalysisPlan(claims=()),
    )
    assert pairs_of(three, "relative") == [("simplified", "AR"), ("simplified", "full")]
    found = claims_found(three, rng=rng())
    assert [one.claim.models for one in found] == pairs_of(three, "relative")
    first, second = (one.tests["mean_difference"].to_numpy() for one in found)
    assert first == pytest.approx(second)  # AR's answers are those of full


def test_who_lacks_one_repeat_is_named(answers):
    gone = answers.answers["relative"][
        (answers.answers["relative"]["participant_id"] == "sub-07")
        & (answers.answers["relative"]["texture"] == "MDF")
    ].index[0]
    cut = replace(answers, answers={"relative": answers.answers["relative"].drop(gone)})
    (one,) = claims_found(cut, rng=rng())
    assert list(incomplete(one)) == [("sub-07", "MDF")]
    tests = one.tests.set_index("texture")
    assert tests.loc[[ALL_TEXTURES, "MDF"], "n"].tolist() == [15, 15]
    same = replace(cut, equal={"MDF": [("full", "simplified")]})
    (one,) = claims_found(same, rng=rng())
    assert list(incomplete(one)) == []  # a control lacks nothing


def test_an_unfinished_task_has_no_verdict(answers):
    begun = replace(answers, planned={"relative": PlannedTask(24, 48, repeats=3)})
    found = claims_found(begun, rng=rng())
    assert set(found[2].tests["verdict"]) == {INTERIM}
    assert found[2].tests["mean_difference"].isna().all()
    assert INTERIM not in set(found[0].tests["verdict"])


@pytest.mark.parametrize(("lower", "told_apart"), [(30.0, True), (0.0, False)])
def test_equality_needs_anchors_that_are_told_apart(answers, lower, told_apart):
    own = answers.answers["absolute"][answers.answers["absolute"]["texture"] == "canvas"]
    noise = rng().normal(0, 6, len(own))
    anchors = own.assign(
        magnitude_similarity=own["magnitude_similarity"] - lower + noise - noise.mean()
    )
    claim = answers.plan.claims[0]
    with_anchors = replace(answers, anchors={"absolute": anchors})
    caveats = claim_caveats(with_anchors, claim, rng=rng())
    assert (caveats.sensitivity == SHOWN) is told_apart
    verdicts = set(claims_found(with_anchors, rng=rng())[0].tests["verdict"])
    assert (WITHHELD in verdicts) is not told_apart
    assert (EQUIVALENT in verdicts) is told_apart
    for none in ({}, {"absolute": anchors.iloc[:0]}):
        caveats = claim_caveats(replace(answers, anchors=none), claim, rng=rng())
        assert caveats.sensitivity == NOT_TESTED


EQUAL = {EQUIVALENT, WITHIN_BOUNDS}


def rated(make, plan, *, anchors: bool) -> Responses:
    """Twenty people rate seven textures with two models; anchors come from the same `make`."""
    rows = pd.DataFrame(
        {"participant_id": f"sub-{person:02d}", "texture": f"t{texture}", "model": model}
        for person in range(20)
        for texture in range(7)
        for model in ("full", "simplified")
    )
    other = (rows["model"] == "simplified").to_numpy()
    own = rows.assign(magnitude_similarity=make(other), frequency_similarity=make(other))
    canvas = rows[(rows["texture"] == "t0") & (rows["model"] == "full")]
    alike = canvas.assign(magnitude_similarity=make(np.zeros(len(canvas))))
    return Responses(
        {"absolute": own},
        simulated_participants=True,
        simulated_rig=True,
        anchors={"absolute": alike} if anchors else {},
        plan=replace(plan, claims=plan.claims[:1], highest_share_at_ends=1.0),
        planned={"absolute": PlannedTask(20, 20)},
    )


def noise(draws: np.random.Generator, other: np.ndarray) -> np.ndarray:
    """What nobody felt: N(50, 8) in place of every rating."""
    return draws.normal(50.0, 8.0, len(other))


def at_the_end(draws: np.random.Generator, other: np.ndarray) -> np.ndarray:
    """A latent difference of −9 points, six ratings of ten at 100."""
    return np.minimum(draws.normal(107.0, 10.0, len(other)) - 9.0 * other, 100.0)


@pytest.mark.parametrize(("world", "withheld"), [(noise, WITHHELD), (at_the_end, BOUNDS_WITHHELD)])
# Without anchors nothing is said, with them what one test in twenty says by chance.
@pytest.mark.parametrize(("anchors", "allowed"), [(False, 0), (True, 2)])
def test_worlds_without_proof_of_sensitivity_are_not_called_equal(
    world, withheld, anchors, allowed, plan
):
    """Of ten studies each: all textures together, each one, and every one at once."""
    draws = np.random.default_rng(3)
    said = []
    for _ in range(10):
        answers = rated(partial(world, draws), plan, anchors=anchors)
        claim = answers.plan.claims[0]
        caveats = claim_caveats(answers, claim, rng=draws)
        values = claim_values(answers, claim)
        found = verdicts(claim, values, n=20, caveats=caveats, rng=draws)
        said.append({one.texture: one.verdict for one in found})
    assert sum(bool(EQUAL & set(one.values())) for one in said) <= allowed
    # The tests alone would have said it.
    assert sum(one[ALL_TEXTURES] == withheld for one in said) >= 10 - allowed - 1


@pytest.mark.parametrize(("world", "told"), [(noise, WITHHELD), (at_the_end, BOUNDS_WITHHELD)])
def test_the_report_on_such_a_world_says_nothing_of_equality(world, told, plan):
    draws = np.random.default_rng(3)
    answers = rated(partial(world, draws), plan, anchors=False)
    found = claims_found(answers, rng=rng())
    assert found[0].tests["verdict"].iloc[0] == told
    sentences = claim_sentences(found[0])
    sentences.append(words_of(answer(found[:1], answers)))
    for sentence in sentences:
        assert NOT_TESTED in sentence
        assert not re.search("TOST|BF₀₁|within (the )?bounds|at once", sentence)
        assert "equivalent" not in sentence.lower().replace("not called equivalent", "")
    assert "sensitivity not tested" in methods_paragraph(answers, found[:1])


def test_equality_of_guesses_is_none(answers):
    """Two models that nobody recognises are equally often right: that says nothing."""
    draws = np.random.default_rng(8)
    guessed = answers.answers["relative"].assign(
        correct=(draws.random(len(answers.answers["relative"])) < 1 / 7).astype(float)
    )
    blind = replace(answers, answers={"relative": guessed})
    caveats = claim_caveats(blind, answers.plan.claims[2], rng=rng())
    assert caveats.sensitivity == "answers on full models were not above chance"
    assert chance_of("relative", guessed) == 1 / 7
    wide = replace(answers.plan.claims[2], bounds=(-0.3, 0.3))
    (one,) = claims_found(replace(blind, plan=AnalysisPlan(claims=(wide,))), rng=rng())
    assert one.tests["verdict"].iloc[0] == WITHHELD


def test_chance_is_one_over_the_alternatives_that_every_trial_has(answers):
    of_three = answers.answers["relative"].assign(layout="a|b|c")
    assert chance_of("relative", of_three) == 1 / 3
    assert np.isnan(chance_of("relative", of_three.assign(layout=np.nan)))
    of_three.loc[of_three.index[0], "layout"] = "a|b"
    with refused(InputError, expected="forced choice", got=[2, 3]):
        chance_of("relative", of_three)


def test_everybody_right_is_above_chance_and_equal(answers):
    always = replace(answers, answers={"relative": answers.answers["relative"].assign(correct=1.0)})
    (one,) = claims_found(always, rng=rng())
    assert one.caveats.sensitivity == SHOWN
    assert set(one.tests["verdict"]) == {EQUIVALENT}
    assert (one.tests["p"] == 1).all()
    assert (one.tests["p_equivalence"] <= 1e-3).all()


def test_the_odd_one_out_is_compared_with_chance(answers, plan):
    draws = np.random.default_rng(5)
    rows = [
        {
            "participant_id": f"sub-{person:02d}",
            "texture": texture,
            "model": odd,
            "layout": "|".join(layout),
            "correct": float(draws.random() < (0.9 if texture == "PVC" else 1 / 3)),
        }
        for person in range(24)
        for texture in ("canvas", "PVC")
        for odd, layout in (
            ("full", ("simplified", "full", "simplified")),
            ("simplified", ("simplified", "full", "full")),
        )
        for _ in range(6)
    ]
    claim = replace(plan.claims[2], task="oddity", bounds=(-0.15, 0.15))
    odd = replace(
        answers,
        answers={"oddity": pd.DataFrame(rows)},
        plan=AnalysisPlan(claims=(claim,)),
        planned={"oddity": PlannedTask(24, 24, repeats=12)},
    )
    values = claim_values(odd, claim).table
    assert values["reference"].unique() == pytest.approx([1 / 3])
    (one,) = claims_found(odd, rng=rng())
    verdicts = one.tests.set_index("texture")["verdict"]
    # Nothing in this task shows that a difference would have been felt.
    assert one.caveats.sensitivity == NOT_TESTED
    assert verdicts[["canvas", "PVC"]].tolist() == [WITHHELD, DIFFERENT]
    assert (one.tests["n"] == 24).all()


@pytest.mark.parametrize(
    ("right", "shown"), [(1.0, True), (0.6, True), (1 / 3, False), (0.0, False)]
)
def test_catch_trials_show_that_the_odd_one_would_have_been_found(answers, plan, right, shown):
    """Six catch trials each of 24 people; the same share of right answers, with some spread."""
    claim = replace(plan.claims[2], task="oddity", bounds=(-0.15, 0.15))
    draws = np.random.default_rng(7)
    # Numbers of right answers that scatter about the share, and have exactly its mean.
    spread = draws.permutation([-1, 0, 1] * 8) * (0 < right < 1)
    numbers = np.round(6 * right).astype(int) + spread
    caught = pd.DataFrame(
        {"participant_id": f"sub-{person:02d}", "correct": float(trial < number)}
        for person, number in enumerate(numbers)
        for trial in range(6)
    )
    here = replace(
        answers,
        answers={"oddity": caught.assign(texture="canvas", model="full")},
        anchors={"oddity": caught},
        plan=AnalysisPlan(claims=(claim,)),
        planned={"oddity": PlannedTask(24, 24, repeats=6)},
    )
    found = claim_caveats(here, claim, rng=rng()).sensitivity
    assert (found == SHOWN) is shown
    assert found != NOT_TESTED
    if not shown:
        assert "catch trials" in found
    nothing = {"oddity": caught.iloc[:0], "absolute": caught}
    for none in ({}, nothing):
        caveats = claim_caveats(replace(here, anchors=none), claim, rng=rng())
        assert caveats.sensitivity == NOT_TESTED


def test_verdicts_stand_beside_what_was_planted(found):
    points = {texture: {"magnitude_similarity": 0.0} for texture in found[0].values["texture"]}
    points["PVC"] = {"magnitude_similarity": -30.0}
    table = planted_verdicts(found, points)
    assert set(table["claim"]) == {found[0].claim.name}
    by = table.set_index("texture")
    assert by.loc[ALL_TEXTURES, "planted"] == pytest.approx(-30 / 7)
    assert by.loc["PVC", ["planted", "agreement"]].tolist() == [-30.0, "agrees"]
    assert "contradicts" not in set(table["agreement"])
    turned = planted_verdicts(found, points | {"PVC": {"magnitude_similarity": 0.0}})
    assert turned.set_index("texture").loc["PVC", "agreement"] == "contradicts"


def test_incomplete_pairs_are_refused_and_named(answers):
    check_complete(answers)
    gone = answers.answers["relative"]["participant_id"].isin(["sub-03", "sub-09"])
    gone &= answers.answers["relative"]["model"] == "full"
    cut = replace(
        answers, answers={**answers.answers, "relative": answers.answers["relative"][~gone]}
    )
    with refused(
        InputError, got=["sub-03", "forced choice", "canvas", "sub-09", "--exclude", "--complete"]
    ):
        check_complete(cut)
    check_complete(leave_out(cut, {"sub-03": "left", "sub-09": "left"}))


def test_who_is_left_out_by_hand_is_gone_and_told(answers):
    fewer = leave_out(answers, {"sub-03": "fell asleep"})
    for table in fewer.answers.values():
        assert "sub-03" not in set(table["participant_id"])
        assert table["participant_id"].nunique() == 15
    planned = {"relative": PlannedTask(16, 16, repeats=3)}
    assert replace(fewer, planned=planned).unfinished == ()
    assert replace(fewer, planned=planned).done("relative").participants == 15
    assert fewer.warnings == ("sub-03 was left out by hand: fell asleep.",)
    for who, why in (("sub-99", "?"), ("sub-03", " ")):
        with refused(InputError, expected=["participant", "reason"], got=[f"'{who}'", f"'{why}'"]):
            leave_out(answers, {who: why})


def by_model(answers: Responses, **changes: object) -> Responses:
    """The same answers under a plan that names the model of the participants."""
    changes = {"rule": "hierarchical", **changes}
    plan = replace(answers.plan, claims=answers.plan.claims[:1], **changes)
    return replace(answers, plan=plan)


@pytest.fixture(scope="module")
def judged_once(ratings, choices, plan, anchors) -> list[ClaimFound]:
    """What the model says of the answers, sampled once."""
    return claims_found(by_model(all_answers(ratings, choices, plan, anchors)), rng=rng())


def test_the_plan_names_the_rule_that_decides(answers, judged_once):
    tested = claims_found(answers, rng=rng())[0]
    judged = judged_once[0]
    assert tested.people is None
    assert set(tested.tests["rule"]) == {"tests"}
    assert judged.people is not None
    # What the tests say stays beside it, with the same p values.
    same = [*("t", "p", "p_equivalence", "mean_difference"), "n"]
    pd.testing.assert_frame_equal(judged.tests[same], tested.tests[same])
    assert judged.tests["tests_verdict"].tolist() == tested.tests["verdict"].tolist()
    overall = judged.tests.iloc[0]
    assert overall["verdict"] == judged.people.summary.verdict(judged.claim.bounds)
    assert overall["model_low"] < overall["model_mean"] < overall["model_high"]
    assert overall["model_mean"] == pytest.approx(overall["mean_difference"], abs=2.0)
    assert 0 <= overall["people_sd_low"] <= overall["people_sd"] <= overall["people_sd_high"]
    assert judged.by_model
    assert sorted(judged.people.people["participant_id"]) == sorted(
        answers.answers["absolute"]["participant_id"].unique()
    )
    textures = judged.tests.set_index("texture")
    assert textures.loc["PVC", "verdict"] == DIFFERENT  # 30 points are planted there
    assert textures.loc["PVC", "model_high"] < 0
    assert "exploratory" not in set(judged.tests["planned"])
    # Measures that nobody planned a claim about are tested as before.
    assert len(judged_once) == 3
    assert all(one.people is None for one in judged_once[1:])


def test_the_model_calls_nothing_equal_without_proof_of_sensitivity(answers):
    blind = claims_found(replace(by_model(answers), anchors={}), rng=rng())[0]
    assert not set(blind.tests["verdict"]) & set(EQUALITY)
    assert blind.tests["doubt"].iloc[0] == NOT_TESTED


def test_the_same_seed_gives_the_same_verdicts_of_the_model(answers, judged_once):
    first, again = judged_once[0], claims_found(by_model(answers), rng=rng())[0]
    pd.testing.assert_frame_equal(first.tests, again.tests)
    pd.testing.assert_frame_equal(first.people.people, again.people.people)


def test_fewer_than_eight_people_are_left_to_the_tests(answers):
    few = sorted(answers.answers["absolute"]["participant_id"].unique())[:7]
    kept = answers.answers["absolute"]["participant_id"].isin(few)
    small = replace(by_model(answers), answers={"absolute": answers.answers["absolute"][kept]})
    (one, *_) = claims_found(small, rng=rng())
    assert one.people is None
    assert set(one.tests["rule"]) == {"tests"}


def test_a_plan_with_the_rule_that_was_withdrawn_keeps_its_tests(answers, judged_once):
    """The model stands beside them and changes no verdict."""
    (old,) = claims_found(by_model(answers, rule="model"), rng=rng())[:1]
    (tested,) = claims_found(answers, rng=rng())[:1]
    assert not old.by_model
    assert set(old.tests["rule"]) == {"tests"}
    assert old.tests["verdict"].tolist() == tested.tests["verdict"].tolist()
    assert old.people is not None
    assert old.tests["model_verdict"].tolist() == judged_once[0].tests["model_verdict"].tolist()


def on_days(table: pd.DataFrame, *, first: int, day: float) -> pd.DataFrame:
    """Each model on a day of its own; so many people begin with the full ones."""
    names = sorted(table["participant_id"].unique())
    begins = table["participant_id"].isin(names[:first])
    second = (table["model"] == "full") != begins
    later = {"session": np.where(second, "ses-02", "ses-01")}
    for scale in ("magnitude_similarity", "frequency_similarity"):
        later[scale] = np.clip(table[scale] + day * second, 0, 100)
    return table.assign(**later)


@pytest.mark.parametrize(("first", "decides"), [(8, True), (11, False)])
def test_models_on_different_days_are_told_apart_from_them(answers, first, decides):
    """16 points from day to day: in unequal groups the plain mean would hold six of them."""
    plain = claims_found(answers, rng=rng())[0].tests.iloc[0]
    moved = on_days(answers.answers["absolute"], first=first, day=16.0)
    found = claims_found(replace(by_model(answers), answers={"absolute": moved}), rng=rng())[0]
    row = found.tests.iloc[0]
    assert found.by_day
    assert found.by_model is decides
    assert row["df"] == row["n"] - 2
    assert row["mean_difference"] == pytest.approx(plain["mean_difference"], abs=1.0)
    shift = row["mean_other"] - row["mean_reference"] - plain["mean_difference"]
    assert shift == pytest.approx(16.0 * (2 * first - 16) / 16, abs=1.0)
    assert row["model_mean"] == pytest.approx(plain["mean_difference"], abs=3.0)


def test_everybody_in_the_same_order_is_no_test(answers):
    moved = on_days(answers.answers["absolute"], first=16, day=5.0)
    (found, *_) = claims_found(replace(answers, answers={"absolute": moved}), rng=rng())
    assert (found.tests["verdict"] == "").all()
    assert found.tests[["p", "p_equivalence", "mean_difference", "ci_low"]].isna().all(axis=None)
    assert set(found.tests["note"]) == {CONFOUNDED}


def test_people_are_counted_where_repeats_suffice_and_only_there(answers):
    """Sixteen people of whom the first three feel 40 points, with 12 repeats of each texture."""
    own = answers.answers["absolute"]
    once = own.assign(repeat=0)
    many = pd.concat([once.assign(repeat=k) for k in range(12)], ignore_index=True)
    feels = many["participant_id"].isin(["sub-01", "sub-02", "sub-03"])
    lower = 40.0 * (feels & (many["model"] == "simplified"))
    noise = rng().normal(0, 6.0, len(many))
    many["magnitude_similarity"] = np.clip(70 - lower + noise, 0, 100)
    found = claims_found(replace(answers, answers={"absolute": many}), rng=rng())[0]
    count = found.people_count
    assert (count.beyond, count.people, count.repeats) == (3, 16, 12)
    assert count.needed <= 12
    once_only = claims_found(answers, rng=rng())[0].people_count
    assert once_only.repeats == 1 < once_only.needed
    assert once_only.people == 0
    assert claims_found(answers, rng=rng())[2].people_count is None  # of right answers by model


def test_a_texture_that_nobody_rated_with_a_model_has_no_verdict(answers):
    own = answers.answers["absolute"]
    gone = (own["texture"] == "MDF") & (own["model"] == "simplified")
    cut = replace(by_model(answers), answers={"absolute": own[~gone]})
    (found, *_) = claims_found(cut, rng=rng())
    table = found.tests.set_index("texture")
    assert found.by_model
    assert table.loc["MDF", "verdict"] == table.loc["MDF", "model_verdict"] == ""
    assert np.isnan(table.loc["MDF", "model_mean"])
    assert table.loc[ALL_TEXTURES, "verdict"]  # of the others
    assert len(found.people.people) == 16
