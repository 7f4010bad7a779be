"""The sentence on top: it answers, with intervals, and claims neither equality nor people."""

from __future__ import annotations

from dataclasses import replace

import pandas as pd
import pytest

from analysis.answers.loading import PlannedTask, Responses
from analysis.columns import names
from analysis.report.answer import NOBODY_ASKED, answer, overall_outcomes, unfinished_tasks
from analysis.report.outcomes import HEADINGS, Outcome, Weight, by_weight
from analysis.statistics.overall import CORRECT_RATE, OVERALL_COLUMNS, overall_tests
from analysis.statistics.paired import rating_tests
from analysis.statistics.rates import rate_tests

NAN = float("nan")


def measured(difference: float, low: float, high: float, *, p: float) -> pd.DataFrame:
    """The comparison of the correct rates as `overall_tests` gives it."""
    row = dict.fromkeys(names(OVERALL_COLUMNS), 0.0)
    row |= {"measure": CORRECT_RATE, "textures": 7, "n": 24, "df": 23, "t": -3.46, "d_z": -0.71}
    row |= {"mean_difference": difference, "ci_low": low, "ci_high": high, "p": p, "p_holm": p}
    return pd.DataFrame([row])


SHOWN = measured(-0.0931, -0.149, -0.037, p=0.006)
NOT_SHOWN = measured(0.01, -0.03, 0.05, p=0.6)


@pytest.fixture
def people(ratings, choices) -> Responses:
    return Responses(
        {"absolute": ratings, "relative": choices},
        simulated_participants=False,
        simulated_rig=False,
    )


def test_a_difference_is_told_with_its_interval(people):
    assert answer(SHOWN, [], responses=people) == (
        "Yes, over 7 textures together: mean difference, simplified − full, of the correct rate "
        "−9.3 percentage points (95% CI −14.9 to −3.7)."
    )


def test_no_difference_shown_is_not_called_equality(people):
    told = answer(NOT_SHOWN, [], responses=people)
    assert told.startswith("No difference was shown, which is not to say that there is none: ")
    assert "+1.0 percentage points (95% CI −3.0 to +5.0)" in told
    assert told.endswith("; whatever lies within these intervals is not ruled out.")


def test_single_textures_that_differ_are_named(people):
    family = pd.DataFrame({"texture": ["PVC", "canvas"], "p_holm": [0.04, 0.7]})
    told = answer(NOT_SHOWN, [family], responses=people)
    assert told.startswith(
        "In single textures (PVC), but no difference was shown over 7 textures together: "
    )


def test_who_did_not_feel_a_surface_is_said_first(people):
    nobody = replace(people, simulated_participants=True)
    assert answer(SHOWN, [], responses=nobody).startswith("In a simulation without people, yes")
    twin = replace(people, simulated_rig=True)
    told = answer(SHOWN, [], responses=twin)
    assert told.startswith("At a simulated rig, where nobody felt a real surface, yes")


def test_an_unfinished_study_answers_so_far(people):
    begun = replace(people, planned={"relative": PlannedTask(24, 48)})
    assert answer(SHOWN, [], responses=begun).startswith("So far, yes, over 7 textures")
    assert unfinished_tasks(begun) == [
        "forced choice: 16 of 24 planned participants, 16 of 48 planned sessions"
    ]
    done = replace(people, planned={"relative": PlannedTask(16, 16)})
    assert answer(SHOWN, [], responses=done).startswith("Yes")
    assert unfinished_tasks(done) == []


def test_nothing_is_answered_where_nothing_can_be(people):
    assert answer(pd.DataFrame(), [], responses=None) == NOBODY_ASKED
    undefined = measured(NAN, NAN, NAN, p=NAN)
    told = answer(undefined, [], responses=people)
    assert told == "It cannot be told yet, for want of answers that vary between participants."
    assert overall_outcomes(undefined) == []
    assert "are identical" in answer(SHOWN.iloc[:0], [], responses=people)


def test_the_answer_comes_from_the_answers(people, ratings, choices):
    overall = overall_tests(people)
    told = answer(overall, [rating_tests(ratings), rate_tests(choices)], responses=people)
    for row in overall.to_dict("records"):
        factor = 100 if row["measure"] == CORRECT_RATE else 1
        difference = f"{factor * row['mean_difference']:+.1f}".replace("-", "−")
        assert f"{row['measure']} {difference} " in told
    assert told.startswith("Yes, over 7 textures together")  # PVC's 30 points


def test_the_weightiest_findings_come_first():
    outcomes = [
        Outcome(Weight.DESCRIPTIVE, "layers"),
        Outcome(Weight.TEXTURES, "canvas"),
        Outcome(Weight.OVERALL, "all"),
        Outcome(Weight.TEXTURES, "PVC"),
    ]
    assert by_weight(outcomes) == {
        HEADINGS[Weight.OVERALL]: ["all"],
        HEADINGS[Weight.TEXTURES]: ["canvas", "PVC"],
        HEADINGS[Weight.DESCRIPTIVE]: ["layers"],
    }
