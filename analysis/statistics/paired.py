"""Paired t-tests of full and simplified models, with effect sizes."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import asdict, dataclass

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from scipy import special, stats

from analysis.columns import TEXTURE, Column, P, names
from analysis.labels import IDENTICAL, MODELS, SCALES
from modeling import InputError
from modeling.arrays import Floats

CONFIDENCE = 0.95


@dataclass(frozen=True)
class PairedTest:
    """Full against simplified model over the participants who gave both.

    Differences are simplified − full, in the unit of the values. `ci_*` is the 95 % confidence
    interval of the mean difference; `d_z` is the mean difference over the standard deviation of
    the differences. What cannot be computed is NaN and `note` says why.
    """

    n: int
    mean_full: float
    se_full: float
    mean_simplified: float
    se_simplified: float
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
    note: str


def paired_test(full: ArrayLike, simplified: ArrayLike) -> PairedTest:
    """Paired t-test, effect size d_z and Wilcoxon signed-rank test.

    docs/method/statistics.md#paired-tests

    Parameters
    ----------
    full, simplified : (n,) array_like
        One finite value per participant, in the same order.

    Returns
    -------
    PairedTest
        With t undefined (fewer than two pairs, or all differences equal) t, p, d_z and the
        interval are NaN.

    Raises
    ------
    InputError
        For different lengths or values that are not finite.
    """
    before, after = np.asarray(full, dtype=float), np.asarray(simplified, dtype=float)
    if before.shape != after.shape or before.ndim != 1 or not np.isfinite(before + after).all():
        raise InputError(
            f"expected two lists of finite values of one length, got shapes {before.shape} and "
            f"{after.shape}; leave participants out of both where one value is missing."
        )
    differences = without_rounding_noise(after - before)
    undefined = why_undefined(differences)
    t, p, low, high = (np.nan,) * 4 if undefined else t_test(differences)
    d_low, d_high = (np.nan, np.nan) if undefined else d_z_interval(t, differences.size)
    wilcoxon_w, wilcoxon_p = wilcoxon(differences)
    return PairedTest(
        n=before.size,
        mean_full=mean(before),
        se_full=standard_error(before),
        mean_simplified=mean(after),
        se_simplified=standard_error(after),
        mean_difference=mean(differences),
        ci_low=low,
        ci_high=high,
        t=t,
        df=max(before.size - 1, 0),
        p=p,
        d_z=float(t / np.sqrt(differences.size)) if differences.size else np.nan,
        d_z_low=d_low,
        d_z_high=d_high,
        shapiro_p=_shapiro(differences),
        wilcoxon_w=wilcoxon_w,
        wilcoxon_p=wilcoxon_p,
        note=undefined,
    )


def standard_error(values: Floats) -> float:
    """Standard deviation over √n; NaN below two values."""
    return float(stats.sem(values)) if values.size > 1 else float("nan")


def d_z_interval(t: float, n: int, *, confidence: float = CONFIDENCE) -> tuple[float, float]:
    """Confidence interval of d_z = t/√n by inverting the noncentral t distribution.

    Parameters
    ----------
    t : float
        Paired t value.
    n : int
        Pairs, ≥ 2.
    confidence : float
        0 … 1.

    Notes
    -----
    Steiger and Fouladi (1997): the limits are the noncentralities that put the observed t at the
    upper and lower tail.
    """
    tail = (1 - confidence) / 2
    low, high = special.nctdtrinc(n - 1, [1 - tail, tail], t) / np.sqrt(n)
    return float(low), float(high)


def holm(p_values: ArrayLike) -> Floats:
    """Holm-adjusted p values; NaN (a test that could not be made) stays outside the family."""
    from pingouin import multicomp  # late: it takes a second to import

    p = np.asarray(p_values, dtype=float)
    if np.isnan(p).all():
        return p.copy()
    adjusted: Floats = np.asarray(multicomp(p, method="holm")[1], dtype=float)
    return adjusted


INFERENCE = ("t", "p", "d_z", "d_z_low", "d_z_high", "shapiro_p", "wilcoxon_w", "wilcoxon_p")
CI_LOW, CI_HIGH = Column("ci_low", "CI from"), Column("ci_high", "to")
T, DF = Column("t"), Column("df")
P_HOLM = Column("p_holm", "p (Holm)", is_p_value=True)
NOTE = Column("note")
PAIRED_COLUMNS = (
    TEXTURE,
    Column("n"),
    Column("excluded"),
    Column("mean_full"),
    Column("se_full", "SE full"),
    Column("mean_simplified"),
    Column("se_simplified", "SE simplified"),
    Column("mean_difference", "difference"),
    *(CI_LOW, CI_HIGH, T, DF, P),
    Column("d_z", "d_z"),
    Column("d_z_low", "CI from"),
    Column("d_z_high", "to"),
    Column("shapiro_p", "Shapiro p", is_p_value=True),
    Column("wilcoxon_w", "Wilcoxon W"),
    Column("wilcoxon_p", "Wilcoxon p", is_p_value=True),
    NOTE,
    P_HOLM,
)
RATING_TEST_COLUMNS = (Column("scale", is_name=True), *PAIRED_COLUMNS)


def rating_tests(
    absolute: pd.DataFrame, *, identical: Collection[str] = frozenset()
) -> pd.DataFrame:
    """Paired tests of both rating scales (PAPER VIII-A), Holm over the textures of a scale.

    Parameters
    ----------
    absolute : DataFrame
        `Responses.absolute`; ratings 0–100.
    identical : collection of str
        Textures whose simplified model is the full one: described, but not tested
        (docs/method/statistics.md#identical-models).

    Returns
    -------
    DataFrame
        One row per scale and texture: scale, texture, n, excluded (participants without both
        values, by name), the other fields of `PairedTest`, and p_holm.
    """
    families = [
        paired_family(absolute, column, identical=identical).assign(scale=scale)
        for column, scale in SCALES.items()
    ]
    return pd.concat(families, ignore_index=True)[names(RATING_TEST_COLUMNS)]


def rating_means(absolute: pd.DataFrame) -> pd.DataFrame:
    """`participant_means` of both rating scales, with a column scale."""
    means = [
        participant_means(absolute, column).assign(scale=scale) for column, scale in SCALES.items()
    ]
    return pd.concat(means, ignore_index=True)


def paired_family(
    table: pd.DataFrame, column: str, *, identical: Collection[str] = frozenset()
) -> pd.DataFrame:
    """Test every texture of a table but the identical ones; the Holm family is these textures."""
    rows = []
    for texture, means in participant_means(table, column).groupby("texture", sort=False):
        means = means.set_index("participant_id")[list(MODELS)]
        both = means.dropna()
        result = asdict(paired_test(both["full"], both["simplified"]))
        if texture in identical:
            result |= dict.fromkeys(INFERENCE, np.nan) | {"note": IDENTICAL}
        excluded = ", ".join(means.index.difference(both.index))
        rows.append({"texture": texture, **result, "excluded": excluded})
    if not rows:
        raise InputError(f"expected answers in column {column}, got none; run a session first.")
    family = pd.DataFrame(rows).sort_values("texture", key=ignoring_case)
    return family.assign(p_holm=holm(family["p"]))


def participant_means(table: pd.DataFrame, column: str) -> pd.DataFrame:
    """What each participant's answers on each texture average to, with either model.

    Parameters
    ----------
    table : DataFrame
        Columns participant_id, texture, model and `column`.
    column : str

    Returns
    -------
    DataFrame
        texture, participant_id, full, simplified: a row for every participant of the table and
        every texture, textures in the order of the answers; NaN where there is no answer.
    """
    means = table.pivot_table(
        index=["texture", "participant_id"],
        columns="model",
        values=column,
        aggfunc="mean",
        dropna=False,
        observed=True,
    ).reindex(columns=list(MODELS))
    # Everybody in every texture, so that a whole missing cell is seen too.
    people = sorted(table["participant_id"].unique())
    every = pd.MultiIndex.from_product(
        [table["texture"].unique(), people], names=["texture", "participant_id"]
    )
    return means.reindex(every).rename_axis(columns=None).reset_index()


def t_test(differences: Floats) -> tuple[float, float, float, float]:
    """t, two-sided p and the confidence limits of the mean."""
    t, p, low, high = (float(values[0]) for values in t_tests(differences[None, :]))
    return t, p, low, high


def t_tests(differences: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """The same of each row of (k, n) differences, (k,) each."""
    result = stats.ttest_1samp(differences, 0.0, axis=1)
    interval = result.confidence_interval(CONFIDENCE)
    t, p, low, high = np.array([result.statistic, result.pvalue, interval.low, interval.high])
    return t, p, low, high


def wilcoxon(differences: Floats) -> tuple[float, float]:
    """W and two-sided p of the signed-rank test; NaN where there is no difference."""
    w, p = (float(values[0]) for values in wilcoxon_tests(differences[None, :]))
    return w, p


def wilcoxon_tests(differences: Floats) -> tuple[Floats, Floats]:
    """The same of each row of (k, n) differences, (k,) each."""
    w, p = np.full((2, len(differences)), np.nan)
    zeros = (differences == 0).sum(axis=1)
    # SciPy takes one distribution for all rows, and another one where a difference is 0.
    for whole in (True, False):
        rows = ((zeros == 0) == whole) & (zeros < differences.shape[1])
        if rows.any():
            w[rows], p[rows] = stats.wilcoxon(differences[rows], axis=1)
    return w, p


def _shapiro(differences: Floats) -> float:
    if differences.size < 3 or np.ptp(differences) == 0:
        return float("nan")
    return float(stats.shapiro(differences).pvalue)


def without_rounding_noise(differences: Floats) -> Floats:
    """Make 2/3 − 1/3 and 1 − 2/3 the same number, so that ties and zero variance are seen."""
    rounded: Floats = np.round(differences, 12)
    return rounded


def why_undefined(differences: Floats) -> str:
    """Why no t-test can be made of these differences; empty where one can."""
    if differences.size < 2:
        return f"t undefined: {differences.size} participant(s)"
    if np.ptp(differences) == 0:
        return "t undefined: no variation between participants"
    return ""


def mean(values: Floats) -> float:
    """Arithmetic mean; NaN of no value."""
    return float(values.mean()) if values.size else float("nan")


def ignoring_case(column: pd.Series) -> pd.Series:
    """Sort key of names: capital letters count as small ones."""
    return column.str.casefold()
