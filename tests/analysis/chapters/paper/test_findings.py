"""The paper's findings beside ours: planted truths come out as what they are."""

from __future__ import annotations

from dataclasses import replace
from math import nan

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from tactileq.analysis.chapters.paper.findings import (
    CONTRADICTED,
    NOT_COMPARABLE,
    OPEN,
    REPLICATED,
    _outcome,
    detectable,
    finding_table,
    in_words,
    of_answers,
    of_models,
)
from tactileq.analysis.chapters.paper.section import paper_section, sections
from tactileq.analysis.page.page import Table
from tactileq.analysis.statistics.verdicts import ClaimFound

numbers = st.integers(-10, 10)


@given(numbers, numbers, numbers, st.sampled_from([-1, 1]))
def test_what_speaks_for_one_side_speaks_against_the_other(one, other, at, sign):
    low, high = sorted((one, other))
    for_it = _outcome(low, high, at=at, sign=sign)
    against = _outcome(low, high, at=at, sign=-sign)
    pairs = {(REPLICATED, CONTRADICTED), (CONTRADICTED, REPLICATED), (OPEN, OPEN)}
    assert (for_it, against) in pairs
    assert _outcome(low, high, at=at, sign=None) in (OPEN, CONTRADICTED)  # equality needs proof
    mirrored = _outcome(2 * at - high, 2 * at - low, at=at, sign=-sign)
    if low not in (at,) and high not in (at,):
        assert mirrored == for_it


@pytest.mark.parametrize(
    ("low", "high", "sign", "equal", "outcome"),
    [
        (-9.0, -2.0, -1, False, REPLICATED),
        (2.0, 9.0, -1, False, CONTRADICTED),
        (-2.0, 9.0, -1, False, OPEN),
        (-2.0, 2.0, -1, True, CONTRADICTED),
        (2.0, 9.0, 0, False, REPLICATED),
        (-2.0, 2.0, None, True, REPLICATED),
        (-2.0, 2.0, None, False, OPEN),
        (1.0, 2.0, None, True, CONTRADICTED),
        (nan, nan, 1, False, OPEN),
    ],
)
def test_an_interval_decides(low, high, sign, equal, outcome):
    assert _outcome(low, high, at=0.0, sign=sign, equal=equal) == outcome


@pytest.mark.parametrize("participants", [8, 20, 24])
def test_the_detectable_effect_has_a_power_of_80_percent(participants):
    effect = detectable(participants)
    df, shift = participants - 1, effect * np.sqrt(participants)
    limit = stats.t.ppf(0.975, df)
    power = stats.nct.sf(limit, df, shift) + stats.nct.cdf(-limit, df, shift)
    assert power == pytest.approx(0.8, abs=1e-6)


def planted(found: list[ClaimFound], shift: dict[str, float]) -> list[ClaimFound]:
    """The claim on magnitude with these differences, of a standard deviation of 4 points."""
    one = found[0]
    noise = stats.norm.ppf((np.arange(16) + 0.5) / 16)
    rows, tests = [], []
    template = one.tests.iloc[0].to_dict()
    for texture, mean in shift.items():
        difference = mean + 4 * noise / noise.std(ddof=1)
        half = stats.t.ppf(0.975, 15) * 4 / 4
        rows += [(texture, f"sub-{n:02d}", 60.0, 60.0 + each) for n, each in enumerate(difference)]
        ends = {"ci_low": mean - half, "ci_high": mean + half}
        means = {"texture": texture, "mean_difference": mean, "verdict": "", "tests_verdict": ""}
        tests.append({**template, **means, **ends, "doubt": ""})
    values = pd.DataFrame(rows, columns=["texture", "participant_id", "reference", "other"])
    return [replace(one, tests=pd.DataFrame(tests), values=values)]


def test_planted_differences_are_held_against_the_paper(found):
    shifts = {"PVC": -10.0, "leather": 10.0, "MDF": -10.0, "canvas": 0.5, "cork": -10.0}
    magnitude = of_answers(planted(found, shifts), {})
    by_texture = {one.texture: one for one in magnitude if one.kind == "magnitude changes"}
    outcomes = {texture: one.outcome for texture, one in by_texture.items()}
    assert outcomes == {
        "PVC": REPLICATED,
        "leather": CONTRADICTED,  # the other way round
        "MDF": CONTRADICTED,  # the paper found no difference
        "canvas": OPEN,
    }  # nothing of cork, which is not in the paper
    for one in by_texture.values():
        assert one.left_open == pytest.approx(detectable(20) * 4.0)
    above = {one.texture: one.outcome for one in magnitude if one.kind == "full model above 50"}
    assert above["MDF"] in (REPLICATED, OPEN)


def test_ratings_above_and_below_the_middle_are_told_apart(found):
    (one,) = planted(found, {"aluminum": 0.0, "PVC": 0.0, "canvas": 0.0})
    spread = np.tile(stats.norm.ppf((np.arange(16) + 0.5) / 16), 3)
    levels = one.values["texture"].map({"aluminum": 30.0, "PVC": 70.0, "canvas": 30.0})
    rated = replace(one, values=one.values.assign(reference=levels + 5 * spread))
    above = {f.texture: f.outcome for f in of_answers([rated], {}) if "above 50" in f.kind}
    assert above == {"aluminum": REPLICATED, "PVC": REPLICATED, "canvas": CONTRADICTED}


def test_identical_models_are_not_compared(found):
    (one,) = planted(found, {"PVC": -10.0})
    same = replace(one, caveats=replace(one.caveats, identical={"PVC": "identical"}))
    changes = [f for f in of_answers([same], {}) if f.kind == "magnitude changes"]
    assert [f.outcome for f in changes] == [NOT_COMPARABLE]


def test_models_of_the_paper_are_compared_and_no_others():
    centroids = pd.DataFrame(
        {
            "texture": ["canvas", "PVC", "cork"],
            "conditions": 49,
            "slope_speed_alone": [0.3, -0.3, 0.3],
            "p_speed_alone": [1e-6, 1e-6, 1e-6],
            "amplitude_r": [0.95, 0.1, 0.9],
        }
    )
    gfc = pd.DataFrame(
        {
            "texture": ["canvas", "canvas", "PVC", "PVC"],
            "model": ["full", "simplified"] * 2,
            "layers": [4, 3, 4, 4],
            "gfc30_mean": [0.999, 0.995, 0.999, 0.999],
        }
    )
    found = {(one.texture, one.where): one.outcome for one in of_models(centroids, gfc)}
    assert found == {
        ("canvas", "figure 5"): REPLICATED,
        ("PVC", "figure 5"): CONTRADICTED,
        ("canvas", "text of IV"): REPLICATED,
        ("PVC", "text of IV"): CONTRADICTED,
        ("canvas", "table 3"): REPLICATED,
        ("PVC", "table 3"): NOT_COMPARABLE,
    }


def test_the_section_counts_and_names_what_is_contradicted(found):
    findings = of_answers(planted(found, {"PVC": -10.0, "leather": 10.0}), {})
    section = paper_section(findings, simulated=True)
    assert "evidence neither for the paper nor against it" in section.answer
    assert section.answer == in_words(findings, simulated=True)
    assert [o.sentence.split(",")[0] for o in section.outcomes] == ["Contradicted: leather"]
    (table,) = (item for item in section.items if isinstance(item, Table))
    assert len(table.frame) == len(findings)
    assert set(finding_table(findings)["outcome"]) <= {REPLICATED, CONTRADICTED, OPEN}


def test_without_a_texture_of_the_paper_there_is_no_chapter():
    assert sections(None, None) == []
