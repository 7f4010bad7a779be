"""The posterior of right answers, by Metropolis–Hastings steps; many studies, or chains, at once.

docs/method/participants.md#sampler
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.special import ndtri

from tactileq.analysis.statistics.participants.mixture import MixtureOfEffects
from tactileq.modeling.arrays import Bools, Floats
from tactileq.modeling.participants.choices import (
    ChoicePriors,
    ChoiceStudies,
    DecisionModel,
    StudyPeople,
    mean_effect,
)
from tactileq.modeling.participants.effects import COMPONENTS, EffectMixture, drawn_places

_ACCEPTED = 0.35  # share of accepted proposals that steps are adapted to
_TINY = 1e-12
_ABILITIES, _EFFECTS = 5, 9  # nodes of the population, at equally likely values


class ChoiceSampler:
    """The state of the chains of B studies; `step` draws everything once.

    Parameters
    ----------
    studies : ChoiceStudies
        Missing people were asked nothing.
    """

    def __init__(
        self,
        studies: ChoiceStudies,
        model: DecisionModel,
        priors: ChoicePriors,
        *,
        rng: np.random.Generator,
    ) -> None:
        self._data, self._model, self._priors, self._rng = studies, model, priors, rng
        b, n, t, m = studies.right.shape
        self._models = m
        self.people = (studies.asked.sum(axis=(2, 3)) > 0) | (studies.catch_asked > 0)
        self._wrong = studies.asked - studies.right
        self._varying = [c for c, one in enumerate(studies.trends) if np.ptp(one) > 0]
        self._mixture = MixtureOfEffects(priors.effects, b, rng=rng)
        two = float(m == 2)
        self._level = np.full(b, priors.ability[0] * two)
        self._person_variance = np.full(b, priors.person_sd**2)
        self._state = StudyPeople(
            ability=np.full((b, n), priors.ability[0] * two),
            effect=np.zeros((b, n)),
            textures=np.zeros((b, t)),
            texture_effects=np.zeros((b, t)),
            slopes=np.zeros((len(studies.trends), b)),
        )
        self.attends = np.ones((b, n), dtype=bool)
        self.lapses = np.full(b, 0.02)
        self._catch = np.full(b, 0.95)
        self._careless_share = np.full(b, 0.05)
        answers, right = studies.asked.sum(axis=(2, 3)), studies.right.sum(axis=(2, 3))
        self._guessing = (right + studies.catch_right) * np.log(model.chance)
        wrong = answers + studies.catch_asked - right - studies.catch_right
        self._guessing += wrong * np.log(1 - model.chance)
        self._steps: dict[str, Floats] = {}
        self._adapting = True
        self._cells = self._log_cells(self._state)

    def settle(self) -> None:
        """End the adaptation of steps: from here on draws are from the posterior."""
        self._adapting = False

    @property
    def mixture(self) -> EffectMixture:
        """The distribution of people's effects as it is now, in d′."""
        return self._mixture.mixture

    def step(self) -> None:
        """Draw every unknown once, given all others."""
        self._draw_people()
        self._draw_population()
        self._move_population()
        self._draw_cells()
        self._draw_lapses()
        self._draw_classes()

    # Likelihoods: of cells (B, n, T, M), of people (B, n), of studies (B,).

    def _log_cells(self, state: StudyPeople, lapses: Floats | None = None) -> Floats:
        rate = (self.lapses if lapses is None else lapses)[:, None, None, None]
        p = self._model.share(state.d_prime(self._models, self._data.trends))
        p *= 1 - rate
        p += rate * self._model.chance
        np.clip(p, _TINY, 1 - _TINY, out=p)
        found: Floats = self._data.right * np.log(p)
        found += self._wrong * np.log1p(-p)
        return found

    def _log_catch(self, lapses: Floats, catch: Floats) -> Floats:
        p = lapses * self._model.chance + (1 - lapses) * catch
        p = np.clip(p, _TINY, 1 - _TINY)[:, None]
        wrong = self._data.catch_asked - self._data.catch_right
        found: Floats = self._data.catch_right * np.log(p) + wrong * np.log1p(-p)
        return found

    def _by_person(self, cells: Floats) -> Floats:
        found: Floats = np.where(self.attends, cells.sum(axis=(2, 3)), 0.0)
        return found

    # Proposals.

    def _proposed(self, name: str, shape: tuple[int, ...], scale: float) -> Floats:
        step = self._steps.setdefault(name, np.full(shape, scale))
        return step * self._rng.standard_normal(shape)

    def _accepted(self, log: Floats, name: str = "") -> Bools:
        yes: Bools = np.log(self._rng.random(log.shape)) < log
        if self._adapting and name:
            change = np.exp(0.15 * (np.minimum(np.exp(np.minimum(log, 0)), 1) - _ACCEPTED))
            self._steps[name] = np.clip(self._steps[name] * change, 1e-3, 5.0)
        return yes

    def _draw_people(self) -> None:
        """Abilities and effects of each person: near the old ones, then anew from the people."""
        shape = self.attends.shape
        near = {"effect": self._state.effect + self._proposed("effect", shape, 0.5)}
        if self._models == 2:
            near["ability"] = self._state.ability + self._proposed("ability", shape, 0.3)
        log = self._log_effect(near["effect"]) - self._log_effect(self._state.effect)
        if self._models == 2:
            log += self._log_ability(near["ability"]) - self._log_ability(self._state.ability)
        self._judge_people(near, log, ("effect", "ability")[: len(near)])
        places = drawn_places(
            np.broadcast_to(self._mixture.weights[:, None], (*shape, COMPONENTS)), self._rng
        )
        fresh = np.take_along_axis(self._mixture.means, places, axis=1)
        fresh = fresh + self._mixture.spread[:, None] * self._rng.standard_normal(shape)
        anew = {"effect": fresh}
        if self._models == 2:
            keep = self._rng.random(shape) < 0.5
            drawn = self._level[:, None] + np.sqrt(self._person_variance)[
                :, None
            ] * self._rng.standard_normal(shape)
            anew["ability"] = np.where(keep & self.attends, self._state.ability, drawn)
        self._judge_people(anew, np.zeros(shape), ())

    def _judge_people(
        self, proposed: dict[str, Floats], log: Floats, steps: tuple[str, ...]
    ) -> None:
        state = replace(self._state, **proposed)
        cells = self._log_cells(state)
        log = log + self._by_person(cells) - self._by_person(self._cells)
        yes = self._accepted(log, steps[0] if steps else "")
        for name in steps[1:]:
            self._steps[name] = self._steps[steps[0]] * 0.7
        kept = {
            name: np.where(yes, new, getattr(self._state, name)) for name, new in proposed.items()
        }
        self._state = replace(self._state, **kept)
        self._cells = np.where(yes[..., None, None], cells, self._cells)

    def _log_effect(self, effects: Floats) -> Floats:
        spread = self._mixture.spread[:, None, None]
        z = (effects[..., None] - self._mixture.means[:, None]) / spread
        found: Floats = np.log(
            (self._mixture.weights[:, None] * np.exp(-0.5 * z * z)).sum(axis=-1) + 1e-300
        )
        return found

    def _log_ability(self, ability: Floats) -> Floats:
        found: Floats = (
            -0.5 * (ability - self._level[:, None]) ** 2 / self._person_variance[:, None]
        )
        return found

    def _draw_population(self) -> None:
        """The mixture of effects, and mean and variance of abilities, given every person's."""
        exactly = np.full(self.attends.shape, _TINY)
        self._mixture.draw(self._state.effect, exactly, self.people)
        if self._models == 1:
            return
        people = self.people.sum(axis=1)
        mean, sd = self._priors.ability
        precision = people / self._person_variance + sd**-2
        total = (self._state.ability * self.people).sum(axis=1) / self._person_variance
        middle = (total + mean * sd**-2) / precision
        self._level = middle + self._rng.standard_normal(middle.shape) / np.sqrt(precision)
        squares = ((self._state.ability - self._level[:, None]) ** 2 * self.people).sum(axis=1)
        gammas = self._rng.standard_gamma(2.0 + people / 2)
        self._person_variance = np.maximum((self._priors.person_sd**2 + squares / 2) / gammas, 1e-6)

    def _move_population(self) -> None:
        """Moves of a whole population with its people, without which chains would stick."""
        effects, places, log = self._mixture.rescaled(self._state.effect)
        yes = self._judge_study({"effect": effects}, log)
        self._mixture.take_spread(yes, places)
        shift = self._proposed("shift", self._level.shape, 0.15)
        old, mean_sd = self._mixture.means, self._priors.effects.mean_sd
        new = old + shift[:, None]
        log = 0.5 * ((old**2 - new**2) / mean_sd**2).sum(axis=1)
        yes = self._judge_study({"effect": self._state.effect + shift[:, None]}, log, "shift")
        self._mixture.means = np.where(yes[:, None], new, old)
        if self._models == 1:
            return
        shift = self._proposed("level", self._level.shape, 0.15)
        mean, sd = self._priors.ability
        log = 0.5 * ((self._level - mean) ** 2 - (self._level + shift - mean) ** 2) / sd**2
        yes = self._judge_study({"ability": self._state.ability + shift[:, None]}, log, "level")
        self._level = np.where(yes, self._level + shift, self._level)
        factor = np.exp(self._proposed("factor", self._level.shape, 0.2))
        away = self._state.ability - self._level[:, None]
        ability = self._level[:, None] + factor[:, None] * away
        variance = self._person_variance
        log = -4 * np.log(factor) - self._priors.person_sd**2 / variance * (factor**-2 - 1)
        yes = self._judge_study({"ability": ability}, log, "factor")
        self._person_variance = np.where(yes, variance * factor**2, variance)

    def _judge_study(self, proposed: dict[str, Floats], log: Floats, name: str = "") -> Bools:
        cells = self._log_cells(replace(self._state, **proposed))
        log = log + (self._by_person(cells) - self._by_person(self._cells)).sum(axis=1)
        yes = self._accepted(log, name)
        for key, new in proposed.items():
            old = getattr(self._state, key)
            chosen = np.where(yes.reshape(-1, *(1,) * (new.ndim - 1)), new, old)
            self._state = replace(self._state, **{key: chosen})
        self._cells = np.where(yes[:, None, None, None], cells, self._cells)
        return yes

    def _draw_cells(self) -> None:
        """Textures, their effects, and trends."""
        self._draw_textures("textures", self._priors.texture_sd)
        if self._models == 2:
            self._draw_textures("texture_effects", self._priors.texture_effect_sd)
        for c in self._varying:
            name, old = f"slope {c}", self._state.slopes
            change = self._proposed(name, self._level.shape, 0.1)
            new = old.copy()
            new[c] += change
            log = 0.5 * (old[c] ** 2 - new[c] ** 2) / self._priors.trend_sd**2
            cells = self._log_cells(replace(self._state, slopes=new))
            log += (self._by_person(cells) - self._by_person(self._cells)).sum(axis=1)
            yes = self._accepted(log, name)
            self._state = replace(self._state, slopes=np.where(yes, new, old))
            self._cells = np.where(yes[:, None, None, None], cells, self._cells)

    def _draw_textures(self, name: str, sd: float) -> None:
        old: Floats = getattr(self._state, name)
        new = old + self._proposed(name, old.shape, 0.2)
        cells = self._log_cells(replace(self._state, **{name: new}))
        log = 0.5 * (old**2 - new**2) / sd**2
        log += np.einsum("bntm,bn->bt", cells - self._cells, self.attends.astype(float))
        yes = self._accepted(log, name)
        self._state = replace(self._state, **{name: np.where(yes, new, old)})
        self._cells = np.where(yes[:, None, :, None], cells, self._cells)

    def _draw_lapses(self) -> None:
        new = 1 / (
            1 + (1 / self.lapses - 1) * np.exp(-self._proposed("lapses", self._level.shape, 0.5))
        )
        new = np.clip(new, 1e-6, 0.999)
        log = _log_beta(new, self._priors.lapses) - _log_beta(self.lapses, self._priors.lapses)
        cells = self._log_cells(self._state, new)
        change = self._by_person(cells) - self._by_person(self._cells)
        change += self.attends * (
            self._log_catch(new, self._catch) - self._log_catch(self.lapses, self._catch)
        )
        yes = self._accepted(log + change.sum(axis=1), "lapses")
        self.lapses = np.where(yes, new, self.lapses)
        self._cells = np.where(yes[:, None, None, None], cells, self._cells)
        new = 1 / (1 + (1 / self._catch - 1) * np.exp(-self._proposed("catch", new.shape, 0.5)))
        new = np.clip(new, 1e-3, 1 - 1e-6)
        log = _log_beta(new, self._priors.catch) - _log_beta(self._catch, self._priors.catch)
        change = self.attends * (
            self._log_catch(self.lapses, new) - self._log_catch(self.lapses, self._catch)
        )
        yes = self._accepted(log + change.sum(axis=1), "catch")
        self._catch = np.where(yes, new, self._catch)

    def _draw_classes(self) -> None:
        attending = self._cells.sum(axis=(2, 3)) + self._log_catch(self.lapses, self._catch)
        share = self._careless_share[:, None]
        log = attending - self._guessing + np.log(1 - share) - np.log(share)
        self.attends = self._rng.random(log.shape) < 1 / (1 + np.exp(-np.clip(log, -500, 500)))
        prior = self._priors.careless
        careless = (self.people & ~self.attends).sum(axis=1)
        attending_ones = (self.people & self.attends).sum(axis=1)
        found = self._rng.beta(prior[0] + careless, prior[1] + attending_ones)
        self._careless_share = np.clip(found, 1e-9, 1 - 1e-9)

    # What is asked of the posterior, in shares of right answers.

    def person_effects(self) -> Floats:
        """(B, n) effect of each participant over all textures, lapses aside."""
        shares = self._model.share(self._state.d_prime(self._models))
        found: Floats = mean_effect(shares, self._model.chance).mean(axis=-1)
        return found

    def mean_effects(self) -> tuple[Floats, Floats]:
        """Mean effect (B,) of people who attend, and on each texture (B, T), lapses aside."""
        return population_effects(
            self._model,
            self._state,
            self.mixture,
            level=self._level,
            person_sd=np.sqrt(self._person_variance),
            models=self._models,
        )


def population_effects(
    model: DecisionModel,
    state: StudyPeople,
    mixture: EffectMixture,
    *,
    level: Floats,
    person_sd: Floats,
    models: int,
) -> tuple[Floats, Floats]:
    """As `ChoiceSampler.mean_effects`, of any population: over its abilities and effects."""
    b = len(level)
    nodes = mixture.means[..., None] + mixture.spread[:, None, None] * _likely(_EFFECTS)
    abilities = level[:, None] + person_sd[:, None] * _likely(_ABILITIES if models == 2 else 1)
    effect = np.broadcast_to(nodes.reshape(b, 1, -1), (b, abilities.shape[1], nodes[0].size))
    ability = np.broadcast_to(abilities[..., None], effect.shape)
    everybody = replace(state, ability=ability.reshape(b, -1), effect=effect.reshape(b, -1))
    weights = np.repeat(mixture.weights, _EFFECTS, axis=1) / _EFFECTS
    weights = np.tile(weights, (1, abilities.shape[1])) / abilities.shape[1]
    found = mean_effect(model.share(everybody.d_prime(models)), model.chance)
    textures = np.einsum("bnt,bn->bt", found, weights)
    return textures.mean(axis=1), textures


def _likely(count: int) -> Floats:
    """Standard normal values in the middle of equally likely ranges."""
    found: Floats = ndtri((np.arange(count) + 0.5) / count)
    return found


def _log_beta(share: Floats, prior: tuple[float, float]) -> Floats:
    """Log density of log odds whose share has a beta prior."""
    found: Floats = prior[0] * np.log(share) + prior[1] * np.log1p(-share)
    return found
