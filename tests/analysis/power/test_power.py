"""Chances of verdicts: the very verdicts of the report, counted."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactileq.analysis.answers.plan import Claim
from tactileq.analysis.labels import ALL_TEXTURES
from tactileq.analysis.power.power import (
    EVERY_TEXTURE,
    NO_VERDICT,
    Verdict,
    people_verdicts,
    power_sentences,
    power_table,
    verdicts,
)
from tactileq.analysis.statistics.caveats import NOT_TESTED, SHOWN, WITHHELD, Caveats
from tactileq.analysis.statistics.claims import Values, all_equivalent, claim_tests, with_people
from tactileq.analysis.statistics.equivalence import (
    DIFFERENT,
    EQUIVALENT,
    INCONCLUSIVE,
)
from tactileq.analysis.statistics.participants.verdict import PeopleJudged, PeopleSummary
from tactileq.benches.validation.procedures import equivalence_power

CLAIM = Claim(
    name="same",
    task="absolute",
    measure="magnitude_similarity",
    models=("full", "simplified"),
    bounds=(-7.5, 7.5),
    test="equivalence",
)


def table_of(differences: np.ndarray) -> pd.DataFrame:
    """Values of (textures, n) differences."""
    return pd.DataFrame(
        {
            "texture": f"t{texture}",
            "participant_id": f"sub-{person}",
            "reference": 60.0,
            "other": 60.0 + difference,
        }
        for (texture, person), difference in np.ndenumerate(differences)
    )


def told(values: Values, caveats: Caveats, *, n: int) -> dict[str, str]:
    found = verdicts(CLAIM, values, n=n, caveats=caveats, rng=np.random.default_rng(1))
    return {one.texture: one.verdict for one in found}


@settings(max_examples=12, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    mean=st.sampled_from([0.0, 4.0, 12.0]),
    sd=st.sampled_from([0.0, 1.0, 9.0]),
    sensitivity=st.sampled_from([SHOWN, NOT_TESTED, "nobody felt anything"]),
    at_end=st.sampled_from([0.0, 0.5]),
)
def test_verdicts_are_those_of_the_report(
    seed: int, mean: float, sd: float, sensitivity: str, at_end: float
):
    rng = np.random.default_rng(seed)
    differences = rng.normal(mean, sd, (4, 10))
    differences[1, 3:5] = np.nan
    values = Values(table=table_of(differences), share_at_ends={"t0": at_end})
    caveats = Caveats(
        identical=["t3"], highest_share_at_ends=0.2, sensitivity=sensitivity, unfinished=False
    )
    tests = claim_tests(CLAIM, values, caveats=caveats, rng=np.random.default_rng(1))
    compared = tests[tests["texture"] != "t3"]
    known = dict(zip(compared["texture"], compared["verdict"], strict=True))
    known[EVERY_TEXTURE] = EQUIVALENT if all_equivalent(tests) else INCONCLUSIVE
    assert told(values, caveats, n=10) == known


def found_of(rng: np.random.Generator, *, textures: int) -> PeopleJudged:
    """Any posterior in short."""
    mean, half = rng.normal(0, 5), rng.uniform(0.5, 6)
    summary = PeopleSummary(
        mean=mean,
        mean_low=mean - 1.2 * half,
        mean_high=mean + 1.2 * half,
        mean90_low=mean - half,
        mean90_high=mean + half,
        **dict.fromkeys(("sd", "sd_low", "sd_high"), 2.0),
        **dict.fromkeys(("careless", "careless_low", "careless_high", "lapses"), 0.0),
        converged=bool(rng.random() < 0.8),
    )
    table = pd.DataFrame(
        {
            "texture": [f"t{number}" for number in range(textures)],
            **dict.fromkeys(("mean", "ci_low", "ci_high"), 0.0),
            "p_difference": rng.choice([0.001, 0.02, 0.5], textures),
            "p_equivalence": rng.choice([0.001, 0.01, 0.3], textures, p=[0.6, 0.3, 0.1]),
        }
    )
    return PeopleJudged(summary=summary, textures=table)


@settings(max_examples=12, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    sensitivity=st.sampled_from([SHOWN, SHOWN, NOT_TESTED]),
    at_end=st.sampled_from([0.0, 0.5]),
)
def test_verdicts_on_people_are_those_of_the_report(seed: int, sensitivity: str, at_end: float):
    rng = np.random.default_rng(seed)
    values = Values(table=table_of(rng.normal(0, 3, (4, 8))), share_at_ends={"t0": at_end})
    caveats = Caveats(identical=["t3"], highest_share_at_ends=0.2, sensitivity=sensitivity)
    found = found_of(rng, textures=3)
    tests = claim_tests(CLAIM, values, caveats=caveats, rng=rng)
    table = with_people(tests, found, CLAIM, caveats=caveats, decides=True)
    compared = table[table["texture"] != "t3"]
    known = dict(zip(compared["texture"], compared["verdict"], strict=True))
    known[EVERY_TEXTURE] = EQUIVALENT if all_equivalent(table) else INCONCLUSIVE
    told = {
        one.texture: one.verdict
        for one in people_verdicts(CLAIM, found, n=8, shares=values.share_at_ends, caveats=caveats)
    }
    if not found.summary.converged:  # too few draws to tell it, where verdicts are counted
        del told[EVERY_TEXTURE], known[EVERY_TEXTURE]
    assert told == known


def test_what_says_nothing_is_counted_as_no_verdict():
    nobody = table_of(np.full((2, 3), np.nan))
    found = told(Values(table=nobody), Caveats(), n=3)
    assert found == {ALL_TEXTURES: NO_VERDICT, "t0": NO_VERDICT, "t1": NO_VERDICT} | {
        EVERY_TEXTURE: INCONCLUSIVE
    }
    assert told(Values(table=nobody), Caveats(identical=["t0", "t1"]), n=3) == {}


def test_a_doubted_texture_is_no_equivalent_one():
    values = Values(
        table=table_of(np.tile([-0.5, 0.5, 0.0, 0.1], (2, 3))), share_at_ends={"t1": 0.3}
    )
    found = told(values, Caveats(highest_share_at_ends=0.2, sensitivity=SHOWN), n=12)
    assert found == {ALL_TEXTURES: EQUIVALENT, "t0": EQUIVALENT, "t1": WITHHELD} | {
        EVERY_TEXTURE: INCONCLUSIVE
    }


@pytest.mark.long("simulations: 300 studies")
def test_the_chance_of_equivalence_is_that_of_the_closed_form():
    """One texture, 20 people: equivalent, or different but within bounds, in 0.80."""
    rng = np.random.default_rng(4)
    simulations = 300
    found = []
    for _ in range(simulations):
        values = Values(table=table_of(rng.normal(0, 11, (1, 20))))
        caveats = Caveats(sensitivity=SHOWN)
        found += verdicts(CLAIM, values, n=20, caveats=caveats, rng=rng)
    table = power_table(found, simulations=simulations)
    every = table[table["texture"] == EVERY_TEXTURE].iloc[0]
    assert every["ci_low"] < equivalence_power(20, 0.0) < every["ci_high"]
    overall = table[table["texture"] == ALL_TEXTURES]
    assert overall["hits"].sum() == simulations
    assert overall["chance"].sum() == pytest.approx(1.0)


def rows_of(**hits: int) -> list[Verdict]:
    names = {"equal": EQUIVALENT, "differ": DIFFERENT, "unclear": INCONCLUSIVE}
    return [
        Verdict("same", ALL_TEXTURES, int(key[-2:]), names[key[:-2]])
        for key, times in hits.items()
        for _ in range(times)
    ]


def test_chances_are_counted_with_every_verdict_at_every_n():
    table = power_table(rows_of(equal20=8, unclear20=2, unclear12=9, differ12=1), simulations=10)
    assert list(zip(table["n"], table["verdict"], table["hits"], strict=True)) == [
        (12, EQUIVALENT, 0),
        (12, DIFFERENT, 1),
        (12, INCONCLUSIVE, 9),
        (20, EQUIVALENT, 8),
        (20, DIFFERENT, 0),
        (20, INCONCLUSIVE, 2),
    ]
    assert ((table["ci_low"] <= table["chance"]) & (table["chance"] <= table["ci_high"])).all()


def test_the_summary_names_the_fewest_people_with_enough_power():
    table = power_table(rows_of(equal20=8, unclear20=2, unclear12=10, equal28=10), simulations=10)
    (line,) = power_sentences(table, claims=[CLAIM])
    assert line == (
        "same: simulated: 20 participants: equivalent 0.80 (0.44–0.97), inconclusive 0.20 "
        "(0.03–0.56)"
    )
    (short,) = power_sentences(
        power_table(rows_of(unclear20=10, unclear12=10), simulations=10), claims=[CLAIM]
    )
    assert short.startswith("same: simulated: 20 participants: equivalent 0.00")
    assert short.endswith("equivalent with 80% is not reached")
    (same,) = power_sentences(power_table([], simulations=10), claims=[CLAIM])
    assert same == "same: identical models, nothing to compare"
