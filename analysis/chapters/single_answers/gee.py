"""Generalized estimating equations of single answers, clustered by participant.

docs/method/mixed-models.md#gee
"""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from tactileq.analysis.columns import TEXTURE, P
from tactileq.analysis.labels import ALL_TEXTURES
from tactileq.analysis.statistics.design import complete_participants, design
from tactileq.analysis.statistics.mixed import t_of
from tactileq.analysis.statistics.paired import sign_flips_p, without_rounding_noise
from tactileq.modeling.arrays import Floats
from tactileq.modeling.files.columns import Column, names

GEE, SIGN_FLIPS = "GEE", "sign flips"
GEE_COLUMNS = (
    TEXTURE,
    Column("method", is_name=True),
    Column("n", "participants"),
    Column("answers"),
    Column("share_reference", "share with reference", format=".3f"),
    Column("share_other", "with other", format=".3f"),
    Column("odds_ratio", "odds ratio, other to reference", format=".2f"),
    Column("ci_low", "95% CI from", format=".2f"),
    Column("ci_high", "to", format=".2f"),
    Column("t", format=".2f"),
    Column("df", format=".0f"),
    P,
    Column("note"),
)


def fit_gee(
    shares: Floats, columns: Floats, *, people: NDArray[Any]
) -> tuple[Floats, Floats] | None:
    """Coefficients of a binomial GEE (logit) and their bias-reduced standard errors.

    Independent working correlation; covariance of Mancl and DeRouen (2001).
    docs/method/mixed-models.md#gee

    Parameters
    ----------
    shares : (m,) ndarray
        0 … 1, one per answer.
    columns : (m, p) ndarray
        Of full rank.
    people : (m,) ndarray

    Returns
    -------
    (estimates, errors) or None
        (p,) each, log odds; None where there is no finite fit.
    """
    from statsmodels.genmod.cov_struct import Independence  # late: it takes a second
    from statsmodels.genmod.families import Binomial
    from statsmodels.genmod.generalized_estimating_equations import GEE as Equations

    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")  # whether it is finite is looked at here
        try:
            fit = Equations(
                shares, columns, groups=people, family=Binomial(), cov_struct=Independence()
            ).fit(cov_type="bias_reduced")
        except np.linalg.LinAlgError:
            return None
        estimates, errors = np.asarray(fit.params), np.asarray(fit.bse)
    finite = np.isfinite(estimates).all() and (np.isfinite(errors) & (errors > 0)).all()
    return (estimates, errors) if finite and fit.converged else None


def gee_effects(
    answers: pd.DataFrame,
    column: str,
    *,
    models: tuple[str, str],
    largest: float,
    rng: np.random.Generator,
) -> pd.DataFrame:
    """Odds ratio of the other model: over all textures, each counting once, and of each texture.

    docs/method/mixed-models.md#gee

    Parameters
    ----------
    answers : DataFrame
        As in `tactileq.analysis.statistics.design.design`, textures with identical models left out.
    column : str
        Right or wrong, or a rating.
    models : (str, str)
        The reference, and the other one.
    largest : float
        The value that counts as 1: 1 of right answers, 100 of ratings. The least one is 0.
    rng : Generator
        Draws sign flips.

    Returns
    -------
    DataFrame
        `GEE_COLUMNS`, not corrected for the number of tests. Where all answers to a texture with a
        model are 0, or all are the largest, odds are infinite: the row has p of the participants'
        sign flips, no odds ratio, and a `note`.
    """
    shares = answers.assign(**{column: answers[column] / largest})
    rows = [{"texture": ALL_TEXTURES, **_row(shares, column, models=models, rng=rng)}]
    textures = sorted(shares["texture"].unique(), key=str.casefold)
    for texture in textures:
        own = shares[shares["texture"] == texture]
        rows.append({"texture": texture, **_row(own, column, models=models, rng=rng)})
    return pd.DataFrame(rows, columns=names(GEE_COLUMNS))


def _row(
    shares: pd.DataFrame, column: str, *, models: tuple[str, str], rng: np.random.Generator
) -> dict[str, Any]:
    built = design(shares, column, models=models)
    cells = shares[shares["model"].isin(models)].groupby(["texture", "model"])[column].mean()
    means = cells.groupby("model").mean()
    row: dict[str, Any] = {
        "answers": len(built.values),
        "n": built.participants,
        "share_reference": means.get(models[0], np.nan),
        "share_other": means.get(models[1], np.nan),
    }
    why = built.unfit or _separated(cells)
    fit = None if why else fit_gee(built.values, built.columns, people=built.people)
    if fit is None:
        whole = complete_participants(shares, column, models=models)
        differences = without_rounding_noise((whole[models[1]] - whole[models[0]]).to_numpy())
        p = sign_flips_p(differences, rng=rng)
        why = why or "no finite fit"
        return {**row, "n": len(whole), "method": SIGN_FLIPS, "p": p, "note": why}
    (estimate, *_), (error, *_) = fit
    tested = t_of(float(estimate), float(error), n=built.participants)
    with np.errstate(over="ignore"):  # two participants leave limits open
        limits = {name: float(np.exp(tested[name])) for name in ("ci_low", "ci_high")}
    ratio = float(np.exp(estimate))
    return {**row, **tested, **limits, "method": GEE, "odds_ratio": ratio, "note": ""}


def _separated(cells: pd.Series) -> str:
    """Which answers are all 0, or all the largest; empty where none are."""
    ends = cells.index[cells.isin([0.0, 1.0])]
    named = [f"{texture} with {model}" for texture, model in ends]
    return f"separated: all answers alike at an end of the scale ({', '.join(named)})" * bool(named)
