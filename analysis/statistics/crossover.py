"""Models on different days: the mean difference apart from what the days add (AB/BA design).

Why: where more people began with one model than with the other, the mean difference holds part of
the change from day to day. docs/method/statistics.md#days
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from tactileq.modeling.arrays import Floats

_ROUNDING = 1e-9
CONFOUNDED = "model and day cannot be told apart in the orders that people had"


def day_contrasts(answers: pd.DataFrame, models: tuple[str, str]) -> pd.DataFrame:
    """On which days each participant had the other model, less those of the reference.

    Parameters
    ----------
    answers : DataFrame
        participant_id, session and model; a row for each answer of the task, also with models that
        are not compared, whose days lie between the others.
    models : (str, str)
        The reference first.

    Returns
    -------
    DataFrame
        A row for each participant with answers to both, a column for each day but the last, from
        −1 to 1; no column where most had both models in one session, or where there are no
        sessions. A participant's days are their sessions, in the order of the names.
    """
    if "session" not in answers:
        return pd.DataFrame(index=answers["participant_id"].unique())
    held = answers[["participant_id", "session", "model"]].drop_duplicates()
    days = held.assign(day=held.groupby("participant_id")["session"].rank("dense"))
    counts = pd.crosstab(days["participant_id"], [days["model"], days["day"]]).astype(float)
    if not set(models) <= set(counts.columns.get_level_values(0)):
        return pd.DataFrame(index=counts.index[:0])
    every = sorted(days["day"].unique())
    reference, other = (
        pd.DataFrame(counts[model]).reindex(columns=every, fill_value=0.0) for model in models
    )
    both = reference.any(axis=1) & other.any(axis=1)
    reference, other = reference[both], other[both]
    apart = ~(reference * other).any(axis=1)
    if apart.mean() < 0.5 or not len(apart):
        return reference.iloc[:, :0]
    return (_shares(other) - _shares(reference)).iloc[:, :-1]


def _shares(counts: pd.DataFrame) -> pd.DataFrame:
    shares: pd.DataFrame = counts.div(counts.sum(axis=1), axis=0)
    return shares


def balanced(contrasts: pd.DataFrame) -> bool:
    """Whether every day was as often that of the one model as of the other; so within sessions."""
    sums: Floats = contrasts.to_numpy(dtype=float).sum(axis=0)
    return bool((np.abs(sums) < _ROUNDING).all())


@dataclass(frozen=True, eq=False, kw_only=True)
class MeanDifferences:
    """Means of k samples of differences of n people, by least squares apart from days.

    Parameters
    ----------
    mean, error : (k,) ndarray
        With its standard error; NaN where it cannot be told from days, or of nobody.
    df : int
        Degrees of freedom of the error; below 1 there is none.
    size : float
        Variance of single differences over that of their mean: n where days do not count.
    adjusted : (k, n) ndarray
        The differences without what days add.
    """

    mean: Floats
    error: Floats
    df: int
    size: float
    adjusted: Floats

    @property
    def confounded(self) -> bool:
        """Whether days and models cannot be told apart."""
        return bool(self.adjusted.size and np.isnan(self.mean).all())

    @property
    def told(self) -> Floats:
        """`adjusted`; of nobody where days and models cannot be told apart."""
        return self.adjusted[:, :0] if self.confounded else self.adjusted


def mean_differences(
    differences: Floats | MeanDifferences, contrasts: Floats | None = None
) -> MeanDifferences:
    """Least squares of differences on their mean and on days.

    With two days this is the t-test of the AB/BA crossover design: the mean of the two groups'
    means (Hills and Armitage 1979).

    Parameters
    ----------
    differences : (k, n) ndarray or MeanDifferences
        Finite; the latter as they are.
    contrasts : (n, c) ndarray, optional
        Of `day_contrasts`; none where days do not count.
    """
    if isinstance(differences, MeanDifferences):
        return differences
    n = differences.shape[1]
    days = np.empty((n, 0)) if contrasts is None else contrasts
    if not n:
        nothing = np.full(len(differences), np.nan)
        return MeanDifferences(mean=nothing, error=nothing, df=-1, size=0.0, adjusted=differences)
    predictors = np.column_stack([np.ones(n), days])
    inverse = np.linalg.pinv(predictors)
    rank = int(np.linalg.matrix_rank(predictors))
    coefficients = differences @ inverse.T
    residuals = differences - coefficients @ predictors.T
    told = abs((inverse @ predictors)[0, 0] - 1) < _ROUNDING
    mean = np.where(told, coefficients[:, 0], np.nan)
    df, size = n - rank, float(1 / (inverse[0] @ inverse[0]))
    variance = (residuals**2).sum(axis=1) / df if df > 0 else np.full(len(mean), np.nan)
    adjusted = np.round(mean[:, None] + residuals, 12) if days.shape[1] else differences
    return MeanDifferences(
        mean=mean, error=np.sqrt(variance / size), df=df, size=size, adjusted=adjusted
    )
