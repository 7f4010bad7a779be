"""The sentence on the worst of several textures, from a table with a known worst."""

from __future__ import annotations

import pandas as pd

from tactileq.analysis.chapters.models.section import left_out_outcomes


def test_the_worst_prediction_is_the_furthest_off_to_either_side() -> None:
    names = ("texture", "foretold_by", "worst_level_error_db", "worst_level_error_at")
    rows = [("oak", "joint", 1.5, "here"), ("elm", "joint", -4.0, "there")]
    table = pd.DataFrame(rows, columns=list(names))
    (sentence,) = left_out_outcomes(table.assign(median_level_error_db=0.5, median_distance_db=1.0))
    assert "at worst −4.0 dB, elm at there" in sentence
