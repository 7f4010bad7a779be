"""Similarities and biases behind a confusion matrix: Luce's similarity choice model.

docs/method/confusions.md#similarity-choice
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from analysis.chapters.confusions.information import check_counts
from modeling import InputError
from modeling.arrays import Floats

FEWEST_CLASSES, MOST_CLASSES = 3, 16
SIMULATIONS = 199
# Cochran's rule for χ²: no expected count below 1, at most a fifth below 5.
LEAST_EXPECTED, USUAL_EXPECTED, MOST_BELOW = 1.0, 5.0, 0.2


@dataclass(frozen=True, eq=False)
class SimilarityChoice:
    """A confusion matrix as symmetric similarities and biases for answers.

    Parameters
    ----------
    similarities : (k, k) ndarray
        Symmetric, 1 on the diagonal; NaN for classes that were never recognised.
    biases : (k,) ndarray
        Adding up to 1; NaN as above, and where nothing was confused.
    deviance : float
        Of the fitted counts; NaN where no class was left to compare, or the counts are too few for
        a fit.
    df : int
        (k−1)(k−2)/2, less one for each pair that was never confused.
    p : float
        Of the deviance under χ².
    p_simulated : float
        Of the deviance among tables that the fitted model draws; NaN where counts are not sparse.
    """

    similarities: Floats
    biases: Floats
    deviance: float
    df: int
    p: float
    p_simulated: float


def similarity_choice(counts: ArrayLike, *, rng: np.random.Generator) -> SimilarityChoice:
    """Fit answers ∝ bias of the answer × similarity to what was presented.

    docs/method/confusions.md#similarity-choice

    Parameters
    ----------
    counts : (k, k) array_like of int
        Rows presented, columns answered; 3 ≤ k ≤ 16.
    rng : Generator
        Draws tables where counts are too few for χ².

    Raises
    ------
    InputError
        For another shape, or counts that are negative.
    """
    table = np.asarray(counts, dtype=float)
    k = len(table)
    if table.shape != (k, k) or not FEWEST_CLASSES <= k <= MOST_CLASSES:
        raise InputError(
            f"expected a square matrix of {FEWEST_CLASSES} to {MOST_CLASSES} classes, got the "
            f"shape {table.shape}; count rows presented against columns answered."
        )
    check_counts(table)
    similarities, biases = np.full((k, k), np.nan), np.full(k, np.nan)
    known = np.flatnonzero(np.diag(table) > 0)
    if known.size < 2:
        return SimilarityChoice(similarities, biases, float("nan"), 0, float("nan"), float("nan"))
    kept = table[np.ix_(known, known)]
    try:
        fitted, logs = _fit(kept)
    except ValueError:  # of statsmodels, where a parameter runs away
        return SimilarityChoice(similarities, biases, float("nan"), 0, float("nan"), float("nan"))
    deviance, df = _deviance(kept, fitted), _degrees(kept)
    similarities[np.ix_(known, known)] = logs
    biases[known] = _biases(fitted)
    return SimilarityChoice(
        similarities,
        biases,
        deviance,
        df,
        float(stats.chi2.sf(deviance, df)) if df else float("nan"),
        _simulated_p(kept, fitted, deviance, rng=rng) if df and _sparse(fitted) else float("nan"),
    )


def _fit(table: Floats) -> tuple[Floats, Floats]:
    """Fitted counts and similarities of a table whose diagonal holds no 0."""
    import statsmodels.api as sm  # late: it takes a second to import

    k = len(table)
    rows, columns = np.indices((k, k)).reshape(2, -1)
    first, second = np.triu_indices(k, 1)
    confused = table[first, second] + table[second, first] > 0
    if not confused.any():
        return table, np.eye(k)
    pair = np.full((k, k), -1)
    pair[first[confused], second[confused]] = np.arange(confused.sum())
    pair = np.maximum(pair, pair.T).ravel()
    design = np.concatenate(
        [
            np.eye(k)[rows],
            np.eye(k)[columns][:, 1:],  # the first column is the reference
            np.eye(int(confused.sum()))[np.maximum(pair, 0)] * (pair >= 0)[:, None],
        ],
        axis=1,
    )
    kept = (rows == columns) | (pair >= 0)  # pairs that were never confused are fitted by 0
    with warnings.catch_warnings():
        # Few counts may be fitted exactly, or by several parameters alike: the fitted counts, which
        # alone are used, are the same.
        warnings.simplefilter("ignore")
        result = sm.GLM(table.ravel()[kept], design[kept], family=sm.families.Poisson()).fit()
    flat = np.zeros(k * k)
    flat[kept] = result.fittedvalues
    fitted = flat.reshape(k, k)
    diagonal = np.diag(fitted)
    return fitted, np.sqrt(fitted * fitted.T / np.outer(diagonal, diagonal))


def _biases(fitted: Floats) -> Floats:
    """Of a fitted table: log(μᵢⱼ μⱼⱼ / μⱼᵢ μᵢᵢ) is twice the difference of log biases."""
    first, second = np.nonzero(np.triu(fitted, 1) * fitted.T)
    k = len(fitted)
    if not first.size:
        return np.full(k, np.nan)
    design = np.eye(k)[second] - np.eye(k)[first]
    ratio = fitted[first, second] * fitted[second, second]
    ratio /= fitted[second, first] * fitted[first, first]
    logs, *_ = np.linalg.lstsq(design, np.log(ratio) / 2, rcond=None)
    shares = np.exp(logs - logs.max())
    result: Floats = shares / shares.sum()
    return result


def _deviance(table: Floats, fitted: Floats) -> float:
    counted = table > 0
    logs = np.log(table[counted] / fitted[counted])
    return float(2 * (table[counted] @ logs - (table - fitted).sum()))


def _degrees(table: Floats) -> int:
    k = len(table)
    first, second = np.triu_indices(k, 1)
    never = (table[first, second] + table[second, first] == 0).sum()
    return max((k - 1) * (k - 2) // 2 - int(never), 0)


def _sparse(fitted: Floats) -> bool:
    expected = fitted[fitted > 0]
    few = (expected < USUAL_EXPECTED).mean() > MOST_BELOW
    return bool(few or (expected < LEAST_EXPECTED).any())


def _simulated_p(
    table: Floats, fitted: Floats, deviance: float, *, rng: np.random.Generator
) -> float:
    """Share of drawn tables that the model fits no better, the table itself among them."""
    totals = table.sum(axis=1).astype(int)
    shares = fitted / fitted.sum(axis=1, keepdims=True)
    worse = 1
    for _ in range(SIMULATIONS):
        drawn = rng.multinomial(totals, shares).astype(float)
        known = np.flatnonzero(np.diag(drawn) > 0)
        drawn = drawn[np.ix_(known, known)]
        try:
            worse += len(known) > 1 and _deviance(drawn, _fit(drawn)[0]) >= deviance - 1e-9
        except ValueError:
            worse += 1  # counted against the difference
    return worse / (SIMULATIONS + 1)
