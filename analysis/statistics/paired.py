"""Two models compared within participants: paired t-test, effect size, alternative tests."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from scipy import special, stats

from tactileq.analysis.statistics.crossover import CONFOUNDED, MeanDifferences, mean_differences
from tactileq.modeling import InputError
from tactileq.modeling.arrays import Floats
from tactileq.modeling.errors import counted

CONFIDENCE = 0.95
RESAMPLES = 9999  # of sign flips; all of them where there are fewer, that is up to 13 participants


Alternative = Literal["two-sided", "greater", "less"]


@dataclass(frozen=True)
class PairedTest:
    """A model against the reference, over the participants who gave both.

    Differences are other − reference, in the unit of the values. `ci_*` is the 95 % confidence
    interval of the mean difference; `d_z` is the mean difference over the standard deviation of
    the differences; all three are apart from days, where models were on different ones. Where
    participants do not vary, t and what follows from it are NaN, `note` says why, and `p` is that
    of the sign flips.
    """

    n: int
    mean_reference: float
    se_reference: float
    mean_other: float
    se_other: float
    mean_difference: float
    ci_low: float
    ci_high: float
    t: float
    df: int
    p: float
    d_z: float
    d_z_low: float
    d_z_high: float
    shapiro_p: float
    wilcoxon_w: float
    wilcoxon_p: float
    sign_flips_p: float
    note: str


def paired_test(
    reference: ArrayLike,
    other: ArrayLike,
    *,
    rng: np.random.Generator,
    contrasts: Floats | None = None,
) -> PairedTest:
    """Paired t-test and effect size d_z; Wilcoxon's signed-rank test and sign flips beside it.

    docs/method/statistics.md#paired-tests

    Parameters
    ----------
    reference, other : (n,) array_like
        One finite value per participant, in the same order.
    rng : Generator
        Draws the sign flips of more than 13 participants.
    contrasts : (n, c) ndarray, optional
        Days that differences are adjusted for (`crossover.day_contrasts`).

    Raises
    ------
    InputError
        For different lengths or values that are not finite.
    """
    before, after = np.asarray(reference, dtype=float), np.asarray(other, dtype=float)
    if before.shape != after.shape or before.ndim != 1 or not np.isfinite(before + after).all():
        alike = before.shape == after.shape and before.ndim == 1
        what = "NaN or inf" if alike else f"shapes {before.shape} and {after.shape}"
        raise InputError(
            f"expected two lists of finite values of one length, got {what}; leave participants "
            "out of both where one value is missing."
        )
    found = mean_differences(without_rounding_noise(after - before)[None, :], contrasts)
    undefined = why_undefined(found)
    t, p, low, high = (np.nan,) * 4 if undefined else _first(t_tests(found))
    d_low, d_high = (np.nan, np.nan) if undefined else d_z_interval(t, found.size, df=found.df)
    differences = found.told[0]
    wilcoxon_w, wilcoxon_p = wilcoxon(differences, rng=rng)
    flipped_p = sign_flips_p(differences, rng=rng)
    return PairedTest(
        n=before.size,
        mean_reference=mean(before),
        se_reference=standard_error(before),
        mean_other=mean(after),
        se_other=standard_error(after),
        mean_difference=float(found.mean[0]),
        ci_low=low,
        ci_high=high,
        t=t,
        df=max(found.df, 0),
        p=flipped_p if undefined else p,
        d_z=float(t / np.sqrt(found.size)) if differences.size else np.nan,
        d_z_low=d_low,
        d_z_high=d_high,
        shapiro_p=_shapiro(differences),
        wilcoxon_w=wilcoxon_w,
        wilcoxon_p=wilcoxon_p,
        sign_flips_p=flipped_p,
        note=undefined,
    )


def standard_error(values: Floats) -> float:
    """Standard deviation over √n; NaN below two values."""
    return float(stats.sem(values)) if values.size > 1 else float("nan")


def t_interval(values: Floats) -> tuple[float, float]:
    """The 95 % interval of a mean by Student's t; NaN below two values."""
    if values.size < 2:
        return float("nan"), float("nan")
    half = stats.sem(values) * stats.t.ppf((1 + CONFIDENCE) / 2, values.size - 1)
    return float(values.mean() - half), float(values.mean() + half)


def d_z_interval(
    t: float, n: float, *, df: int | None = None, confidence: float = CONFIDENCE
) -> tuple[float, float]:
    """Confidence interval of d_z = t/√n by inverting the noncentral t distribution.

    Parameters
    ----------
    t : float
        Paired t value.
    n : float
        Pairs, ≥ 2; `MeanDifferences.size` where days count.
    df : int, optional
        n − 1 without it.
    confidence : float
        0 … 1.

    Notes
    -----
    Steiger and Fouladi (1997): the limits are the noncentralities that put the observed t at the
    upper and lower tail.
    """
    tail = (1 - confidence) / 2
    df = round(n) - 1 if df is None else df
    low, high = special.nctdtrinc(df, [1 - tail, tail], t) / np.sqrt(n)
    return float(low), float(high)


def holm(p_values: ArrayLike) -> Floats:
    """Holm-adjusted p values; NaN (a test that could not be made) stays outside the family."""
    from pingouin import multicomp  # late: it takes a second to import

    p = np.asarray(p_values, dtype=float)
    if np.isnan(p).all():
        return p.copy()
    adjusted: Floats = np.asarray(multicomp(p, method="holm")[1], dtype=float)
    return adjusted


def participant_means(table: pd.DataFrame, column: str) -> pd.DataFrame:
    """The mean of each participant's answers on each texture with each model.

    Parameters
    ----------
    table : DataFrame
        Columns participant_id, texture, model and `column`.

    Returns
    -------
    DataFrame
        texture, participant_id and a column for each model: a row for every participant of the
        table and every texture, textures in the order of the answers; NaN where there is no answer.
    """
    means = table.pivot_table(
        index=["texture", "participant_id"],
        columns="model",
        values=column,
        aggfunc="mean",
        dropna=False,
        observed=True,
    )
    # Everybody in every texture, so that a whole missing cell is seen too.
    people = sorted(table["participant_id"].unique())
    every = pd.MultiIndex.from_product(
        [table["texture"].unique(), people], names=["texture", "participant_id"]
    )
    return means.reindex(every).rename_axis(columns=None).reset_index()


def t_test(differences: Floats) -> tuple[float, float, float, float]:
    """t, two-sided p and the confidence limits of the mean."""
    return _first(t_tests(differences[None, :]))


def mean_test(differences: Floats, *, rng: np.random.Generator) -> tuple[float, float]:
    """t and two-sided p of their mean; of sign flips, with t NaN, where participants are alike."""
    rounded = without_rounding_noise(differences)
    if why_undefined(rounded):
        needless = rounded.size and not rounded.any()  # zeros have no sign to draw
        return float("nan"), 1.0 if needless else sign_flips_p(rounded, rng=rng)
    return t_test(rounded)[:2]


def t_tests(
    differences: Floats | MeanDifferences, *, confidence: float = CONFIDENCE
) -> tuple[Floats, Floats, Floats, Floats]:
    """The same of each row of (k, n) differences, (k,) each."""
    found = mean_differences(differences)
    with np.errstate(divide="ignore", invalid="ignore"):  # where nobody varies
        t = found.mean / found.error
    half = found.error * stats.t.ppf((1 + confidence) / 2, found.df)
    return t, 2 * stats.t.sf(np.abs(t), found.df), found.mean - half, found.mean + half


def _first(values: tuple[Floats, Floats, Floats, Floats]) -> tuple[float, float, float, float]:
    t, p, low, high = (float(one[0]) for one in values)
    return t, p, low, high


def wilcoxon(differences: Floats, *, rng: np.random.Generator) -> tuple[float, float]:
    """W and two-sided p of the signed-rank test; NaN where there is no difference.

    Differences of 0 are left out. Exact up to 50 people; where some are tied, by sign flips of the
    ranks, as SciPy's `PermutationMethod` does, but for all draws at once.
    """
    moved = differences[differences != 0]
    if not moved.size:
        return float("nan"), float("nan")
    ranks = stats.rankdata(np.abs(moved))
    if np.unique(ranks).size == ranks.size:
        result = stats.wilcoxon(moved)
        return float(result.statistic), float(result.pvalue)
    signed = np.sign(moved) * ranks
    w = min(signed[signed > 0].sum(), -signed[signed < 0].sum())
    return float(w), sign_flips_p(signed, rng=rng)


def sign_flips_p(
    differences: Floats, *, rng: np.random.Generator, alternative: Alternative = "two-sided"
) -> float:
    """p of the mean when the sign of each participant's difference is random.

    Exact up to 13 participants, else from 9999 draws; of one participant 1, of none NaN.
    docs/method/statistics.md#sign-flips

    Parameters
    ----------
    differences : (n,) ndarray
    alternative : {"two-sided", "greater", "less"}
    """
    if differences.size < 2:
        return 1.0 if differences.size else float("nan")
    result = stats.permutation_test(
        (differences, np.zeros_like(differences)),
        lambda one, other, axis: (one - other).mean(axis=axis),
        permutation_type="samples",
        vectorized=True,
        n_resamples=RESAMPLES,
        alternative=alternative,
        rng=rng,
    )
    return float(result.pvalue)


def _shapiro(differences: Floats) -> float:
    if differences.size < 3 or np.ptp(differences) == 0:
        return float("nan")
    return float(stats.shapiro(differences).pvalue)


def without_rounding_noise(differences: Floats) -> Floats:
    """Make 2/3 − 1/3 and 1 − 2/3 the same number, so that ties and zero variance are seen."""
    rounded: Floats = np.round(differences, 12)
    return rounded


def why_undefined(differences: Floats | MeanDifferences) -> str:
    """Why no t-test can be made of these differences of one sample; empty where one can."""
    if isinstance(differences, np.ndarray):
        differences = differences[None, :]
    found = mean_differences(differences)
    count = found.adjusted.shape[1]
    if found.confounded:
        return CONFOUNDED
    if found.df < 1:
        return f"t undefined: {counted(count, 'participant')}"
    if np.ptp(found.adjusted) == 0:
        return "t undefined: no variation between participants"
    return ""


def mean(values: Floats) -> float:
    """Arithmetic mean; NaN of no value."""
    return float(values.mean()) if values.size else float("nan")


def ignoring_case(column: pd.Series) -> pd.Series:
    """Sort key of names: capital letters count as small ones."""
    return column.str.casefold()
