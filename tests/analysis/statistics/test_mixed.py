"""Models of single answers: the predictor, a published mixed model, planted effects."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.optimize import minimize

from tactileq.analysis.statistics.design import (
    MODEL_EFFECT,
    ORDER,
    SESSION,
    complete_participants,
    design,
)
from tactileq.analysis.statistics.mixed import (
    MIXED_COLUMNS,
    MIXED_MODEL,
    PAIRED,
    fit_mixed,
    mixed_effects,
    t_of,
)
from tactileq.analysis.statistics.paired import paired_test
from tactileq.modeling.files.columns import names

DATA = Path(__file__).parents[2] / "data" / "sleepstudy" / "reaction_ms.tsv"
MODELS = ("full", "simplified")
TEXTURES = ("canvas", "leather", "PVC")
pytestmark = pytest.mark.filterwarnings("error")


def rng() -> np.random.Generator:
    return np.random.default_rng(7)


def planted(
    effect: float = 0.0,
    *,
    people: int = 12,
    slope_sd: float = 6.0,
    session: float = 0.0,
    order: float = 0.0,
    noise_sd: float = 5.0,
    mirrored: bool = False,
    seed: int = 3,
) -> pd.DataFrame:
    """Two sessions of ratings, each cell twice in each; shuffled, or forth and back again."""
    draws = np.random.default_rng(seed)
    cells = [(texture, model) for texture in TEXTURES for model in MODELS]
    rows = []
    for person in range(people):
        own, slope = draws.normal(60, 10), draws.normal(effect, slope_sd)
        for day in range(2):
            first = [cells[place] for place in draws.permutation(len(cells))]
            both = [*first, *first[::-1]]
            if not mirrored:
                both = [both[place] for place in draws.permutation(len(both))]
            for place, (texture, model) in enumerate(both):
                value = own + 4 * TEXTURES.index(texture) + slope * (model == "simplified")
                value += session * day + order * place / (len(both) - 1)
                value += draws.normal(0, noise_sd)
                rows.append((f"sub-{person:02d}", f"ses-{day + 1}", texture, model, value))
    columns = ["participant_id", "session", "texture", "model", "rating"]
    return pd.DataFrame(rows, columns=columns)


def model_row(answers: pd.DataFrame) -> pd.Series:
    return mixed_effects(answers, "rating", models=MODELS, rng=rng()).iloc[0]


def test_a_published_model_of_reaction_times():
    """Bates et al. 2015: reaction on days, correlated random intercept and slope."""
    table = pd.read_csv(DATA, sep="\t", index_col=0)
    assert table.shape == (18, 10)
    days = np.tile(np.arange(10.0), 18)
    fit = fit_mixed(
        table.to_numpy().ravel(),
        np.column_stack([np.ones_like(days), days]),
        slope=days,
        people=np.repeat(table.index.to_numpy(), 10),
    )
    assert fit is not None
    assert_allclose(fit.estimates, [251.405, 10.467], atol=5e-4)
    assert_allclose(fit.errors, [6.825, 1.546], atol=5e-4)
    spread = [fit.intercept_sd, fit.slope_sd, fit.residual_sd]
    assert_allclose(spread, [24.741, 5.922, 25.592], atol=1e-3)


def covariance_of_moments(answers: pd.DataFrame) -> np.ndarray:
    """Of balanced answers: the covariance of intercepts and slopes.

    Of each person's least-squares coefficients, less what the noise adds to it. Where it is
    positive definite, it is what restricted maximum likelihood finds (Searle, Casella and
    McCulloch 1992).
    """
    built = design(answers, "rating", models=MODELS)
    fixed = built.columns
    rest = built.values - fixed @ np.linalg.lstsq(fixed, built.values, rcond=None)[0]
    random = np.column_stack([np.ones_like(built.model), built.model])
    people = [built.people == who for who in np.unique(built.people)]
    found = np.array([np.linalg.lstsq(random[own], rest[own], rcond=None)[0] for own in people])
    left = np.concatenate(
        [rest[own] - random[own] @ c for own, c in zip(people, found, strict=True)]
    )
    noise = np.sum(left**2) / (left.size - 2 * len(people) - (fixed.shape[1] - 2))
    own = random[people[0]]
    return np.cov(found.T) - noise * np.linalg.inv(own.T @ own)


@settings(max_examples=8, deadline=None)
@given(seed=st.integers(0, 2**20), effect=st.floats(-20, 20))
@example(seed=230, effect=0.0)  # L-BFGS stops before the maximum from several starting points
def test_of_balanced_answers_it_is_the_paired_test(seed: int, effect: float):
    answers = planted(effect, mirrored=True, seed=seed)
    # Within the boundary of covariances; what holds on it, the next test says.
    assume(np.linalg.eigvalsh(covariance_of_moments(answers)).min() > 0)
    row = model_row(answers)
    whole = complete_participants(answers, "rating", models=MODELS)
    paired = paired_test(whole["full"], whole["simplified"], rng=rng())
    assert (row["method"], row["note"], row["n"], row["df"]) == (MIXED_MODEL, "", 12, 11)
    assert_allclose(row["estimate"], paired.mean_difference, atol=1e-8)
    limits = row[["t", "ci_low", "ci_high"]].astype(float)
    assert_allclose(limits, [paired.t, paired.ci_low, paired.ci_high], rtol=2e-3, atol=2e-3)


def test_where_intercepts_and_slopes_are_perfectly_correlated_the_maximum_is_found():
    """The covariance of moments has a negative eigenvalue, so the maximum is on the boundary.

    There another restricted likelihood, written out here, is maximised over both deviations.
    """
    answers = planted(1.5, mirrored=True, seed=6604)
    assert np.linalg.eigvalsh(covariance_of_moments(answers)).min() < 0
    built = design(answers, "rating", models=MODELS)
    values, fixed = built.values, built.columns
    same = built.people[:, None] == built.people[None, :]

    def fitted(logarithms: np.ndarray) -> tuple[float, np.ndarray]:
        intercept, slope, noise = np.exp(logarithms)
        effects = intercept + slope * built.model
        covariance = np.where(same, np.outer(effects, effects), 0) + noise**2 * np.eye(values.size)
        inverse = np.linalg.inv(covariance)
        information = fixed.T @ inverse @ fixed
        rest = values - fixed @ np.linalg.solve(information, fixed.T @ inverse @ values)
        determinants = np.linalg.slogdet(covariance)[1] + np.linalg.slogdet(information)[1]
        return float(determinants + rest @ inverse @ rest), np.linalg.inv(information)

    best = minimize(lambda at: fitted(at)[0], np.log([11.0, 5.0, 5.0]), method="Nelder-Mead")
    row = model_row(answers)
    assert row["method"] == MIXED_MODEL
    place = built.terms[MODEL_EFFECT]
    assert_allclose(row["se"], np.sqrt(fitted(best.x)[1][place, place]), rtol=2e-3)
    spreads = row[["intercept_sd", "slope_sd", "residual_sd"]].astype(float)
    assert_allclose(spreads, np.exp(best.x), rtol=5e-3)


def test_effects_of_session_and_order_are_taken_into_account():
    answers = planted(5.0, people=24, session=8.0, order=20.0, mirrored=True)
    table = mixed_effects(answers, "rating", models=MODELS, rng=rng()).set_index("term")
    assert list(table.index) == [MODEL_EFFECT, SESSION, ORDER]
    for term, truth in ((MODEL_EFFECT, 5.0), (SESSION, 8.0), (ORDER, 20.0)):
        estimate, se = table.loc[term, ["estimate", "se"]]
        assert abs(estimate - truth) < 3.5 * se, term
    assert table["p"].notna().tolist() == [True, False, False]
    assert table.loc[MODEL_EFFECT, "slope_sd"] == pytest.approx(6.0, rel=0.5)
    assert table.loc[MODEL_EFFECT, "residual_sd"] == pytest.approx(5.0, rel=0.1)


def test_missing_answers_weigh_neither_textures_nor_models():
    """Half of one cell's answers are lost; means of what is left would move by its texture."""
    answers = planted(-10.0, people=30, slope_sd=3.0)
    lost = (answers["texture"] == "PVC") & (answers["model"] == "full") & (rng().random(720) < 0.7)
    row = model_row(answers.assign(rating=answers["rating"].mask(lost)))
    assert row["method"] == MIXED_MODEL
    assert row["answers"] == len(answers) - lost.sum()
    assert row["ci_low"] < -10 < row["ci_high"]
    assert row["n"] == 30


def test_slopes_that_do_not_vary_leave_no_smaller_error_than_the_paired_test():
    ratios = []
    for seed in range(6):
        answers = planted(slope_sd=0.0, mirrored=True, seed=seed)
        row = model_row(answers)
        assert row["method"] == MIXED_MODEL
        whole = complete_participants(answers, "rating", models=MODELS)
        paired = paired_test(whole["full"], whole["simplified"], rng=rng())
        ratios.append(row["se"] / abs(paired.mean_difference / paired.t))
    assert min(ratios) > 0.99
    assert max(ratios) > 1.02


def test_a_model_per_session_cannot_be_told_from_the_session():
    answers = planted(5.0)
    apart = answers[(answers["model"] == "full") == (answers["session"] == "ses-1")]
    row = model_row(apart)
    assert row["method"] == PAIRED
    assert row["note"] == (
        "no mixed model: the effect of the model cannot be separated from textures, sessions or "
        "order"
    )
    whole = complete_participants(apart, "rating", models=MODELS)
    paired = paired_test(whole["full"], whole["simplified"], rng=rng())
    shown = row[["estimate", "t", "p"]].astype(float)
    assert_allclose(shown, [paired.mean_difference, paired.t, paired.p])


def test_nobody_one_person_and_nothing_that_varies():
    answers = planted()
    nobody = mixed_effects(answers.iloc[:0], "rating", models=MODELS, rng=rng())
    assert list(nobody) == names(MIXED_COLUMNS)
    assert nobody["n"].tolist() == [0]
    assert nobody["note"].str.contains("0 participant").all()
    one = model_row(answers[answers["participant_id"] == "sub-00"])
    assert (one["n"], one["method"]) == (1, PAIRED)
    same = model_row(answers.assign(rating=50.0))
    assert "all answers are the same" in same["note"]
    assert np.isnan(same["t"])


def test_the_predictor_weighs_every_texture_once():
    answers = planted(noise_sd=0.0, slope_sd=0.0)
    shift = {"canvas": 3.0, "leather": 6.0, "PVC": -21.0}
    moved = answers["rating"] + answers["texture"].map(shift) * (answers["model"] == "simplified")
    answers = answers.assign(rating=moved)
    fewer = answers[(answers["texture"] == "PVC") | (rng().random(len(answers)) < 0.6)]
    built = design(fewer, "rating", models=MODELS)
    found = np.linalg.lstsq(
        np.column_stack([built.columns, pd.get_dummies(built.people, dtype=float)]),
        built.values,
        rcond=None,
    )[0]
    assert found[built.terms[MODEL_EFFECT]] == pytest.approx(-4.0)
    assert set(np.unique(built.model)) == {-0.5, 0.5}
    assert built.textures == 3


def test_a_texture_without_one_of_the_models_is_left_out():
    answers = planted()
    lacking = (answers["texture"] == "PVC") & (answers["model"] == "full")
    built = design(answers[~lacking], "rating", models=MODELS)
    assert built.textures == 2
    assert len(built.values) == 2 * len(answers) // 3


def test_covariates_that_do_not_vary_are_no_columns():
    answers = planted().drop(columns="session").groupby(["participant_id", "texture"]).head(1)
    answers = pd.concat([answers, answers.assign(model="simplified")]).drop_duplicates()
    single = answers.groupby("participant_id").head(1)
    assert design(single, "rating", models=MODELS).terms == {MODEL_EFFECT: 0}
    assert SESSION not in design(answers, "rating", models=MODELS).terms


def test_t_of_an_estimate():
    """Twice its error with 9 degrees of freedom: tables of Student's t."""
    found = t_of(4.0, 2.0, n=10)
    assert (found["t"], found["df"]) == (2.0, 9)
    assert found["p"] == pytest.approx(0.0766, abs=5e-5)
    assert found["ci_high"] == pytest.approx(4 + 2.262 * 2, abs=1e-3)
