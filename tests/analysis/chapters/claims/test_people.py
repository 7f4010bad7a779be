"""What is said of people, and of the model that tells it: as far as the data can tell."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tactileq.analysis.answers.plan import MODEL_RULE
from tactileq.analysis.answers.responses import PlannedTask, Responses
from tactileq.analysis.chapters.claims.answer import answer
from tactileq.analysis.chapters.claims.model_sentences import decided_by_tests
from tactileq.analysis.chapters.claims.people import (
    DOUBLED,
    OWN,
    people_items,
    people_table,
    priors_table,
)
from tactileq.analysis.chapters.claims.people_sentences import do_people_differ, how_many
from tactileq.analysis.chapters.claims.plan_sentences import deviations, methods_paragraph
from tactileq.analysis.chapters.claims.section import sections
from tactileq.analysis.chapters.claims.sentences import claim_in_short, claim_sentences
from tactileq.analysis.page.page import Fold
from tactileq.analysis.report.report import write_report
from tactileq.analysis.statistics.caveats import INTERIM, NOT_CONVERGED, WITHHELD
from tactileq.analysis.statistics.equivalence import (
    DIFFERENT,
    EQUIVALENT,
    INCONCLUSIVE,
    WITHIN_BOUNDS,
)
from tactileq.analysis.statistics.participants.posterior import Effort
from tactileq.analysis.statistics.participants.verdict import PeopleSummary
from tactileq.analysis.statistics.people import PeopleCount
from tactileq.analysis.statistics.verdicts import ClaimFound, claims_found, overall_row
from tactileq.modeling.files.claims import WITHDRAWN
from tactileq.modeling.files.writing import file_stem
from tactileq.modeling.participants.ratings import RatingPriors
from tests.analysis.conftest import answered_of, by_model, people_summary, rating_table, words_of

pytestmark = pytest.mark.usefixtures("few_draws")

ROOT = Path(__file__).parents[4]
SUMMARIES = {
    EQUIVALENT: people_summary(mean=(-0.4, -1.2, 0.4)),
    WITHIN_BOUNDS: people_summary(mean=(3.0, 1.0, 5.0)),
    DIFFERENT: people_summary(mean=(6.0, 2.0, 9.0)),
    INCONCLUSIVE: people_summary(mean=(4.0, -3.0, 11.0)),
}
# The mean, and the interval on which the verdict rests.
SAID = {
    EQUIVALENT: ("0.4 points of 100 lower", "90% CI −1.2 to +0.4"),
    WITHIN_BOUNDS: ("3.0 points of 100 higher", "95% CI +1.0 to +5.0"),
    DIFFERENT: ("6.0 points of 100 higher", "95% CI +2.0 to +9.0", "open"),
    INCONCLUSIVE: ("4.0 points of 100 higher", "95% CI −3.0 to +11.0"),
}


@pytest.fixture(scope="module")
def one(found) -> ClaimFound:
    """The claim about vibration magnitude, by its tests."""
    return found[0]


@pytest.fixture(scope="module")
def responses(ratings, choices, plan) -> Responses:
    return Responses(
        {"absolute": ratings, "relative": choices},
        simulated_participants=False,
        simulated_rig=False,
        plan=replace(plan, rule=MODEL_RULE),
    )


def doubted(one: ClaimFound, summary: PeopleSummary) -> ClaimFound:
    """The same of people who were not shown to tell surfaces apart."""
    failed = replace(
        one,
        caveats=replace(one.caveats, sensitivity="anchors failed"),
        tests=one.tests.assign(doubt="anchors failed"),
    )
    return by_model(failed, summary)


def told(one: ClaimFound) -> str:
    row = overall_row(one)
    assert row is not None
    return claim_in_short(one, row, what="magnitude")


def of_people(one: ClaimFound) -> str:
    row = overall_row(one)
    assert row is not None
    return do_people_differ(one, row)


@pytest.mark.parametrize("verdict", SUMMARIES)
def test_the_answer_says_the_mean_with_the_interval_that_decides(one, responses, verdict):
    judged = by_model(one, SUMMARIES[verdict])
    row = overall_row(judged)
    assert row is not None
    assert row["verdict"] == verdict
    sentence = words_of(answer([judged], responses))
    for part in (*SAID[verdict], "allowed ±7.5"):
        assert part in sentence, part
    first, *_ = claim_sentences(judged)
    assert f": {verdict}; paired tests: " in first
    assert "TOST" in first


def test_a_difference_beyond_the_bounds_is_too_large_and_one_at_them_open(one):
    beyond, at = (
        told(by_model(one, people_summary(mean=mean)))
        for mean in ((12.0, 9.0, 15.0), (8.0, 7.0, 9.0))
    )
    assert "larger than allowed" in beyond
    assert "open" not in beyond
    assert "open" in at


def test_which_textures_differ_is_told_beside_those_that_do_not(one):
    judged = by_model(one, SUMMARIES[DIFFERENT])
    tests = judged.tests.copy()
    tests.loc[tests["texture"].isin(["aluminum", "canvas"]), "verdict"] = INCONCLUSIVE
    sentence = told(replace(judged, tests=tests))
    assert "It comes from" in sentence
    assert "PVC (+6.0)" in sentence
    assert "aluminum, canvas show none" in sentence
    tests.loc[tests.index[1:], "verdict"] = INCONCLUSIVE
    assert "No single texture" in told(replace(judged, tests=tests))
    assert "texture" not in told(by_model(one, SUMMARIES[EQUIVALENT])).split("Do people")[0]


def test_equality_is_withheld_with_the_reason(one):
    withheld = doubted(one, SUMMARIES[EQUIVALENT])
    assert withheld.tests.iloc[0]["verdict"] == WITHHELD
    for sentence in (told(withheld), claim_sentences(withheld)[0]):
        assert "anchors failed" in sentence
        assert "equivalent" not in sentence.replace("not called equivalent", "").replace(
            WITHHELD, ""
        )


def test_nothing_is_said_of_a_posterior_that_did_not_converge(one):
    stuck = by_model(one, replace(SUMMARIES[EQUIVALENT], converged=False))
    assert set(stuck.tests["verdict"]) == {NOT_CONVERGED}
    assert stuck.tests[["model_mean", "model_low", "people_sd", "p_of_model"]].isna().all(axis=None)
    assert "CI" not in told(stuck)
    assert "--seed" in told(stuck)


def test_a_verdict_that_wider_priors_would_turn_says_so_at_once(one):
    wide = people_summary(mean=(-0.6, -1.6, 7.6))
    judged = by_model(one, SUMMARIES[EQUIVALENT], doubled=wide)
    assert f"“{INCONCLUSIVE}”" in told(judged)
    assert "priors" not in told(by_model(one, SUMMARIES[EQUIVALENT]))
    table = priors_table([judged])
    assert list(table["priors"]) == [OWN, DOUBLED]
    assert list(table["verdict"]) == [EQUIVALENT, INCONCLUSIVE]
    withheld = priors_table([doubted(one, SUMMARIES[EQUIVALENT])])
    assert list(withheld["verdict"]) == [WITHHELD] * 2


def test_the_sd_between_people_is_at_most_its_limit_where_it_may_be_none(one):
    near = of_people(by_model(one, people_summary(sd=(2.0, 0.1, 5.4))))
    assert "at most 5.4 points" in near
    away = of_people(by_model(one, people_summary(sd=(4.0, 2.5, 6.1))))
    assert "4.0 points of 100 (95% CI 2.5 to 6.1)" in away
    days = replace(by_model(one, people_summary()), by_day=True)
    assert "SD of people and days" in of_people(days)
    unknown = of_people(by_model(one, people_summary(sd=(float("nan"),) * 3)))
    assert "SD" not in unknown


@pytest.mark.parametrize(("p", "shown"), [(0.3, "Not shown"), (0.001, "Shown")])
def test_that_people_differ_is_said_by_the_f_test(one, p, shown):
    judged = by_model(one, people_summary())
    judged = replace(judged, tests=judged.tests.assign(people_p=p))
    assert f"Do people differ? {shown} (F(15, 90)" in of_people(judged)


def test_people_are_counted_only_where_the_design_can_tell(one, found):
    few = replace(one, people_count=PeopleCount(repeats=2, needed=9))
    assert "(9 are needed)" in how_many(few)
    assert "Holm" not in how_many(few)
    enough = replace(one, people_count=PeopleCount(repeats=9, needed=9, beyond=3, people=16))
    assert how_many(enough).startswith("3 of 16 participants are shown to differ")
    nobody = replace(one, people_count=PeopleCount(repeats=9, needed=9, beyond=0, people=16))
    assert how_many(nobody).startswith("0 of 16 participants are shown to differ")
    assert how_many(nobody, doubt="anchors failed") == ""
    assert how_many(enough, doubt="anchors failed").startswith("3 of 16")
    days = replace(one, people_count=PeopleCount(repeats=9, needed=9, by_day=True))
    assert "days" in how_many(days)
    assert how_many(replace(found[2], people_count=None)) == ""
    assert of_people(found[2]) == ""  # right answers by model say nothing of single people


def test_an_unfinished_task_shows_no_effect_whatever_the_rule(responses):
    begun = replace(responses, planned={"absolute": PlannedTask(24, 24, repeats=1)})
    begun = replace(begun, answers={"absolute": responses.answers["absolute"]})
    judged = claims_found(begun, rng=np.random.default_rng(1))
    assert {one.tests.iloc[0]["verdict"] for one in judged} == {INTERIM}
    assert all(one.people is None and one.people_count is None for one in judged)
    said = words_of(answer(judged, begun))
    assert said
    assert "CI" not in said
    assert "people" not in said
    assert people_items([one for one in judged if not one.caveats.unfinished], simulated=True) == ()


def test_that_tests_say_something_else_is_said_with_the_reasons(one):
    judged = by_model(one, replace(SUMMARIES[EQUIVALENT], careless=0.12))
    tests = judged.tests.assign(tests_verdict=DIFFERENT, share_at_ends=0.11, excluded="sub-04")
    judged = replace(judged, tests=tests)
    *_, said = claim_sentences(judged)
    for part in (EQUIVALENT, DIFFERENT, "12%", "11%", "sub-04"):
        assert part in said, part
    agree = replace(judged, tests=judged.tests.assign(tests_verdict=EQUIVALENT))
    assert len(claim_sentences(agree)) == 2


def test_textures_are_told_by_the_model(one):
    same = claim_sentences(by_model(one, SUMMARIES[EQUIVALENT]))[1]
    assert f"{EQUIVALENT}: aluminum, canvas" in same
    assert "jointly within the bounds" in same
    apart = claim_sentences(by_model(one, SUMMARIES[DIFFERENT]))[1]
    assert "canvas +6.0 points of 100 (95% CI +2.0 to +9.0)" in apart
    assert "Holm" not in apart


def test_everybody_is_in_the_table_with_their_claim(found):
    judged = [by_model(each, SUMMARIES[DIFFERENT]) for each in found[:2]]
    table = people_table([*judged, found[2]])
    assert table.groupby("claim")["participant_id"].nunique().to_dict() == {
        one.claim.name: 16 for one in judged
    }


def test_each_claim_that_the_model_is_asked_about_has_its_pictures(responses, found):
    judged = [by_model(found[0], SUMMARIES[DIFFERENT]), *found[1:]]
    (with_model,) = sections(answered_of(responses, found=judged))
    (without,) = sections(answered_of(responses, found=found))
    inside = {i.name for item in with_model.items if isinstance(item, Fold) for i in item.items}
    stem = file_stem(found[0].claim.name)
    assert {f"people_{stem}", f"predictive_{stem}", "people"} <= inside
    assert not any(str(getattr(item, "name", "")).startswith("people") for item in without.items)


def test_the_chapter_is_a_table_of_one_row_per_claim(responses, found):
    judged = [by_model(found[0], SUMMARIES[DIFFERENT]), *found[1:]]
    (section,) = sections(answered_of(responses, found=judged))
    assert section.findings == ()
    table = section.opening.frame.set_index("claim")
    assert list(table.index) == [one.claim.name for one in found]
    row = table.iloc[0]
    assert (row["verdict"], row["difference"], row["rule"]) == (DIFFERENT, 6.0, MODEL_RULE)
    assert row["beside"] == found[0].tests.iloc[0]["verdict"]
    assert table["rule"].iloc[1:].tolist() == ["tests", "tests"]
    assert np.isnan(table["people_p"].iloc[2])  # of right answers


def test_the_model_is_reported_as_in_a_paper(responses, found):
    judged = [by_model(found[0], SUMMARIES[DIFFERENT])]
    text = methods_paragraph(responses, judged)
    ratings, effort = RatingPriors(), Effort()
    assert f"an SD half-normal (scale {ratings.people_sd:g})" in text
    assert f"{effort.chains} chains of {effort.steps} steps after {effort.warm_up}" in text
    assert f"“{found[0].claim.name}”" in text
    assert "decide the other" not in text
    assert "decide the other claims." in methods_paragraph(responses, [*judged, *found[1:]])
    assert "hierarchical" not in methods_paragraph(responses, found)
    beside = methods_paragraph(responses, [by_model(found[0], people_summary(), decides=False)])
    assert "hierarchical" in beside
    assert "verdicts on" not in beside.lower()


def test_the_page_on_the_model_states_the_priors_that_are_used():
    text = (ROOT / "docs/method/participants.md").read_text(encoding="utf-8")
    rows = [line for line in text.splitlines() if line.startswith("| `")]
    stated = {
        row.split("`")[1]: [float(one) for one in row.split("|")[2].replace("−", "-").split(",")]
        for row in rows
    }
    assert stated == {name: list(np.atleast_1d(v)) for name, v in vars(RatingPriors()).items()}


def test_the_model_beside_the_tests_is_heard_where_it_says_something_else(one):
    beside = by_model(one, SUMMARIES[INCONCLUSIVE], decides=False)
    assert f"“{INCONCLUSIVE}”" in told(beside)
    same = replace(beside, tests=beside.tests.assign(model_verdict=beside.tests["verdict"]))
    assert "hierarchical" not in told(same)


def test_claims_that_tests_decide_in_spite_of_the_plan_are_named_with_the_reason(responses, found):
    judged = [by_model(found[0], people_summary(), decides=False), *found[1:]]
    uneven, few = decided_by_tests(responses, judged)
    assert found[0].claim.name in uneven
    assert "began" in uneven
    assert found[1].claim.name in few
    assert {uneven, few} <= set(deviations(responses, judged))
    by_tests = replace(responses, plan=replace(responses.plan, rule="tests"))
    assert decided_by_tests(by_tests, judged) == []
    old = replace(responses, plan=replace(responses.plan, rule=WITHDRAWN))
    (why,) = decided_by_tests(old, judged)
    assert "not printed" in why


def test_a_report_by_the_model_is_whole(tmp_path, responses, anchors, monkeypatch, undrawn):
    """The whole way, with short chains: eight people, of whom none feels a difference."""
    short = Effort(chains=2, warm_up=20, steps=40, every=4)
    where = "tactileq.analysis.statistics.participants.posterior"
    monkeypatch.setattr(f"{where}.Effort", lambda: short)
    for effort in ("LONGER", "LONGEST"):
        monkeypatch.setattr(f"{where}.{effort}", short)
    few = rating_table(np.random.default_rng(3), people=8).assign(session=1)
    few["trial"] = few.groupby("participant_id").cumcount() + 1
    of_few = anchors["absolute"].assign(session=1, trial=99)
    of_few = of_few[of_few["participant_id"].isin(few["participant_id"])]
    small = replace(responses, answers={"absolute": few}, anchors={"absolute": of_few})
    html = write_report(tmp_path / "report.html", responses=small).read_text(encoding="utf-8")
    # So few draws tell nothing, and that is what is said.
    assert NOT_CONVERGED in html
    tables = {path.stem for path in (tmp_path / "tables").iterdir()}
    assert {"people", "people_priors", "claims", "claims_in_short"} <= tables
