"""Full against simplified over all textures: planted differences come out, and only those."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from analysis.answers.loading import Responses
from analysis.columns import names
from analysis.statistics.overall import CORRECT_RATE, OVERALL_COLUMNS, overall_tests
from analysis.statistics.paired import holm

MAGNITUDE = "rated similarity of vibration magnitude"


def answers(ratings: pd.DataFrame, choices: pd.DataFrame) -> Responses:
    return Responses(
        {"absolute": ratings, "relative": choices}, simulated_participants=True, simulated_rig=True
    )


def choice_rows(rates: dict[tuple[str, str], tuple[float, ...]]) -> pd.DataFrame:
    """A row per participant: (texture, model) to the share that each of them got right."""
    return pd.DataFrame(
        [
            {"participant_id": f"sub-{n}", "texture": texture, "model": model, "correct": share}
            for (texture, model), shares in rates.items()
            for n, share in enumerate(shares)
        ]
    )


RATES = {
    ("canvas", "full"): (0.9, 0.7, 0.8),
    ("canvas", "simplified"): (0.5, 0.4, 0.3),
    ("PVC", "full"): (0.6, 0.6, 0.5),
    ("PVC", "simplified"): (0.6, 0.6, 0.5),
}


def test_the_three_measures_are_one_family(ratings, choices):
    table = overall_tests(answers(ratings, choices))
    assert list(table) == names(OVERALL_COLUMNS)
    assert table["measure"].tolist()[:2] == [CORRECT_RATE, MAGNITUDE]
    assert table["textures"].tolist() == [7, 7, 7]
    assert table["p_holm"].tolist() == pytest.approx(holm(table["p"]).tolist())
    # The planted effect of 30 points is on one of seven textures.
    assert table.loc[1, "mean_difference"] == pytest.approx(-30 / 7, abs=2.0)
    assert table.loc[1, "ci_low"] < table.loc[1, "mean_difference"] < table.loc[1, "ci_high"]


def test_identical_models_do_not_dilute_the_difference(ratings):
    choices = choice_rows(RATES)
    for identical, difference in ((frozenset(), -0.2), (frozenset({"PVC"}), -0.4)):
        row = overall_tests(answers(ratings.iloc[:0], choices), identical=identical).iloc[0]
        assert row["mean_difference"] == pytest.approx(difference)
        assert row["textures"] == 2 - len(identical)


def test_nothing_is_left_where_all_models_are_identical(ratings):
    alike = frozenset({"canvas", "PVC"})
    table = overall_tests(answers(ratings.iloc[:0], choice_rows(RATES)), identical=alike)
    assert table.empty
    assert list(table) == names(OVERALL_COLUMNS)


def test_a_session_that_ended_early_does_not_compare_different_textures(ratings):
    choices = choice_rows(RATES)
    cut = (choices["participant_id"] == "sub-0") & (choices["texture"] == "PVC")
    cut &= choices["model"] == "simplified"
    row = overall_tests(answers(ratings.iloc[:0], choices[~cut])).iloc[0]
    # The first one judged only canvas with both models: 0.9 against 0.5, not 0.75 against 0.5.
    assert row["mean_difference"] == pytest.approx(np.mean([-0.4, -0.15, -0.25]))
    assert row["excluded"] == ""


def test_who_has_only_one_model_is_named(ratings):
    choices = choice_rows(RATES)
    one_day = (choices["participant_id"] == "sub-2") & (choices["model"] == "simplified")
    row = overall_tests(answers(ratings.iloc[:0], choices[~one_day])).iloc[0]
    assert (row["n"], row["excluded"]) == (2, "sub-2")
