"""The sentence on top: it answers by the plan, with intervals, and claims no more."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tactileq.analysis.answers.plan import AnalysisPlan
from tactileq.analysis.answers.responses import PlannedTask, Responses
from tactileq.analysis.chapters.claims.answer import answer, unfinished_tasks
from tactileq.analysis.chapters.claims.plan_sentences import deviations, methods_paragraph
from tactileq.analysis.chapters.claims.sentences import claim_sentences
from tactileq.analysis.labels import ALL_TEXTURES
from tactileq.analysis.page.outcomes import Outcome, Weight
from tactileq.analysis.page.sections import Section
from tactileq.analysis.statistics.claims import CONTROL
from tactileq.analysis.statistics.verdicts import ClaimFound, claims_found, overall_row
from tests.analysis.conftest import words_of

pytestmark = pytest.mark.usefixtures("few_draws")


@pytest.fixture(scope="module")
def people(ratings, choices, plan) -> Responses:
    return Responses(
        {"absolute": ratings, "relative": choices},
        simulated_participants=False,
        simulated_rig=False,
        plan=plan,
    )


@pytest.fixture(scope="module")
def own(people) -> list[ClaimFound]:
    """The claims about these people's answers."""
    return analysed(people)


def analysed(responses: Responses) -> list[ClaimFound]:
    return claims_found(responses, rng=np.random.default_rng(5))


def told(responses: Responses) -> str:
    return words_of(answer(analysed(responses), responses))


def with_verdict(found: list[ClaimFound], verdict: str) -> list[ClaimFound]:
    """The same tests with this verdict on all textures together."""
    changed = []
    for one in found:
        tests = one.tests.copy()
        tests.loc[tests["texture"] == ALL_TEXTURES, "verdict"] = verdict
        changed.append(replace(one, tests=tests))
    return changed


def test_the_answer_is_the_verdicts_with_their_intervals(people, own):
    headline = answer(own, people)
    assert headline is not None
    names = "aluminum, canvas, leather, MDF, polyester, PVC and wall paper"
    assert headline.subject == f"Simplified compared with full models, over {names}:"
    assert len(headline.points) == len(own)
    assert all(point.endswith(".") for point in headline.points)
    for one, point in zip(own, headline.points, strict=True):
        row = overall_row(one)
        assert row is not None
        equal = row["verdict"] in ("equivalent", "equivalence withheld")
        within = row["verdict"] in ("different but within bounds", "different, bounds withheld")
        factor = 100 if one.claim.measure == "correct" else 1
        for level, ends, shown in (
            ("95", ("ci_low", "ci_high"), not equal),
            ("90", ("ci90_low", "ci90_high"), equal or within),
        ):
            low, high = (f"{factor * row[name]:+.1f}".replace("-", "−") for name in ends)
            assert (f"{level}% CI {low} to {high}" in point) is shown
        assert "; allowed ±" in point
    assert "PVC (" in headline.points[0]


def test_claims_about_other_textures_name_their_own(people):
    own = analysed(people)
    fewer = own[1].tests.copy()
    fewer.loc[fewer["texture"] == "canvas", "verdict"] = CONTROL
    headline = answer([own[0], replace(own[1], tests=fewer)], people)
    assert "over" not in headline.subject
    assert "canvas" in headline.points[0].split(":")[0]
    assert "(1 more has identical models)" in headline.points[1].split(":")[0]


@pytest.mark.parametrize(
    ("verdict", "words"),
    [
        ("equivalent", "equivalent"),
        ("different", "a difference is shown"),
        ("different but within bounds", "no more than allowed"),
        ("inconclusive", "inconclusive"),
        ("interim, no verdict", "no verdict before the study is complete"),
        ("", "because answers are incomplete"),
    ],
)
def test_each_verdict_has_its_words(people, found, verdict, words):
    headline = answer(with_verdict(found, verdict), people)
    for point in headline.points:
        assert words in point
        assert ("CI" in point) == (verdict not in ("interim, no verdict", ""))


def test_why_equality_is_withheld_is_said(people, found):
    withheld = with_verdict(found, "equivalence withheld")
    alike = replace(withheld[1], tests=withheld[1].tests.assign(doubt="all alike"))
    assert "since all alike" in words_of(answer([alike], people))
    assert "withheld, since all alike" in claim_sentences(alike)[0]
    assert "BF₀₁" not in claim_sentences(alike)[0]
    assert "BF₀₁" in claim_sentences(found[1])[0]


def test_without_a_plan_nothing_is_called_equal(people):
    bare = replace(people, plan=AnalysisPlan(claims=()))
    sentence = told(bare)
    assert "(exploratory: nothing was planned)" in sentence
    assert "equivalent" not in sentence
    assert "95% CI" in sentence
    assert "allowed" not in sentence
    [first, *_] = deviations(bare, analysed(bare))
    assert first.startswith("No claim was registered before the first answer")


def test_who_did_not_feel_a_surface_is_said_first(people, own):
    assert words_of(answer(own, replace(people, simulated_participants=True))).startswith(
        "In a simulation without people, simplified compared with full models"
    )
    assert words_of(answer(own, replace(people, simulated_rig=True))).startswith(
        "At a simulated rig, where nobody felt a real surface, simplified"
    )


def test_an_unfinished_study_answers_so_far(people):
    begun = replace(people, planned={"relative": PlannedTask(24, 48, repeats=3)})
    sentence = told(begun)
    assert sentence.startswith("So far, simplified compared with full models")
    assert "Correct rate: no verdict before the study is complete" in sentence
    assert unfinished_tasks(begun) == [
        "forced choice: 16 of 24 planned participants, 16 of 48 planned sessions"
    ]
    done = replace(people, planned={"relative": PlannedTask(16, 16, repeats=3)})
    assert told(done).startswith("Simplified")
    assert unfinished_tasks(done) == []


def test_nothing_is_answered_where_nothing_can_be(people, choices):
    nobody = {task: table[:0] for task, table in people.answers.items()}
    assert told(replace(people, answers=nobody)) == ""
    same = {texture: [("full", "simplified")] for texture in people.textures}
    assert "are identical" in told(replace(people, equal=same))
    one_model = replace(people, answers={"relative": choices[choices["model"] == "full"]})
    assert "answers are incomplete" in told(one_model)


def test_every_texture_is_told_with_its_verdict(people):
    same = replace(people, equal={"canvas": [("full", "simplified")]})
    found = analysed(same)
    for one in found:
        _, sentence = claim_sentences(one)
        for row in one.tests.iloc[1:].to_dict("records"):
            assert row["texture"] in sentence
            assert row["verdict"] in (CONTROL, *sentence.replace(":", ";").split("; "))
        assert "identical models, nothing to compare: canvas" in sentence


def test_deviations_name_who_was_left_out_and_what_was_not_planned(people, plan):
    gone = (people.answers["absolute"]["participant_id"] == "sub-05") & (
        people.answers["absolute"]["texture"] == "MDF"
    )
    cut = replace(
        people,
        answers={**people.answers, "absolute": people.answers["absolute"][~gone]},
        plan=replace(plan, claims=plan.claims[:1], sha256=("0a" * 32, "0b" * 32)),
        warnings=("sub-09 relative ses-01 was a pilot.",),
    )
    sentences = deviations(cut, analysed(cut))
    assert sentences[0] == (
        "Claims fixed before the first answer: 1 (preregistration page: 0a0a0a0a0a0a…)."
    )
    assert sentences[1] == "Planned exclusion: Trials in which the rig failed are repeated."
    assert "other sessions ran under 0b0b0b0b0b0b…" in sentences[2]
    assert sentences[3] == (
        "Exploratory, since not in the plan: rated similarity of frequency pattern; correct rate."
    )
    assert "answers are incomplete: sub-05 (MDF)." in sentences[4]
    assert sentences[-1] == "On reading the answers: sub-09 relative ses-01 was a pilot."


def test_the_methods_are_reported_as_in_a_paper(people, own):
    text = methods_paragraph(people, own)
    assert text.startswith(
        "16 participants took part in the absolute evaluation with 7 textures; 16 participants "
        "took part in the forced choice with 7 textures."
    )
    assert "rated similarity of vibration magnitude −7.5 to +7.5" in text
    assert "bounds fixed before the first answer" in text
    bare = replace(people, plan=AnalysisPlan(claims=()), simulated_participants=True)
    other = methods_paragraph(bare, analysed(bare))
    assert other.startswith("16 simulated participants")
    assert "TOST" not in other


def test_the_weightiest_findings_come_first():
    outcomes = [
        Outcome(Weight.DESCRIPTIVE, "layers"),
        Outcome(Weight.TEXTURES, "canvas"),
        Outcome(Weight.OVERALL, "all"),
        Outcome(Weight.TEXTURES, "PVC"),
    ]
    section = Section("verdicts", "Verdicts", (), outcomes=tuple(outcomes))
    assert section.findings == ("all", "canvas", "PVC", "layers")
    answered = replace(section, answer="PVC")
    assert answered.findings == ("PVC", "all", "canvas", "layers")  # none twice
