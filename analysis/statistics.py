"""Paired comparisons, correct rates and confusion matrices (PAPER VIII, METHOD 12)."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray
from scipy import special, stats

from analysis.load import MODELS, SCALES
from modeling import InputError

Floats = NDArray[np.float64]

CONFIDENCE = 0.95
BOOTSTRAP_RESAMPLES = 5000
ALL_TEXTURES = "all textures"


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
    """Paired t-test, effect size d_z and Wilcoxon signed-rank test (METHOD 12).

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
    differences = _without_rounding_noise(after - before)
    undefined = _why_undefined(differences)
    t, p, low, high = (np.nan,) * 4 if undefined else _t_test(differences)
    d_low, d_high = (np.nan, np.nan) if undefined else d_z_interval(t, differences.size)
    wilcoxon_w, wilcoxon_p = _wilcoxon(differences)
    return PairedTest(
        n=before.size,
        mean_full=_mean(before),
        se_full=standard_error(before),
        mean_simplified=_mean(after),
        se_simplified=standard_error(after),
        mean_difference=_mean(differences),
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


def rating_tests(absolute: pd.DataFrame) -> pd.DataFrame:
    """Paired tests of both rating scales (PAPER VIII-A), Holm over the textures of a scale.

    Parameters
    ----------
    absolute : DataFrame
        `Responses.absolute`; ratings 0–100.

    Returns
    -------
    DataFrame
        One row per scale and texture: scale, texture, the fields of `PairedTest`, p_holm, and
        excluded (participants without both values, by name).
    """
    families = [
        _paired_family(absolute, column).assign(scale=scale) for column, scale in SCALES.items()
    ]
    return _columns_first(
        pd.concat(families, ignore_index=True), ["scale", "texture", "n", "excluded"]
    )


def rate_tests(relative: pd.DataFrame) -> pd.DataFrame:
    """Paired tests of the correct rates (PAPER VIII-B), Holm over the textures.

    Parameters
    ----------
    relative : DataFrame
        `Responses.relative`; rates are shares 0–1 per participant.

    Returns
    -------
    DataFrame
        One row per texture as in `rating_tests`, then one over all textures, which is not part
        of the family (its p_holm is NaN).
    """
    family = _paired_family(relative, "correct")
    overall = _paired_family(relative.assign(texture=ALL_TEXTURES), "correct")
    return _columns_first(
        pd.concat([family, overall.assign(p_holm=np.nan)], ignore_index=True),
        ["texture", "n", "excluded"],
    )


def correct_rates(
    relative: pd.DataFrame, *, rng: np.random.Generator, chance: float = 1 / 7
) -> pd.DataFrame:
    """Correct rates per texture and model against chance, participants as units (METHOD 12).

    Parameters
    ----------
    relative : DataFrame
        Columns participant_id, texture, model, correct (0, 1 or NaN).
    rng : Generator
        Draws the participants of the bootstrap.
    chance : float
        Rate of a guessing participant, 0 … 1.

    Returns
    -------
    DataFrame
        texture, model, participants, trials, mean, se, ci_low, ci_high (95 %, bias-corrected and
        accelerated bootstrap over participants), t, df, p (one-sample t of the participants'
        rates against chance, two-sided), p_holm (over the textures of one model), note. The rows
        `all textures` pool a participant's trials and stand outside the family.
    """
    pooled = relative.assign(texture=ALL_TEXTURES)
    rows = []
    for model in MODELS:
        for table in (relative, pooled):
            chosen = table[table["model"] == model]
            family = pd.DataFrame(
                _rate_row(cell, rng=rng, chance=chance) | {"texture": texture, "model": model}
                for texture, cell in chosen.groupby("texture", sort=False)
            )
            if family.empty:
                continue
            family["p_holm"] = holm(family["p"]) if table is relative else np.nan
            rows.append(family.sort_values("texture", key=_ignoring_case))
    if not rows:
        raise InputError("expected answers of the forced choice, got none; run a session first.")
    return _columns_first(pd.concat(rows, ignore_index=True), ["texture", "model"])


def participant_rates(relative: pd.DataFrame) -> pd.DataFrame:
    """Correct rate (0–1) of each participant (rows) per texture and model (columns)."""
    return relative.pivot_table(
        index="participant_id", columns=["texture", "model"], values="correct", aggfunc="mean"
    )


@dataclass(frozen=True, eq=False)
class ConfusionMatrix:
    """Answers of the forced choice for one model.

    Parameters
    ----------
    model : str
        full or simplified.
    textures : (k,) tuple of str
        Names of rows and columns.
    counts : (k, k) ndarray of int
        Row: the real surface presented; column: the virtual surface answered.
    """

    model: str
    textures: tuple[str, ...]
    counts: NDArray[np.int64]

    @property
    def row_shares(self) -> Floats:
        """(k, k) shares of a row's answers, each row adding up to 1; NaN in rows without any."""
        totals = self.counts.sum(axis=1, keepdims=True)
        shares = np.full(self.counts.shape, np.nan)
        np.divide(self.counts, totals, out=shares, where=totals > 0)
        return shares


def confusion_matrices(relative: pd.DataFrame) -> dict[str, ConfusionMatrix]:
    """Count who was taken for whom, for the full and the simplified model (PAPER fig. 10).

    Parameters
    ----------
    relative : DataFrame
        `Responses.relative`; trials without an answer are left out.

    Returns
    -------
    dict
        By model, both over the same textures: all that were presented or on offer.
    """
    answered = relative[relative["answer"].notna()]
    offered = {name for layout in answered["layout"] for name in str(layout).split("|")}
    textures = tuple(sorted(offered | set(answered["texture"]), key=str.casefold))
    matrices = {}
    for model in MODELS:
        chosen = answered[answered["model"] == model]
        counts = pd.crosstab(chosen["texture"], chosen["answer"])
        square = counts.reindex(index=list(textures), columns=list(textures), fill_value=0)
        matrices[model] = ConfusionMatrix(model, textures, square.to_numpy(dtype=np.int64))
    return matrices


def _paired_family(table: pd.DataFrame, column: str) -> pd.DataFrame:
    """Test every texture of a table; the Holm family is these textures."""
    rows = []
    for texture, cells in table.groupby("texture", sort=False):
        means = cells.pivot_table(
            index="participant_id", columns="model", values=column, aggfunc="mean", dropna=False
        ).reindex(columns=list(MODELS))
        # Named against everybody in the table, so that a whole missing cell is seen too.
        means = means.reindex(sorted(table["participant_id"].unique()))
        both = means.dropna()
        result = asdict(paired_test(both["full"], both["simplified"]))
        excluded = ", ".join(means.index.difference(both.index))
        rows.append({"texture": texture, **result, "excluded": excluded})
    if not rows:
        raise InputError(f"expected answers in column {column}, got none; run a session first.")
    family = pd.DataFrame(rows).sort_values("texture", key=_ignoring_case)
    return family.assign(p_holm=holm(family["p"]))


def _rate_row(cell: pd.DataFrame, *, rng: np.random.Generator, chance: float) -> dict[str, Any]:
    rates = cell.groupby("participant_id")["correct"].mean().dropna().to_numpy(dtype=float)
    against_chance = _without_rounding_noise(rates - chance)
    undefined = _why_undefined(against_chance)
    t, p = (np.nan, np.nan) if undefined else _t_test(against_chance)[:2]
    low, high = (np.nan, np.nan) if undefined else _bootstrap_interval(rates, rng)
    return {
        "participants": rates.size,
        "trials": int(cell["correct"].notna().sum()),
        "mean": _mean(rates),
        "se": standard_error(rates),
        "ci_low": low,
        "ci_high": high,
        "t": t,
        "df": max(rates.size - 1, 0),
        "p": p,
        "note": undefined,
    }


def _bootstrap_interval(rates: Floats, rng: np.random.Generator) -> tuple[float, float]:
    interval = stats.bootstrap(
        (rates,),
        np.mean,
        n_resamples=BOOTSTRAP_RESAMPLES,
        confidence_level=CONFIDENCE,
        method="BCa",
        rng=rng,
    ).confidence_interval
    return float(interval.low), float(interval.high)


def _t_test(differences: Floats) -> tuple[float, float, float, float]:
    """t, two-sided p and the confidence limits of the mean."""
    result = stats.ttest_1samp(differences, 0.0)
    interval = result.confidence_interval(CONFIDENCE)
    return float(result.statistic), float(result.pvalue), float(interval.low), float(interval.high)


def _wilcoxon(differences: Floats) -> tuple[float, float]:
    if not differences.any():
        return float("nan"), float("nan")
    result = stats.wilcoxon(differences)
    return float(result.statistic), float(result.pvalue)


def _shapiro(differences: Floats) -> float:
    if differences.size < 3 or np.ptp(differences) == 0:
        return float("nan")
    return float(stats.shapiro(differences).pvalue)


def _without_rounding_noise(differences: Floats) -> Floats:
    """Make 2/3 − 1/3 and 1 − 2/3 the same number, so that ties and zero variance are seen."""
    rounded: Floats = np.round(differences, 12)
    return rounded


def _why_undefined(differences: Floats) -> str:
    if differences.size < 2:
        return f"t undefined: {differences.size} participant(s)"
    if np.ptp(differences) == 0:
        return "t undefined: no variation between participants"
    return ""


def _mean(values: Floats) -> float:
    return float(values.mean()) if values.size else float("nan")


def _ignoring_case(column: pd.Series) -> pd.Series:
    return column.str.casefold()


def _columns_first(table: pd.DataFrame, names: list[str]) -> pd.DataFrame:
    return table[names + [name for name in table if name not in names]]
