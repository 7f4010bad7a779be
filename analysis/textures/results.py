"""Everything about one texture: recordings, models and verdicts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields

import numpy as np
import pandas as pd

from tactileq.analysis.columns import LAYER, SIMULATED_COLUMN, TEXTURE
from tactileq.modeling import (
    InputError,
    LayerVerdict,
    RecordingSet,
    Simplification,
    Spectrum,
    TextureModel,
)
from tactileq.modeling.errors import shown
from tactileq.modeling.files.columns import Column
from tactileq.modeling.fitting.conditions import recording_spectra
from tactileq.modeling.reprs import one_line


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
        What was planted, where the recordings are simulated from a known model, at their rate.
    other_estimates : tuple of TextureModel
        Models of other estimators, to be compared with the truth beside `model`.
    left_out : mapping of str to DataFrame
        By model (joint, AR(20), a field of spectra): conditions predicted by one that was fitted
        without them (`tactileq.analysis.textures.between.left_out_table`); empty where that was not
        tried.
    """

    recordings: RecordingSet
    model: TextureModel
    simplification: Simplification
    truth: TextureModel | None = None
    other_estimates: tuple[TextureModel, ...] = ()
    left_out: Mapping[str, pd.DataFrame] = field(default_factory=dict)

    __repr__ = one_line

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
                f"expected a recording of {shown(self.texture)} at {speed_mm_s:g} mm/s and "
                f"{force_n:g} N, got none; choose a recorded condition."
            )
        floor = [r for r in self.recordings if r.force_n == 0]
        spectra = recording_spectra(RecordingSet([here[0], *floor]), rate_hz=self.model.rate_hz)
        return spectra[0][1]


LAYER_VERDICT_COLUMNS = (
    TEXTURE,
    LAYER,
    Column("verdict", is_name=True),
    Column("reason"),
    Column("worst_speed_mm_s", "worst speed", "mm/s", format="g"),
    Column("worst_force_n", "worst force", "N", format="g"),
    Column("worst_frequency_hz", "worst frequency", "Hz"),
    Column("distance_db", "distance", "dB"),
    Column("flip_probability", is_p_value=True),
    Column("assumed"),
    Column("fills"),
    SIMULATED_COLUMN,
    Column("full_sha256", "SHA-256 of the full model"),
    Column("threshold_sha256", "SHA-256 of the threshold"),
)


def simplification_table(simplification: Simplification) -> pd.DataFrame:
    """The verdict on every layer and its reason (docs/method/perception.md#simplification).

    Returns
    -------
    DataFrame
        texture, layer (1-based), verdict (kept|dropped), reason, worst_speed_mm_s, worst_force_n,
        worst_frequency_hz (the condition where what decides is highest against the threshold),
        distance_db (to the threshold there, + above), flip_probability (0–1), assumed and fills
        (as in `tactileq.LayerVerdict`), simulated, full_sha256 and threshold_sha256.
    """
    columns = [each.name for each in fields(LayerVerdict)]
    table = pd.DataFrame([asdict(v) for v in simplification.layers], columns=columns)
    worst = ["worst_speed_mm_s", "worst_force_n", "worst_frequency_hz"]
    # No condition is the worst one where no threshold is known in any.
    table.loc[table["distance_db"].isna(), worst] = np.nan
    table.insert(0, "texture", simplification.model.texture)
    return table.assign(
        simulated=simplification.model.simulated,
        full_sha256=simplification.full_sha256,
        threshold_sha256=simplification.threshold.sha256,
    )


MODEL_FIT_COLUMNS = (
    TEXTURE,
    Column("layers"),
    Column("distance_db", "expected distance at conditions", "dB"),
    Column("with_blends_db", "and between", "dB"),
    Column("blend_defect_db", "largest blend defect", "dB"),
    Column("by_layers", "with other numbers of layers"),
    Column("warnings"),
    SIMULATED_COLUMN,
)


def fit_table(results: Sequence[TextureResult]) -> pd.DataFrame:
    """What the estimator `joint` says of its own fits; textures of other estimators have no row.

    Returns
    -------
    DataFrame
        texture, layers, distance_db, with_blends_db, blend_defect_db (as in
        `tactileq.modeling.models.fit_summary.FitSummary`), by_layers and warnings (text),
        simulated.
    """
    rows = [
        {
            "texture": result.texture,
            "layers": result.model.n_layers,
            "distance_db": fit.distance_db,
            "with_blends_db": fit.with_blends_db,
            "blend_defect_db": fit.blend_defect_db,
            "by_layers": ", ".join(f"{m}: {d:.2f} dB" for m, d in fit.by_layers_db.items()),
            "warnings": "; ".join(fit.warnings),
            "simulated": result.simulated,
        }
        for result in results
        if (fit := result.model.fit) is not None
    ]
    return pd.DataFrame(rows, columns=[column.name for column in MODEL_FIT_COLUMNS])


def reference_condition(result: TextureResult) -> tuple[float, float]:
    """(speed, force): the strongest force and the highest speed recorded at it."""
    conditions = [recording.condition for recording in result.recordings.recordings]
    return max(conditions, key=lambda condition: (condition[1], condition[0]))
