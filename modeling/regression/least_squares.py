"""Ordinary least squares with p-values, and its reduction to significant terms (eq. 3)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tactileq.modeling.arrays import Bools, Floats
from tactileq.modeling.errors import InputError
from tactileq.modeling.models.terms import FORCE, SPEED, SPEED_FORCE

ALPHA = 0.05
# Of the largest value: what is smaller than this is rounding, and no response to anything.
ROUNDING = 1e-9


@dataclass(frozen=True, eq=False)
class Regression:
    """Ordinary least squares of one parameter over n conditions (eq. 3).

    Parameters
    ----------
    terms : tuple of str
        The predictors that are in, in order; the intercept is always in.
    coefficients, p_values : (1 + terms,) ndarray
        The intercept first, then one per term, and the two-sided p of its t-test.
    n_conditions : int
        0 where no condition yields the parameter: then the intercept is a mean of what neighbours
        predict, and nothing can be tested.
    multiple_r, adjusted_r_squared, p : float
        Multiple correlation R (0–1), 1 − (1 − R²)(n − 1)/(n − k − 1) with k terms, and p of the
        F test of all terms at once.

    Notes
    -----
    What cannot be said is NaN: all p-values and the adjusted R² where as many conditions as
    coefficients leave no residual degree of freedom (a 2 × 2 grid and three terms); R and all
    p-values of a parameter that is constant. Where a fit is exact to rounding, p is 0 for what
    responds and 1 for what does not. Without terms R is 0 and the F test has no p.
    """

    terms: tuple[str, ...]
    coefficients: Floats
    p_values: Floats
    n_conditions: int
    multiple_r: float
    adjusted_r_squared: float
    p: float

    @property
    def residual_degrees(self) -> int:
        """Residual degrees of freedom: conditions beyond the coefficients; 0 allows no test."""
        return self.n_conditions - int(self.coefficients.size)

    def coefficient(self, term: str) -> float:
        """The coefficient of this term, 0 where the term is not in."""
        return float(self.coefficients[self.terms.index(term) + 1]) if term in self.terms else 0.0

    def p_value(self, term: str) -> float:
        """p of this term, NaN where the term is not in."""
        return float(self.p_values[self.terms.index(term) + 1]) if term in self.terms else np.nan


def regress(values: ArrayLike, predictors: Mapping[str, ArrayLike]) -> Regression:
    """Ordinary least squares with an intercept (eq. 3).

    Predictors that are linear combinations of a constant and the ones before them are
    left out: three corners of a 2 × 2 grid say nothing about the interaction.

    Parameters
    ----------
    values : (n,) array_like
        The parameter in n ≥ 1 conditions.
    predictors : mapping of str to (n,) array_like
        By name, such as `condition_predictors` gives them.

    Raises
    ------
    InputError
        For no conditions, different lengths or values that are not finite.
    """
    observed, columns = _checked(values, predictors)
    terms = _independent_terms(columns)
    if np.ptp(observed) <= ROUNDING * np.abs(observed).max():
        unknown = np.full(1 + len(terms), np.nan)
        mean_only = np.array([observed.mean(), *np.zeros(len(terms))])
        return Regression(terms, mean_only, unknown, observed.size, np.nan, np.nan, np.nan)
    return _least_squares(observed, {term: columns[term] for term in terms})


def _least_squares(observed: Floats, columns: Mapping[str, Floats]) -> Regression:
    from statsmodels.regression.linear_model import OLS

    # Columns of one size: v·F is a thousand times F, and would cost digits.
    scales = np.array([1.0, *(np.abs(column).max() for column in columns.values())])
    design = np.column_stack([np.ones(observed.size), *columns.values()]) / scales
    fit = OLS(observed, design).fit()
    coefficients: Floats = fit.params / scales
    if observed.size == coefficients.size:
        p_values, adjusted_r_squared, p = np.full(coefficients.shape, np.nan), np.nan, np.nan
    elif np.abs(fit.resid).max() <= ROUNDING * np.abs(observed).max():
        silent = _silent(coefficients, columns, observed=observed)
        p_values, adjusted_r_squared, p = silent.astype(np.float64), 1.0, 0.0
    else:
        p_values, adjusted_r_squared = fit.pvalues, float(fit.rsquared_adj)
        p = float(fit.f_pvalue) if columns else np.nan
    multiple_r = float(np.sqrt(max(fit.rsquared, 0.0))) if columns else 0.0
    terms = tuple(columns)
    return Regression(
        terms, coefficients, p_values, observed.size, multiple_r, adjusted_r_squared, p
    )


def reduced_regression(values: ArrayLike, predictors: Mapping[str, ArrayLike]) -> Regression:
    """The reduced model: backward elimination of terms that are not significant.

    docs/method/regression.md#reduced-models

    The term with the largest p is dropped and the rest fitted again, until each one left has
    p < .05; a term without any response (to rounding) counts as p = 1. The intercept stays. The
    interaction may stay without its main effects: speed and force have natural zeros, so v·F
    alone means something. Terms without a p (no residual degree of freedom) stay.

    Parameters and errors as in `regress`.
    """
    left = dict(predictors)
    while True:
        fit = regress(values, left)
        left = {term: left[term] for term in fit.terms}
        if not left:
            return fit
        observed, columns = _checked(values, left)
        silent = _silent(fit.coefficients, columns, observed=observed)[1:]
        doubt = np.where(silent, 1.0, np.nan_to_num(fit.p_values[1:], nan=0.0))
        # Of equals the last one goes: the interaction before the main effects.
        weakest = len(doubt) - 1 - int(np.argmax(doubt[::-1]))
        if doubt[weakest] < ALPHA:
            return fit
        del left[fit.terms[weakest]]


def condition_predictors(speed_mm_s: Floats, force_n: Floats) -> dict[str, Floats]:
    """The terms of eq. 3: speed (mm/s), force (N) and their product, each (n,)."""
    return {SPEED: speed_mm_s, FORCE: force_n, SPEED_FORCE: speed_mm_s * force_n}


def _checked(
    values: ArrayLike, predictors: Mapping[str, ArrayLike]
) -> tuple[Floats, dict[str, Floats]]:
    observed = np.asarray(values, dtype=np.float64)
    columns = {name: np.asarray(x, dtype=np.float64) for name, x in predictors.items()}
    alike = all(x.shape == observed.shape for x in columns.values())
    if observed.ndim != 1 or not observed.size or not alike:
        raise InputError(
            "expected a parameter and its predictors in the same conditions, one at least, got "
            f"shapes {[observed.shape, *(x.shape for x in columns.values())]}; match them."
        )
    if not all(np.isfinite(x).all() for x in (observed, *columns.values())):
        raise InputError(
            "expected finite values of a parameter and its predictors, got NaN or inf; leave "
            "those conditions out."
        )
    return observed, columns


def _independent_terms(columns: Mapping[str, Floats]) -> tuple[str, ...]:
    """The terms that are no combination of a constant and of those before them."""
    kept: dict[str, Floats] = {}
    for term, column in columns.items():
        size = np.abs(column).max()
        centred = (column - column.mean()) / (size if size > 0 else 1.0)
        if np.linalg.matrix_rank(np.array([*kept.values(), centred]), tol=1e-8) > len(kept):
            kept[term] = centred
    return tuple(kept)


def _silent(coefficients: Floats, columns: Mapping[str, Floats], *, observed: Floats) -> Bools:
    """Coefficients, the intercept first, whose share in the values is nothing but rounding."""
    reach = np.array([1.0, *(np.ptp(column) for column in columns.values())])
    silent: Bools = np.abs(coefficients) * reach <= ROUNDING * np.abs(observed).max()
    return silent
