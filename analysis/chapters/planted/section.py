"""The section on planted textures: which of the planted layers were found."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from tactileq.analysis.chapters.chapter import Modelled
from tactileq.analysis.labels import ALL_LAYERS, signed
from tactileq.analysis.page.outcomes import described
from tactileq.analysis.page.page import Fold, Item, Picture, Table
from tactileq.analysis.page.sections import Section
from tactileq.analysis.spectra.figures.layers_over_speed import figure_layers_over_speed
from tactileq.analysis.spectra.layers_over_grid import layers_over_speed
from tactileq.analysis.textures.between import PLANTED_BETWEEN_COLUMNS, planted_between_table
from tactileq.analysis.textures.recovery import (
    PLANTED_LAYER_COLUMNS,
    PLANTED_TRUTH_COLUMNS,
    planted_layers_table,
    planted_truth_table,
)
from tactileq.analysis.textures.results import TextureResult, reference_condition
from tactileq.modeling.errors import counted
from tactileq.modeling.files.columns import without
from tactileq.stimuli.planted.textures import TEXTURES


def sections(modelled: Modelled) -> list[Section]:
    """The section on the textures whose truth is known, where there are some."""
    known = [result for result in modelled.textures if result.truth is not None]
    return [planted_section(known)] if known else []


def planted_section(textures: Sequence[TextureResult]) -> Section:
    """How well the estimators find what was planted; every texture has a truth."""
    scores, layers = [], []
    for result in textures:
        assert result.truth is not None
        estimates = (result.model, *result.other_estimates)
        scores.append(planted_truth_table(result.truth, estimates))
        speed_mm_s, force_n = reference_condition(result)
        layers += [
            planted_layers_table(result.truth, model, speed_mm_s=speed_mm_s, force_n=force_n)
            for model in estimates
        ]
    score = pd.concat(scores, ignore_index=True)
    tables = _planted_tables(score, pd.concat(layers, ignore_index=True))
    between = _planted_between(textures)
    return Section(
        "planted",
        "Planted truth",
        (_course(textures), tables[0], *between, *tables[1:]),
        outcomes=tuple(described(planted_outcomes(score))),
    )


def _course(textures: Sequence[TextureResult]) -> Picture:
    """The estimated and the planted layers of the texture that has most of them."""
    result = max(textures, key=lambda each: each.truth.n_layers if each.truth else 0)
    assert result.truth is not None
    force_n = reference_condition(result)[1]
    truth = result.truth.at_rate(result.model.rate_hz)
    models = [result.model] + [truth] * (force_n in result.truth.forces_n)
    return Picture(
        "planted_course",
        f"{result.texture}: estimated layers over speed at {force_n:g} N, and the planted ones",
        "Frequency and amplitude of each layer. Dashed: the planted layers.",
        figure_layers_over_speed([layers_over_speed(each, force_n=force_n) for each in models]),
        simulated=True,
    )


def _planted_between(textures: Sequence[TextureResult]) -> tuple[Item, ...]:
    known = [result for result in textures if result.texture in TEXTURES]
    if not known:
        return ()
    table = Table(
        "planted_between",
        "Distance to the planted spectrum at the conditions and between them",
        "RMS of the log ratio of the two responses over all conditions (15 Hz to 0.96 of the "
        "Nyquist frequency, unsmoothed), at the recorded conditions and half-way between them, "
        "where the truth is known in closed form; level errors are those half-way between.",
        planted_between_table(known),
        PLANTED_BETWEEN_COLUMNS,
        simulated=True,
    )
    return (table,)


def _planted_tables(score: pd.DataFrame, layers: pd.DataFrame) -> tuple[Item, ...]:
    found = Table(
        "planted_truth",
        "Planted layers found",
        "Planted and estimated layers are matched one to one within max(B/2, 10 Hz) in every "
        "condition. Precision: share of the estimated layers closest to this planted layer that "
        "have a match; recall: share of the conditions in which it was found. Errors: medians over "
        "the matched pairs and, beside each, the worst pair with its sign and place. Bandwidth "
        "ratio: estimated over planted. Frequency errors are estimated − planted; their median is "
        "of absolute values. Levels compare |G| at the same rate. The truth is planted at the "
        "recorder's rate, where skirts are wider than at the model's; noise gains are compared "
        "with the one that brings the planted layers, at the model's rate, closest to that truth.",
        score,
        PLANTED_TRUTH_COLUMNS,
        simulated=True,
    )
    overall = Table(
        "planted_overall",
        "Planted layers found, by texture",
        "The rows for all layers of the table below; its caption explains the columns.",
        score[score["layer"] == ALL_LAYERS].drop(columns="layer"),
        without(PLANTED_TRUTH_COLUMNS, "layer", "median_absolute_level_error_db"),
        simulated=True,
    )
    detail = Table(
        "planted_layers",
        "Planted and estimated parameters, layer by layer",
        "At the strongest force and highest speed of each texture; gains are |G| at the estimated "
        "model's rate; surplus: estimated where nothing was planted.",
        layers,
        PLANTED_LAYER_COLUMNS,
        simulated=True,
    )
    return (
        overall,
        Fold("Layer by layer", (detail,), opened=True),
        Fold("Scores by estimator and layer", (found,)),
    )


def planted_outcomes(planted: pd.DataFrame) -> list[str]:
    """One sentence per estimator, from rows of `recovery.planted_truth_table`: means."""
    overall = planted[planted["layer"] == ALL_LAYERS]
    return [
        _planted_outcome(str(estimator), rows)
        for estimator, rows in overall.groupby("estimator", sort=False)
    ]


def _planted_outcome(estimator: str, rows: pd.DataFrame) -> str:
    if not rows["recall"].any():
        return f"The estimator {estimator} found 0% of the planted layers."
    return (
        f"The estimator {estimator} found {rows['recall'].mean():.0%} of the planted layers, and "
        f"{rows['precision'].mean():.0%} of the layers it reports were planted; median errors: "
        f"{rows['median_frequency_error_hz'].mean():.1f} Hz in frequency, a factor of "
        f"{rows['median_bandwidth_ratio'].mean():.2f} in bandwidth, "
        f"{signed(rows['median_level_error_db'].mean(), 1)} dB in level, "
        f"{signed(rows['median_noise_gain_error_db'].mean(), 1)} dB in noise gain (medians over "
        f"the conditions, averaged over {counted(len(rows), 'texture')}); at worst "
        f"{_worst_of(rows, 'frequency_error', digits=1, unit='_hz')}, a factor of "
        f"{_worst_of(rows, 'bandwidth_ratio', digits=2)} and "
        f"{_worst_of(rows, 'level_error', digits=1, unit='_db')}."
    )


def _worst_of(rows: pd.DataFrame, name: str, *, digits: int, unit: str = "") -> str:
    """The worst of all textures, with its place."""
    values = rows[f"worst_{name}{unit}"]
    far = values.abs() if unit else np.log(values).abs()
    worst = rows.iloc[int(far.fillna(0.0).to_numpy().argmax())]
    value = float(worst[f"worst_{name}{unit}"])
    units = {"_hz": " Hz", "_db": " dB", "": ""}
    shown = signed(value, digits) if unit else f"{value:.{digits}f}"
    return f"{shown}{units[unit]} ({worst['texture']}, {worst[f'worst_{name}_at']})"
