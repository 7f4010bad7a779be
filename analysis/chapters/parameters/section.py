"""The section on the parameters' dependence on speed and force (PAPER IV, IX-B)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from tactileq.analysis.chapters.chapter import Modelled
from tactileq.analysis.chapters.parameters.figure import figure_centroid
from tactileq.analysis.labels import ALL_TEXTURES
from tactileq.analysis.page.outcomes import described
from tactileq.analysis.page.page import Fold, Item, Picture, Table
from tactileq.analysis.page.sections import Section
from tactileq.analysis.textures.regressions import (
    CENTROID_AMPLITUDE_COLUMNS,
    CENTROID_COLUMNS,
    COEFFICIENT_COLUMNS,
    DRIVING_COLUMNS,
    NAMES,
    REGRESSION_COLUMNS,
    SUPPORT_COLUMNS,
    centroid_amplitude_table,
    centroid_table,
    centroids_over_speed,
    coefficient_table,
    regression_table,
    support_table,
)
from tactileq.analysis.textures.results import TextureResult
from tactileq.modeling import TextureModel
from tactileq.modeling.files.columns import chosen

REGRESSIONS_SHOWN = chosen(
    REGRESSION_COLUMNS,
    *("texture", "parameter", "peak", "conditions", "inherited", "multiple_r"),
    *("adjusted_r_squared", "p", "mark", "reduced"),
)
CENTROID_SHOWN = chosen(
    CENTROID_COLUMNS,
    *("texture", "mean_centroid_hz", "multiple_r", "adjusted_r_squared", "p", "mark"),
    *("speed_coefficient", "p_speed", "force_coefficient", "p_force", "speed_force_coefficient"),
    *("p_speed_force", "slope_speed_alone", "p_speed_alone", "amplitude_r", "p_amplitude"),
)
AMPLITUDES_SHOWN = chosen(
    CENTROID_AMPLITUDE_COLUMNS,
    *("texture", "peak", "conditions", "amplitude_r", "p_amplitude", "mark"),
)
DRIVING_SHOWN = chosen(
    DRIVING_COLUMNS,
    *("texture", "driven_by", "numbers", "gfc30_mean", "gfc30_floor", "gfc30_expected"),
    *("gfc30_deficit", "log_spectral_distance_db", "rms_error_db", "band_energy_error_db"),
)
NO_CORRECTION = "As in the paper, p values are not corrected for multiple testing."


def sections(modelled: Modelled) -> list[Section]:
    """The section on all textures."""
    return [parameter_section(modelled.textures, modelled.driving)]


def parameter_section(textures: Sequence[TextureResult], driving: pd.DataFrame) -> Section:
    """Regressions of the full models' parameters, and the models driven by them.

    docs/method/regression.md

    Parameters
    ----------
    textures : sequence of TextureResult
        At least one.
    driving : DataFrame
        `tactileq.analysis.textures.regressions.driving_table` of all of them.
    """
    models = [result.model for result in textures]
    simulated = any(result.simulated for result in textures)
    found = regression_table(models)
    support = support_table(found)
    return Section(
        "parameters",
        "Dependence of the parameters on speed and force",
        (
            *_parameter_tables(found, support, simulated=simulated),
            *_centroid_items(models, simulated=simulated),
            _driving_table(driving, simulated=simulated),
        ),
        outcomes=tuple(described([*regression_outcomes(support), *driving_outcomes(driving)])),
    )


def _parameter_tables(
    found: pd.DataFrame, support: pd.DataFrame, *, simulated: bool
) -> tuple[Item, ...]:
    validity = Table(
        "regressions",
        "Regressions of each parameter by peak",
        "P = β + α1·v + α2·F + α3·v·F by ordinary least squares over the recorded conditions; a "
        "frequency that a condition inherited is a copy and is left out of the regression of the "
        "frequency. p: F test of the model. * p < .05, ** p < .01, *** p < .001. Reduced: the "
        "terms that remain after backward elimination, which drops the least significant term "
        "until all have p < .05; an interaction may remain without its main effects. n/a: nothing "
        f"varies, or no residual degree of freedom. {NO_CORRECTION} Coefficients are in the file. "
        "Compare table 1 of the paper.",
        found.assign(parameter=found["parameter"].map(NAMES)),
        REGRESSIONS_SHOWN,
        simulated,
    )
    ratings = Table(
        "regression_support",
        "Support ratings compared with the published ones",
        "Share of the layers (for the noise gain: of the textures) whose coefficient has p < .05 "
        "in the full regression, and mean adjusted R². Published: from other surfaces, with the "
        f"paper's own estimator. {NO_CORRECTION} Compare table 2 of the paper.",
        support,
        SUPPORT_COLUMNS,
        simulated,
    )
    coefficients = Table(
        "regression_coefficients",
        "Mean coefficients compared with the published ones",
        "Means over layers (for the noise gain: over textures) of the full regressions. Gains are "
        "per unit noise. The published coefficients are given without units; their magnitudes "
        "suggest forces in mN, so the last column multiplies those of F and v·F by 1000; the unit "
        "of the published amplitudes and noise gains is unknown. Compare table 2 of the paper.",
        coefficient_table(found),
        COEFFICIENT_COLUMNS,
        simulated,
    )
    return ratings, coefficients, Fold("Regressions of each parameter by peak", (validity,))


def _centroid_items(models: Sequence[TextureModel], *, simulated: bool) -> tuple[Item, ...]:
    """Figure 5 and its numbers; nothing where no texture has a layer."""
    courses = centroids_over_speed(models)
    if not courses:
        return ()
    picture = Picture(
        "centroid",
        "Response of the spectral centroid to the probing speed",
        "SC = Σ G²f / Σ G² over the layers; mean ± standard deviation over the forces at each "
        "speed. Dashed: regression on speed alone. Compare figure 5 of the paper.",
        figure_centroid(courses),
        simulated,
    )
    table = Table(
        "centroid",
        "Regressions of the spectral centroid",
        "SC in Hz on speed, force and their product, and on speed alone; Pearson's r of SC with "
        f"the amplitude √ΣG² over the conditions (published: above 0.6). {NO_CORRECTION}",
        centroid_table(models),
        CENTROID_SHOWN,
        simulated,
    )
    by_peak = Table(
        "centroid_amplitude",
        "Correlation of the spectral centroid with the amplitude of each peak",
        f"Pearson's r over the recorded conditions. {NO_CORRECTION}",
        centroid_amplitude_table(models),
        AMPLITUDES_SHOWN,
        simulated,
    )
    return picture, table, Fold("Centroid and amplitude by peak", (by_peak,))


def _driving_table(driving: pd.DataFrame, *, simulated: bool) -> Table:
    return Table(
        "driving",
        "Models driven by the grid, by regressions and by the centroid",
        "Numbers: total stored; for regressions only the coefficients that are not 0. conditions: "
        "reduced regressions on speed, force and their product. centroid: SC is linear in speed "
        "and every parameter is linear in SC (PAPER IX-B); force then has no effect, nor has speed "
        "where SC does not depend significantly on it. All three are compared with the same "
        "recordings that they were fitted to. Measures as in the table of simplification rate and "
        "quality; deficit: 1 − GFC30/expected.",
        driving,
        DRIVING_SHOWN,
        simulated,
    )


def regression_outcomes(support: pd.DataFrame) -> list[str]:
    """How well speed and force explain the parameters, from `regressions.support_table`."""
    explained = "; ".join(
        f"{row['parameter']} {row['adjusted_r_squared']:.2f} "
        f"({row['published_adjusted_r_squared']:.2f})"
        for row in support.to_dict("records")
        if np.isfinite(row["adjusted_r_squared"])
    )
    if not explained:
        return []
    return [
        "Regressions on speed, force and their product: mean adjusted R² (published values in "
        f"brackets) {explained}."
    ]


def driving_outcomes(driving: pd.DataFrame) -> list[str]:
    """Accuracy by way of driving, from `regressions.driving_table`; means over the textures."""
    overall = driving[driving["texture"] == ALL_TEXTURES]
    ways = {"grid": "the grid", "conditions": "regressions", "centroid": "the centroid alone"}
    shown = [
        f"{ways[row['driven_by']]}: {row['numbers']:.0f} numbers, GFC30 {row['gfc30_mean']:.4f}, "
        f"log-spectral distance {row['log_spectral_distance_db']:.2f} dB"
        for row in overall.to_dict("records")
    ]
    return [f"Full models (means over the textures) driven by {'; by '.join(shown)}."] * bool(shown)
