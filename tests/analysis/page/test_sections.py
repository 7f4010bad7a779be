"""Sections about pairs of models become one, and say which pair."""

from __future__ import annotations

import pandas as pd
from matplotlib.figure import Figure

from tactileq.analysis.page.outcomes import Outcome, Weight
from tactileq.analysis.page.page import Fold, Picture, Table
from tactileq.analysis.page.sections import Section, of_pairs
from tactileq.modeling.files.columns import Column


def section(told: str) -> Section:
    table = Table("t", "Times", "", pd.DataFrame({"a": [told]}), (Column("a"),), simulated=False)
    picture = Picture("p", "Points", "", Figure(), simulated=False)
    return Section(
        "speed",
        "Speed",
        (picture, Fold("Details", (table,))),
        outcomes=(Outcome(Weight.SECONDARY, told), Outcome(Weight.SECONDARY, "always")),
    )


def test_one_pair_stays_as_it_is():
    only = section("a")
    assert of_pairs({("full", "simplified"): only}) is only
    assert of_pairs({("full", "simplified"): only, ("full", "AR"): None}) is only
    assert of_pairs({("full", "AR"): None}) is None
    assert of_pairs({}) is None


def test_names_and_titles_of_several_pairs_differ():
    both = of_pairs({("full", "simplified"): section("a"), ("full", "AR 20"): section("b")})
    assert both is not None
    first, first_fold, second, second_fold = both.items
    assert isinstance(first, Picture)
    assert isinstance(second, Picture)
    assert (first.name, second.name) == ("p_simplified_full", "p_AR-20_full")
    assert second.title == "Points: AR 20 compared with full models"
    assert isinstance(first_fold, Fold)
    assert isinstance(second_fold, Fold)
    assert second_fold.summary == "Details: AR 20 compared with full models"
    tables = [first_fold.items[0], second_fold.items[0]]
    assert [table.name for table in tables] == ["t_simplified_full", "t_AR-20_full"]
    assert [told.sentence for told in both.outcomes] == ["a", "always", "b"]
