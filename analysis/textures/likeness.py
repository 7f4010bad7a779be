"""Similarity of models to recordings, by texture."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from tactileq.analysis.columns import CONDITIONS, MODEL, TEXTURE
from tactileq.modeling import InputError, RecordingSet, RegressedModel, TextureModel, similarity
from tactileq.modeling.files.columns import Column
from tactileq.modeling.fitting.conditions import recording_spectra
from tactileq.modeling.models.grid import Condition

MEASURE_COLUMNS = (
    Column("gfc30_mean", "GFC30 mean", format=".4f"),
    Column("gfc30_min", "GFC30 min", format=".4f"),
    Column("gfc30_floor", "GFC30 floor", format=".4f"),
    Column("gfc30_expected", "GFC30 expected", format=".4f"),
    Column("gfc5_mean", "GFC5 mean", format=".4f"),
    Column("gfc5_floor", "GFC5 floor", format=".4f"),
    Column("gfc5_expected", "GFC5 expected", format=".4f"),
    Column("log_spectral_distance_db", "log-spectral distance", "dB"),
    Column("rms_error_db", "RMS error", "dB"),
    Column("band_energy_error_db", "band energy error", "dB"),
    Column("gfc30_deficit", "GFC30 deficit", format=".4f"),
)
GFC_COLUMNS = (
    TEXTURE,
    MODEL,
    Column("layers"),
    Column("parameters"),
    CONDITIONS,
    *MEASURE_COLUMNS,
)


@dataclass(frozen=True, eq=False)
class ConditionTarget:
    """What models of a texture are compared with in one condition, (speed, force)."""

    condition: Condition
    spectrum: similarity.Target


def condition_targets(
    recordings: RecordingSet, *, rate_hz: float, rng: np.random.Generator
) -> list[ConditionTarget]:
    """What models of one texture are compared with, one for each recording above the floor.

    Parameters
    ----------
    recordings : RecordingSet
        Of one texture; those at force 0 are the sensor's floor and are subtracted.
    rate_hz : float
        Of the models.
    rng : Generator
        Draws behind the expected GFC (docs/method/similarity.md#floor-and-expected-gfc), the same
        for all models.

    Raises
    ------
    InputError
        Where no recording is above the floor.
    """
    above_floor = [
        (recording, measured)
        for recording, measured in recording_spectra(recordings, rate_hz=rate_hz)
        if measured.magnitude.any()
    ]
    if not above_floor:
        raise InputError(
            f"{recordings.texture}: expected recordings above the sensor's floor, got none; check "
            "those at force 0."
        )
    seeds = rng.integers(2**63, size=len(above_floor))
    return [
        ConditionTarget(
            recording.condition, similarity.target_of(measured, rng=np.random.default_rng(seed))
        )
        for (recording, measured), seed in zip(above_floor, seeds, strict=True)
    ]


def gfc_table(
    targets: Sequence[ConditionTarget], full: TextureModel, simplified: TextureModel
) -> pd.DataFrame:
    """Simplification rate and quality of one texture (PAPER table 3).

    Parameters
    ----------
    targets : sequence of ConditionTarget
        What both models are compared with, condition by condition.
    full, simplified : TextureModel
        Before and after simplification.

    Returns
    -------
    DataFrame
        Two rows (model = full, simplified): texture, layers, parameters, conditions (recordings
        above the sensor's floor), then means over them: gfc30_mean (and gfc30_min), gfc30_floor
        (white noise of equal RMS), gfc30_expected (of the true spectrum),
        gfc5_mean, gfc5_floor, gfc5_expected, log_spectral_distance_db, rms_error_db (mean of
        |error|), band_energy_error_db (RMS over bands) and gfc30_deficit (1 − GFC30/expected).
    """
    models = {"full": full, "simplified": simplified}
    table = likeness_table(targets, models)
    table.insert(3, "parameters", [model.n_parameters for model in models.values()])
    return table


def likeness_table(
    targets: Sequence[ConditionTarget], models: Mapping[str, TextureModel | RegressedModel]
) -> pd.DataFrame:
    """Similarity of the recordings and each of these models of one texture, one row per model.

    Parameters and columns as in `gfc_table`, but for `parameters`.
    """
    rows = []
    for name, model in models.items():
        reports = [target.spectrum.report(model.peq(*target.condition)) for target in targets]
        labels = {
            "texture": model.texture,
            "model": name,
            "layers": model.n_layers,
            "conditions": len(reports),
        }
        rows.append(labels | _means(reports))
    return pd.DataFrame(rows)


def _means(reports: Sequence[similarity.SimilarityReport]) -> dict[str, float]:
    """Means over the conditions, and the lowest GFC30."""

    def mean_of(field: str) -> float:
        return float(np.mean([getattr(report, field) for report in reports]))

    return {
        "gfc30_mean": mean_of("gfc30"),
        "gfc30_min": min(report.gfc30 for report in reports),
        "gfc30_floor": mean_of("floor_gfc30"),
        "gfc30_expected": mean_of("expected_gfc30"),
        "gfc5_mean": mean_of("gfc5"),
        "gfc5_floor": mean_of("floor_gfc5"),
        "gfc5_expected": mean_of("expected_gfc5"),
        "log_spectral_distance_db": mean_of("log_spectral_distance_db"),
        "rms_error_db": float(np.mean([abs(report.rms_error_db) for report in reports])),
        "band_energy_error_db": float(np.mean([_band_error_db(report) for report in reports])),
        "gfc30_deficit": mean_of("gfc30_deficit"),
    }


def _band_error_db(report: similarity.SimilarityReport) -> float:
    """RMS over the bands that hold energy; a short record leaves narrow bands empty."""
    errors = report.band_energy_error_db[np.isfinite(report.band_energy_error_db)]
    return float(np.sqrt(np.mean(errors**2))) if errors.size else float("nan")
