"""How a participant comes to a choice: the one definition for simulation, planning and verdicts.

docs/method/participants.md#choices
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, partial

import numpy as np
from scipy.special import ndtr

from tactileq.modeling.arrays import Bools, Floats
from tactileq.modeling.checks import is_whole
from tactileq.modeling.errors import InputError, shown
from tactileq.modeling.participants.effects import (
    EffectMixture,
    EffectPriors,
    drawn_effects,
    drawn_mixture,
)

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(200)
_FURTHEST = 10.0  # normal values beyond it do not count
_STEP = 0.01  # of the tables, in d′
_LOWEST, _HIGHEST = -5.0, 10.0


def m_afc_share(d_prime: Floats | float, *, alternatives: int) -> Floats:
    """Share of right answers of an unbiased observer in m-alternative forced choice.

    The largest of m independent normal values is chosen; that of the right answer has the mean d′
    (Green and Swets 1966; Hacker and Ratcliff 1979).

    Parameters
    ----------
    d_prime : float or ndarray
        Any shape.
    alternatives : int
        m ≥ 2.

    Raises
    ------
    InputError
        For fewer than two alternatives.
    """
    if not is_whole(alternatives) or alternatives < 2:
        raise InputError(
            f"expected two alternatives or more, got {shown(alternatives)}; give the number of "
            "buttons."
        )
    x, weights = _FURTHEST * _NODES, _FURTHEST * _WEIGHTS * _density(_FURTHEST * _NODES)
    # Values about the right answer's, so that the nodes lie where the density is.
    shares = ndtr(x + np.asarray(d_prime)[..., None]) ** (alternatives - 1) @ weights
    return _shares(shares)


def oddity_share(d_prime: Floats | float) -> Floats:
    """Share of right answers of an observer who finds the odd one of three.

    The one farthest from the other two is chosen (triangular method: Frijters, Kooistra and
    Vereijken 1980).

    Parameters
    ----------
    d_prime : float or ndarray
        Of the odd one from the other two, ≥ 0; any shape.
    """
    x = _FURTHEST * (_NODES + 1) / 2
    weights = _FURTHEST * _WEIGHTS * _density(x)
    apart = np.sqrt(2 / 3) * np.asarray(d_prime)[..., None]
    right = ndtr(apart - np.sqrt(3) * x) + ndtr(-apart - np.sqrt(3) * x)
    return _shares(right @ weights)


def _shares(found: Floats) -> Floats:
    return np.clip(found, 0.0, 1.0)  # which rounding could pass


def _density(x: Floats) -> Floats:
    found: Floats = np.exp(-0.5 * x * x) / np.sqrt(2 * np.pi)
    return found


@dataclass(frozen=True, kw_only=True)
class DecisionModel:
    """From d′ to the share of right answers of somebody who attends.

    Parameters
    ----------
    chance : float
        Share of right answers of somebody who guesses.
    exact : callable
        From d′ to shares; a d′ below 0 of a task whose trials hold both models counts as 0.
    both_models : bool
        Whether a trial holds both models, so that d′ is what lies between them.
    """

    chance: float
    exact: Callable[[Floats], Floats]
    both_models: bool

    @property
    def table(self) -> Floats:
        """Shares at d′ from −5 in steps of 0.01."""
        return _table(self)

    def share(self, d_prime: Floats) -> Floats:
        """Shares by linear interpolation of the table, to 1e-5; any shape.

        Beyond the table's ends, −5 and 10, they are those at the ends.
        """
        place = np.clip(d_prime, _LOWEST, _HIGHEST - 2 * _STEP)
        place -= _LOWEST
        place /= _STEP
        below = place.astype(np.intp)
        place -= below
        table, steps = _table(self), _steps(self)
        found: Floats = table[below]
        place *= steps[below]
        found += place
        return found


@cache
def _table(model: DecisionModel) -> Floats:
    d_prime = np.arange(_LOWEST, _HIGHEST + _STEP / 2, _STEP)
    return model.exact(np.maximum(d_prime, 0.0) if model.both_models else d_prime)


@cache
def _steps(model: DecisionModel) -> Floats:
    return np.diff(_table(model))


ODDITY = DecisionModel(chance=1 / 3, exact=oddity_share, both_models=True)


@cache
def forced_choice(alternatives: int) -> DecisionModel:
    """The decision model of m-alternative forced choice."""
    return DecisionModel(
        chance=1 / alternatives,
        exact=partial(m_afc_share, alternatives=alternatives),
        both_models=False,
    )


@dataclass(frozen=True, kw_only=True)
class ChoicePriors:
    """Priors of the participants' choices, in units of d′ where nothing else is said.

    docs/method/participants.md#priors

    Parameters
    ----------
    effects : EffectPriors
        Of the effect of the other model on d′; of the d′ between the two where trials hold both.
    ability : (float, float)
        Mean and SD of people's mean ability to recognise textures.
    person_sd : float
        Typical SD of their abilities; the variance is inverse gamma of shape 2 and mean sd².
    texture_sd, texture_effect_sd, trend_sd : float
        SD of the textures' effects, of their deviations from the mean effect of the model, and of
        the effects of day and place.
    lapses, careless, catch : (float, float)
        Beta priors of the share of lapsed trials, of careless people, and of the share of right
        answers to catch trials of somebody who attends.
    """

    effects: EffectPriors
    ability: tuple[float, float] = (1.5, 1.0)
    person_sd: float = 0.6
    texture_sd: float = 0.5
    texture_effect_sd: float = 0.2
    trend_sd: float = 0.3
    lapses: tuple[float, float] = (1.0, 14.0)
    careless: tuple[float, float] = (1.0, 6.0)
    catch: tuple[float, float] = (100.0, 1.0)

    @staticmethod
    def of(model: DecisionModel) -> ChoicePriors:
        """Those of a decision model."""
        if model.both_models:
            return ChoicePriors(effects=EffectPriors(mean_sd=2.0, spread=0.4, weight=0.1))
        return ChoicePriors(effects=EffectPriors(mean_sd=0.7, spread=0.3, weight=0.1))

    def doubled(self) -> ChoicePriors:
        """The same with every SD of a prior twice as large, and careless people twice as likely."""
        own = self.effects
        wide = replace(own, mean_sd=2 * own.mean_sd, spread=2 * own.spread)
        names = ("person_sd", "texture_sd", "texture_effect_sd", "trend_sd")
        return replace(
            self,
            effects=wide,
            ability=(self.ability[0], 2 * self.ability[1]),
            lapses=(self.lapses[0], self.lapses[1] / 2),
            careless=(self.careless[0], self.careless[1] / 2),
            **{name: 2 * getattr(self, name) for name in names},
        )


@dataclass(frozen=True, eq=False, kw_only=True)
class ChoiceStudies:
    """Choices of B studies with n people, T textures and M models: counts of each cell.

    Parameters
    ----------
    right, asked : (B, n, T, M) ndarray
        Right answers, of how many; M is 2, the reference first, or 1 where trials hold both.
    catch_right, catch_asked : (B, n) ndarray
        The same of catch trials.
    trends : (C, B, n, T, M) ndarray
        Mean session and place in the session of a cell's trials, −½ … ½; 0 where it does not vary.
    """

    right: Floats
    asked: Floats
    catch_right: Floats
    catch_asked: Floats
    trends: Floats


@dataclass(frozen=True, eq=False, kw_only=True)
class StudyPeople:
    """Abilities and effects of n people of B studies, and what textures and trends add.

    Parameters
    ----------
    ability, effect : (B, n) ndarray
    textures, texture_effects : (B, T) ndarray
    slopes : (C, B) ndarray
    """

    ability: Floats
    effect: Floats
    textures: Floats
    texture_effects: Floats
    slopes: Floats

    def d_prime(self, models: int, trends: Floats | None = None) -> Floats:
        """(B, n, T, M) d′ in every cell; without trends halfway through the study."""
        level = self.ability[..., None] + self.textures[:, None]
        effects = self.effect[..., None] + self.texture_effects[:, None]
        signs = np.array([-0.5, 0.5]) if models == 2 else np.ones(1)
        found: Floats = level[..., None] + signs * effects[..., None]
        if trends is not None:
            for slope, trend in zip(self.slopes, trends, strict=True):
                found += slope[:, None, None, None] * trend
        return found


def mean_effect(shares: Floats, chance: float) -> Floats:
    """Shares (…, T, M) as effects (…, T): other − reference, or − chance where trials hold both."""
    found: Floats = shares[..., -1] - (shares[..., 0] if shares.shape[-1] == 2 else chance)
    return found


@dataclass(frozen=True, eq=False, kw_only=True)
class DrawnChoices:
    """Studies drawn from the priors, and what they were drawn from.

    Parameters
    ----------
    level, person_sd : (B,) ndarray
        Mean and SD of people's abilities.
    careless : (B, n) ndarray of bool
    lapses : (B,) ndarray
    """

    studies: ChoiceStudies
    people: StudyPeople
    mixture: EffectMixture
    level: Floats
    person_sd: Floats
    careless: Bools
    lapses: Floats


def drawn_choices(
    model: DecisionModel,
    priors: ChoicePriors,
    *,
    asked: Floats,
    catch_asked: Floats,
    trends: Floats,
    rng: np.random.Generator,
) -> DrawnChoices:
    """Studies whose parameters are drawn from the priors: what simulation-based calibration needs.

    Parameters
    ----------
    priors : ChoicePriors
        `asked`, `catch_asked` and `trends` as in `ChoiceStudies`.
    asked, catch_asked, trends : ndarray
    """
    studies, people, textures, models = asked.shape
    mixture = drawn_mixture(priors.effects, studies, rng=rng)
    level, person_sd = np.zeros(studies), np.zeros(studies)
    if models == 2:
        level = np.asarray(rng.normal(*priors.ability, studies), dtype=float)
        person_sd = np.sqrt(priors.person_sd**2 / rng.standard_gamma(2.0, studies))
    own = rng.standard_normal((2, studies, textures))
    drawn = StudyPeople(
        ability=level[:, None] + person_sd[:, None] * rng.standard_normal((studies, people)),
        effect=drawn_effects(mixture, people, rng=rng),
        textures=priors.texture_sd * own[0],
        texture_effects=priors.texture_effect_sd * own[1] * (models == 2),
        slopes=rng.normal(0.0, priors.trend_sd, (len(trends), studies)),
    )
    careless = rng.random((studies, people)) < _betas(rng, priors.careless, studies)[:, None]
    lapses = _betas(rng, priors.lapses, studies)
    catch = _betas(rng, priors.catch, studies)[:, None]
    shares = model.share(drawn.d_prime(models, trends))
    rate = np.where(careless, 1.0, lapses[:, None])
    seen = rate[..., None, None] * model.chance + (1 - rate[..., None, None]) * shares
    caught = rate * model.chance + (1 - rate) * catch
    return DrawnChoices(
        studies=ChoiceStudies(
            right=rng.binomial(asked.astype(int), seen).astype(float),
            asked=asked,
            catch_right=rng.binomial(catch_asked.astype(int), caught).astype(float),
            catch_asked=catch_asked,
            trends=trends,
        ),
        people=drawn,
        mixture=mixture,
        level=level,
        person_sd=person_sd,
        careless=careless,
        lapses=lapses,
    )


def _betas(rng: np.random.Generator, prior: tuple[float, float], count: int) -> Floats:
    return np.asarray(rng.beta(*prior, count), dtype=float)
