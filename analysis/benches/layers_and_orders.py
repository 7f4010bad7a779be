"""A bench: how well so many layers, or an autoregressive filter of such an order, do."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import pandas as pd

from modeling import Recording, Spectrum, similarity, spectrum
from modeling.estimation.given_count import fit_layer_count
from modeling.fitting.autoregressive import fit_filter
from modeling.similarity import SimilarityReport, SpectralFilter

LAYERS = (1, 2, 3, 4)
ORDERS = (3, 6, 9, 12, 20)
# Of the Nyquist frequency; toolkit models at 1 kHz fall off a cliff above 480 Hz.
TRUTH_SHARE = 0.96
AR, EQUAL, CHOSEN = "AR", "layers, equal signs", "layers, chosen signs"


def layers_and_orders(
    cases: Iterable[tuple[Recording, SpectralFilter]],
    *,
    layers: Sequence[int] = LAYERS,
    orders: Sequence[int] = ORDERS,
) -> pd.DataFrame:
    """Likeness by number of layers and by order, to the record and to the truth behind it.

    Parameters
    ----------
    cases : iterable of (Recording, SpectralFilter)
        Simulated records, each with the filter that made it.
    layers, orders : sequence of int

    Returns
    -------
    DataFrame
        One row per model: model, size (layers or order), numbers (per condition); means of gfc30
        with its floor and expected value, gfc30_deficit and log_spectral_distance_db
        (docs/method/similarity.md, to the record), distance_to_truth_db (of the two responses,
        unsmoothed, 10 Hz to 0.96 of the Nyquist frequency: the measure of
        docs/method/equalizer.md#signs on real textures); lowest_gfc30, level_error_db (root mean
        square); records, simulated.
    """
    scores: dict[tuple[str, int], list[tuple[SimilarityReport, float]]] = {}
    simulated = False
    for recording, truth in cases:
        measured = spectrum(recording)
        for key, model in _fits(recording, layers, orders).items():
            both = similarity.report(measured, model), _distance_db(measured, model, truth)
            scores.setdefault(key, []).append(both)
        simulated |= recording.simulated
    table = pd.DataFrame([_row(*key, found, simulated=simulated) for key, found in scores.items()])
    return table.sort_values(["model", "size"], ignore_index=True)


def _distance_db(measured: Spectrum, model: SpectralFilter, truth: SpectralFilter) -> float:
    """Log-spectral distance of two responses from 10 Hz to 0.96 of the Nyquist frequency."""
    frequency = measured.frequency_hz
    highest = TRUTH_SHARE * measured.rate_hz / 2
    frequency = frequency[(frequency >= similarity.LOWEST_HZ) & (frequency <= highest)]
    return similarity.log_spectral_distance_db(model.response(frequency), truth.response(frequency))


def _fits(
    recording: Recording, layers: Sequence[int], orders: Sequence[int]
) -> dict[tuple[str, int], SpectralFilter]:
    measured = spectrum(recording)
    fits: dict[tuple[str, int], SpectralFilter] = {}
    for count in layers:
        fits[EQUAL, count] = fit_layer_count(measured, count, equal_signs=True)
        fits[CHOSEN, count] = fit_layer_count(measured, count)
    for order in orders:
        fits[AR, order] = fit_filter([measured], order=order)
    return fits


def _row(
    model: str,
    size: int,
    found: Sequence[tuple[SimilarityReport, float]],
    *,
    simulated: bool,
) -> dict[str, Any]:
    reports = pd.DataFrame([vars(report) for report, _ in found])
    means = ("gfc30", "floor_gfc30", "expected_gfc30", "gfc30_deficit", "log_spectral_distance_db")
    return {
        "model": model,
        "size": size,
        "numbers": size + 1 if model == AR else 1 + 3 * size,
        **{name: float(reports[name].mean()) for name in means},
        "distance_to_truth_db": float(np.mean([distance for _, distance in found])),
        "lowest_gfc30": float(reports["gfc30"].min()),
        "level_error_db": float(np.sqrt((reports["rms_error_db"] ** 2).mean())),
        "records": len(found),
        "simulated": simulated,
    }
