"""Similarities and biases come back where they were planted; counts alone decide the rest."""

from __future__ import annotations

import numpy as np
import pytest
import statsmodels.api as sm
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy import stats

from tactileq.analysis.chapters.confusions.similarity_choice import similarity_choice
from tactileq.modeling import InputError
from tests.refusals import refused


def rng() -> np.random.Generator:
    return np.random.default_rng(4)


def planted(k: int, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Similarities, biases and the shares of answers that follow from them."""
    draws = np.random.default_rng(seed)
    similarities = np.triu(draws.uniform(0.05, 0.7, (k, k)), 1)
    similarities = similarities + similarities.T + np.eye(k)
    biases = draws.dirichlet(np.full(k, 5.0))
    shares = biases * similarities
    return similarities, biases, shares / shares.sum(axis=1, keepdims=True)


@settings(max_examples=12)
@given(st.integers(3, 9), st.integers(0, 1000))
def test_exact_shares_give_exact_similarities_and_biases(k, seed):
    similarities, biases, shares = planted(k, seed)
    totals = np.random.default_rng(seed + 1).integers(50, 500, (k, 1))  # unequal
    found = similarity_choice(totals * shares, rng=rng())
    assert_allclose(found.similarities, similarities, rtol=1e-5)
    assert_allclose(found.biases, biases, rtol=1e-5)
    assert found.deviance == pytest.approx(0, abs=1e-6)
    assert found.df == (k - 1) * (k - 2) // 2


def test_the_deviance_has_its_distribution_where_the_model_holds():
    _, _, shares = planted(4, 3)
    draws = np.random.default_rng(5)
    deviances = [
        similarity_choice(draws.multinomial(np.full(4, 400), shares), rng=rng()).deviance
        for _ in range(300)
    ]
    assert stats.kstest(deviances, stats.chi2(3).cdf).pvalue > 0.01
    assert np.mean(deviances) == pytest.approx(3, abs=4 * np.sqrt(6 / 300))


def test_confusions_that_go_one_way_only_are_seen():
    # 1 is taken for 2, 2 for 3 and 3 for 1: no bias and no symmetric similarity explains that.
    table = 100 * np.eye(3) + 60 * np.roll(np.eye(3), 1, axis=1) + 5
    found = similarity_choice(table, rng=rng())
    assert found.df == 1
    assert found.p < 1e-6
    assert np.isnan(found.p_simulated)  # the counts suffice for χ²


def test_sparse_counts_get_a_p_from_drawn_tables():
    _, _, shares = planted(5, 2)
    table = np.random.default_rng(3).multinomial(np.full(5, 9), shares)
    found = similarity_choice(table, rng=rng())
    assert 1 / 200 <= found.p_simulated <= 1
    again = similarity_choice(table, rng=rng())
    assert again.p_simulated == found.p_simulated


def test_pairs_that_nobody_confused_have_no_similarity_and_take_a_degree_of_freedom():
    table = np.array([[20, 3, 0, 2], [4, 20, 2, 1], [0, 3, 20, 5], [2, 2, 4, 20]])
    found = similarity_choice(table, rng=rng())
    assert found.similarities[0, 2] == found.similarities[2, 0] == 0
    assert found.df == 2
    assert np.isfinite(found.biases).all()


def test_classes_that_nobody_recognised_are_left_out():
    table = np.array([[20, 3, 2, 0], [4, 20, 2, 0], [1, 3, 20, 0], [6, 7, 8, 0]])
    found = similarity_choice(table, rng=rng())
    assert np.isnan(found.similarities[3]).all()
    assert np.isnan(found.similarities[:, 3]).all()
    assert np.isnan(found.biases[3])
    rest = similarity_choice(table[:3, :3], rng=rng())
    assert_allclose(found.similarities[:3, :3], rest.similarities)
    assert found.df == 1
    nobody = similarity_choice(np.roll(np.eye(4), 1, axis=0), rng=rng())
    assert np.isnan(nobody.deviance)


def test_all_right_leaves_nothing_to_test():
    found = similarity_choice(9 * np.eye(7), rng=rng())
    assert_allclose(found.similarities, np.eye(7), atol=1e-12)
    assert (found.df, found.deviance) == (0, pytest.approx(0, abs=1e-9))
    assert np.isnan([found.p, found.p_simulated]).all()
    assert np.isnan(found.biases).all()


@pytest.mark.parametrize(
    ("wrong", "expected", "got"),
    [
        (np.eye(2), "3 to 16", "(2, 2)"),
        (np.ones((3, 4)), "square", "(3, 4)"),
        (np.eye(17), "3 to 16", "(17, 17)"),
        (-np.eye(4), ["counts", 0], -1),
    ],
)
def test_other_tables_are_refused(wrong, expected, got):
    with refused(InputError, expected=expected, got=got):
        similarity_choice(wrong, rng=rng())


@pytest.mark.parametrize("seed", range(6))
def test_the_fit_is_that_of_a_poisson_regression(seed: int) -> None:
    """Of statsmodels: answers ~ row + column + pair, the diagonal without a pair of its own."""
    k = 3 + seed
    _, _, shares = planted(k, seed)
    table = np.random.default_rng(seed).multinomial(np.full(k, 300), shares)
    rows, columns = np.indices((k, k)).reshape(2, -1)
    pairs = [(i, j) for i in range(k) for j in range(i + 1, k)]
    apart = [
        [{row, column} == {i, j} for i, j in pairs]
        for row, column in zip(rows, columns, strict=True)
    ]
    design = np.column_stack([np.eye(k)[rows], np.eye(k)[columns][:, 1:], np.array(apart, float)])
    model = sm.GLM(table.ravel(), design, family=sm.families.Poisson()).fit(tol=1e-13)
    fitted = model.fittedvalues.reshape(k, k)
    diagonal = np.diag(fitted)
    found = similarity_choice(table, rng=rng())
    assert found.deviance == pytest.approx(model.deviance, rel=1e-8)
    assert found.df == model.df_resid
    alike = np.sqrt(fitted * fitted.T / np.outer(diagonal, diagonal))
    assert_allclose(found.similarities, alike, rtol=1e-8)
