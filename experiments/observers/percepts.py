"""What surfaces feel like to simulated participants: levels above threshold, and distances.

The one substantial property of this stipulation: vibration below threshold changes no percept
(docs/method/protocols.md#simulated-participants).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tactileq.experiments.study.models import ModelSets
from tactileq.experiments.study.study import Study
from tactileq.modeling import InputError, Threshold
from tactileq.modeling.arrays import Floats
from tactileq.modeling.errors import shown
from tactileq.modeling.models.ar_model import ARModel
from tactileq.modeling.models.loading import AnyModel
from tactileq.rig.shared.interface import Presentable, Stimulus

BAND_EDGES_HZ = (10.0, 20.0, 35.0, 60.0, 90.0, 130.0, 180.0, 250.0, 350.0, 480.0)
STROKES = ((100.0, 1.0), (200.0, 1.5), (300.0, 2.5))  # (mm/s, N)
STEP_HZ = 1.0
NOTHING_DB = -300.0  # stands for the level of silence
_FREQUENCY_HZ = np.arange(BAND_EDGES_HZ[0], BAND_EDGES_HZ[-1], STEP_HZ) + STEP_HZ / 2


def sensation_levels(
    model: Presentable,
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
    model : TextureModel, RegressedModel, ARModel or Stimulus
        In g; a stimulus is felt alike in every stroke.
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
    shown_as: Presentable,
    threshold: Threshold,
    *,
    strokes: tuple[tuple[float, float], ...] = STROKES,
) -> Floats:
    """As `sensation_levels`, but negative below threshold; `NOTHING_DB` of silence."""
    if isinstance(shown_as, Stimulus):  # felt alike whatever the hand does
        one = _in_bands(_power_of_signal(shown_as), shown_as.rate_hz, threshold)
        return np.tile(one, (len(strokes), 1))
    if shown_as.unit != "g":
        raise InputError(
            f"expected a model in g for a simulated participant, got one of {shown_as.texture} in "
            f"unit {shown(shown_as.unit)}; record it with a calibrated sensor."
        )
    made = shown_as.filter if isinstance(shown_as, ARModel) else shown_as.peq
    responses = (made(*stroke).response(_FREQUENCY_HZ) for stroke in strokes)
    powers = (response**2 * (2 / shown_as.rate_hz) * STEP_HZ for response in responses)
    return np.stack([_in_bands(power, shown_as.rate_hz, threshold) for power in powers])


def _power_of_signal(stimulus: Stimulus) -> Floats:
    """Power (g²) of a signal in the steps of `_FREQUENCY_HZ`, averaged over its length (Welch)."""
    from scipy.signal import welch

    length = min(stimulus.samples_g.size, round(stimulus.rate_hz / STEP_HZ))
    frequency_hz, density = welch(stimulus.samples_g, fs=stimulus.rate_hz, nperseg=length)
    power: Floats = np.interp(_FREQUENCY_HZ, frequency_hz, density, right=0.0) * STEP_HZ
    return power


def _in_bands(power_g2: Floats, rate_hz: float, threshold: Threshold) -> Floats:
    """Power (n,) at `_FREQUENCY_HZ` as levels (9,) above threshold in the bands, in dB."""
    limit_g = threshold.at(_FREQUENCY_HZ)
    known = np.isfinite(limit_g) & (rate_hz / 2 > _FREQUENCY_HZ)
    band = np.searchsorted(BAND_EDGES_HZ, _FREQUENCY_HZ[known], side="right") - 1
    relative = 2 * power_g2[known] / limit_g[known] ** 2
    total = np.bincount(band, weights=relative, minlength=len(BAND_EDGES_HZ) - 1)
    levels: Floats = 10 * np.log10(np.maximum(total, 10 ** (NOTHING_DB / 10)))
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
    among : (2, K, T, T) ndarray
        Between one set's models of two textures.
    """

    from_real: Floats
    between: Floats
    among: Floats


class Perception:
    """What the surfaces of a study feel like, computed once for all simulated participants.

    Parameters
    ----------
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
        """All distances, as felt by a person whose threshold is that much higher."""
        percepts = np.maximum(self._levels - threshold_shift_db, 0.0)
        real, virtual = percepts[0], percepts[1:]
        return Felt(
            from_real=_distances(real[:, None], virtual[:, None]),
            between=_distances(virtual[:, None], virtual),
            among=_distances(virtual[:, :, None], virtual[:, None]),
        )

    def distance(self, texture: str, model: str, other: str) -> Distance:
        """Distance of the real surface `texture` to the virtual one of texture `other`."""
        where = self.set_number[model], self.place[texture], self.place[other]
        magnitude, frequency = self.felt().from_real[(slice(None), *where)]
        return Distance(float(magnitude), float(frequency))
