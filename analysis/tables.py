"""Tables of the modeling half: simplification rate and quality (PAPER table 3, METHOD 7, 8)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields

import numpy as np
import pandas as pd

from modeling import (
    InputError,
    LayerVerdict,
    RecordingSet,
    RegressedModel,
    Simplification,
    Spectrum,
    TextureModel,
    similarity,
)
from modeling.fitting import recording_spectra


@dataclass(frozen=True, eq=False)
class TextureResult:
    """What the modeling half says about one texture.

    Parameters
    ----------
    recordings : RecordingSet
        Of this texture.
    model : TextureModel
        The full model, fitted to the recordings.
    simplification : Simplification
        Its simplified model and the verdict on every layer.
    truth : TextureModel, optional
        What was planted, where the recordings are simulated from a known model.
    other_estimates : tuple of TextureModel
        Models of other estimators, to be held against the truth beside `model`.
    left_out : mapping of str to DataFrame
        By model (joint, AR(20)): conditions foretold by one that was fitted without them
        (`analysis.between.left_out_table`); empty where that was not tried.
    """

    recordings: RecordingSet
    model: TextureModel
    simplification: Simplification
    truth: TextureModel | None = None
    other_estimates: tuple[TextureModel, ...] = ()
    left_out: Mapping[str, pd.DataFrame] = field(default_factory=dict)

    @property
    def texture(self) -> str:
        """Name of the surface."""
        return self.model.texture

    @property
    def simulated(self) -> bool:
        """True where no real surface was touched."""
        return self.model.simulated or any(r.simulated for r in self.recordings.recordings)

    def spectrum_at(self, speed_mm_s: float, force_n: float) -> Spectrum:
        """The first recording of a condition at the model's rate, sensor's floor subtracted.

        Raises
        ------
        InputError
            Where there is none.
        """
        condition = (speed_mm_s, force_n)
        here = [r for r in self.recordings if r.condition == condition]
        if not here:
            raise InputError(
                f"expected a recording of {self.texture!r} at {speed_mm_s:g} mm/s and "
                f"{force_n:g} N, got none; choose a recorded condition."
            )
        floor = [r for r in self.recordings if r.force_n == 0]
        spectra = recording_spectra(RecordingSet([here[0], *floor]), rate_hz=self.model.rate_hz)
        return spectra[0][1]


def gfc_table(
    recordings: RecordingSet,
    full: TextureModel,
    simplified: TextureModel,
    *,
    rng: np.random.Generator,
) -> pd.DataFrame:
    """Simplification rate and quality of one texture (PAPER table 3).

    Parameters
    ----------
    recordings : RecordingSet
        What both models are held against, condition by condition; those at force 0 are the
        sensor's floor and are subtracted.
    full, simplified : TextureModel
        Before and after simplification.
    rng : Generator
        Draws behind the ceiling (METHOD 8), the same for both models.

    Returns
    -------
    DataFrame
        Two rows (model = full, simplified): texture, layers, parameters, conditions (recordings
        above the sensor's floor), then means over them: gfc30_mean (and gfc30_min), gfc30_floor
        (white noise of equal RMS), gfc30_ceiling (draws of the recording's own spectrum),
        gfc5_mean, gfc5_floor, gfc5_ceiling, log_spectral_distance_db, rms_error_db (mean of
        |error|), band_energy_error_db (RMS over bands) and oracle_gap (1 − GFC30/ceiling).
    """
    models = {"full": full, "simplified": simplified}
    table = likeness_table(recordings, models, rng=rng)
    table.insert(3, "parameters", [model.n_parameters for model in models.values()])
    return table


def likeness_table(
    recordings: RecordingSet,
    models: Mapping[str, TextureModel | RegressedModel],
    *,
    rng: np.random.Generator,
) -> pd.DataFrame:
    """How alike recordings and each of these models of one texture are, one row per model.

    Parameters, errors and columns as in `gfc_table`, but for `parameters`.
    """
    first = next(iter(models.values()))
    above_floor = [
        (recording, measured)
        for recording, measured in recording_spectra(recordings, rate_hz=first.rate_hz)
        if measured.magnitude.any()
    ]
    if not above_floor:
        raise InputError(
            f"{first.texture}: expected recordings above the sensor's floor, got none; check those "
            "at force 0."
        )
    seeds = rng.integers(2**63, size=len(above_floor))
    by_condition = [
        similarity.reports(
            measured,
            [model.peq(*recording.condition) for model in models.values()],
            rng=np.random.default_rng(seed),
        )
        for (recording, measured), seed in zip(above_floor, seeds, strict=True)
    ]
    rows = []
    for (name, model), reports in zip(models.items(), zip(*by_condition, strict=True), strict=True):
        labels = {
            "texture": first.texture,
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
        "gfc30_ceiling": mean_of("ceiling_gfc30"),
        "gfc5_mean": mean_of("gfc5"),
        "gfc5_floor": mean_of("floor_gfc5"),
        "gfc5_ceiling": mean_of("ceiling_gfc5"),
        "log_spectral_distance_db": mean_of("log_spectral_distance_db"),
        "rms_error_db": float(np.mean([abs(report.rms_error_db) for report in reports])),
        "band_energy_error_db": float(np.mean([_band_error_db(report) for report in reports])),
        "oracle_gap": mean_of("oracle_gap"),
    }


def _band_error_db(report: similarity.SimilarityReport) -> float:
    """RMS over the bands that hold energy; a short record leaves narrow bands empty."""
    errors = report.band_energy_error_db[np.isfinite(report.band_energy_error_db)]
    return float(np.sqrt(np.mean(errors**2))) if errors.size else float("nan")


def simplification_table(simplification: Simplification) -> pd.DataFrame:
    """The verdict on every layer and its reason (METHOD 7).

    Returns
    -------
    DataFrame
        texture, layer (1-based), verdict (kept|dropped), reason, worst_speed_mm_s, worst_force_n,
        worst_frequency_hz (the condition where the layer stands highest against the threshold),
        distance_db (to the threshold there, + above), flip_probability (0–1), simulated.
    """
    columns = [each.name for each in fields(LayerVerdict)]
    table = pd.DataFrame([asdict(v) for v in simplification.layers], columns=columns)
    worst = ["worst_speed_mm_s", "worst_force_n", "worst_frequency_hz"]
    # No condition is the worst one where no threshold is known in any.
    table.loc[table["distance_db"].isna(), worst] = np.nan
    table.insert(0, "texture", simplification.model.texture)
    return table.assign(simulated=simplification.model.simulated)
