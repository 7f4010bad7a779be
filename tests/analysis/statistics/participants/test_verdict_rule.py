"""The rule that turns a posterior into a verdict, and what may be said where there is doubt."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from tactileq.analysis.labels import ALL_TEXTURES
from tactileq.analysis.statistics.caveats import (
    BOUNDS_WITHHELD,
    DIFFERENCES,
    EQUALITY,
    INTERIM,
    NOT_CONVERGED,
    SHOWN,
    WITHHELD,
    Caveats,
)
from tactileq.analysis.statistics.claims import words_of_people
from tactileq.analysis.statistics.equivalence import (
    DIFFERENT,
    EQUIVALENT,
    INCONCLUSIVE,
    WITHIN_BOUNDS,
)
from tactileq.analysis.statistics.participants import verdict as verdict_module
from tactileq.analysis.statistics.participants.design import PeopleData
from tactileq.analysis.statistics.participants.posterior import Draws
from tactileq.analysis.statistics.participants.verdict import (
    PeopleJudged,
    PeopleSummary,
    people_found,
    summary_of,
    texture_table,
)
from tactileq.modeling.arrays import Floats
from tactileq.modeling.participants.ratings import RatingStudies

BOUNDS = (-7.5, 7.5)
# Mean near 0 and well inside.
EQUAL = PeopleSummary(
    mean=0.5,
    mean_low=-2.0,
    mean_high=3.0,
    mean90_low=-1.6,
    mean90_high=2.6,
    sd=3.0,
    sd_low=1.0,
    sd_high=6.0,
    careless=0.05,
    careless_low=0.0,
    careless_high=0.2,
    lapses=0.04,
    converged=True,
)
WIDE = {"mean_low": -9.0, "mean_high": 10.0, "mean90_low": -8.0, "mean90_high": 9.0}
ABOVE = {"mean": 9.0, "mean_low": 5.0, "mean_high": 13.0, "mean90_low": 5.6, "mean90_high": 12.4}
BELOW = {"mean": -4.0, "mean_low": -7.9, "mean_high": -1.0, "mean90_low": -7.4, "mean90_high": -1.4}
NEARLY = {"mean": 5.0, "mean_low": -0.1, "mean_high": 8.0, "mean90_low": 0.5, "mean90_high": 7.6}


@pytest.mark.parametrize(
    ("changes", "word"),
    [
        ({}, EQUIVALENT),
        (BELOW, WITHIN_BOUNDS),  # the 90 % interval decides, not that of 95 %
        (WIDE, INCONCLUSIVE),
        (NEARLY, INCONCLUSIVE),  # the 95 % interval holds 0, whatever that of 90 % does
        (ABOVE, DIFFERENT),
        ({"sd": 40.0, "sd_high": 60.0, "careless": 0.6}, EQUIVALENT),  # of the mean alone
        ({"converged": False}, NOT_CONVERGED),
        ({**ABOVE, "converged": False}, NOT_CONVERGED),
    ],
)
def test_each_word_has_its_place(changes: dict[str, float], word: str) -> None:
    assert replace(EQUAL, **changes).verdict(BOUNDS) == word


@given(st.tuples(*[st.floats(-20.0, 20.0)] * 5), st.tuples(st.floats(-15, -1), st.floats(1, 15)))
def test_words_rest_on_both_intervals(
    means: tuple[float, ...], bounds: tuple[float, float]
) -> None:
    low, low90, middle, high90, high = sorted(means)
    one = replace(
        EQUAL, mean=middle, mean_low=low, mean_high=high, mean90_low=low90, mean90_high=high90
    )
    word = one.verdict(bounds)
    assert (word in EQUALITY) == (bounds[0] < low90 and high90 < bounds[1])
    assert (word in DIFFERENCES) == (not low <= 0 <= high)
    assert Caveats().allowed(word) not in EQUALITY  # without proof of sensitivity nothing is equal
    assert (Caveats().allowed(word) in DIFFERENCES) == (word in DIFFERENCES)
    assert Caveats(sensitivity=SHOWN).allowed(word) == word


# --- From draws to numbers --------------------------------------------------------------------


def normal(mean: float, sd: float) -> Floats:
    """Normal quantiles as four chains that agree and do not remember."""
    drawn = mean + sd * stats.norm.ppf((np.arange(4000) + 0.5) / 4000)
    return np.random.default_rng(1).permutation(drawn).reshape(4, 1000)


def stacked(*columns: Floats) -> Floats:
    return np.stack(columns, axis=-1)


def apart(values: Floats) -> Floats:
    """The same with a chain elsewhere."""
    return values + np.array([0.0, 0.0, 0.0, 50.0])[:, None]


def draws_of(**given: Floats) -> Draws:
    """Two textures, three people."""
    share = stats.norm.cdf(normal(0, 1))
    good = {
        "mean": normal(2.0, 3.0),
        "textures": stacked(normal(1.0, 2.0), normal(3.0, 2.0)),
        "people_sd": np.abs(normal(5.0, 1.0)),
        "effects": stacked(normal(-4.0, 2.0), normal(0.0, 3.0), normal(9.0, 4.0)),
        "attends": stacked(share < 0.9, share < 0.2, share < 2.0),
        "careless": share,
        "lapses": share / 10,
        "at_ends": share,
        "spread": stacked(share, share + 1, share + 2),
        "repeated": share,
    }
    return Draws(**{**good, **given})


def test_a_summary_is_made_of_quantiles() -> None:
    one = summary_of(draws_of())
    z = stats.norm.ppf([0.5, 0.975, 0.95])
    near = {"abs": 0.01}
    assert (one.mean, one.mean_low, one.mean_high) == pytest.approx(
        (2.0, 2 - 3 * z[1], 2 + 3 * z[1]), **near
    )
    assert (one.mean90_low, one.mean90_high) == pytest.approx((2 - 3 * z[2], 2 + 3 * z[2]), **near)
    assert (one.sd, one.sd_low, one.sd_high) == pytest.approx((5, 5 - z[1], 5 + z[1]), **near)
    assert (one.careless, one.careless_low, one.careless_high) == pytest.approx(
        (0.5, 0.025, 0.975), abs=1e-3
    )
    assert one.lapses == pytest.approx(0.05, abs=1e-4)
    assert one.converged


def test_what_is_not_sampled_well_is_not_told() -> None:
    whole = draws_of()
    for name, lost in (
        ("people_sd", ["sd", "sd_low", "sd_high"]),
        ("careless", ["careless", "careless_low", "careless_high"]),
        ("lapses", ["lapses"]),
    ):
        found = vars(summary_of(draws_of(**{name: apart(getattr(whole, name))})))
        assert sorted(field for field, value in found.items() if np.isnan(value)) == sorted(lost)
        assert found["converged"]
    assert not summary_of(draws_of(mean=apart(whole.mean))).converged
    one_bad = whole.textures.copy()
    one_bad[..., 1] = apart(one_bad[..., 1])
    assert not summary_of(draws_of(textures=one_bad)).converged
    assert summary_of(draws_of(mean=apart(whole.mean)), converged=True).converged


@pytest.mark.parametrize("bounds", [BOUNDS, (-2.0, 9.0)])
def test_p_of_textures_is_the_share_of_a_normal_posterior(bounds: tuple[float, float]) -> None:
    planted = [(1.0, 2.0), (-3.0, 2.0), (5.0, 3.0), (6.0, 0.2)]
    draws = draws_of(textures=stacked(*(normal(*one) for one in planted)))
    table = texture_table(draws, bounds, textures=list("dcba"))
    assert list(table["texture"]) == list("dcba")
    flat = draws.textures.reshape(-1, 4)
    for row, one, (mean, sd) in zip(table.itertuples(), flat.T, planted, strict=True):
        assert row.mean == pytest.approx(mean, abs=1e-6)
        z = stats.norm.ppf(0.975)
        assert (row.ci_low, row.ci_high) == pytest.approx((mean - z * sd, mean + z * sd), abs=0.01)
        beyond_zero = min((one > 0).mean(), (one < 0).mean())
        assert row.p_difference == pytest.approx(2 * beyond_zero, abs=2e-3)
        outside = max((one < bounds[0]).mean(), (one > bounds[1]).mean())
        assert row.p_equivalence == pytest.approx(outside, abs=2e-3)
    assert 0 < table["p_difference"].iloc[3] < 1e-100  # of which no draws are left to count


def test_people_are_told_only_as_far_as_they_are_sampled_well(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    whole = draws_of()
    effects = whole.effects.copy()
    effects[..., 1] = apart(effects[..., 1])
    attends = whole.attends.copy()
    attends[0, :, 0] = False
    draws = draws_of(effects=effects, attends=attends)
    monkeypatch.setattr(verdict_module, "sufficient_draws", lambda studies, **_: [draws])
    values = np.full((1, 3, 2, 2, 2), 50.0)
    values[..., 1] = 60.0
    values[0, 0, 0, 0, 1] = np.nan
    studies = RatingStudies(
        values=values, anchors=np.zeros((1, 3, 0)), trends=np.zeros((2, *values.shape))
    )
    data = PeopleData(studies=studies, people=["a", "b", "c"], textures=["t1", "t2"])
    found = people_found(data, BOUNDS, rng=np.random.default_rng(1))
    table = found.people.set_index("participant_id")
    assert list(table.index) == ["a", "b", "c"]
    z = stats.norm.ppf(0.975)
    for who, mean, sd in (("a", -4.0, 2.0), ("c", 9.0, 4.0)):
        told = table.loc[who, ["effect", "ci_low", "ci_high"]].tolist()
        assert told == pytest.approx([mean, mean - z * sd, mean + z * sd], abs=0.02)
    assert table.loc["b", ["effect", "ci_low", "ci_high"]].isna().all()
    assert table["careless"].tolist() == pytest.approx([np.nan, 0.8, 0.0], abs=1e-3, nan_ok=True)
    assert found.replicated.spread.shape == (4000, 3)
    assert found.replicated.at_ends.shape == found.replicated.repeated.shape == (4000,)
    assert found.given.repeated[0] == pytest.approx(np.sqrt(50.0))


# --- Verdicts on all textures and on each -----------------------------------------------------


def judged(
    p: dict[str, tuple[float, float]], summary: PeopleSummary = EQUAL
) -> tuple[PeopleJudged, list[str]]:
    columns = ["texture", "p_difference", "p_equivalence"]
    table = pd.DataFrame([(name, *two) for name, two in p.items()], columns=columns)
    return PeopleJudged(summary=summary, textures=table), list(p)


def words(
    found: PeopleJudged, textures: list[str], *, caveats: Caveats, **shares: float
) -> dict[str, str]:
    return words_of_people(found, BOUNDS, textures=textures, shares=shares, caveats=caveats)


def steps(values: list[float]) -> list[bool]:
    """Which of these p values Holm's steps leave below .05."""
    left, found = sorted(range(len(values)), key=values.__getitem__), [False] * len(values)
    for place, at in enumerate(left):
        if values[at] * (len(values) - place) >= 0.05:
            break
        found[at] = True
    return found


small = st.floats(0.0, 0.06)


@given(st.lists(st.tuples(small, small), min_size=1, max_size=7))
def test_probabilities_of_textures_are_corrected_by_holms_steps(
    p: list[tuple[float, float]],
) -> None:
    named = {f"t{place}": two for place, two in enumerate(p)}
    found, textures = judged({**named, "identical": (0.0, 0.0)})
    said = words(found, textures[:-1], caveats=Caveats(sensitivity=SHOWN))
    assert list(said) == [ALL_TEXTURES, *named]
    assert said[ALL_TEXTURES] == EQUIVALENT
    differs, equals = (steps(list(column)) for column in zip(*p, strict=True))
    for texture, one, other in zip(named, differs, equals, strict=True):
        assert (said[texture] in DIFFERENCES, said[texture] in EQUALITY) == (one, other)


def test_doubt_takes_words_of_equality_where_it_stands() -> None:
    found, textures = judged({"a": (0.9, 0.001), "b": (0.001, 0.001), "c": (0.001, 0.9)})
    sure = Caveats(sensitivity=SHOWN, highest_share_at_ends=0.2)
    shown = words(found, textures, caveats=sure, **{ALL_TEXTURES: 0.1, "a": 0.3, "b": 0.1})
    assert list(shown.values()) == [EQUIVALENT, WITHHELD, WITHIN_BOUNDS, DIFFERENT]
    doubted = words(found, textures, caveats=Caveats())
    assert list(doubted.values()) == [WITHHELD, WITHHELD, BOUNDS_WITHHELD, DIFFERENT]
    early = words(found, textures, caveats=Caveats(sensitivity=SHOWN, unfinished=True))
    assert set(early.values()) == {INTERIM}


def test_of_draws_that_do_not_suffice_nothing_is_said_of_any_texture() -> None:
    found, textures = judged({"a": (0.9, 0.001), "b": (0.0, 0.9)}, replace(EQUAL, converged=False))
    said = words(found, textures, caveats=Caveats(sensitivity=SHOWN))
    assert said == dict.fromkeys([ALL_TEXTURES, "a", "b"], NOT_CONVERGED)
