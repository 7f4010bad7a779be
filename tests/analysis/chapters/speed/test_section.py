"""What the report says of speed and accuracy: tables, pictures, sentences."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from tactileq.analysis.chapters.chapter import Stream
from tactileq.analysis.chapters.speed.section import applies, speed_accuracy_section
from tactileq.analysis.page.outcomes import Weight
from tactileq.analysis.page.page import Fold, Picture, Table, table_html
from tactileq.analysis.page.sections import Section
from tactileq.modeling.files.answer_tables import ANSWER_TABLES
from tactileq.modeling.files.columns import names

MODELS = ("full", "simplified")
pytestmark = pytest.mark.filterwarnings("error")


def timed(choices: pd.DataFrame, *, ratio: float = 1.0) -> pd.DataFrame:
    """The choices with times of everybody's own, `ratio` as long with the simplified models."""
    draws = np.random.default_rng(3)
    log_s = draws.normal(2.0, 0.3, len(choices))
    people = choices["participant_id"].unique()
    slopes = dict(zip(people, draws.normal(np.log(ratio), 0.2, len(people)), strict=True))
    slope = choices["participant_id"].map(slopes).where(choices["model"] == "simplified", 0.0)
    return choices.assign(response_time_s=np.exp(log_s + slope))


def odd_ones(people: int = 4) -> pd.DataFrame:
    draws = np.random.default_rng(4)
    rows = [
        (f"sub-{who}", texture, model, layout, float(draws.random() < 0.5), 3 + draws.random())
        for who in range(people)
        for texture in ("canvas", "PVC")
        for model, layout in (
            ("full", "simplified|full|simplified"),
            ("simplified", "simplified|full|full"),
        )
        for _ in range(4)
    ]
    columns = ["participant_id", "texture", "model", "layout", "correct", "response_time_s"]
    return pd.DataFrame(rows, columns=columns)


def section_or_none(answers: dict[str, pd.DataFrame], *, simulated: bool = False) -> Section | None:
    rng = np.random.default_rng(1)
    tasks = [(Stream(task, "", rng), table) for task, table in answers.items()]
    return speed_accuracy_section(tasks, models=MODELS, simulated=simulated)


def section_of(answers: dict[str, pd.DataFrame], *, simulated: bool = False) -> Section:
    section = section_or_none(answers, simulated=simulated)
    assert section is not None
    return section


def shown(section: Section) -> list[Table | Picture]:
    inside = [i.items if isinstance(i, Fold) else (i,) for i in section.items]
    return [item for items in inside for item in items]


def test_the_forced_choice_is_compared_and_the_odd_one_out_pooled(choices):
    section = section_of({"relative": timed(choices), "oddity": odd_ones()})
    assert [item.name for item in shown(section)] == [
        *("speed_accuracy_relative", "conditional_accuracy_relative", "speed_accuracy"),
        *("time_ratio", "speed_right_and_wrong_relative", "speed_scores_relative"),
        *("speed_cells_relative", "speed_quantiles_relative", "speed_accuracy_oddity"),
        *("conditional_accuracy_oddity", "speed_right_and_wrong_oddity", "speed_scores_oddity"),
        *("speed_cells_oddity", "speed_quantiles_oddity"),
    ]
    pooled = next(item for item in shown(section) if item.name == "speed_cells_oddity")
    assert isinstance(pooled, Table)
    assert set(pooled.frame["trials"]) == {8}
    assert set(pooled.frame["model"]) == {"both models in each trial"}


def test_a_planted_ratio_is_told_without_praise(choices):
    section = section_of({"relative": timed(choices, ratio=0.5)})
    [told] = section.outcomes
    assert told.sentence.startswith(
        "Speed and accuracy, simplified compared with full models: faster; "
    )
    assert told.weight == Weight.SECONDARY
    assert "better" not in told.sentence


def test_tables_are_whole_and_stamped(choices):
    answers = {"relative": timed(choices), "oddity": odd_ones()}
    for item in shown(section_of(answers, simulated=True)):
        assert item.simulated
        if isinstance(item, Table):
            assert names(item.columns) == list(item.frame)
            assert "(SIMULATED)" in table_html(item)


def test_odd_ones_of_other_models_are_left_out():
    others = odd_ones().assign(layout="full|AR|AR")
    assert section_of({"oddity": pd.concat([odd_ones(), others])}).outcomes == ()
    assert section_or_none({"oddity": others}) is None
    assert section_or_none({}) is None


def test_only_timed_answers_that_are_right_or_wrong_have_the_section():
    applied = {task for task, table in ANSWER_TABLES.items() if applies(table)}
    assert applied == {"relative", "oddity"}


def test_one_participant_is_described_and_not_compared(choices):
    one = timed(choices)
    section = section_of({"relative": one[one["participant_id"] == "sub-01"]})
    (told,) = (outcome.sentence for outcome in section.outcomes)
    assert told.endswith("not compared, because 1 participant answered with both.")


def test_one_model_alone_is_no_comparison(choices):
    assert section_or_none({"relative": choices[choices["model"] == "full"]}) is None
