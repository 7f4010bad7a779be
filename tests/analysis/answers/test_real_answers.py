"""Correct rates of ten real people (HaptiComm, see tests/data/hapticomm_3x3) against counting."""

from __future__ import annotations

import csv
from collections import defaultdict
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose
from scipy import stats

from tactileq.analysis.answers.plan import Claim
from tactileq.analysis.labels import ALL_TEXTURES
from tactileq.analysis.statistics.caveats import Caveats
from tactileq.analysis.statistics.claims import Values, claim_tests, complete_means
from tactileq.analysis.statistics.rates import correct_rates

FOLDER = Path(__file__).parents[2] / "data" / "hapticomm_3x3"
TYPES = {"1": "slide", "2": "tap", "3": "tap and hold"}


@pytest.fixture(scope="module")
def answers() -> pd.DataFrame:
    """Three kinds of touch as textures; small and large arrays as the two models."""
    tables = []
    for path in sorted(FOLDER.glob("P*.csv")):
        table = pd.read_csv(path, encoding="utf-8-sig", dtype={"TYPE": str})
        tables.append(table.assign(participant_id=path.stem))
    table = pd.concat(tables, ignore_index=True)
    table = table[table["SIZE"] != 2]
    return pd.DataFrame(
        {
            "participant_id": table["participant_id"],
            "texture": table["TYPE"].map(TYPES),
            "model": table["SIZE"].map({1: "full", 3: "simplified"}),
            "correct": table["TYPE_ANS"].astype(float),
        }
    )


def _counted() -> dict[tuple[str, str, str], list[int]]:
    """Right and wrong answers by person, touch and size, counted line by line."""
    counts: dict[tuple[str, str, str], list[int]] = defaultdict(list)
    for path in sorted(FOLDER.glob("P*.csv")):
        with path.open(encoding="utf-8-sig", newline="") as file:
            for row in csv.DictReader(file):
                counts[path.stem, TYPES[row["TYPE"]], row["SIZE"]].append(int(row["TYPE_ANS"]))
    return counts


def test_rates_against_chance(answers):
    counted = _counted()
    models = ("full", "simplified")
    rates = correct_rates(answers, models, rng=np.random.default_rng(0), chance=1 / 3)
    overall = rates[(rates["texture"] == ALL_TEXTURES) & (rates["model"] == "full")].iloc[0]
    by_person: dict[str, list[int]] = defaultdict(list)
    for (person, _, size), right in counted.items():
        if size == "1":
            by_person[person] += right
    shares = [sum(right) / len(right) for right in by_person.values()]
    expected = stats.ttest_1samp(shares, 1 / 3)
    assert (overall["participants"], overall["trials"]) == (10, 180)
    assert_allclose(overall["mean"], np.mean(shares))
    assert_allclose([overall["t"], overall["p"]], [expected.statistic, expected.pvalue])
    assert overall["ci_low"] > 1 / 3  # people do recognise how they are touched


def test_paired_comparison_of_rates(answers):
    models = ("full", "simplified")
    claim = Claim(
        name="size",
        task="relative",
        measure="correct",
        models=models,
        bounds=None,
        test="difference",
    )
    means = complete_means(answers, "correct", models=models, repeats=6)
    found = claim_tests(claim, Values(table=means), caveats=Caveats(), rng=np.random.default_rng(1))
    tests = found.set_index("texture")
    counted = _counted()
    for touch in TYPES.values():
        differences = np.array(
            [
                np.mean(counted[person, touch, "3"]) - np.mean(counted[person, touch, "1"])
                for person in sorted({person for person, _, _ in counted})
            ]
        )
        expected = stats.ttest_1samp(differences, 0)
        assert_allclose(tests.loc[touch, "t"], expected.statistic)
        assert_allclose(tests.loc[touch, "d_z"], differences.mean() / differences.std(ddof=1))
