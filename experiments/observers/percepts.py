"""What surfaces feel like to simulated participants: levels above threshold, and distances.

The one substantial property of this stipulation: vibration below threshold changes no percept
(docs/method/protocols.md#simulated-participants).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from experiments.study.models import ModelSets
from experiments.study.study import Study
from modeling import InputError, Threshold
from modeling.arrays import Floats
from modeling.errors import shown
from modeling.models.ar_model import ARModel
from modeling.models.loading import AnyModel

BAND_EDGES_HZ = (10.0, 20.0, 35.0, 60.0, 90.0, 130.0, 180.0, 250.0, 350.0, 480.0)
STROKES = ((100.0, 1.0), (200.0, 1.5), (300.0, 2.5))  # (mm/s, N)
STEP_HZ = 1.0
NOTHING_DB = -300.0  # stands for the level of silence


def sensation_levels(
    model: AnyModel,
    threshold: Threshold,
    *,
    strokes: tuple[tuple[float, float], ...] = STROKES,
) -> Floats:
    """How far above threshold a surface is felt, by stroke and frequency band.

    The power in a band, ∫ response² · 2/rate df, is that of a sinusoid of peak amplitude √2·RMS
    (criterion `energy`, docs/method/perception.md#criteria); each frequency counts relative to its
    own threshold. Frequencies without a known threshold, and those beyond the model's Nyquist
    frequency, contribute nothing.

    Parameters
    ----------
    model : TextureModel, RegressedModel or ARModel
        In g.
    threshold : Threshold
    strokes : tuple of (speed in mm/s, force in N)

    Returns
    -------
    (strokes, 9) ndarray
        dB above threshold in the bands of `BAND_EDGES_HZ`; 0 where nothing is felt.

    Raises
    ------
    InputError
        If the model's unit is arbitrary: nothing can be compared with a threshold then.
    """
    return np.maximum(_levels(model, threshold, strokes=strokes), 0.0)


def _levels(
    model: AnyModel, threshold: Threshold, *, strokes: tuple[tuple[float, float], ...] = STROKES
) -> Floats:
    """As `sensation_levels`, but negative below threshold; `NOTHING_DB` of silence."""
    if model.unit != "g":
        raise InputError(
            f"expected a model in g for a simulated participant, got one of {model.texture} in "
            f"unit {shown(model.unit)}; record it with a calibrated sensor."
        )
    edges = np.array(BAND_EDGES_HZ)
    frequency_hz = np.arange(edges[0], edges[-1], STEP_HZ) + STEP_HZ / 2
    limit_g = threshold.at(frequency_hz)
    known = np.isfinite(limit_g) & (frequency_hz < model.rate_hz / 2)
    frequency_hz, limit_g = frequency_hz[known], limit_g[known]
    band = np.searchsorted(edges, frequency_hz, side="right") - 1
    levels = np.zeros((len(strokes), edges.size - 1))
    for row, (speed_mm_s, force_n) in enumerate(strokes):
        made = model.filter if isinstance(model, ARModel) else model.peq
        response = made(speed_mm_s, force_n).response(frequency_hz)
        power = 2 * response**2 * (2 / model.rate_hz) * STEP_HZ / limit_g**2
        total = np.bincount(band, weights=power, minlength=edges.size - 1)
        levels[row] = 10 * np.log10(np.maximum(total, 10 ** (NOTHING_DB / 10)))
    return levels


@dataclass(frozen=True)
class Distance:
    """How differently two surfaces feel, in dB: in overall level, and in shape over frequency."""

    magnitude_db: float
    frequency_db: float

    @property
    def total_db(self) -> float:
        """Root mean square difference of the sensation levels; level and shape are orthogonal."""
        return float(np.hypot(self.magnitude_db, self.frequency_db))


def distance(first: Floats, second: Floats) -> Distance:
    """Distance of two percepts, (strokes, bands) each, from `sensation_levels`."""
    magnitude, frequency = _distances(first, second)
    return Distance(float(magnitude), float(frequency))


def _distances(first: Floats, second: Floats) -> Floats:
    """(2, …): distances in level and in shape of percepts (…, strokes, bands)."""
    difference = first - second
    level = difference.mean(axis=-1, keepdims=True)
    shape = difference - level
    apart: Floats = np.sqrt(
        np.stack([(level[..., 0] ** 2).mean(axis=-1), (shape**2).mean(axis=(-2, -1))])
    )
    return apart


@dataclass(frozen=True, eq=False, kw_only=True)
class Felt:
    """All distances that matter in a study, as one listener feels them, in dB.

    Parameters
    ----------
    from_real : (2, K, T, T) ndarray
        In level and in shape: by set of models, real texture, and texture of the virtual surface.
    between : (2, K, K, T) ndarray
        Between two sets' models of one texture.
    """

    from_real: Floats
    between: Floats


class Perception:
    """What the surfaces of a study feel like, computed once for all simulated participants.

    Parameters
    ----------
    study : Study
    real : mapping of str to TextureModel
        The truth behind each real surface.
    models : ModelSets
        The first set is the reference.
    threshold : Threshold
        Of the average participant.

    Attributes
    ----------
    threshold : Threshold
    textures, names : tuple of str
        Of the study; of the sets of models.
    identical : frozenset of str
        Textures whose models are all equal.

    Raises
    ------
    InputError
        If a surface has no model, or one that is not in g.
    """

    def __init__(
        self,
        study: Study,
        *,
        real: Mapping[str, AnyModel],
        models: ModelSets,
        threshold: Threshold,
    ) -> None:
        models.require(study)
        missing = [texture for texture in study.textures if texture not in real]
        if missing:
            raise InputError(
                f"expected the truth behind each real surface, got none for {', '.join(missing)}; "
                "give a model for each."
            )
        self.threshold = threshold
        self.textures = tuple(study.textures)
        self.names = tuple(models.names)
        self.identical = frozenset(models.identical(study.textures))
        self.place = {texture: number for number, texture in enumerate(self.textures)}
        self.set_number = {name: number for number, name in enumerate(self.names)}
        sources = [real, *({t: models.of(t, name) for t in self.textures} for name in self.names)]
        self._levels = np.stack(
            [[_levels(source[t], threshold) for t in self.textures] for source in sources]
        )

    def felt(self, threshold_shift_db: float = 0.0) -> Felt:
        """All distances, as felt by somebody whose threshold is that much higher."""
        percepts = np.maximum(self._levels - threshold_shift_db, 0.0)
        real, virtual = percepts[0], percepts[1:]
        return Felt(
            from_real=_distances(real[:, None], virtual[:, None]),
            between=_distances(virtual[:, None], virtual),
        )

    def distance(self, texture: str, model: str, other: str) -> Distance:
        """Distance of the real surface `texture` to the virtual one of texture `other`."""
        where = self.set_number[model], self.place[texture], self.place[other]
        magnitude, frequency = self.felt().from_real[(slice(None), *where)]
        return Distance(float(magnitude), float(frequency))
