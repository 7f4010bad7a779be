"""Accuracy, or a mean, by any factors varied within participants: repeated-measures ANOVA.

docs/method/tables.md#analysis-of-variance
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import combinations

import numpy as np
import pandas as pd
from scipy import linalg, stats

from tactileq.analysis.answers.imported import in_order
from tactileq.analysis.columns import P
from tactileq.analysis.statistics.paired import (
    CONFIDENCE,
    holm,
    mean_test,
    t_interval,
    why_undefined,
    without_rounding_noise,
)
from tactileq.modeling import InputError
from tactileq.modeling.arrays import Floats
from tactileq.modeling.files.columns import Column, names

EFFECT = Column("effect", is_name=True)
ANOVA_COLUMNS = (
    EFFECT,
    Column("df_effect", "df of the effect"),
    Column("df_error", "df of the error"),
    Column("F", format=".3f"),
    P,
    Column("epsilon", "ε of Greenhouse and Geisser", format=".3f"),
    Column("df_effect_corrected", "df of the effect, times ε", format=".2f"),
    Column("df_error_corrected", "df of the error, times ε", format=".2f"),
    Column("p_corrected", "p, corrected by ε", is_p_value=True),
    Column("generalized_eta_squared", "generalized η²", format=".3f"),
    Column("n", "participants"),
)
CORRECTED = ("epsilon", "df_effect_corrected", "df_error_corrected", "p_corrected")
CONDITION_COLUMNS = (
    Column("condition", is_name=True),
    Column("n", "participants"),
    Column("mean"),
    Column("ci_low", "95% CI from"),
    Column("ci_high", "95% CI to"),
)
PARTICIPANT_CELL_COLUMNS = (
    Column("participant_id", "participant", is_name=True),
    Column("condition", is_name=True),
    Column("trials"),
    Column("mean"),
    Column("ci_low", "95% CI from"),
    Column("ci_high", "95% CI to"),
)
PAIR_COLUMNS = (
    Column("factor", is_name=True),
    Column("pair", "levels compared", is_name=True),
    Column("n", "participants"),
    Column("mean_difference", "mean difference"),
    Column("ci_low", "95% CI from"),
    Column("ci_high", "95% CI to"),
    Column("t", format=".2f"),
    Column("df"),
    P,
    Column("p_holm", "p (Holm)", is_p_value=True),
    Column("d_z", "d_z", format=".2f"),
    Column("note"),
)


@dataclass(frozen=True, eq=False)
class CompleteCells:
    """Means of the participants who have all cells, (n, levels of factor 1, factor 2, …)."""

    participants: tuple[str, ...]
    levels: dict[str, tuple[str, ...]]
    means: Floats
    excluded: tuple[str, ...]

    @property
    def size(self) -> float:
        """The power of ten above all means: rounding errors are relative to it."""
        largest = float(np.abs(self.means).max(initial=0.0))
        return float(10.0 ** np.ceil(np.log10(largest))) if largest else 1.0

    def level_means(self, factor: str) -> dict[str, float]:
        """Mean of each level of a factor, over participants and the other factors."""
        axis = 1 + list(self.levels).index(factor)
        others = tuple(i for i in range(self.means.ndim) if i != axis)
        return dict(zip(self.levels[factor], map(float, self.means.mean(axis=others)), strict=True))


def participant_cells(
    answers: pd.DataFrame, measure: str, *, factors: Sequence[str]
) -> pd.DataFrame:
    """Mean of each participant in each condition, with a 95 % interval.

    Of correct: Wilson's interval of a share; of a value: Student's t over the trials.

    Parameters
    ----------
    answers : DataFrame
        participant_id, the factors, count and `measure`, as in `Imported.answers`.
    measure : str
        correct (0–1) or value.
    factors : sequence of str
        Without any there is one condition.

    Returns
    -------
    DataFrame
        participant_id, the factors, condition, trials, mean, ci_low, ci_high.
    """
    rows = []
    for key, cell in answers.groupby(["participant_id", *factors], sort=False):
        who, *levels = (str(part) for part in key)
        trials, mean = int(cell["count"].sum()), _weighted_mean(cell, measure)
        if measure == "correct":
            low, high = _wilson(mean, trials)
        else:
            values = np.repeat(cell[measure].to_numpy(dtype=float), cell["count"])
            low, high = t_interval(values)
        row: dict[str, object] = {"participant_id": who, **dict(zip(factors, levels, strict=True))}
        row |= {"condition": _condition(levels), "trials": trials}
        rows.append(row | {"mean": mean, "ci_low": low, "ci_high": high})
    return pd.DataFrame(rows)


def cell_means(cells: pd.DataFrame, factors: Sequence[str]) -> pd.DataFrame:
    """Means over participants, each counting once, with the 95 % interval of Student's t.

    Parameters
    ----------
    cells : DataFrame
        From `participant_cells`.

    Returns
    -------
    DataFrame
        The factors, condition, n, mean, ci_low, ci_high; levels in order.
    """
    rows = []
    for _, cell in cells.groupby(list(factors) or ["condition"], sort=False):
        condition = cell["condition"].iloc[0]
        values = cell["mean"].to_numpy(dtype=float)
        low, high = interval_of(values)
        row: dict[str, object] = {factor: cell[factor].iloc[0] for factor in factors}
        row |= {"condition": condition, "n": values.size, "mean": float(values.mean())}
        rows.append(row | {"ci_low": low, "ci_high": high})
    table = pd.DataFrame(rows)
    order = sorted(table.index, key=lambda i: [in_order(table.loc[i, f]) for f in factors])
    return table.loc[order].reset_index(drop=True)


def interval_of(values: Floats) -> tuple[float, float]:
    """Student's 95 % interval of participants' mean; NaN where they are alike, as the test is."""
    return (
        (np.nan, np.nan) if np.ptp(values) <= 1e-12 * np.abs(values).max() else t_interval(values)
    )


def complete_cells(cells: pd.DataFrame, factors: Sequence[str]) -> CompleteCells:
    """The participants who have a mean in each condition, and who has not.

    Parameters
    ----------
    cells : DataFrame
        From `participant_cells`.

    Raises
    ------
    InputError
        Where a factor has one level, or is constant within each participant.
    """
    levels = {f: tuple(sorted(cells[f].unique(), key=in_order)) for f in factors}
    for factor, own in levels.items():
        if len(own) < 2:
            raise InputError(
                f"expected two levels or more of the factor {factor}, got {', '.join(own)}; "
                "leave it out of the map."
            )
        if cells.groupby("participant_id")[factor].nunique().max() < 2:
            raise InputError(
                f"expected the factor {factor} to vary within participants, got one level of "
                "each participant; leave it out, or analyse the groups one by one."
            )
    every = pd.MultiIndex.from_product(list(levels.values()), names=list(factors))
    wide = cells.pivot_table(index="participant_id", columns=list(factors), values="mean")
    wide = wide.reindex(columns=every if len(factors) > 1 else every.get_level_values(0))
    whole = wide.dropna()
    shape = (len(whole), *(len(own) for own in levels.values()))
    excluded = tuple(wide.index.difference(whole.index))
    return CompleteCells(tuple(whole.index), levels, whole.to_numpy().reshape(shape), excluded)


def repeated_measures_anova(complete: CompleteCells) -> pd.DataFrame:
    """F tests of all factors and their interactions, varied within participants.

    docs/method/tables.md#analysis-of-variance

    Parameters
    ----------
    complete : CompleteCells
        Of at least two participants and one factor.

    Returns
    -------
    DataFrame
        `ANOVA_COLUMNS`, a row per effect; what is corrected equals the uncorrected where the effect
        has one degree of freedom. F and p are NaN where an effect is the same in all participants.

    Raises
    ------
    InputError
        For fewer than two participants.
    """
    n = len(complete.participants)
    if n < 2:
        raise InputError(
            f"expected two participants or more with answers in every condition, got {n}; "
            "collect the missing ones or leave a factor out."
        )
    effects = _effects(complete)
    unexplained = sum(map(_error_squares, [_scores(complete.means, ()), *effects.values()]))
    factors = list(complete.levels)
    rows = []
    for which, scores in effects.items():
        row: dict[str, object] = {"effect": " × ".join(factors[i] for i in which)}
        # Where all participants show one effect alike, F would be rounding over rounding.
        alike = float(np.ptp(scores, axis=0).max()) <= 1e-12 * complete.size
        rows.append(row | _f_test(scores, unexplained=np.nan if alike else unexplained) | {"n": n})
    return pd.DataFrame(rows, columns=names(ANOVA_COLUMNS))


def _f_test(scores: Floats, *, unexplained: float) -> dict[str, float]:
    """The row of an effect from its scores; without F where `unexplained` is NaN."""
    n, df = scores.shape
    found: dict[str, float] = {"df_effect": df, "df_error": df * (n - 1)}
    if np.isnan(unexplained):
        return found
    squares = n * float(np.sum(scores.mean(axis=0) ** 2))
    f, epsilon = (n - 1) * squares / _error_squares(scores), _epsilon(scores)
    corrected = epsilon * df, epsilon * df * (n - 1)
    return found | {
        "F": f,
        "p": float(stats.f.sf(f, df, df * (n - 1))),
        "epsilon": epsilon,
        "df_effect_corrected": corrected[0],
        "df_error_corrected": corrected[1],
        "p_corrected": float(stats.f.sf(f, *corrected)),
        "generalized_eta_squared": squares / (squares + unexplained),
    }


def _error_squares(scores: Floats) -> float:
    return float(np.sum((scores - scores.mean(axis=0)) ** 2))


def _effects(complete: CompleteCells) -> dict[tuple[int, ...], Floats]:
    """Scores of each effect, by its factors' numbers: main effects, then interactions."""
    return {
        which: _scores(complete.means, which)
        for size in range(1, len(complete.levels) + 1)
        for which in combinations(range(len(complete.levels)), size)
    }


def _scores(means: Floats, which: tuple[int, ...]) -> Floats:
    """(n, df) scores of each participant on orthonormal contrasts of an effect."""
    contrasts = [
        linalg.helmert(k) if axis in which else np.full((1, k), k**-0.5)
        for axis, k in enumerate(means.shape[1:])
    ]
    scores: Floats = means.reshape(len(means), -1) @ reduce(np.kron, contrasts).T
    return scores


def _epsilon(scores: Floats) -> float:
    """Greenhouse and Geisser's ε: 1 where the contrasts vary alike and do not covary."""
    covariance = np.atleast_2d(np.cov(scores, rowvar=False))
    return float(np.trace(covariance) ** 2 / (len(covariance) * np.sum(covariance**2)))


def pairwise_tests(complete: CompleteCells, *, rng: np.random.Generator) -> pd.DataFrame:
    """Paired t-tests between the levels of each factor, over the means of the other factors.

    Holm's correction runs over the pairs of one factor. `rng` draws sign flips, which give p where
    participants do not vary.

    Returns
    -------
    DataFrame
        `PAIR_COLUMNS`; differences are second − first level.
    """
    tables = []
    for axis, (factor, levels) in enumerate(complete.levels.items()):
        others = tuple(i + 1 for i in range(len(complete.levels)) if i != axis)
        means = complete.means.mean(axis=others)
        rows: list[dict[str, object]] = []
        for first, second in combinations(range(len(levels)), 2):
            found = _pair(means[:, second] - means[:, first], size=complete.size, rng=rng)
            pair = f"{levels[second]} − {levels[first]}"
            rows.append({"factor": factor, "pair": pair, **found})
        tables.append(pd.DataFrame(rows).assign(p_holm=lambda table: holm(table["p"])))
    return pd.concat(tables, ignore_index=True)


def _pair(differences: Floats, *, size: float, rng: np.random.Generator) -> dict[str, object]:
    scaled = without_rounding_noise(differences / size)
    (t, p), (low, high) = mean_test(scaled, rng=rng), interval_of(scaled)
    n, mean, note = scaled.size, float(scaled.mean()), why_undefined(scaled)
    found = {"n": n, "mean_difference": size * mean, "ci_low": size * low, "ci_high": size * high}
    return found | {"t": t, "df": n - 1, "p": p, "d_z": t / np.sqrt(n), "note": note}


def overall_mean(cells: pd.DataFrame) -> tuple[float, float, float]:
    """Mean over participants of the mean of their conditions, and its 95 % interval.

    Parameters
    ----------
    cells : DataFrame
        From `participant_cells`.
    """
    people = cells.groupby("participant_id")["mean"].mean().to_numpy(dtype=float)
    return float(people.mean()), *interval_of(people)


def _condition(levels: Sequence[str]) -> str:
    return ", ".join(levels) or "all"


def _weighted_mean(cell: pd.DataFrame, measure: str) -> float:
    return float(np.average(cell[measure], weights=cell["count"]))


def _wilson(share: float, trials: int) -> tuple[float, float]:
    from statsmodels.stats.proportion import proportion_confint  # late: it takes a second

    low, high = proportion_confint(share * trials, trials, alpha=1 - CONFIDENCE, method="wilson")
    return float(low), float(high)
