"""Regressions of the parameters: tables 1 and 2 and figure 5 of the paper, and their loss."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from tactileq.analysis.columns import CONDITIONS, SIMULATED_COLUMN, TEXTURE, P
from tactileq.analysis.labels import ALL_TEXTURES, significance_mark
from tactileq.analysis.textures.likeness import MEASURE_COLUMNS, ConditionTarget, likeness_table
from tactileq.modeling import RegressedModel, TextureModel, regressed
from tactileq.modeling.arrays import Floats
from tactileq.modeling.files.columns import Column
from tactileq.modeling.models.own_peaks import own_peaks
from tactileq.modeling.models.terms import FORCE, SPEED, SPEED_FORCE, TERMS, DrivenBy
from tactileq.modeling.regression.centroid import (
    centroid_correlations,
    centroid_regression,
    spectral_centroid_hz,
    with_centroid,
)
from tactileq.modeling.regression.least_squares import ALPHA, Regression
from tactileq.modeling.regression.parameters import (
    PARAMETERS,
    ParameterRegression,
    parameter_regressions,
)

NAMES = dict(
    zip(
        PARAMETERS,
        ("noise gain n", "frequency f (Hz)", "amplitude a", "bandwidth b (Hz)"),
        strict=True,
    )
)
SYMBOLS = {SPEED: "v", FORCE: "F", SPEED_FORCE: "v·F"}
ALPHAS = {SPEED: "α1", FORCE: "α2", SPEED_FORCE: "α3"}
PER = {SPEED: "mm/s", FORCE: "N", SPEED_FORCE: "(mm/s·N)"}
NO_PEAK, ALL_PEAKS = "–", "all peaks"
# PAPER table 2 (α1, α2, α3 in the order of `TERMS`) and section IV-B.
PUBLISHED_SUPPORT = dict(
    zip(
        PARAMETERS,
        ((85.7, 14.3, 42.9), (40.0, 32.0, 8.0), (92.0, 72.0, 88.0), (24.0, 20.0, 4.0)),
        strict=True,
    )
)
PUBLISHED_COEFFICIENTS = dict(
    zip(
        PARAMETERS,
        (
            (-5.7e-8, -1.0e-7, 1.3e-10),
            (1.6e-1, 6.0e-3, 1.7e-6),
            (4.0e-4, -1.7e-5, 1.3e-7),
            (-2.6e-4, -5.9e-6, 1.3e-8),
        ),
        strict=True,
    )
)
PUBLISHED_ADJUSTED_R_SQUARED = dict(zip(PARAMETERS, (0.68, 0.40, 0.88, 0.20), strict=True))
MN_PER_N = 1000.0
GRID = "grid"
DRIVERS: tuple[DrivenBy, ...] = ("conditions", "centroid")

PARAMETER = Column("parameter", is_name=True)
PEAK, UNIT, MARK = Column("peak"), Column("unit"), Column("mark")
ADJUSTED_R_SQUARED = Column("adjusted_r_squared", "adjusted R²")
FIT_COLUMNS = (
    Column("multiple_r", "R"),
    ADJUSTED_R_SQUARED,
    P,
    MARK,
    Column("residual_degrees"),
    Column("intercept"),
    Column("p_intercept", "p of intercept", is_p_value=True),
    *(
        column
        for term, alpha in ALPHAS.items()
        for column in (
            Column(f"{term}_coefficient", f"{alpha} ({SYMBOLS[term]})"),
            Column(f"p_{term}", f"p of {alpha}", is_p_value=True),
            Column(f"mark_{term}", f"mark of {alpha}"),
        )
    ),
)
REGRESSION_COLUMNS = (
    *(TEXTURE, PARAMETER, PEAK, UNIT, CONDITIONS),
    Column("inherited"),
    Column("own_peak"),
    *FIT_COLUMNS,
    Column("reduced", is_name=True),
    Column("reduced_adjusted_r_squared", "adjusted R², reduced"),
    SIMULATED_COLUMN,
)


def regression_table(models: Sequence[TextureModel]) -> pd.DataFrame:
    """Every regression of every parameter (PAPER table 1).

    Parameters
    ----------
    models : sequence of TextureModel
        One per texture.

    Returns
    -------
    DataFrame
        Per texture one row for the noise gain and three per peak: texture, parameter, peak
        (1-based), unit, conditions (that the regression rests on), inherited (conditions left
        out because the frequency there is a copy), own_peak (false of a layer without a maximum of
        the response, which takes no part in support ratings), multiple_r, adjusted_r_squared, p
        (F test), mark (* p < .05, ** p < .01, *** p < .001), residual_degrees (of freedom),
        intercept, p_intercept, and for speed, force and speed_force the coefficient
        (…_coefficient; per mm/s, N and mm/s·N), p (p_…) and mark (mark_…); reduced: the
        terms that backward elimination leaves, reduced_adjusted_r_squared; simulated. What cannot
        be said is NaN (see `tactileq.modeling.regression.least_squares.Regression`).
    """
    rows = []
    for model in models:
        peaks = own_peaks(model)
        for found in parameter_regressions(model):
            gain = found.parameter in ("noise_gain", "amplitude")
            labels = {
                "texture": model.texture,
                "parameter": found.parameter,
                "peak": str(found.layer) if found.layer else NO_PEAK,
                "unit": model.unit if gain else "Hz",
                "conditions": found.full.n_conditions,
                "inherited": found.inherited,
                "own_peak": bool(peaks.is_peak[found.layer - 1]) if found.layer else True,
            }
            rows.append(
                labels | _fit(found.full) | _reduced(found) | {"simulated": model.simulated}
            )
    return pd.DataFrame(rows)


def _fit(full: Regression) -> dict[str, object]:
    row: dict[str, object] = {
        "multiple_r": full.multiple_r,
        "adjusted_r_squared": full.adjusted_r_squared,
        "p": full.p,
        "mark": significance_mark(full.p),
        "residual_degrees": full.residual_degrees,
        "intercept": float(full.coefficients[0]),
        "p_intercept": float(full.p_values[0]),
    }
    for term in TERMS:
        known = term in full.terms
        row[f"{term}_coefficient"] = full.coefficient(term) if known else np.nan
        row[f"p_{term}"] = full.p_value(term)
        row[f"mark_{term}"] = significance_mark(full.p_value(term))
    return row


def _reduced(found: ParameterRegression) -> dict[str, object]:
    terms = ", ".join(SYMBOLS[term] for term in found.reduced.terms)
    return {
        "reduced": terms or "constant",
        "reduced_adjusted_r_squared": found.reduced.adjusted_r_squared,
    }


SUPPORT_COLUMNS = (
    PARAMETER,
    Column("of"),
    *(Column(f"support_{term}", f"support {alpha}", "%") for term, alpha in ALPHAS.items()),
    *(
        Column(f"published_support_{term}", f"published {alpha}", "%")
        for term, alpha in ALPHAS.items()
    ),
    ADJUSTED_R_SQUARED,
    Column("published_adjusted_r_squared", "published"),
)


def support_table(regressions: pd.DataFrame) -> pd.DataFrame:
    """Support ratings and mean adjusted R² with the published ones (PAPER table 2, left half).

    Parameters
    ----------
    regressions : DataFrame
        From `regression_table`.

    Returns
    -------
    DataFrame
        One row per parameter: parameter, of (how many layers, or textures for the noise gain,
        could be tested; layers without a maximum of their own take no part), support_… (share in %
        of them whose coefficient has p < .05; a constant parameter supports nothing) for speed,
        force and speed_force, published_support_…, adjusted_r_squared (their mean) and
        published_adjusted_r_squared.
    """
    rows = []
    for parameter in PARAMETERS:
        chosen = regressions[regressions["parameter"] == parameter]
        # No residual degree of freedom: no test, which is no verdict on the coefficient.
        tested = chosen[(chosen["residual_degrees"] > 0) & chosen["own_peak"]]
        row: dict[str, object] = {"parameter": NAMES[parameter], "of": len(tested)}
        published = dict(zip(TERMS, PUBLISHED_SUPPORT[parameter], strict=True))
        for term in TERMS:
            share = (tested[f"p_{term}"] < ALPHA).mean() if len(tested) else np.nan
            row[f"support_{term}"] = 100 * share
        row |= {f"published_support_{term}": published[term] for term in TERMS}
        row["adjusted_r_squared"] = tested["adjusted_r_squared"].mean()
        row["published_adjusted_r_squared"] = PUBLISHED_ADJUSTED_R_SQUARED[parameter]
        rows.append(row)
    return pd.DataFrame(rows)


COEFFICIENT_COLUMNS = (
    PARAMETER,
    Column("coefficient", is_name=True),
    UNIT,
    Column("mean"),
    Column("mean_significant", "mean of significant ones"),
    Column("published"),
    Column("published_for_n", "published, taken as per N"),
)


def coefficient_table(regressions: pd.DataFrame) -> pd.DataFrame:
    """Mean coefficients with the published ones (PAPER table 2, right half).

    Parameters
    ----------
    regressions : DataFrame
        From `regression_table`.

    Returns
    -------
    DataFrame
        Three rows per parameter: parameter, coefficient (α1, α2, α3), unit, mean (over all layers,
        or textures for the noise gain), mean_significant (over those with p < .05; NaN where there
        are none), published (as printed) and published_for_n (its forces taken as mN and converted
        to N). Means over textures of different units are NaN.
    """
    rows = []
    for parameter in PARAMETERS:
        chosen = regressions[regressions["parameter"] == parameter]
        units = sorted(set(chosen["unit"]))
        for number, term in enumerate(TERMS):
            values = chosen[f"{term}_coefficient"]
            significant = values[chosen[f"p_{term}"] < ALPHA]
            published = PUBLISHED_COEFFICIENTS[parameter][number]
            rows.append(
                {
                    "parameter": NAMES[parameter].removesuffix(" (Hz)"),
                    "coefficient": f"{ALPHAS[term]} ({SYMBOLS[term]})",
                    "unit": f"{' or '.join(units)} per {PER[term]}",
                    "mean": values.mean() if len(units) == 1 else np.nan,
                    "mean_significant": significant.mean() if len(units) == 1 else np.nan,
                    "published": published,
                    "published_for_n": published * (1.0 if term == SPEED else MN_PER_N),
                }
            )
    return pd.DataFrame(rows)


AMPLITUDE_R = Column("amplitude_r", "r with amplitude")
P_AMPLITUDE = Column("p_amplitude", "p", is_p_value=True)
CENTROID_COLUMNS = (
    TEXTURE,
    Column("mean_centroid_hz", "mean", "Hz"),
    CONDITIONS,
    *FIT_COLUMNS,
    Column("slope_speed_alone", "slope on speed alone", "Hz per mm/s"),
    Column("p_speed_alone", "p", is_p_value=True),
    Column("mark_speed_alone", "mark"),
    AMPLITUDE_R,
    P_AMPLITUDE,
    Column("mark_amplitude", "mark"),
    SIMULATED_COLUMN,
)


def centroid_table(models: Sequence[TextureModel]) -> pd.DataFrame:
    """The spectral centroid's regressions and its correlation with amplitude (eq. 4, PAPER IV-C).

    Returns
    -------
    DataFrame
        One row per texture with a layer: texture, mean_centroid_hz, conditions, the regression on
        speed, force and their product as in `regression_table`, slope_speed_alone (Hz per mm/s) and
        p_speed_alone with mark_speed_alone, amplitude_r (Pearson, with √ΣG²), p_amplitude,
        mark_amplitude, simulated.
    """
    rows = []
    for model in models:
        if not with_centroid(model).any():
            continue
        found = centroid_regression(model)
        alone = found.speed_only
        total = centroid_correlations(model)[0]
        rows.append(
            {
                "texture": model.texture,
                "mean_centroid_hz": spectral_centroid_hz(model)[with_centroid(model)].mean(),
                "conditions": found.full.n_conditions,
                **_fit(found.full),
                "slope_speed_alone": alone.coefficient(SPEED),
                "p_speed_alone": alone.p_value(SPEED),
                "mark_speed_alone": significance_mark(alone.p_value(SPEED)),
                "amplitude_r": total.r,
                "p_amplitude": total.p,
                "mark_amplitude": significance_mark(total.p),
                "simulated": model.simulated,
            }
        )
    return pd.DataFrame(rows)


CENTROID_AMPLITUDE_COLUMNS = (
    TEXTURE,
    PEAK,
    AMPLITUDE_R,
    P_AMPLITUDE,
    MARK,
    CONDITIONS,
    SIMULATED_COLUMN,
)


def centroid_amplitude_table(models: Sequence[TextureModel]) -> pd.DataFrame:
    """Pearson's correlation of the centroid with the amplitude of each peak and with √ΣG².

    Returns
    -------
    DataFrame
        texture, peak (1-based, or all peaks), amplitude_r, p_amplitude, mark, conditions,
        simulated; textures without layers are left out.
    """
    rows = []
    for model in models:
        found = centroid_correlations(model) if with_centroid(model).any() else ()
        for peak, correlation in enumerate(found):
            rows.append(
                {
                    "texture": model.texture,
                    "peak": str(peak) if peak else ALL_PEAKS,
                    "amplitude_r": correlation.r,
                    "p_amplitude": correlation.p,
                    "mark": significance_mark(correlation.p),
                    "conditions": correlation.n_conditions,
                    "simulated": model.simulated,
                }
            )
    return pd.DataFrame(rows)


@dataclass(frozen=True, eq=False)
class CentroidOverSpeed:
    """One texture's spectral centroid over speed (PAPER fig. 5).

    Parameters
    ----------
    speeds_mm_s : (S,) ndarray
    mean_hz, sd_hz : (S,) ndarray
        Over the forces of recorded conditions; NaN where there is none, the SD where fewer than
        two.
    regression_hz : (S,) ndarray
        The regression on speed alone.
    """

    texture: str
    simulated: bool
    speeds_mm_s: Floats
    mean_hz: Floats
    sd_hz: Floats
    regression_hz: Floats


def centroids_over_speed(models: Sequence[TextureModel]) -> tuple[CentroidOverSpeed, ...]:
    """What figure 5 shows: one course per texture with a layer."""
    courses = []
    for model in models:
        chosen = with_centroid(model)
        if not chosen.any():
            continue
        # By speed; pandas' mean and SD leave NaN out and say NaN where nothing is left.
        centroid = pd.DataFrame(np.where(chosen, spectral_centroid_hz(model), np.nan))
        alone = centroid_regression(model).speed_only
        courses.append(
            CentroidOverSpeed(
                texture=model.texture,
                simulated=model.simulated,
                speeds_mm_s=model.speeds_mm_s,
                mean_hz=centroid.mean(axis=1).to_numpy(),
                sd_hz=centroid.std(axis=1, ddof=1).to_numpy(),
                regression_hz=alone.coefficients[0] + alone.coefficient(SPEED) * model.speeds_mm_s,
            )
        )
    return tuple(courses)


DRIVING_COLUMNS = (
    TEXTURE,
    Column("driven_by", is_name=True),
    Column("numbers"),
    CONDITIONS,
    *MEASURE_COLUMNS,
)


def driving_table(driven: Sequence[pd.DataFrame]) -> pd.DataFrame:
    """Grid, regressions and centroid compared with the recordings, with the numbers they need.

    Parameters
    ----------
    driven : sequence of DataFrame
        `driven_table` of each texture.

    Returns
    -------
    DataFrame
        Their rows, then the means over the textures that have all three, in rows of
        `ALL_TEXTURES`.
    """
    table = pd.concat(driven, ignore_index=True)
    complete = table.groupby("texture")["driven_by"].transform("size") == 1 + len(DRIVERS)
    measures = [name for name in table if name not in ("texture", "driven_by")]
    if not complete.any():
        return table
    means = table[complete].groupby("driven_by", sort=False)[measures].mean()
    means = means.round({"numbers": 0, "conditions": 0}).reset_index()
    means = means.astype({"numbers": int, "conditions": int})
    means.insert(0, "texture", ALL_TEXTURES)
    return pd.concat([table, means], ignore_index=True)


def driven_table(full: TextureModel, targets: Sequence[ConditionTarget]) -> pd.DataFrame:
    """One texture's model driven in three ways, against its recordings.

    Parameters
    ----------
    targets : sequence of ConditionTarget
        What all three are compared with.

    Returns
    -------
    DataFrame
        One row each for grid, conditions (reduced regressions on speed, force and their product)
        and, where the model has a layer, centroid: texture, driven_by, numbers (stored in all),
        conditions, and the measures of `tactileq.analysis.textures.likeness.gfc_table`.
    """
    models: dict[str, TextureModel | RegressedModel] = {GRID: full}
    numbers = [full.noise_gains.size * full.n_parameters]
    for by in DRIVERS if with_centroid(full).any() else DRIVERS[:1]:
        driven = regressed(full, by=by)
        models[by] = driven
        numbers.append(driven.n_parameters)
    table = likeness_table(targets, models).rename(columns={"model": "driven_by"})
    table.insert(2, "numbers", numbers)
    return table.drop(columns="layers")
