"""GEE against the closed form of one texture, planted odds, and cells that are all right."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose
from scipy import special, stats

from tactileq.analysis.chapters.single_answers.gee import (
    GEE,
    GEE_COLUMNS,
    SIGN_FLIPS,
    fit_gee,
    gee_effects,
)
from tactileq.analysis.labels import ALL_TEXTURES
from tactileq.analysis.statistics.design import design
from tactileq.modeling.files.columns import names

MODELS = ("full", "simplified")
pytestmark = pytest.mark.filterwarnings("error")


def rng() -> np.random.Generator:
    return np.random.default_rng(5)


def answers(
    log_odds: dict[str, tuple[float, float]], *, people: int = 20, repeats: int = 6, seed: int = 1
) -> pd.DataFrame:
    """Right and wrong answers in shuffled order; log odds with the reference, and their change."""
    draws = np.random.default_rng(seed)
    rows = []
    for person in range(people):
        ability = draws.normal(0, 0.5)
        own = [
            (f"sub-{person:02d}", texture, model, float(draws.random() < special.expit(z)))
            for texture, (base, change) in log_odds.items()
            for other, model in enumerate(MODELS)
            for z in [base + ability + change * other] * repeats
        ]
        rows += [own[place] for place in draws.permutation(len(own))]
    return pd.DataFrame(rows, columns=["participant_id", "texture", "model", "correct"])


def effects(table: pd.DataFrame, column: str = "correct", largest: float = 1.0) -> pd.DataFrame:
    found = gee_effects(table, column, models=MODELS, largest=largest, rng=rng())
    assert list(found) == names(GEE_COLUMNS)
    return found.set_index("texture")


def closed_form(right: np.ndarray, trials: int) -> tuple[float, float]:
    """Difference of log odds and its error (Mancl and DeRouen 2001), of (n, 2) counts."""
    n = len(right)
    share = right.mean(axis=0) / trials
    estimate = special.logit(share[1]) - special.logit(share[0])
    weight = trials * share * (1 - share)
    # A cluster's leverage in a cell is 1/n, so that its residuals grow by n/(n − 1).
    residuals = (right - trials * share) * n / (n - 1)
    scores = residuals / (n * weight)
    influence = scores[:, 1] - scores[:, 0]
    return float(estimate), float(np.sqrt((influence**2).sum()))


def test_one_texture_has_the_closed_form():
    table = answers({"canvas": (0.3, 0.8)})
    built = design(table, "correct", models=MODELS)
    found = fit_gee(built.values, built.columns[:, :2], people=built.people)
    assert found is not None
    counts = table.pivot_table(
        index="participant_id", columns="model", values="correct", aggfunc="sum"
    )
    estimate, error = closed_form(counts[list(MODELS)].to_numpy(), trials=6)
    assert_allclose([found[0][0], found[1][0]], [estimate, error], rtol=1e-6)


def test_planted_odds_lie_in_their_interval_and_every_texture_counts_once():
    planted = {"canvas": (0.0, 0.9), "leather": (0.5, 0.0), "PVC": (-0.5, 0.6)}
    table = answers(planted, people=60, repeats=8)
    found = effects(table)
    assert list(found.index) == [ALL_TEXTURES, *planted]
    assert (found["method"] == GEE).all()
    assert (found["df"] == 59).all()
    truths = {ALL_TEXTURES: 0.5, **{name: change for name, (_, change) in planted.items()}}
    for texture, truth in truths.items():
        row = found.loc[texture]
        # An effect within a person is a little larger than that over people.
        assert row["ci_low"] < np.exp(0.95 * truth) < row["ci_high"], texture
    expected = table.groupby(["model", "texture"])["correct"].mean().groupby("model").mean()
    shown = found.loc[ALL_TEXTURES, ["share_reference", "share_other"]].astype(float)
    assert_allclose(shown, expected[list(MODELS)])


def test_a_cell_that_is_all_right_goes_to_sign_flips():
    table = answers({"canvas": (0.0, 1.0), "leather": (0.5, 0.0)})
    separated = (table["texture"] == "leather") & (table["model"] == "full")
    table.loc[separated, "correct"] = 1.0
    found = effects(table)
    for texture in (ALL_TEXTURES, "leather"):
        row = found.loc[texture]
        assert row["method"] == SIGN_FLIPS
        assert row["note"].endswith("(leather with full)")
        assert np.isnan(row[["odds_ratio", "ci_low", "ci_high", "t"]].astype(float)).all()
        assert 0 < row["p"] <= 1
    assert found.loc["canvas", "method"] == GEE
    assert found.loc["leather", "p"] < 0.01


def test_all_right_is_no_difference_rather_than_undefined():
    table = answers({"canvas": (0.0, 0.0)}).assign(correct=1.0)
    row = effects(table).loc[ALL_TEXTURES]
    assert (row["method"], row["p"]) == (SIGN_FLIPS, 1.0)
    assert row["note"] == "all answers are the same"


def test_ratings_are_shares_of_the_largest():
    draws = np.random.default_rng(2)
    table = answers({"canvas": (0, 0), "leather": (0, 0)}, people=16, repeats=2)
    lower = 10.0 * (table["model"] == "simplified")
    person = table["participant_id"].map(lambda name: hash_free(name)) * 1.0
    table["rating"] = np.clip(70 + person - lower + draws.normal(0, 8, len(table)), 1, 99)
    found = effects(table, "rating", 100.0)
    row = found.loc[ALL_TEXTURES]
    assert row["method"] == GEE
    assert row["p"] < 0.001
    shares = row[["share_other", "share_reference"]].astype(float)
    assert row["odds_ratio"] == pytest.approx(np.exp(np.subtract(*special.logit(shares))), rel=0.02)


def hash_free(name: str) -> int:
    """A number of the participant's own, −9 … 9."""
    return (int(name[4:]) * 7) % 19 - 9


def test_the_level_holds_for_ten_people_who_differ_in_their_effect():
    """Rejections of 150 studies without an effect: a binomial of 0.05, with a chance of 1e-4."""
    rejected = 0
    for seed in range(150):
        draws = np.random.default_rng(seed)
        z = draws.normal(0.5, 0.6, (10, 1)) + draws.normal(0, 0.5, (10, 2))
        right = draws.random((10, 2, 12)) < special.expit(z)[..., None]
        people = np.repeat(np.arange(10), 24)
        model = np.tile(np.repeat([-0.5, 0.5], 12), 10)
        found = fit_gee(
            right.astype(float).ravel(),
            np.column_stack([model, np.ones_like(model)]),
            people=people,
        )
        assert found is not None
        t = found[0][0] / found[1][0]
        rejected += 2 * stats.t.sf(abs(t), 9) < 0.05
    assert stats.binom.ppf(5e-5, 150, 0.05) <= rejected <= stats.binom.ppf(1 - 5e-5, 150, 0.05)


def test_nobody_and_one_participant():
    table = answers({"canvas": (0.0, 1.0)})
    nobody = effects(table.iloc[:0]).loc[ALL_TEXTURES]
    assert (nobody["n"], nobody["answers"]) == (0, 0)
    assert np.isnan(nobody["p"])
    one = effects(table[table["participant_id"] == "sub-00"]).loc[ALL_TEXTURES]
    assert (one["n"], one["method"], one["note"]) == (1, SIGN_FLIPS, "1 participant")


def test_two_participants_may_leave_the_limits_open():
    """Twelve times an error of 60 and more: no warning of an overflow."""
    row = effects(answers({"canvas": (0.0, 1.0), "PVC": (0.0, 0.0)}, people=2, repeats=2, seed=22))
    assert row.loc["canvas", "method"] == GEE
    assert row.loc["canvas", ["ci_low", "ci_high"]].tolist() == [0.0, np.inf]
