"""The section on confusions: what is planted is told, few people and any sets of models."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from tactileq.analysis.chapters.chapter import Stream
from tactileq.analysis.chapters.confusions.section import confusion_section
from tactileq.analysis.page.page import Fold, Table
from tactileq.analysis.page.sections import Section
from tactileq.analysis.statistics.confusion import confusion_matrices, participant_counts

pytestmark = pytest.mark.usefixtures("few_draws")

TEXTURES = ("canvas", "leather", "MDF", "PVC")


def answers(*, people: int = 10, other_confuses: bool = False) -> pd.DataFrame:
    """With full models 70 % right; with AR ones as many, or PVC and MDF exchanged throughout."""
    rng = np.random.default_rng(6)
    rows = []
    for person in range(people):
        for model in ("full", "AR"):
            for trial in range(24):
                texture = TEXTURES[trial % 4]
                answer = texture if rng.random() < 0.7 else str(rng.choice(TEXTURES))
                if other_confuses and model == "AR" and texture in ("MDF", "PVC"):
                    answer = {"MDF": "PVC", "PVC": "MDF"}[texture]
                layout = "|".join(rng.permutation(TEXTURES))
                rows.append((f"sub-{person}", texture, model, layout, answer))
    return pd.DataFrame(rows, columns=["participant_id", "texture", "model", "layout", "answer"])


def section_of(table: pd.DataFrame) -> Section:
    stream = Stream("relative", "", np.random.default_rng(1))
    return confusion_section(table, ("full", "AR"), simulated=False, stream=stream)


def frame(section: Section, name: str) -> pd.DataFrame:
    items = [
        i for item in section.items for i in (item.items if isinstance(item, Fold) else [item])
    ]
    (found,) = [item for item in items if isinstance(item, Table) and item.name == name]
    return found.frame


def told(section: Section) -> str:
    return " ".join(outcome.sentence for outcome in section.outcomes)


def test_other_confusions_are_found_and_equal_ones_are_not():
    planted = section_of(answers(other_confuses=True))
    assert frame(planted, "confusion_change")["p"].tolist() == [pytest.approx(2 / 2**10)]
    assert "were confused differently with AR than with full models" in told(planted)
    alike = section_of(answers())
    assert frame(alike, "confusion_change")["p"].iloc[0] > 0.05
    assert "were not shown to be confused differently" in told(alike)


def test_each_persons_counts_add_up_to_the_matrix():
    table = answers(people=3)
    for matrix in confusion_matrices(table, ("full", "AR")).values():
        people, counts = participant_counts(table, matrix)
        assert people == ("sub-0", "sub-1", "sub-2")
        assert (counts.sum(axis=0) == matrix.counts).all()
        assert counts.sum(axis=(1, 2)).tolist() == [24, 24, 24]


def test_one_person_has_no_information_and_no_change():
    alone = section_of(answers(people=1))
    assert frame(alone, "transferred_information").empty
    assert frame(alone, "confusion_change")["p"].tolist() == [1.0]
    begun = answers(people=4)
    half = section_of(begun[begun["model"] == "full"])
    assert frame(half, "transferred_information")["model"].tolist() == ["full"]
    assert frame(half, "confusion_change")["p"].isna().all()
    assert "confused differently" not in told(half)


def test_a_button_that_is_liked_is_a_caveat():
    table = answers(people=8)
    wrong = table["answer"] != table["texture"]
    liked = [layout.split("|")[2] for layout in table["layout"]]
    table["answer"] = table["answer"].where(~wrong, liked)
    section = section_of(table)
    assert "Caveat: some buttons were preferred" in told(section)
    assert "some buttons" not in told(section_of(answers(people=8)))
