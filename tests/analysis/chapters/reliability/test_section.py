"""What the report says of reliability: tables, sentences, and a list that excludes nobody."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from tactileq.analysis.chapters.reliability.section import (
    CARELESS_COLUMNS,
    careless_signs,
    reliability_section,
)
from tactileq.analysis.page.page import Table, table_html
from tactileq.analysis.page.sections import Section
from tactileq.modeling.files.columns import names

pytestmark = pytest.mark.filterwarnings("error")
CHANCES = {"relative": 1 / 3}


def ratings_of(*, people: int = 6, careless: int = 0, repeats: int = 1) -> pd.DataFrame:
    """Who rates six cells alike but for a noise of 3 points; the last ones rate all 70, fast."""
    rng = np.random.default_rng(2)
    rows = []
    for person in range(1, people + 1):
        idle = person > people - careless
        for cell in [*range(6)] * repeats:
            rating = 70.0 if idle else 40 + 8 * cell + 3 * rng.standard_normal()
            rows.append(
                {
                    "participant_id": f"sub-{person:02d}",
                    "texture": f"t{cell // 2}",
                    "model": ("full", "other")[cell % 2],
                    "magnitude_similarity": rating,
                    "frequency_similarity": 50 + person + rng.standard_normal(),
                    "response_time_s": 0.8 if idle else 9.0,
                }
            )
    return pd.DataFrame(rows)


def choices_of(*right: int, of: int = 42) -> pd.DataFrame:
    rows = [(f"sub-{n:02d}", float(i < r), 9.0) for n, r in enumerate(right, 1) for i in range(of)]
    return pd.DataFrame(rows, columns=["participant_id", "correct", "response_time_s"])


def section_of(answers: dict[str, pd.DataFrame], *, simulated: bool = False) -> Section:
    section = reliability_section(
        answers, chances=CHANCES, simulated=simulated, rng=np.random.default_rng(1)
    )
    assert section is not None
    return section


def test_careless_answers_are_listed_by_task_and_nobody_is_left_out():
    answers = {"absolute": ratings_of(careless=1), "relative": choices_of(40, 39, 14, 41, 38, 40)}
    found = careless_signs(answers, chances=CHANCES, rng=np.random.default_rng(1))
    assert list(found) == names(CARELESS_COLUMNS)
    assert found[["task", "participant_id", "sign"]].to_numpy().tolist() == [
        ["absolute", "sub-06", "all ratings the same"],
        ["absolute", "sub-06", "every answer within 2 s"],
        ["relative", "sub-03", "right answers at chance"],
    ]
    assert found["detail"].iloc[0] == "6 ratings of 70 of vibration magnitude"
    section = section_of(answers)
    told = [outcome.sentence for outcome in section.outcomes]
    assert (
        "Answers of 2 participants look careless (sub-03, sub-06); they are not left out." in told
    )
    raters = next(i for i in section.items if isinstance(i, Table) and i.name == "raters")
    assert "sub-06" in set(raters.frame["participant_id"])


def test_agreement_and_repeats_are_told():
    told = [o.sentence for o in section_of({"absolute": ratings_of(repeats=2)}).outcomes]
    assert len(told) == 4
    # Cells have a standard deviation of 15, the mean of two ratings 3/√2.
    assert told[0].startswith(
        "Agreement on vibration magnitude: one participant's ratings have an intraclass "
        "correlation (consistency) of 0.9"
    )
    assert told[2].startswith("Ratings of vibration magnitude that a participant repeated have a")
    assert float(told[2].split(" points")[0].rpartition(" ")[2]) == pytest.approx(3.0, abs=0.6)


def test_tables_are_whole_and_stamped():
    section = section_of({"absolute": ratings_of(), "relative": choices_of(40, 41)}, simulated=True)
    assert [i.name for i in section.items if isinstance(i, Table)] == [
        *("agreement", "raters", "careless")
    ]
    for item in section.items:
        assert isinstance(item, Table)
        assert set(names(item.columns)) == set(item.frame)
        assert "(SIMULATED)" in table_html(item)


def test_choices_alone_and_one_rater_are_no_reason_to_stop():
    (table,) = section_of({"relative": choices_of(40)}).items
    assert isinstance(table, Table)
    assert table.title == "No answers look careless"
    one = section_of({"absolute": ratings_of(people=1)})
    assert one.outcomes == ()
    agreement = one.items[0]
    assert isinstance(agreement, Table)
    assert (agreement.frame["note"] == "undefined: 1 participant with 6 cells").all()


def test_without_answers_there_is_no_section():
    none = {"absolute": ratings_of().iloc[:0]}
    rng = np.random.default_rng(1)
    assert reliability_section(none, chances=CHANCES, simulated=False, rng=rng) is None
    assert reliability_section({}, chances=CHANCES, simulated=False, rng=rng) is None
