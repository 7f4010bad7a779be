"""Verdicts of the model of the participants as they are told: people first, with their limits."""

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
from tactileq.analysis.chapters.claims.people_sentences import FEEL_IT, about, headline
from tactileq.analysis.chapters.claims.plan_sentences import deviations, methods_paragraph
from tactileq.analysis.chapters.claims.section import sections
from tactileq.analysis.chapters.claims.sentences import claim_outcomes, overall_row
from tactileq.analysis.page.outcomes import Weight
from tactileq.analysis.report.report import write_report
from tactileq.analysis.statistics.caveats import INTERIM, WITHHELD
from tactileq.analysis.statistics.equivalence import (
    ALL_BUT,
    AVERAGE_FELT,
    DIFFERENT,
    EQUAL_ON_AVERAGE,
    EQUIVALENT,
    FELT,
    INCONCLUSIVE,
    WITHIN_BOUNDS,
)
from tactileq.analysis.statistics.participants.posterior import Effort
from tactileq.analysis.statistics.participants.verdict import DOUBLED_CHAINS, PeopleSummary
from tactileq.analysis.statistics.verdicts import ClaimFound, claims_found
from tactileq.modeling.files.writing import file_stem
from tactileq.modeling.participants.choices import ODDITY, ChoicePriors, forced_choice
from tactileq.modeling.participants.ratings import RatingPriors
from tests.analysis.conftest import answered_of, by_model, people_summary, rating_table, words_of
from tests.analysis.conftest import people_table as people

pytestmark = pytest.mark.usefixtures("few_draws")

ROOT = Path(__file__).parents[4]
SOME = {"share": (0.42, 0.25, 0.58), "most": 0.55, "somebody": 1.0}
FEW = {"share": (0.09, 0.04, 0.16), "most": 0.14, "somebody": 0.99}
SUMMARIES = {
    EQUIVALENT: people_summary(mean=(-0.4, -1.2, 0.4), share=(0.02, 0.0, 0.11), most=0.09),
    ALL_BUT: people_summary(mean=(1.0, -0.5, 2.5), **FEW),
    AVERAGE_FELT: people_summary(mean=(3.0, 1.0, 5.0), **SOME),
    FELT: people_summary(mean=(6.0, -1.0, 9.0), **SOME),
    DIFFERENT: people_summary(
        mean=(12.0, 9.0, 15.0), share=(0.9, 0.8, 0.97), most=0.96, somebody=1.0
    ),
    INCONCLUSIVE: people_summary(mean=(0.5, -2.0, 3.0), share=(0.1, 0.02, 0.3), most=0.27),
}
# What is said of people, of the mean, and of the verdict.
SAID = {
    EQUIVALENT: ("equivalent in", "at most 9% of people", "−0.4", "−1.2 to +0.4"),
    ALL_BUT: ("all but 4–16% of people", "+1.0", "−0.5 to +2.5"),
    AVERAGE_FELT: ("on average", "about 4 in 10 people", "25–58%", "+1.0 to +5.0"),
    FELT: ("felt by some", "about 4 in 10 people", "25–58%", "−1.0 to +9.0"),
    DIFFERENT: ("different in", "+12.0", "about 9 in 10 people", "80–97%"),
    INCONCLUSIVE: ("inconclusive in", "the mean lies inside the bounds", "2–30%", "15%"),
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
    return headline(one, row, what="magnitude")


@pytest.mark.parametrize("verdict", SUMMARIES)
def test_the_answer_is_about_people_with_their_intervals(one, responses, verdict):
    judged = by_model(one, SUMMARIES[verdict])
    row = overall_row(judged)
    assert row is not None
    assert row["verdict"] == verdict
    sentence = words_of(answer([judged], responses))
    for part in (*SAID[verdict], "points of 100", "bounds −7.5 to +7.5"):
        assert part.lower() in sentence.lower(), part
    [first, *_] = claim_outcomes([judged])
    assert f": {verdict}; " in first.sentence
    assert "TOST" in first.sentence
    assert "people feel it" not in first.sentence  # said on the first page


def test_choices_are_told_in_percentage_points(found):
    of_choice = by_model(found[2], people_summary(mean=(0.051, 0.02, 0.08), **SOME))
    assert "mean +5.1 percentage points (95% CI +2.0 to +8.0, bounds −10.0 to +10.0)" in told(
        of_choice
    )


def test_an_open_mean_is_told_as_open(one):
    wide = by_model(one, people_summary(mean=(4.0, -3.0, 11.0), share=(0.3, 0.04, 0.6), most=0.56))
    assert "open whether the mean lies inside the bounds" in told(wide)
    assert "4–60%" in told(wide)


def test_equality_is_withheld_with_the_reason_and_no_upper_limit_of_people(one):
    withheld = doubted(one, SUMMARIES[EQUIVALENT])
    assert withheld.tests.iloc[0]["verdict"] == WITHHELD
    for sentence in (told(withheld), claim_outcomes([withheld])[0].sentence):
        assert "anchors failed" in sentence
        assert "people feel it" not in sentence
    some = doubted(one, SUMMARIES[AVERAGE_FELT])
    assert some.tests.iloc[0]["verdict"] == FELT
    assert "at least 25% of people feel it" in told(some)
    assert "anchors failed" in told(some)
    assert "58%" not in told(some)
    different = doubted(one, SUMMARIES[DIFFERENT])
    assert "at least 80% of people" in told(different)
    unclear = doubted(one, SUMMARIES[INCONCLUSIVE])
    assert "lies inside" not in told(unclear)
    for judged in (withheld, some, unclear):
        [priors] = [o for o in claim_outcomes([judged]) if "priors" in o.sentence]
        assert "at most" not in priors.sentence


def test_an_unfinished_task_shows_no_effect_whatever_the_rule(responses):
    begun = replace(responses, planned={"absolute": PlannedTask(24, 24, repeats=1)})
    begun = replace(begun, answers={"absolute": responses.answers["absolute"]})
    judged = claims_found(begun, rng=np.random.default_rng(1))
    assert {one.tests.iloc[0]["verdict"] for one in judged} == {INTERIM}
    assert all(one.people is None for one in judged)
    said = words_of(answer(judged, begun))
    assert said
    assert "CI" not in said
    assert "feel it" not in said
    assert people_items([one for one in judged if not one.caveats.unfinished], simulated=True) == ()


@pytest.mark.parametrize(
    ("share", "words"),
    [
        (0.001, "fewer than 1 in 100"),
        (0.03, "about 3 in 100"),
        (0.08, "about 1 in 10"),
        (0.42, "about 4 in 10"),
        (0.94, "about 9 in 10"),
        (0.97, "nearly everybody"),
    ],
)
def test_shares_are_told_as_numbers_of_people(share, words):
    assert about(share).startswith(words)


def test_that_tests_say_something_else_is_said_with_the_reasons(one):
    table = people([0.0] * 16, careless=(2, 15))
    judged = by_model(one, SUMMARIES[AVERAGE_FELT], people=table, lapses=0.12)
    judged = replace(judged, tests=judged.tests.assign(share_at_ends=0.11, excluded="sub-04"))
    [said] = [o for o in claim_outcomes([judged]) if "paired tests “" in o.sentence]
    assert said.weight == Weight.OVERALL
    tests = judged.tests.iloc[0]["tests_verdict"]
    for part in (AVERAGE_FELT, tests, "mean alone", "sub-03, sub-16", "11%", "12%", "sub-04"):
        assert part in said.sentence, part


@pytest.mark.parametrize("tests", [EQUIVALENT, WITHIN_BOUNDS, ""])
def test_nothing_is_said_where_the_tests_do_not_contradict(one, tests):
    judged = by_model(one, SUMMARIES[EQUIVALENT])
    judged = replace(judged, tests=judged.tests.assign(tests_verdict=tests))
    assert not any("paired tests “" in o.sentence for o in claim_outcomes([judged]))


def test_what_doubled_priors_change_is_said(one):
    wide = people_summary(mean=(-0.6, -1.6, 0.4), share=(0.05, 0.0, 0.2), most=0.18)
    judged = by_model(one, SUMMARIES[EQUIVALENT], doubled=wide)
    [said] = [o for o in claim_outcomes([judged]) if "priors" in o.sentence]
    for part in (INCONCLUSIVE, "−0.6 instead of −0.4", "18% instead of 9%"):
        assert part in said.sentence, part
    table = priors_table([judged])
    assert list(table["priors"]) == [OWN, DOUBLED]
    assert list(table["verdict"]) == [EQUIVALENT, INCONCLUSIVE]
    assert list(table["share_most"]) == [0.09, 0.18]
    withheld = priors_table([doubted(one, SUMMARIES[EQUIVALENT])])
    assert list(withheld["verdict"]) == [WITHHELD] * 2


def test_chains_that_disagree_are_reported(one):
    stuck = replace(SUMMARIES[EQUIVALENT], r_hat=1.31)
    assert any("1.31" in o.sentence for o in claim_outcomes([by_model(one, stuck)]))
    assert not any("R̂" in o.sentence for o in claim_outcomes([by_model(one, SUMMARIES[FELT])]))


def test_textures_are_equal_on_average_or_differ_by_the_model(one):
    same = claim_outcomes([by_model(one, SUMMARIES[EQUIVALENT])])[-1].sentence
    assert f"{EQUAL_ON_AVERAGE}: aluminum, canvas" in same
    assert "jointly equal on average" in same
    assert "jointly equivalent" not in same
    apart = claim_outcomes([by_model(one, SUMMARIES[DIFFERENT])])[-1]
    assert apart.weight == Weight.TEXTURES
    assert "canvas +12.0 points of 100 (95% CI +9.0 to +15.0)" in apart.sentence
    assert "Holm" not in apart.sentence


def test_everybody_is_in_the_table_with_their_claim(found):
    judged = [by_model(each, SUMMARIES[FELT]) for each in found[:2]]
    table = people_table([*judged, found[2]])
    assert table.groupby("claim")["participant_id"].nunique().to_dict() == {
        one.claim.name: 16 for one in judged
    }


def test_each_claim_that_the_model_decides_has_its_picture(responses, found):
    judged = [by_model(found[0], SUMMARIES[FELT]), *found[1:]]
    (with_model,) = sections(answered_of(responses, found=judged))
    (without,) = sections(answered_of(responses, found=found))
    names = {getattr(item, "name", "") for item in with_model.items}
    assert {file_stem(f"people_{found[0].claim.name}"), "people_priors"} <= names
    assert not any(str(getattr(item, "name", "")).startswith("people") for item in without.items)


def test_the_model_is_reported_as_in_a_paper(responses, found):
    judged = [by_model(found[0], SUMMARIES[FELT]), by_model(found[2], SUMMARIES[EQUIVALENT])]
    text = methods_paragraph(responses, judged)
    ratings, effort = RatingPriors(), Effort()
    assert f"scale {ratings.effects.spread:g}" in text
    assert f"{effort.chains} chains of {effort.steps} steps after {effort.warm_up}" in text
    assert f"({DOUBLED_CHAINS} chains)" in text
    assert f"below {responses.plan.few:.0%}" in text
    for one in judged:
        assert f"“{one.claim.name}”" in text
    assert "forced choice of 7 alternatives" in text
    assert "decide the other" not in text
    assert "decide the other claim." in methods_paragraph(responses, [*judged, found[1]])
    assert "hierarchical" not in methods_paragraph(responses, found)


def test_priors_of_the_odd_one_out_are_its_own(responses, found, choices):
    oddity = replace(found[2], claim=replace(found[2].claim, task="oddity", name="odd"))
    odd = choices.assign(layout="full|simplified|full")
    answers = replace(responses, answers={"oddity": odd})
    text = methods_paragraph(answers, [by_model(oddity, SUMMARIES[EQUIVALENT])])
    priors = ChoicePriors.of(ODDITY)
    assert f"means normal (0, {priors.effects.mean_sd:g})" in text
    assert f"beta({priors.catch[0]:g}, {priors.catch[1]:g})" in text


def values_of(row: str, *, cell: int) -> list[float]:
    """Numbers in a cell of a row of the page's table."""
    return [float(one) for one in row.split("|")[cell].replace("−", "-").split(",") if one.strip()]


def priors_by_name(priors: RatingPriors | ChoicePriors) -> dict[str, list[float]]:
    """Every number of the priors, by the name that the page gives it."""
    own = {f"effects.{name}": value for name, value in vars(priors.effects).items()}
    own |= {name: value for name, value in vars(priors).items() if name != "effects"}
    return {name: list(np.atleast_1d(value)) for name, value in own.items()}


def test_the_page_on_the_model_states_the_priors_that_are_used():
    text = (ROOT / "docs/method/participants.md").read_text(encoding="utf-8")
    rows = [line for line in text.splitlines() if line.startswith("| `")]
    split = next(k for k, row in enumerate(rows) if k and "effects.mean_sd" in row)
    of_choices = [ChoicePriors.of(model) for model in (forced_choice(7), ODDITY)]
    tables = [(rows[:split], RatingPriors(), 2)]
    tables += [(rows[split:], priors, cell) for cell, priors in enumerate(of_choices, start=2)]
    for own, priors, cell in tables:
        known = priors_by_name(priors)
        stated = {row.split("`")[1]: values_of(row, cell=cell) for row in own}
        assert set(stated) == set(known)
        for name, values in stated.items():
            assert values in ([], known[name]), name
        assert sum(map(bool, stated.values())) >= 7


def test_claims_that_tests_decide_in_spite_of_the_plan_are_named(responses, found):
    judged = [by_model(found[0], SUMMARIES[FELT]), *found[1:]]
    [sentence] = decided_by_tests(responses, judged)
    assert found[0].claim.name not in sentence
    assert found[1].claim.name in sentence
    assert sentence in deviations(responses, judged)
    by_tests = replace(responses, plan=replace(responses.plan, rule="tests"))
    assert sentence not in deviations(by_tests, judged)


def test_a_report_by_the_model_says_what_feeling_it_means(
    tmp_path, responses, anchors, monkeypatch, undrawn
):
    """The whole way, with short chains: eight people, of whom none feels a difference."""
    short = Effort(chains=2, warm_up=20, steps=40, every=4)
    monkeypatch.setattr("tactileq.analysis.statistics.participants.verdict.Effort", lambda: short)
    few = rating_table(np.random.default_rng(3), people=8).assign(session=1)
    few["trial"] = few.groupby("participant_id").cumcount() + 1
    of_few = anchors["absolute"].assign(session=1, trial=99)
    of_few = of_few[of_few["participant_id"].isin(few["participant_id"])]
    small = replace(responses, answers={"absolute": few}, anchors={"absolute": of_few})
    html = write_report(tmp_path / "report.html", responses=small).read_text(encoding="utf-8")
    assert FEEL_IT.replace("'", "&#x27;") in html
    tables = {path.stem for path in (tmp_path / "tables").iterdir()}
    assert {"people", "people_priors", "claims"} <= tables
