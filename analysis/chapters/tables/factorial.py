"""Accuracy, or a mean, by any factors varied within participants: repeated-measures ANOVA.

docs/method/tables.md#analysis-of-variance
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import combinations

import numpy as np
import pandas as pd
from scipy import linalg, stats

from tactileq.analysis.columns import P
from tactileq.analysis.statistics.paired import CONFIDENCE, holm, paired_test, t_interval
from tactileq.modeling import InputError
from tactileq.modeling.arrays import Floats
from tactileq.modeling.files.columns import Column

EFFECT = Column("effect", is_name=True)
ANOVA_COLUMNS = (
    EFFECT,
    Column("df_effect", "df of the effect"),
    Column("df_error", "df of the error"),
    Column("F", format=".3f"),
    P,
    Column("epsilon", "ε of Greenhouse and Geisser", format=".3f"),
    Column("p_corrected", "p, corrected by ε", is_p_value=True),
    Column("generalized_eta_squared", "generalized η²", format=".3f"),
    Column("n", "participants"),
)
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
    def long(self) -> pd.DataFrame:
        """One row per participant and cell: participant_id, the factors and mean."""
        index = pd.MultiIndex.from_product(
            [self.participants, *self.levels.values()], names=["participant_id", *self.levels]
        )
        return pd.DataFrame({"mean": self.means.ravel()}, index=index).reset_index()


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
    for condition, cell in cells.groupby("condition", sort=False):
        values = cell["mean"].to_numpy(dtype=float)
        low, high = t_interval(values)
        row: dict[str, object] = {factor: cell[factor].iloc[0] for factor in factors}
        row |= {"condition": condition, "n": values.size, "mean": float(values.mean())}
        rows.append(row | {"ci_low": low, "ci_high": high})
    table = pd.DataFrame(rows)
    order = sorted(table.index, key=lambda i: [in_order(table.loc[i, f]) for f in factors])
    return table.loc[order].reset_index(drop=True)


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
    for factor, names in levels.items():
        if len(names) < 2:
            raise InputError(
                f"expected two levels or more of the factor {factor}, got {', '.join(names)}; "
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
    shape = (len(whole), *(len(names) for names in levels.values()))
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
        `ANOVA_COLUMNS`, a row per effect; `p_corrected` equals p where the effect has one degree of
        freedom. F and p are NaN where an effect is the same in all participants.

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
    factors = list(complete.levels)
    table = _few_factors(complete.long, factors) if len(factors) < 3 else _many_factors(complete)
    single = table["df_effect"] == 1
    table.loc[single, "epsilon"] = 1.0
    table.loc[single, "p_corrected"] = table.loc[single, "p"]
    table["n"] = n
    # Where all participants show one effect alike, F would be rounding over rounding.
    alike = [float(np.ptp(score, axis=0).max()) < 1e-12 for score in _effects(complete).values()]
    undefined = ["F", "p", "epsilon", "p_corrected", "generalized_eta_squared"]
    table.loc[alike, undefined] = np.nan
    return table


def _few_factors(long: pd.DataFrame, factors: list[str]) -> pd.DataFrame:
    from pingouin import rm_anova  # late: it takes a second to import

    within = factors[0] if len(factors) == 1 else factors
    with np.errstate(divide="ignore", invalid="ignore"), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "The inplace keyword", module="pingouin")
        found = rm_anova(
            data=long,
            dv="mean",
            within=within,
            subject="participant_id",
            correction=True,
            effsize="ng2",
        )
    # It drops columns without any number.
    numbers = ["ddof1", "ddof2", "F", "p_unc", "eps", "p_GG_corr", "ng2"]
    found = found.reindex(columns=["Source", *numbers])
    return pd.DataFrame(
        {
            "effect": [str(source).replace(" * ", " × ") for source in found["Source"]],
            "df_effect": found["ddof1"].astype(int),
            "df_error": found["ddof2"].astype(int),
            "F": found["F"],
            "p": found["p_unc"],
            "epsilon": found["eps"],
            "p_corrected": found["p_GG_corr"],
            "generalized_eta_squared": found["ng2"],
        }
    )


def _many_factors(complete: CompleteCells) -> pd.DataFrame:
    """F and p by statsmodels, which has neither ε nor η²: those from orthonormal contrasts."""
    from statsmodels.stats.anova import AnovaRM  # late: it takes a second to import

    factors = list(complete.levels)
    # Names of columns become names in a formula: only plain ones are safe there.
    plain = {factor: f"f{number}" for number, factor in enumerate(factors)}
    long = complete.long.rename(columns=plain)
    found = AnovaRM(long, "mean", "participant_id", within=list(plain.values())).fit().anova_table
    scores = _effects(complete)
    unexplained = complete.means.size * np.var(complete.means) - sum(
        len(score) * np.sum(score.mean(axis=0) ** 2) for score in scores.values()
    )
    rows = []
    for which, score in scores.items():
        test = found.loc[":".join(f"f{i}" for i in which)]
        squares = len(score) * np.sum(score.mean(axis=0) ** 2)
        epsilon = _epsilon(score)
        f, df, df_error = (float(test[name]) for name in ("F Value", "Num DF", "Den DF"))
        rows.append(
            {
                "effect": " × ".join(factors[i] for i in which),
                "df_effect": int(df),
                "df_error": int(df_error),
                "F": f,
                "p": float(test["Pr > F"]),
                "epsilon": epsilon,
                "p_corrected": float(stats.f.sf(f, epsilon * df, epsilon * df_error)),
                "generalized_eta_squared": _share(squares, squares + unexplained),
            }
        )
    return pd.DataFrame(rows)


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
    return _share(np.trace(covariance) ** 2, len(covariance) * np.sum(covariance**2))


def _share(part: float, whole: float) -> float:
    return float(part / whole) if whole > 0 else float("nan")


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
            test = paired_test(means[:, first], means[:, second], rng=rng)
            row: dict[str, object] = {
                "factor": factor,
                "pair": f"{levels[second]} − {levels[first]}",
            }
            shown = ("n", "mean_difference", "ci_low", "ci_high", "t", "df", "p", "d_z", "note")
            rows.append(row | {name: getattr(test, name) for name in shown})
        tables.append(pd.DataFrame(rows).assign(p_holm=lambda table: holm(table["p"])))
    return pd.concat(tables, ignore_index=True)


def overall_mean(cells: pd.DataFrame) -> tuple[float, float, float]:
    """Mean over participants of the mean of their conditions, and its 95 % interval.

    Parameters
    ----------
    cells : DataFrame
        From `participant_cells`.
    """
    people = cells.groupby("participant_id")["mean"].mean().to_numpy(dtype=float)
    return float(people.mean()), *t_interval(people)


def in_order(level: object) -> tuple[bool, float, str]:
    """Key that sorts levels: numbers by size, before names by letter."""
    text = str(level)
    try:
        return False, float(text), ""
    except ValueError:
        return True, 0.0, text.casefold()


def _condition(levels: Sequence[str]) -> str:
    return ", ".join(levels) or "all"


def _weighted_mean(cell: pd.DataFrame, measure: str) -> float:
    return float(np.average(cell[measure], weights=cell["count"]))


def _wilson(share: float, trials: int) -> tuple[float, float]:
    from statsmodels.stats.proportion import proportion_confint  # late: it takes a second

    low, high = proportion_confint(share * trials, trials, alpha=1 - CONFIDENCE, method="wilson")
    return float(low), float(high)
