"""Models of single answers in the report: which claims, what is said beside the paired test."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from tactileq.analysis.answers.plan import AnalysisPlan
from tactileq.analysis.answers.responses import Responses
from tactileq.analysis.chapters.single_answers.gee import SIGN_FLIPS
from tactileq.analysis.chapters.single_answers.section import mixed_section
from tactileq.analysis.page.page import Table, table_html
from tactileq.analysis.page.sections import Section
from tactileq.analysis.statistics.verdicts import claims_found
from tests.analysis.conftest import choice_table, rating_table

pytestmark = pytest.mark.usefixtures("few_draws")


def section(plan: AnalysisPlan, effect: float, *, identical: tuple[str, ...] = ()) -> Section:
    ratings = rating_table(np.random.default_rng(4), effect=effect)
    choices = choice_table(np.random.default_rng(5))
    responses = Responses(
        answers={"absolute": ratings, "relative": choices},
        simulated_participants=True,
        simulated_rig=True,
        plan=plan,
        equal={texture: [("full", "simplified")] for texture in identical},
    )
    found = claims_found(responses, rng=np.random.default_rng(6))
    made = mixed_section(responses, found, rng=np.random.default_rng(7))
    assert made is not None
    return made


def frame(made: Section, name: str) -> pd.DataFrame:
    (table,) = (item for item in made.items if isinstance(item, Table) and item.name == name)
    assert table.simulated
    assert table.title in table_html(table)
    return table.frame


def test_an_effect_is_found_by_every_model_and_said_so(plan):
    made = section(plan, effect=50.0)
    mixed = frame(made, "mixed_effects")
    assert mixed["claim"].unique().tolist() == [claim.name for claim in plan.claims[:2]]
    magnitude = mixed.iloc[0]
    assert magnitude["ci_low"] < -50 / 7 < magnitude["ci_high"]
    assert magnitude["ci_high"] < 0
    odds = frame(made, "gee_effects")
    assert odds["claim"].unique().tolist() == [claim.name for claim in plan.claims]
    first, second, third = (outcome.sentence for outcome in made.outcomes)
    for told in (first, second):
        assert "mixed model −" in told
        assert " points, p < .001; GEE odds ratio 0." in told
        assert told.endswith("in agreement with the paired test over all textures (p < .001).")
    assert "mixed model" not in third
    assert "odds ratio" in third


def test_identical_textures_are_no_part_of_it(plan):
    with_it = frame(section(plan, effect=50.0), "gee_effects")
    without = frame(section(plan, effect=50.0, identical=("PVC",)), "gee_effects")
    assert "PVC" in set(with_it["texture"])
    assert "PVC" not in set(without["texture"])
    assert (without["answers"] < with_it["answers"].max()).all()


def test_a_model_that_disagrees_is_told(plan):
    """A paired p that was put on the other side of .05."""
    ratings = rating_table(np.random.default_rng(4), effect=50.0)
    responses = Responses(
        answers={"absolute": ratings},
        simulated_participants=True,
        simulated_rig=True,
        plan=plan,
    )
    found = claims_found(responses, rng=np.random.default_rng(6))[0]
    apart = replace(found, tests=found.tests.assign(p=0.5))
    made = mixed_section(responses, [apart], rng=np.random.default_rng(7))
    assert made is not None
    assert "This is not in agreement with the paired test" in made.outcomes[0].sentence


def test_all_right_answers_are_told_by_sign_flips(plan):
    choices = choice_table(np.random.default_rng(5)).assign(correct=1.0)
    responses = Responses(
        answers={"relative": choices},
        simulated_participants=False,
        simulated_rig=False,
        plan=plan,
    )
    found = claims_found(responses, rng=np.random.default_rng(6))
    made = mixed_section(responses, found, rng=np.random.default_rng(7))
    assert made is not None
    (table,) = made.items
    assert isinstance(table, Table)
    assert not table.simulated
    assert (table.frame["method"] == SIGN_FLIPS).all()
    assert "sign flips p = 1.000. This is in agreement" in made.outcomes[0].sentence


@pytest.mark.parametrize("identical", [True, False])
def test_nothing_to_compare_makes_no_section(plan, identical: bool):
    ratings = rating_table(np.random.default_rng(4))
    textures = ratings["texture"].unique() if identical else ()
    responses = Responses(
        answers={"absolute": ratings},
        simulated_participants=True,
        simulated_rig=True,
        plan=plan,
        equal={texture: [("full", "simplified")] for texture in textures},
    )
    found = claims_found(responses, rng=np.random.default_rng(6)) if identical else []
    assert mixed_section(responses, found, rng=np.random.default_rng(7)) is None
