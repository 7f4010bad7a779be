"""Verdicts by the plan: families, controls, what withholds equality, who is complete."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose
from scipy import stats

from tactileq.analysis.answers.plan import Claim
from tactileq.analysis.labels import ALL_TEXTURES, IDENTICAL
from tactileq.analysis.statistics.caveats import (
    BOUNDS_WITHHELD,
    INTERIM,
    NOT_TESTED,
    SHOWN,
    WITHHELD,
    Caveats,
)
from tactileq.analysis.statistics.claims import (
    CLAIM_COLUMNS,
    CONTROL,
    Values,
    all_equivalent,
    claim_tests,
    complete_means,
    share_at_ends,
)
from tactileq.analysis.statistics.equivalence import (
    DIFFERENT,
    EQUIVALENT,
    INCONCLUSIVE,
    WITHIN_BOUNDS,
)
from tactileq.analysis.statistics.paired import holm
from tactileq.modeling.files.columns import names

CLAIM = Claim(
    name="as strong",
    task="absolute",
    measure="magnitude_similarity",
    models=("full", "simplified"),
    bounds=(-7.5, 7.5),
    test="equivalence",
)
PEOPLE = 24
SENSITIVE = Caveats(sensitivity=SHOWN)


def values(effects: dict[str, float], *, sd: float = 4.0, seed: int = 0) -> Values:
    """Ratings of each texture whose differences have exactly these means and this deviation."""
    rng = np.random.default_rng(seed)
    rows = []
    for texture, effect in effects.items():
        reference = rng.normal(60, 8, PEOPLE)
        noise = rng.normal(0, 1, PEOPLE)
        noise = (noise - noise.mean()) / noise.std(ddof=1)
        other = reference + effect + sd * noise
        people = [f"sub-{n:02d}" for n in range(PEOPLE)]
        rows.append(
            pd.DataFrame(
                {
                    "texture": texture,
                    "participant_id": people,
                    "reference": reference,
                    "other": other,
                }
            )
        )
    return Values(table=pd.concat(rows, ignore_index=True))


def verdicts_on(
    what: Values, *, caveats: Caveats | None = None, claim: Claim = CLAIM
) -> pd.DataFrame:
    return claim_tests(claim, what, caveats=caveats or SENSITIVE, rng=np.random.default_rng(1))


EFFECTS = {"canvas": 0.0, "PVC": -12.0, "MDF": 3.5, "leather": -7.0}


def test_each_texture_gets_the_verdict_that_was_planted():
    table = verdicts_on(values(EFFECTS))
    assert list(table) == names(CLAIM_COLUMNS)
    assert table["texture"].tolist() == [ALL_TEXTURES, "canvas", "leather", "MDF", "PVC"]
    found = table.set_index("texture")["verdict"].to_dict()
    assert found == {
        ALL_TEXTURES: WITHIN_BOUNDS,  # −3.9 on average
        "canvas": EQUIVALENT,
        "PVC": DIFFERENT,
        "MDF": WITHIN_BOUNDS,
        "leather": DIFFERENT,  # not significantly within
    }
    noisy = verdicts_on(values(EFFECTS, sd=25.0)).set_index("texture")["verdict"]
    assert noisy["canvas"] == noisy["MDF"] == noisy["leather"] == INCONCLUSIVE


def test_all_textures_are_a_family_of_their_own_and_textures_another():
    table = verdicts_on(values(EFFECTS))
    overall, textures = table.iloc[0], table.iloc[1:]
    assert overall["p_holm"] == overall["p"]
    assert overall["p_equivalence_holm"] == overall["p_equivalence"]
    assert_allclose(textures["p_holm"], holm(textures["p"]))
    assert_allclose(textures["p_equivalence_holm"], holm(textures["p_equivalence"]))
    assert (textures["p_equivalence_holm"] > textures["p_equivalence"]).any()


def test_the_row_over_all_textures_weighs_textures_equally_and_has_complete_people_only():
    what = values(EFFECTS)
    gone = (what.table["participant_id"] == "sub-03") & (what.table["texture"] == "PVC")
    cut = Values(table=what.table.assign(other=what.table["other"].where(~gone)))
    table = verdicts_on(cut).set_index("texture")
    assert (table["n"].drop([ALL_TEXTURES, "PVC"]) == PEOPLE).all()
    for texture in (ALL_TEXTURES, "PVC"):
        assert table.loc[texture, ["n", "excluded"]].tolist() == [PEOPLE - 1, "sub-03"]
    wide = cut.table.assign(d=cut.table["other"] - cut.table["reference"])
    wide = wide.pivot(index="participant_id", columns="texture", values="d").dropna()
    expected = stats.ttest_1samp(wide.mean(axis=1), 0)
    overall = table.loc[ALL_TEXTURES]
    assert_allclose([overall["t"], overall["p"]], [expected.statistic, expected.pvalue])
    ninety = expected.confidence_interval(0.9)
    assert_allclose([overall["ci90_low"], overall["ci90_high"]], [ninety.low, ninety.high])


def test_identical_models_are_controls_outside_the_family():
    what = values(EFFECTS)
    alone = verdicts_on(what, caveats=replace(SENSITIVE, identical={"canvas", "MDF"}))
    assert alone["texture"].tolist() == [ALL_TEXTURES, "leather", "PVC", "canvas", "MDF"]
    controls = alone[alone["verdict"] == CONTROL]
    assert (controls["note"] == IDENTICAL).all()
    assert controls[["t", "p", "p_holm", "p_equivalence", "d_z", "bf01"]].isna().all(axis=None)
    assert controls[["mean_difference", "ci_low", "mean_reference"]].notna().all(axis=None)
    fewer = Values(table=what.table[what.table["texture"].isin(["leather", "PVC"])])
    same = verdicts_on(fewer)
    pd.testing.assert_frame_equal(alone.iloc[:3], same, check_dtype=False)
    nothing = verdicts_on(what, caveats=replace(SENSITIVE, identical=set(EFFECTS)))
    assert (nothing["verdict"] == CONTROL).all()
    assert not all_equivalent(nothing)


@pytest.mark.parametrize(
    ("caveats", "share", "expected"),
    [
        (replace(SENSITIVE, highest_share_at_ends=0.2), 0.1, (EQUIVALENT, WITHIN_BOUNDS, "")),
        # Not more than planned.
        (replace(SENSITIVE, highest_share_at_ends=0.2), 0.2, (EQUIVALENT, WITHIN_BOUNDS, "")),
        (
            replace(SENSITIVE, highest_share_at_ends=0.2),
            0.65,
            (WITHHELD, BOUNDS_WITHHELD, "65% of the ratings lie at an end of the scale"),
        ),
        (Caveats(), 0.0, (WITHHELD, BOUNDS_WITHHELD, NOT_TESTED)),
        (Caveats(sensitivity="anchors alike"), 0.0, (WITHHELD, BOUNDS_WITHHELD, "anchors alike")),
    ],
)
def test_what_withholds_equality(caveats, share, expected):
    what = values({"canvas": 0.0, "PVC": -12.0, "MDF": 3.5})
    shares = {"canvas": share, "PVC": share, "MDF": share, ALL_TEXTURES: share}
    table = verdicts_on(replace(what, share_at_ends=shares), caveats=caveats).set_index("texture")
    assert (*table.loc[["canvas", "MDF"], "verdict"],) == expected[:2]
    # A difference is a difference, whatever the ends of the scale hide.
    assert table.loc["PVC", "verdict"] == DIFFERENT
    assert table["doubt"].str.startswith(expected[2]).all()
    assert (table["doubt"] == "").all() == (expected[2] == "")
    alike = replace(values({"a": 0.0}), share_at_ends={"a": share})
    assert all_equivalent(verdicts_on(alike, caveats=caveats)) is (expected[2] == "")


def test_no_doubt_is_hidden_by_holm():
    """Every texture is equivalent without Holm, none with it: nothing is left to be withheld."""
    close = values({"a": 6.0, "b": 6.0, "c": -6.0})
    assert (verdicts_on(close).iloc[1:]["p_equivalence"] < 0.05).all()
    doubted = verdicts_on(close, caveats=Caveats())
    assert WITHHELD not in set(doubted["verdict"])
    assert all_equivalent(verdicts_on(close))
    assert not all_equivalent(doubted)


def test_an_unfinished_task_shows_no_effect():
    caveats = replace(SENSITIVE, unfinished=True, identical={"MDF"})
    what = replace(values(EFFECTS), share_at_ends={"PVC": 0.1, ALL_TEXTURES: 0.2})
    table = verdicts_on(what, caveats=caveats)
    assert list(table) == names(CLAIM_COLUMNS)
    assert table["verdict"].tolist() == [*[INTERIM] * 4, CONTROL]
    told = ["claim", "measure", "planned", "texture", "verdict", "reference", "other", "n"]
    told += ["bound_low", "bound_high", "share_at_ends", "excluded", "rule", "note"]
    told += ["tests_verdict", "model_verdict"]
    assert table.drop(columns=told).isna().all(axis=None)
    assert set(table[["tests_verdict", "model_verdict"]].to_numpy().ravel()) == {""}
    assert (table["n"] == PEOPLE).all()
    assert table["note"].tolist() == [*[""] * 4, IDENTICAL]
    assert not all_equivalent(table)


def test_all_equivalent_takes_the_largest_unadjusted_p():
    close = {"a": 0.0, "b": 6.0, "c": -6.0}
    table = verdicts_on(values(close))
    textures = table.iloc[1:]
    assert (textures["p_equivalence"] < 0.05).all()
    assert (textures["p_equivalence_holm"] >= 0.05).any()  # Holm alone would not allow it
    assert all_equivalent(table)
    assert not all_equivalent(verdicts_on(values({**close, "d": 7.0})))


def test_a_claim_without_bounds_finds_no_equality():
    table = verdicts_on(values(EFFECTS), claim=replace(CLAIM, bounds=None)).set_index("texture")
    assert table["p_equivalence"].isna().all()
    assert table["bound_low"].isna().all()
    assert table.loc["canvas", "verdict"] == INCONCLUSIVE
    assert table.loc["PVC", "verdict"] == DIFFERENT
    assert not all_equivalent(table.reset_index())


@pytest.mark.filterwarnings("error")
def test_nobody_complete_is_told_and_not_tested():
    what = values({"canvas": 0.0})
    one_model = Values(table=what.table.assign(other=np.nan))
    table = verdicts_on(one_model)
    assert (table["n"] == 0).all()
    assert (table["verdict"] == "").all()
    assert table["note"].str.startswith("t undefined").all()


def test_means_count_where_every_repeat_was_answered():
    rows = [
        ("sub-01", "canvas", "full", 10.0),
        ("sub-01", "canvas", "full", 20.0),
        ("sub-01", "canvas", "simplified", 30.0),
        ("sub-01", "canvas", "simplified", np.nan),
        ("sub-02", "canvas", "full", 50.0),
        ("sub-02", "canvas", "full", 60.0),
        ("sub-02", "canvas", "simplified", 70.0),
        ("sub-02", "canvas", "simplified", 90.0),
        ("sub-02", "PVC", "full", 1.0),
        ("sub-02", "canvas", "AR", 5.0),
    ]
    table = pd.DataFrame(rows, columns=["participant_id", "texture", "model", "rating"])
    means = complete_means(table, "rating", models=("full", "simplified"), repeats=2)
    by = means.set_index(["participant_id", "texture"])
    assert by.loc[("sub-01", "canvas"), "reference"] == 15.0
    assert np.isnan(by.loc[("sub-01", "canvas"), "other"])
    assert by.loc[("sub-02", "canvas")].tolist() == [55.0, 80.0]
    assert by.loc[[("sub-01", "PVC"), ("sub-02", "PVC")]].isna().all(axis=None)


def test_the_share_at_the_ends_leaves_identical_textures_out_of_the_whole():
    table = pd.DataFrame(
        {"texture": ["a", "a", "b", "b", "b"], "rating": [100.0, 50.0, 0.0, 100.0, np.nan]}
    )
    shares = share_at_ends(table, "rating", identical={"b"}, ends=(0.0, 100.0))
    assert shares == {"a": 0.5, "b": 1.0, ALL_TEXTURES: 0.5}
