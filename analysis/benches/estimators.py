"""A bench: estimators and their rival on random spectra whose layers are known.

What estimators do: docs/method/estimation.md.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from time import perf_counter
from typing import Any, TypeVar

import numpy as np
import pandas as pd

from analysis.textures.recovery import match_layers
from modeling import (
    ESTIMATORS,
    PEQ,
    Layers,
    Recording,
    Spectrum,
    find_layers,
    similarity,
    spectrum,
)
from modeling.arrays import Floats, Integers
from modeling.estimation.coherent import climb, limits_of, observe
from modeling.estimation.joint import as_layers
from modeling.estimation.likelihood import centres_and_widths, signal_power
from modeling.fitting.autoregressive import fit_filter
from modeling.seeds import generator
from stimuli.planted.spectra import KINDS, RATE_HZ, RandomTruth, TruthKind, random_truth

STEP_HZ = 0.5
ALL_KINDS = "all"
ORDERS = (6, 20)
FROM_THE_TRUTH = "likelihood from the truth"
ROUNDS = 4
Scores = dict[str, list[dict[str, Any]]]
Result = TypeVar("Result")


def estimators_table(*, textures: int, seed: int) -> pd.DataFrame:
    """Every estimator, and autoregressive filters, on the same random records of 1 s.

    Parameters
    ----------
    textures : int
        Of each kind of truth.
    seed : int

    Returns
    -------
    DataFrame
        One row per kind (and for all together) and estimator: kind, estimator, textures; gfc30,
        expected_gfc30, gfc30_deficit and log_spectral_distance_db (means;
        docs/method/similarity.md); rms_error_db (mean) and median_absolute_rms_error_db, both of
        the record; precision and recall (of all layers, matched one to one within max(B/2, 10 Hz))
        and layers_per_true_layer; level_error_db and median_absolute_level_error_db (medians over
        matched layers: of the gain for coherent truth, else of the energy within ±B/2);
        milliseconds (median for one spectrum); simulated (always true). NaN where there are no
        layers to match. For coherent truth there is also what no estimator can have: the
        likelihood's maximum next to the truth, untimed.
    """
    rows = []
    everything: Scores = {}
    for kind in KINDS:
        scores = _scores(kind, textures=textures, seed=seed)
        rows += [{"kind": kind, "estimator": e, **_summary(s)} for e, s in scores.items()]
        for name, found in scores.items():
            if name == FROM_THE_TRUTH:
                continue
            everything.setdefault(name, []).extend(found)
    rows += [{"kind": ALL_KINDS, "estimator": e, **_summary(s)} for e, s in everything.items()]
    return pd.DataFrame(rows).assign(simulated=True)


def _scores(kind: TruthKind, *, textures: int, seed: int) -> Scores:
    rng = generator([seed, KINDS.index(kind)])
    scores: Scores = {}
    for _ in range(textures):
        truth = random_truth(kind, rng=rng)
        record = Recording(truth.record(rng=rng), RATE_HZ, 100.0, 1.0, "random", simulated=True)
        measured = spectrum(record)
        for name, score in _scores_of_one(measured, truth).items():
            scores.setdefault(name, []).append(score)
    return scores


def _scores_of_one(measured: Spectrum, truth: RandomTruth) -> dict[str, dict[str, Any]]:
    """Every estimator and filter on one spectrum, compared with the same draws."""
    layers: dict[str, tuple[Layers, float]] = {
        name: _timed(partial(find_layers, measured, estimator=name)) for name in ESTIMATORS
    }
    if truth.kind == "coherent":
        layers[FROM_THE_TRUTH] = _from_the_truth(measured, truth.layers), np.nan
    filters = {
        f"AR({order})": _timed(partial(fit_filter, [measured], order=order)) for order in ORDERS
    }
    models: dict[str, similarity.SpectralFilter] = {
        name: found.peq(rate_hz=RATE_HZ) for name, (found, _) in layers.items()
    }
    models |= {name: found for name, (found, _) in filters.items()}
    seconds = {name: taken for name, (_, taken) in (layers | filters).items()}
    scores = {
        name: {**_likeness(report), "seconds": seconds[name]}
        for name, report in zip(models, similarity.reports(measured, models.values()), strict=True)
    }
    for name, (found, _) in layers.items():
        scores[name] |= _recovery(truth, found)
    return scores


def _from_the_truth(measured: Spectrum, planted: PEQ) -> Layers:
    """The likelihood's maximum next to the truth itself: what a record can tell at best."""
    power, m = signal_power(measured), planted.gains.size
    assert power is not None, "a record with layers has power"
    places = (planted.frequencies_hz, planted.bandwidths_hz)
    gains = np.hstack((planted.noise_gain, planted.gains)) / power.scale
    theta = np.log(np.hstack((gains[0], *places, gains[1:])))[None]
    signs, limits = (
        np.ones((1, m)),
        limits_of(m, rate_hz=power.rate_hz, step_hz=power.step_hz),
    )
    for _ in range(ROUNDS):  # bins are narrowest near the layers, so they are drawn anew
        observed = observe([power], *centres_and_widths(theta, m), scale=power.scale)
        fitted = climb(theta, signs, observed, limits=limits, steps=10, enough=1e-3)
        theta = fitted.theta
    return as_layers(fitted.row(0), power, observed)


def _timed(work: Callable[[], Result]) -> tuple[Result, float]:
    start = perf_counter()
    result = work()
    return result, perf_counter() - start


def _likeness(report: similarity.SimilarityReport) -> dict[str, Any]:
    names = ("gfc30", "expected_gfc30", "gfc30_deficit", "log_spectral_distance_db", "rms_error_db")
    return {name: getattr(report, name) for name in names}


def _recovery(truth: RandomTruth, found: Layers) -> dict[str, Any]:
    planted = truth.layers
    partner = match_layers(
        planted.frequencies_hz,
        planted.bandwidths_hz,
        estimated_frequency_hz=found.frequencies_hz,
    )
    return {
        "matched": int((partner >= 0).sum()),
        "found": found.gains.size,
        "true": planted.gains.size,
        "level_errors_db": _level_errors_db(truth, found.peq(rate_hz=RATE_HZ), partner),
    }


def _level_errors_db(truth: RandomTruth, found: PEQ, partner: Integers) -> Floats:
    """Errors of the matched layers' levels, in dB."""
    planted, mine = truth.layers, np.flatnonzero(partner >= 0)
    if truth.kind == "coherent":
        ratios = np.abs(found.gains[partner[mine]]) / planted.gains[mine]
        return np.asarray(20 * np.log10(ratios), dtype=np.float64)
    frequency = np.arange(STEP_HZ, RATE_HZ / 2, STEP_HZ)
    expected, got = truth.expected_power(frequency), found.response(frequency) ** 2
    within = [
        np.abs(frequency - planted.frequencies_hz[i]) <= planted.bandwidths_hz[i] / 2 for i in mine
    ]
    return np.array([10 * np.log10(got[w].sum() / expected[w].sum()) for w in within])


def _summary(scores: Sequence[dict[str, Any]]) -> dict[str, Any]:
    table = pd.DataFrame(scores)
    means = ("gfc30", "expected_gfc30", "gfc30_deficit", "log_spectral_distance_db", "rms_error_db")
    summary = {
        "textures": len(table),
        **{name: float(table[name].mean()) for name in means},
        "median_absolute_rms_error_db": float(table["rms_error_db"].abs().median()),
        "milliseconds": 1e3 * float(table["seconds"].median()),
    }
    if "matched" in table:
        levels = np.concatenate(list(table["level_errors_db"]))
        summary |= {
            "precision": table["matched"].sum() / max(1, table["found"].sum()),
            "recall": table["matched"].sum() / table["true"].sum(),
            "layers_per_true_layer": table["found"].sum() / table["true"].sum(),
            "level_error_db": float(np.median(levels)),
            "median_absolute_level_error_db": float(np.median(np.abs(levels))),
        }
    return summary
