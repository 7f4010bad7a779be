"""A linear mixed model of single answers: random intercept and slope of the model per participant.

docs/method/mixed-models.md
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy import stats

from tactileq.analysis.columns import P
from tactileq.analysis.statistics.design import MODEL_EFFECT, complete_participants, design
from tactileq.analysis.statistics.paired import CONFIDENCE, paired_test
from tactileq.modeling.arrays import Floats
from tactileq.modeling.files.columns import Column, names

MOST_SIMPLEX_STEPS = 1000
LEAST_VARIANCE = 0.01  # of the noise's: where the search begins
MIXED_MODEL, PAIRED = "mixed model", "paired t"
MIXED_COLUMNS = (
    Column("term", is_name=True),
    Column("method", is_name=True),
    Column("n", "participants"),
    Column("answers"),
    Column("estimate", format=".2f"),
    Column("se", "SE", format=".2f"),
    Column("ci_low", "95% CI from", format=".2f"),
    Column("ci_high", "to", format=".2f"),
    Column("t", format=".2f"),
    Column("df", format=".0f"),
    P,
    Column("intercept_sd", "SD of intercepts", format=".2f"),
    Column("slope_sd", "SD of slopes", format=".2f"),
    Column("residual_sd", "SD of residuals", format=".2f"),
    Column("note"),
)


@dataclass(frozen=True, eq=False, kw_only=True)
class MixedFit:
    """What restricted maximum likelihood found.

    Parameters
    ----------
    estimates, errors : (p,) ndarray
        Of the fixed effects, in the unit of the values.
    intercept_sd, slope_sd, residual_sd : float
        Of participants' intercepts and slopes, and of what is left of a single value.
    """

    estimates: Floats
    errors: Floats
    intercept_sd: float
    slope_sd: float
    residual_sd: float


def fit_mixed(
    values: Floats, fixed: Floats, *, slope: Floats, people: NDArray[Any]
) -> MixedFit | None:
    """Fit values = fixed effects + a random intercept and slope per person + noise.

    Restricted maximum likelihood by `statsmodels.MixedLM`, from the covariance of moments.
    docs/method/mixed-models.md#fitting

    Parameters
    ----------
    values : (m,) ndarray
    fixed : (m, p) ndarray
        Of full rank.
    slope : (m,) ndarray
        What the random slope is of.
    people : (m,) ndarray

    Returns
    -------
    MixedFit or None
        None where it did not converge.
    """
    from statsmodels.regression.mixed_linear_model import (  # late: it takes a second
        MixedLM,
        MixedLMParams,
    )

    random = np.column_stack([np.ones_like(slope), slope])
    model = MixedLM(values, fixed, groups=people, exog_re=random)
    moments = MixedLMParams.from_components(
        fe_params=np.zeros(fixed.shape[1]),
        cov_re=_random_covariance(values, fixed, random=random, people=people),
    )
    # It warns of variances below 0.01, whatever their unit.
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        best = _most_likely(model, start=moments)
        if best is None:
            return None
        errors = np.asarray(best.bse_fe, dtype=float)
    if not (np.isfinite(errors) & (errors > 0)).all():
        return None
    variances = np.maximum(np.diag(np.asarray(best.cov_re)), 0.0)
    intercept_sd, slope_sd = (float(sd) for sd in np.sqrt(variances))
    return MixedFit(
        estimates=np.asarray(best.fe_params, dtype=float),
        errors=errors,
        intercept_sd=intercept_sd,
        slope_sd=slope_sd,
        residual_sd=float(np.sqrt(best.scale)),
    )


def _most_likely(model: Any, *, start: Any) -> Any:
    """The fit of BFGS; where it does not converge, Nelder and Mead go on from there; or None."""
    for options in ({"method": "bfgs"}, {"method": "nm", "maxiter": MOST_SIMPLEX_STEPS}):
        try:
            fit = model.fit(start_params=start, **options)
        except np.linalg.LinAlgError:
            continue
        if fit.converged:
            return fit
        start = fit.params_object
    return None


def _random_covariance(
    values: Floats, fixed: Floats, *, random: Floats, people: NDArray[Any]
) -> Floats:
    """Covariance of intercepts and slopes, (2, 2), over the variance of the noise, by moments.

    That of each person's least-squares coefficients, less what the noise adds to it; made positive
    definite, as where it is not the maximum is on the boundary.
    """
    residuals = values - fixed @ np.linalg.lstsq(fixed, values, rcond=None)[0]
    coefficients, added, squares = [], [], 0.0
    for who in np.unique(people):
        own = people == who
        found = np.linalg.lstsq(random[own], residuals[own], rcond=None)[0]
        coefficients.append(found)
        added.append(np.linalg.pinv(random[own].T @ random[own]))
        squares += float(np.sum((residuals[own] - random[own] @ found) ** 2))
    shared = fixed.shape[1] - random.shape[1]
    variance = squares / max(len(values) - 2 * len(coefficients) - shared, 1)
    if variance <= 0:
        return np.eye(2)
    size, axes = np.linalg.eigh(
        np.cov(np.array(coefficients).T) / variance - np.mean(added, axis=0)
    )
    covariance: Floats = (axes * np.maximum(size, LEAST_VARIANCE)) @ axes.T
    return covariance


def mixed_effects(
    answers: pd.DataFrame, column: str, *, models: tuple[str, str], rng: np.random.Generator
) -> pd.DataFrame:
    """The other model's effect on single answers, with those of session and order.

    docs/method/mixed-models.md

    Parameters
    ----------
    answers : DataFrame
        As in `tactileq.analysis.statistics.design.design`, textures with identical models left out.
    models : (str, str)
        The reference, and the other one.
    rng : Generator
        Draws the sign flips of the paired test.

    Returns
    -------
    DataFrame
        `MIXED_COLUMNS`, a row for each term. The row of the model has t with one degree of freedom
        less than participants; where nothing can be fitted, it is the paired t-test of means over
        textures, and `note` says why. The other rows have no test: they have no random slopes.
    """
    built = design(answers, column, models=models)
    fit = None
    if not (why := built.unfit):
        fit = fit_mixed(built.values, built.columns, slope=built.model, people=built.people)
        why = "" if fit else "the fit did not converge"
    if fit is None:
        row = _paired(answers, column, models=models, rng=rng)
        note = "; ".join(filter(None, [f"no mixed model: {why}", row["note"]]))
        table = pd.DataFrame([{**row, "answers": len(built.values), "note": note}])
        return table.reindex(columns=names(MIXED_COLUMNS))
    shared = {"method": MIXED_MODEL, "n": built.participants, "answers": len(built.values)}
    rows = []
    for term, place in built.terms.items():
        row = {"term": term, "estimate": fit.estimates[place], "se": fit.errors[place], "note": ""}
        if term == MODEL_EFFECT:
            row |= t_of(fit.estimates[place], fit.errors[place], n=built.participants)
            row |= {name: getattr(fit, name) for name in _SPREADS}
        rows.append(row | shared)
    return pd.DataFrame(rows, columns=names(MIXED_COLUMNS))


_SPREADS = ("intercept_sd", "slope_sd", "residual_sd")


def t_of(estimate: float, error: float, *, n: int) -> dict[str, float]:
    """t, its degrees of freedom n − 1, two-sided p and the 95 % interval of an estimate.

    Parameters
    ----------
    n : int
        Participants, ≥ 2.
    """
    half = error * float(stats.t.isf((1 - CONFIDENCE) / 2, n - 1))
    t = estimate / error
    p = float(2 * stats.t.sf(abs(t), n - 1))
    return {"t": t, "df": n - 1, "p": p, "ci_low": estimate - half, "ci_high": estimate + half}


def _paired(
    answers: pd.DataFrame, column: str, *, models: tuple[str, str], rng: np.random.Generator
) -> dict[str, Any]:
    """The paired test of who answered on every texture with both models."""
    whole = complete_participants(answers, column, models=models)
    test = paired_test(whole[models[0]], whole[models[1]], rng=rng)
    shown = {name: getattr(test, name) for name in ("n", "ci_low", "ci_high", "t", "df", "p")}
    se = abs(test.mean_difference / test.t) if test.t else np.nan
    return {
        "term": MODEL_EFFECT,
        "method": PAIRED,
        "estimate": test.mean_difference,
        "se": se,
        "note": test.note,
        **shown,
    }
