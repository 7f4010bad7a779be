"""Simulated participants with a known truth: what they feel, rate and choose in closed form.

The truth is a stipulation that lets analyses be tested, not a model of people. Its one
substantial property: vibration below threshold changes no percept.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import softmax

from experiments.sessions.surfaces import HIGHEST_RATING, Choice, ChoiceTrial, Rating, Surfaces
from experiments.study.design import Trial
from experiments.study.models import ModelSets
from experiments.study.study import Study
from modeling import InputError, TextureModel, Threshold
from modeling.arrays import Floats
from modeling.errors import shown
from modeling.models.loading import Layered
from modeling.seeds import generator

SurfaceKind = Literal["real", "full", "simplified"]

BAND_EDGES_HZ = (10.0, 20.0, 35.0, 60.0, 90.0, 130.0, 180.0, 250.0, 350.0, 480.0)
STROKES = ((100.0, 1.0), (200.0, 1.5), (300.0, 2.5))  # (mm/s, N)
STEP_HZ = 1.0


def sensation_levels(
    model: Layered,
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
    model : TextureModel or RegressedModel
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
        response = model.peq(speed_mm_s, force_n).response(frequency_hz)
        power = 2 * response**2 * (2 / model.rate_hz) * STEP_HZ / limit_g**2
        total = np.bincount(band, weights=power, minlength=edges.size - 1)
        levels[row] = 10 * np.log10(np.maximum(total, 1.0))
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
    difference = first - second
    level = difference.mean(axis=1, keepdims=True)
    shape = difference - level
    return Distance(float(np.sqrt((level**2).mean())), float(np.sqrt((shape**2).mean())))


@dataclass(frozen=True, kw_only=True)
class Psychometrics:
    """How percepts become answers; the planted truth of a simulated study.

    Parameters
    ----------
    scale_db : float
        Distance at which a rating has fallen to 100/e; > 0.
    bias_sd, noise_sd : float
        Standard deviation over subjects, and from trial to trial, in points of the scale; ≥ 0.
    temperature_db : float
        τ of the choice rule: distance that makes a surface e times less likely; > 0.
    lapse_rate : float
        Share of choices made blindly, 0 … 1.

    Raises
    ------
    InputError
        For values out of range.
    """

    scale_db: float = 12.0
    bias_sd: float = 8.0
    noise_sd: float = 10.0
    temperature_db: float = 1.0
    lapse_rate: float = 0.03

    def __post_init__(self) -> None:
        limits = (
            ("scale_db", self.scale_db > 0, "above 0"),
            ("bias_sd", self.bias_sd >= 0, "of at least 0"),
            ("noise_sd", self.noise_sd >= 0, "of at least 0"),
            ("temperature_db", self.temperature_db > 0, "above 0"),
            ("lapse_rate", 0 <= self.lapse_rate <= 1, "from 0 to 1"),
        )
        for name, good, wanted in limits:
            if not (good and np.isfinite(getattr(self, name))):
                raise InputError(
                    f"expected a {name} {wanted}, got {getattr(self, name)}; choose another."
                )

    def true_rating(self, distance_db: ArrayLike) -> Floats:
        """Rating without bias and noise: 100·exp(−distance/scale); same shape as the input."""
        rating: Floats = HIGHEST_RATING * np.exp(-np.asarray(distance_db) / self.scale_db)
        return rating

    def choice_probabilities(self, distances_db: ArrayLike) -> Floats:
        """Probability of each of n surfaces to be chosen, (n,): Luce's rule with lapses.

        p_j = (1 − λ)·exp(−d_j/τ)/Σ exp(−d_k/τ) + λ/n.
        """
        distances = np.asarray(distances_db, dtype=np.float64)
        attentive = softmax(-distances / self.temperature_db)
        probabilities: Floats = (1 - self.lapse_rate) * attentive + self.lapse_rate / distances.size
        return probabilities


class Perception:
    """What the surfaces of a study feel like, computed once for all simulated participants.

    Parameters
    ----------
    study : Study
    real : mapping of str to TextureModel
        The truth behind each real surface.
    models : ModelSets
    threshold : Threshold

    Raises
    ------
    InputError
        If a surface has no model, or one that is not in g.
    """

    def __init__(
        self,
        study: Study,
        *,
        real: Mapping[str, TextureModel],
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
        kinds: tuple[tuple[SurfaceKind, Mapping[str, Layered]], ...] = (
            ("real", real),
            ("full", models.sets["full"]),
            ("simplified", models.sets["simplified"]),
        )
        percepts = {
            (kind, texture): sensation_levels(source[texture], threshold)
            for kind, source in kinds
            for texture in study.textures
        }
        self._distances = {
            (texture, kind, other): distance(percepts["real", texture], percepts[kind, other])
            for texture in study.textures
            for kind, _ in kinds[1:]
            for other in study.textures
        }

    def distance(self, texture: str, kind: SurfaceKind, other: str) -> Distance:
        """Distance of the real surface `texture` to the virtual one of texture `other`."""
        return self._distances[texture, kind, other]


class SimulatedParticipant:
    """One simulated participant, with the same answers for the same seed.

    Parameters
    ----------
    perception : Perception
    psychometrics : Psychometrics
    seed : int
        Of the whole simulation.
    subject : int
        Fixes, with the seed, the participant's bias on either scale.
    occasion : tuple of int
        Distinguishes the sessions of a participant.
    """

    simulated = True

    def __init__(
        self,
        perception: Perception,
        psychometrics: Psychometrics,
        *,
        seed: int,
        subject: int,
        occasion: tuple[int, ...],
    ) -> None:
        self._perception = perception
        self._psychometrics = psychometrics
        person = generator(seed, subject)
        self._bias = person.normal(0.0, psychometrics.bias_sd, size=2)
        self._rng = generator(seed, subject, *occasion)

    def announce(self, title: str, text: str) -> None:
        """Simulated participants know the task."""

    def confirm_mount(self, tray: str) -> None:
        """The simulated experimenter is quick and careful."""

    def rate(self, trial: Trial, surfaces: Surfaces) -> Rating:
        """Switch a few times, then rate by the distance to the real surface."""
        for _ in range(1 + int(self._rng.poisson(2.0))):
            surfaces.toggle()
        apart = self._perception.distance(trial.texture, trial.model, trial.texture)
        truth = self._psychometrics.true_rating([apart.magnitude_db, apart.frequency_db])
        noise = self._rng.normal(0.0, self._psychometrics.noise_sd, size=2)
        magnitude, frequency = np.clip(truth + self._bias + noise, 0.0, HIGHEST_RATING)
        return Rating(
            magnitude_similarity=float(magnitude),
            frequency_similarity=float(frequency),
            response_time_s=self._response_time_s(),
        )

    def choose(self, trial: ChoiceTrial, surfaces: Surfaces) -> Choice:
        """Feel every surface once, return to the real one, and choose by Luce's rule."""
        for button in range(surfaces.count):
            surfaces.present_virtual(button)
        surfaces.present_real()
        apart = [
            self._perception.distance(trial.texture, trial.model, other).total_db
            for other in trial.layout
        ]
        probabilities = self._psychometrics.choice_probabilities(apart)
        button = int(self._rng.choice(surfaces.count, p=probabilities))
        surfaces.present_virtual(button)
        return Choice(button=button, response_time_s=self._response_time_s())

    def _response_time_s(self) -> float:
        return round(float(self._rng.lognormal(np.log(20.0), 0.4)), 3)
