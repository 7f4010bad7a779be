"""How percepts become answers: a population of simulated participants, and each of them.

docs/method/protocols.md#simulated-participants
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import exp, log
from typing import Any

import numpy as np

from tactileq.experiments.study.study import MOST_TEXTURES
from tactileq.modeling import InputError
from tactileq.modeling.arrays import Floats
from tactileq.modeling.checks import check_keys, check_number
from tactileq.modeling.errors import shown
from tactileq.modeling.participants.ratings import RatingPriors, careless_sds
from tactileq.modeling.reprs import one_line

RATED_SCALES = ("magnitude_similarity", "frequency_similarity")
EFFECTS = (*RATED_SCALES, "choice")
FURTHEST_SD = 3.0  # nobody is further from the mean of a trait
LOWEST_FELT, HIGHEST_FELT = 3.0, 95.0  # ratings that distances can stand for, in points
MOST_POINTS = 90.0  # between anybody's judgements of two models


@dataclass(frozen=True)
class Trait:
    """What differs between people: normal, but nobody is more than 3 SD from the mean.

    Parameters
    ----------
    sd : float
        Standard deviation between people, ≥ 0.
    """

    mean: float
    sd: float = 0.0

    @property
    def ends(self) -> tuple[float, float]:
        """The lowest and the highest possible value."""
        return self.mean - FURTHEST_SD * self.sd, self.mean + FURTHEST_SD * self.sd


@dataclass(frozen=True, kw_only=True)
class SimulatedPerson:
    """One participant, drawn from `Psychometrics`; its traits are described there.

    Parameters
    ----------
    preferences : tuple of float
        Of the buttons, log odds.
    careless : bool
        Whether nothing that is presented matters.
    level, level_sd : float
        Mean and SD of a careless person's judgements, in points.
    deviations : tuple of float
        Points by which planted effects are larger than the average person's, for each of `EFFECTS`.
    """

    threshold_db: float
    sensitivity: float
    magnitude_bias: float
    frequency_bias: float
    lapse_rate: float
    learning: float
    care: float
    preferences: tuple[float, ...]
    careless: bool = False
    level: float = 0.0
    level_sd: float = 0.0
    deviations: tuple[float, ...] = (0.0,) * len(EFFECTS)

    @property
    def blind_rate(self) -> float:
        """Share of choices that follow preference alone: all of a careless person."""
        return 1.0 if self.careless else self.lapse_rate


# What any participant may have of a trait.
_LIMITS = {
    "threshold_db": (-40.0, 40.0),
    "sensitivity": (0.05, 10.0),
    "magnitude_bias": (-100.0, 100.0),
    "frequency_bias": (-100.0, 100.0),
    "lapse_rate": (0.0, 0.5),
    "learning": (0.0, 3.0),
    "care": (0.1, 10.0),
}
_NUMBERS = {
    "preference_sd": (0.0, 5.0),
    "best_rating": (LOWEST_FELT, HIGHEST_FELT),
    "scale_db": (0.1, 1000.0),
    "noise_sd": (0.0, 25.0),
    "temperature_db": (0.01, 1000.0),
    "learning_trials": (0.1, 1000.0),
    "careless": (0.0, 1.0),
    "effect_sd": (0.0, 25.0),
}


@dataclass(frozen=True, kw_only=True)
class Psychometrics:
    """A population of simulated participants; the planted truth of a simulated study.

    docs/method/protocols.md#simulated-participants

    Parameters
    ----------
    threshold_db : Trait
        By how much a person's threshold is above that of the study, in dB.
    sensitivity : Trait
        What distances and planted effects are multiplied by.
    magnitude_bias, frequency_bias : Trait
        Points added to all judgements on a scale.
    lapse_rate : Trait
        Share of trials answered blindly; 0 … 0.5 of anybody.
    learning : Trait
        Noise is 1 + learning times as large in the first trial, and falls towards 1.
    care : Trait
        How often (2·care on average, beside one) and how long (20·care s) a person compares; the
        SD of judgements is divided by √care.
    preference_sd : float
        SD of the log odds of the buttons, between buttons and people.
    best_rating : float
        Average judgement of surfaces that feel alike, in points.
    scale_db : float
        Distance at which a judgement has fallen to best_rating/e.
    noise_sd : float
        SD of judgements from trial to trial, in points; ratings are judgements censored at the ends
        of the scale (`tactileq.modeling.participants.ratings`).
    temperature_db : float
        τ: distance that makes a surface e times less likely to be chosen; the noise of percepts in
        the oddity task.
    learning_trials : float
        After so many trials learning is 1/e of what it was.
    careless : float
        Share of people, 0 … 1, who rate near an own level whatever is presented, and choose by
        preference alone.
    effect_sd : float
        SD between people of each planted effect, in points (in percentage points of `choice`), in
        addition to what sensitivity does: normal, but nobody is more than 3 SD from the mean.
    planted : mapping of texture to mapping of what to points
        What another model than the reference does to the judgements of a texture on a scale
        (magnitude_similarity, frequency_similarity), or to the share of right answers in the
        relative task (choice, percentage points), on average over people who are not careless;
        instead of what percepts do. So small that nobody's judgements differ by more than 90.

    Raises
    ------
    InputError
        For values out of range.
    """

    threshold_db: Trait = Trait(0.0, 2.5)
    sensitivity: Trait = Trait(1.0, 0.2)
    magnitude_bias: Trait = Trait(0.0, 6.0)
    frequency_bias: Trait = Trait(0.0, 6.0)
    lapse_rate: Trait = Trait(0.01, 0.003)
    learning: Trait = Trait(0.5, 0.15)
    care: Trait = Trait(1.0, 0.2)
    preference_sd: float = 0.3
    best_rating: float = 80.0
    scale_db: float = 12.0
    noise_sd: float = 8.0
    temperature_db: float = 1.0
    learning_trials: float = 8.0
    careless: float = 0.0
    effect_sd: float = 0.0
    planted: Mapping[str, Mapping[str, float]] = field(default_factory=dict)

    __repr__ = one_line

    def __post_init__(self) -> None:
        for name, limits in _LIMITS.items():
            _check_trait(name, getattr(self, name), limits)
        for name, (low, high) in _NUMBERS.items():
            check_number(name, getattr(self, name), low=low, high=high)
        if not isinstance(self.planted, Mapping):
            raise InputError(
                f"expected effects by texture in planted, got {shown(self.planted)}; name textures."
            )
        planted = {}
        for texture, effects in self.planted.items():
            if not isinstance(effects, Mapping):
                raise InputError(
                    f"expected points by {', '.join(EFFECTS)} planted for {texture}, got "
                    f"{shown(effects)}; name what they apply to."
                )
            planted[texture] = self._checked(texture, effects)
        object.__setattr__(self, "planted", planted)

    def _checked(self, texture: str, effects: Mapping[str, float]) -> dict[str, float]:
        """The effects on a texture, which nobody may feel so strongly that no scale shows it."""
        where = f"what is planted for {texture}"
        check_keys(effects, EFFECTS, where=where)
        strongest = self.sensitivity.ends[1] / self.sensitivity.mean
        most = (MOST_POINTS - FURTHEST_SD * self.effect_sd) / strongest
        for what, points in effects.items():
            check_number(f"{what} in {where}", points, low=-most, high=most)
        return dict(effects)

    def draw(self, rng: np.random.Generator) -> SimulatedPerson:
        """One participant.

        Parameters
        ----------
        rng : numpy.random.Generator
            Asked once, for 19 normal numbers; whether somebody is careless, and how effects differ
            between people, follows from a generator that it spawns.
        """
        own = _cut(rng.standard_normal(len(_LIMITS) + MOST_TEXTURES))
        traits = {}
        for name, z in zip(_LIMITS, own, strict=False):
            trait = getattr(self, name)
            traits[name] = trait.mean + trait.sd * z
        liked = tuple(self.preference_sd * z for z in own[len(_LIMITS) :])
        return SimulatedPerson(**traits, preferences=liked, **self._beside(rng))

    def _beside(self, rng: np.random.Generator) -> dict[str, Any]:
        """Carelessness and deviations; what else `rng` is asked for does not depend on them."""
        if not (self.careless or self.effect_sd):
            return {}
        [own] = rng.spawn(1)
        priors = RatingPriors()
        return {
            "careless": bool(own.random() < self.careless),
            "deviations": tuple(
                self.effect_sd * z for z in _cut(own.standard_normal(len(EFFECTS)))
            ),
            "level": float(own.normal(*priors.level)),
            "level_sd": float(careless_sds(priors, (1,), rng=own)[0]),
        }

    def effect(self, texture: str, what: str) -> float | None:
        """The points planted for a texture, None where percepts decide."""
        return self.planted.get(texture, {}).get(what)

    def felt_rating(self, distance_db: float) -> float:
        """Mean judgement by distance alone: best_rating·exp(−distance/scale)."""
        return self.best_rating * exp(-distance_db / self.scale_db)

    def as_distance_db(self, points: float) -> float:
        """The distance from an identical surface that lowers a rating by |points|, in dB."""
        left = max(self.best_rating - abs(points), LOWEST_FELT) / self.best_rating
        return -self.scale_db * log(left)

    def unpractised(self, person: SimulatedPerson, trial: int) -> float:
        """How many times as large noise is in a trial (from 1) as after much practice."""
        return 1.0 + person.learning * exp(-(trial - 1) / self.learning_trials)


def choice_shares(
    evidence: Sequence[float], lapse_rate: float, preferences: Sequence[float]
) -> list[float]:
    """Probability of each of n buttons: Luce's rule with preferences and lapses.

    p_j = (1 − λ)·exp(e_j + b_j)/Σ exp(e_k + b_k) + λ·exp(b_j)/Σ exp(b_k)

    Parameters
    ----------
    evidence : sequence of n float
        e, log odds; of the distance d to what is looked for, −d/τ.
    lapse_rate : float
        λ, 0 … 1: share of blind answers, which follow preference alone.
    preferences : sequence of n float
        b, log odds.
    """
    attentive = _softmax([e + b for e, b in zip(evidence, preferences, strict=True)])
    blind = _softmax(preferences)
    mixed = zip(attentive, blind, strict=True)
    return [(1 - lapse_rate) * seen + lapse_rate * unseen for seen, unseen in mixed]


def with_effect(
    shares: Sequence[float], right: int, *, effect: float
) -> tuple[list[float], list[float]]:
    """Shares of the reference and of the other model, `effect` apart at the right button.

    Those of the reference are moved inward where the other's would leave 0 … 1, so the difference
    is kept; the other buttons keep their proportions.

    Parameters
    ----------
    shares : sequence of n float
        By percepts; the sum is 1.
    right : int
        Index of the right button.
    effect : float
        −1 … 1.
    """
    reference = min(max(shares[right], -min(effect, 0.0)), 1.0 - max(effect, 0.0))
    return _with_share(shares, right, reference), _with_share(shares, right, reference + effect)


def _with_share(shares: Sequence[float], right: int, share: float) -> list[float]:
    # Not what is left of the sum, of which rounding would be a large part where it is small.
    rest = sum(other for place, other in enumerate(shares) if place != right)
    if rest > 0:
        changed = [(1.0 - share) * (other / rest) for other in shares]
    else:
        changed = [(1.0 - share) / (len(shares) - 1)] * len(shares)
    changed[right] = share
    return changed


def _softmax(log_odds: Sequence[float]) -> list[float]:
    highest = max(log_odds)
    weights = [exp(value - highest) for value in log_odds]
    total = sum(weights)
    return [weight / total for weight in weights]


def _cut(normal: Floats) -> list[float]:
    found: list[float] = np.minimum(np.maximum(normal, -FURTHEST_SD), FURTHEST_SD).tolist()
    return found


def _check_trait(name: str, trait: object, limits: tuple[float, float]) -> None:
    if not isinstance(trait, Trait):
        raise InputError(
            f"expected a Trait for {name}, got {shown(trait)}; give mean and SD between people."
        )
    check_number(f"the mean of {name}", trait.mean, low=limits[0], high=limits[1])
    check_number(f"the SD of {name}", trait.sd, high=limits[1])
    low, high = trait.ends
    if low < limits[0] or high > limits[1]:
        raise InputError(
            f"expected a {name} from {limits[0]:g} to {limits[1]:g} up to 3 SD from the mean, got "
            f"{low:g} to {high:g}; lower the SD."
        )
