"""Similarities and biases behind a confusion matrix: Luce's similarity choice model.

docs/method/confusions.md#similarity-choice
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy import special, stats

from tactileq.analysis.chapters.confusions.information import check_counts
from tactileq.modeling import InputError
from tactileq.modeling.arrays import Floats

FEWEST_CLASSES, MOST_CLASSES = 3, 16
SIMULATIONS = 199
# Of Newton's method: steps at most, the longest one, a curvature in all directions, and the largest
# change of a fitted count at which it ends.
MOST_STEPS, LONGEST_STEP, SLIGHT, CONVERGED = 60, 2.0, 1e-9, 1e-10
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
        Of the fitted counts; NaN where no class was left to compare.
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
    (fitted,) = _fitted(kept[None])
    deviance, df = float(_deviances(kept[None], fitted[None])[0]), _degrees(kept)
    similarities[np.ix_(known, known)] = _similarities(fitted)
    biases[known] = _biases(fitted)
    return SimilarityChoice(
        similarities,
        biases,
        deviance,
        df,
        float(stats.chi2.sf(deviance, df)) if df else float("nan"),
        _simulated_p(kept, fitted, deviance, rng=rng) if df and _sparse(fitted) else float("nan"),
    )


def _fitted(tables: Floats) -> Floats:
    """Fitted counts of tables (s, k, k) side by side.

    The model is quasi-symmetry: its fit keeps the diagonal and the sum of each pair of opposite
    cells, and shares that sum out as Bradley and Terry do (Agresti, Categorical Data Analysis,
    section 11.2), log μᵢⱼ/μⱼᵢ = θⱼ − θᵢ. Newton's method; where a parameter runs away the counts
    converge all the same.
    """
    k = tables.shape[-1]
    first, second = np.triu_indices(k, 1)
    there, back = tables[:, first, second], tables[:, second, first]
    totals = there + back
    design = np.eye(k)[second] - np.eye(k)[first]
    theta = np.zeros((len(tables), k))
    for _ in range(MOST_STEPS):
        shares = special.expit(theta @ design.T)
        slope = (there - totals * shares) @ design
        weights = totals * shares * (1 - shares)
        curve = np.einsum("sp,pi,pj->sij", weights, design, design)
        # Only differences count, and of classes that nothing joins none does.
        step = np.linalg.solve(curve + 1 / k + SLIGHT * np.eye(k), slope[..., None])[..., 0]
        theta += np.clip(step, -LONGEST_STEP, LONGEST_STEP)
        if np.abs(weights @ np.abs(design) * step).max(initial=0.0) < CONVERGED:
            break
    shares = special.expit(theta @ design.T)
    fitted = tables * np.eye(k)
    fitted[:, first, second], fitted[:, second, first] = totals * shares, totals * (1 - shares)
    return fitted


def _similarities(fitted: Floats) -> Floats:
    diagonal = np.diag(fitted)
    return np.sqrt(fitted * fitted.T / np.outer(diagonal, diagonal))


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


def _deviances(tables: Floats, fitted: Floats) -> Floats:
    """Of tables (s, k, k), whose totals are those of the fitted ones; (s,)."""
    result: Floats = 2 * special.xlogy(tables, tables / np.where(tables > 0, fitted, 1)).sum((1, 2))
    return result


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
    drawn = np.array([rng.multinomial(totals, shares) for _ in range(SIMULATIONS)], dtype=float)
    known = np.einsum("sii->si", drawn) > 0
    drawn *= known[:, :, None] & known[:, None, :]
    worse = _deviances(drawn, _fitted(drawn)) >= deviance - 1e-9
    return float(1 + (worse & (known.sum(axis=1) > 1)).sum()) / (SIMULATIONS + 1)
