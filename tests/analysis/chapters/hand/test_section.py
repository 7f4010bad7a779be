"""What the report says of the hand: a caveat where it moved otherwise, and nothing unmeasured."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from tactileq.analysis.chapters.hand.section import hand_section
from tactileq.analysis.page.page import Fold, Table, table_html
from tactileq.analysis.page.sections import Section
from tactileq.modeling.files.columns import names

pytestmark = pytest.mark.filterwarnings("error")
PAIR = ("full", "simplified")


def hand_of(*, faster: float = 0.0, people: int = 10, task: str = "absolute") -> pd.DataFrame:
    """One texture, people 100, 101 … mm/s fast, one half of them slower with the other model."""
    rows = []
    for person in range(people):
        for model in PAIR:
            other = model == PAIR[1]
            sway = (-1) ** person * other
            rows.append(
                {
                    "task": task,
                    "participant_id": f"sub-{person + 1:02d}",
                    "texture": "oak",
                    "model": model,
                    "trials": 1,
                    "speed_mm_s": 100.0 + person + faster * other + sway,
                    "force_n": 1.5 + 0.05 * sway,
                    "contact_s": 8.0 + sway,
                    "presentations": 3.0 + sway,
                }
            )
    return pd.DataFrame(rows)


def section_of(hand: pd.DataFrame, *, simulated: bool = False) -> Section:
    section = hand_section(hand, models=PAIR, simulated=simulated, rng=np.random.default_rng(1))
    assert section is not None
    return section


def test_a_hand_that_moved_differently_is_a_caveat_in_one_sentence():
    section = section_of(hand_of(faster=12.0))
    (outcome,) = section.outcomes
    assert outcome.sentence == (
        "Caveat: the hand moved differently with simplified than with full models (simplified − "
        "full: speed while touching in the absolute evaluation +12.0 mm/s (95% CI +11.2 to "
        "+12.8)), so a difference in the answers, or its absence, may be due to the hand rather "
        "than the models."
    )


def test_without_a_difference_the_intervals_are_stated():
    (outcome,) = section_of(hand_of()).outcomes
    assert outcome.sentence == (
        "No difference in hand movement between full and simplified models was shown "
        "(simplified − full: speed while touching in the absolute evaluation +0.0 mm/s (95% CI "
        "−0.8 to +0.8); force while touching in the absolute evaluation +0.00 N (95% CI −0.04 to "
        "+0.04))."
    )


def test_both_tasks_have_a_picture_and_every_table_is_whole():
    section = section_of(pd.concat([hand_of(), hand_of(task="relative")]), simulated=True)
    assert [item.name for item in section.items[:2]] == ["hand_absolute", "hand_relative"]
    paired, fold = section.items[2:]
    assert isinstance(paired, Table)
    assert isinstance(fold, Fold)
    assert len(paired.frame) == 8
    assert set(paired.frame["task"]) == {"absolute evaluation", "forced choice"}
    for table in (paired, *fold.items):
        assert isinstance(table, Table)
        assert set(names(table.columns)) <= set(table.frame)
        assert "(SIMULATED)" in table_html(table)


@pytest.mark.parametrize(
    "hand",
    [
        hand_of().iloc[:0],
        hand_of().assign(speed_mm_s=np.nan, force_n=np.nan),  # only presses are known
        hand_of().query("model == 'full'"),
    ],
)
def test_without_a_measured_pair_there_is_no_section(hand):
    assert hand_section(hand, models=PAIR, simulated=False, rng=np.random.default_rng(1)) is None


def test_one_participant_is_described_and_not_tested():
    (outcome,) = section_of(hand_of(people=1, faster=12.0)).outcomes
    assert "No difference" in outcome.sentence
    assert "CI" not in outcome.sentence
