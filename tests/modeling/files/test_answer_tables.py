"""What a table of answers declares of its task."""

from __future__ import annotations

from typing import Any

import pytest

from tactileq.modeling.files.answer_tables import (
    ANSWER_TABLES,
    CORRECT,
    RESPONSE_TIME,
    AnswerColumn,
    answer_table,
)
from tests.refusals import refused

ABOUT = {"title": "dummy", "texture": "", "model": ""}


def test_claims_can_be_about_ratings_and_right_answers() -> None:
    measures = {task: table.measures for task, table in ANSWER_TABLES.items()}
    assert measures == {
        "absolute": ("magnitude_similarity", "frequency_similarity"),
        "relative": ("correct",),
        "oddity": ("correct",),
        "threshold": (),  # which compares no models
    }
    assert answer_table(RESPONSE_TIME, **ABOUT).measures == ()


@pytest.mark.parametrize(
    "own",
    [
        (),
        (AnswerColumn(name="strength", description="", limits=(0.0, 100.0), scale="strength"),),
        (CORRECT,),
    ],
)
def test_trials_of_both_models_need_right_answers_and_their_chance(
    own: tuple[AnswerColumn, ...],
) -> None:
    chance = {} if own == (CORRECT,) else {"chance": 0.5}
    with pytest.raises(ValueError, match="right answers and their chance"):
        answer_table(*own, both_models=True, **chance, **ABOUT)


@pytest.mark.parametrize(
    ("own", "declared", "named"),
    [
        ((CORRECT,), {"alternatives": "layouts"}, "layouts"),
        ((CORRECT,), {"other_texture": "odd"}, "odd"),
        ((CORRECT, RESPONSE_TIME), {"alternatives": RESPONSE_TIME.name, "chance": 0.5}, "both"),
        ((RESPONSE_TIME,), {"chance": 0.5}, "correct"),
        ((RESPONSE_TIME,), {"alternatives": RESPONSE_TIME.name}, "correct"),
    ],
)
def test_a_chance_that_cannot_be_told_is_refused_before_any_study(
    own: tuple[AnswerColumn, ...], declared: dict[str, Any], named: str
) -> None:
    with refused(ValueError, expected="dummy", got=named):
        answer_table(*own, **declared, **ABOUT)


@pytest.mark.parametrize("chance", [0.0, 1.0, 50.0])
def test_a_chance_is_a_share(chance: float) -> None:
    with pytest.raises(ValueError, match="chance between 0 and 1"):
        answer_table(CORRECT, chance=chance, **ABOUT)


def test_a_scale_goes_from_0_to_100() -> None:
    with pytest.raises(ValueError, match="the limits"):
        AnswerColumn(name="strength", description="", limits=(1, 7), scale="strength")
