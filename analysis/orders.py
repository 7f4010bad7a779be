"""A bench: how well so many layers, or an autoregressive filter of such an order, do."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pandas as pd

from modeling import Recording, similarity, spectrum
from modeling.autoregressive import fit_filter, tapered
from modeling.layer_count import fit_layer_count
from modeling.similarity import SimilarityReport, SpectralFilter

LAYERS = (1, 2, 3, 4)
ORDERS = (3, 6, 9, 12, 20)
AR, EQUAL, CHOSEN = "AR", "layers, equal signs", "layers, chosen signs"


def layers_and_orders(
    pairs: Sequence[tuple[Recording, Recording]],
    *,
    layers: Sequence[int] = LAYERS,
    orders: Sequence[int] = ORDERS,
    progress: Callable[[str], None] = lambda condition: None,
) -> pd.DataFrame:
    """Likeness by number of layers and by order: fitted to one record, judged on another.

    Parameters
    ----------
    pairs : sequence of (Recording, Recording)
        Two records of each condition: the one to fit and the one to judge by, whose length sets
        how close its spectrum is to the truth.
    layers, orders : sequence of int
    progress : callable
        Told of every condition that is done.

    Returns
    -------
    DataFrame
        One row per model: model, size (layers or order), numbers (per condition), gfc30 with its
        floor and ceiling, oracle_gap, log_spectral_distance_db and level_error_db (root mean
        squares), lowest_gfc30, records, simulated.
    """
    scores: dict[tuple[str, int], list[SimilarityReport]] = {}
    for fitted, judged in pairs:
        truth = spectrum(judged, rate_hz=fitted.rate_hz)
        for key, model in _fits(fitted, layers, orders).items():
            scores.setdefault(key, []).append(similarity.report(truth, model))
        progress(fitted.describe())
    simulated = any(record.simulated for pair in pairs for record in pair)
    return pd.DataFrame([_row(*key, found, simulated=simulated) for key, found in scores.items()])


def _fits(
    recording: Recording, layers: Sequence[int], orders: Sequence[int]
) -> dict[tuple[str, int], SpectralFilter]:
    measured, faded = spectrum(recording), spectrum(tapered(recording))
    fits: dict[tuple[str, int], SpectralFilter] = {}
    for count in layers:
        fits[EQUAL, count] = fit_layer_count(measured, count, equal_signs=True)
        fits[CHOSEN, count] = fit_layer_count(measured, count)
    for order in orders:
        fits[AR, order] = fit_filter([faded], order=order)
    return fits


def _row(
    model: str, size: int, found: Sequence[SimilarityReport], *, simulated: bool
) -> dict[str, Any]:
    def mean(name: str) -> float:
        return float(np.mean([getattr(report, name) for report in found]))

    def root_mean_square(name: str) -> float:
        return float(np.sqrt(np.mean([getattr(report, name) ** 2 for report in found])))

    return {
        "model": model,
        "size": size,
        "numbers": size + 1 if model == AR else 1 + 3 * size,
        "gfc30": mean("gfc30"),
        "floor_gfc30": mean("floor_gfc30"),
        "ceiling_gfc30": mean("ceiling_gfc30"),
        "oracle_gap": mean("oracle_gap"),
        "lowest_gfc30": min(report.gfc30 for report in found),
        "log_spectral_distance_db": root_mean_square("log_spectral_distance_db"),
        "level_error_db": root_mean_square("rms_error_db"),
        "records": len(found),
        "simulated": simulated,
    }
