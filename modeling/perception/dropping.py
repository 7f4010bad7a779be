"""Which sets of layers may be dropped without being felt (docs/method/perception.md#sets)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np

from tactileq.modeling.arrays import Bools, Floats
from tactileq.modeling.equalizer.bands import band_rms
from tactileq.modeling.models.parameter_table import Parameters
from tactileq.modeling.perception.power_changes import PowerChange, PowerChanges
from tactileq.modeling.perception.signs_of_rest import SignsOfRest

HIGHEST_FLIP_PROBABILITY = 0.05
MOST_GROUPS = 6  # of layers, all unions of which are looked at
Layers = tuple[int, ...]  # 0-based, rising


def flip_probabilities(distances: Floats, level_sd_db: Floats) -> Floats:
    """P(flip) per layer, (m,), from (conditions, m) distances and deviations; NaN if unknown.

    The levels' deviations enter once, as in a bootstrap of the records. That two recordings differ
    by √2 of it is made up for by selection: of several levels the one nearest to the threshold is
    there in part by its own error. Planted repeats turn about as often as said here.
    """
    from scipy.special import ndtr

    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        z = np.where(level_sd_db > 0, -distances / level_sd_db, np.copysign(np.inf, -distances))
    below = np.prod(ndtr(z), axis=0)
    dropped = (distances < 0).all(axis=0)
    flips: Floats = np.where(
        np.isnan(distances).any(axis=0), np.nan, np.where(dropped, 1 - below, below)
    )
    return flips


@dataclass(frozen=True, eq=False)
class Dropping:
    """What dropping some layers changes, at n places.

    Parameters
    ----------
    layers : tuple of int
        0-based, rising.
    distances_db : (n,) ndarray
        Of the change of power to the threshold; NaN where it is not known.
    assumed, unknown : (n,) ndarray of bool
        Most of the change is above the threshold's table and below its last level; at
        frequencies where nothing is known of the threshold.
    margin_db : float
        ≥ 0; how far below the threshold the change has to be.
    flip_probability : float
        That the levels, drawn again, would decide otherwise.
    """

    layers: Layers
    distances_db: Floats
    assumed: Bools
    unknown: Bools
    margin_db: float
    flip_probability: float

    @cached_property
    def highest_db(self) -> float:
        """The highest of the distances that are known; −inf where none is."""
        return float(np.max(self.distances_db, where=~np.isnan(self.distances_db), initial=-np.inf))

    @cached_property
    def below(self) -> bool:
        """Whether the change is below the threshold, by the margin, at every place."""
        return bool((self.distances_db + self.margin_db < 0).all())


@dataclass(frozen=True, eq=False)
class Recorded:
    """The n recorded conditions whose levels tell how certain a verdict is.

    Parameters
    ----------
    at : Parameters
        Of the full model there.
    level_sd_db : (n, m) ndarray
    beyond : bool
        Whether some of them are beyond the places that are judged. What is felt there says
        nothing.
    """

    at: Parameters
    changes: PowerChanges
    level_sd_db: Floats
    beyond: bool

    def flip_probability(self, layers: Layers, distances_db: Floats) -> float:
        """P(flip) of dropping some layers, from distances (n,) that include the margin."""
        if self.beyond:
            distances_db = np.where(distances_db < 0, distances_db, -np.inf)
        deviation = self.deviations_db(layers)
        return float(flip_probabilities(distances_db[:, None], deviation[:, None])[0])

    def deviations_db(self, layers: Layers) -> Floats:
        """Of some layers together, (n,): the mean of theirs, weighted by their power."""
        chosen = list(layers)
        amplitude = np.abs(self.at.gains[:, chosen])
        largest = float(amplitude.max(initial=0.0)) or 1.0
        # Relative to the largest one: no power overflows. Of silent layers all count alike.
        width = band_rms(1.0, self.at.bandwidths_hz[:, chosen], rate_hz=self.changes.rate_hz)
        power = np.maximum((amplitude / largest * width) ** 2, np.finfo(np.float64).tiny)
        deviations: Floats = (power * self.level_sd_db[:, chosen]).sum(axis=1) / power.sum(axis=1)
        return deviations


class Judge:
    """What dropping any set of layers changes.

    Parameters
    ----------
    at : Parameters
        Of the full model at the n places that are judged.
    changes : PowerChanges
        At the same places.
    signs : SignsOfRest
        Of the full model.
    """

    def __init__(
        self,
        at: Parameters,
        changes: PowerChanges,
        *,
        recorded: Recorded,
        signs: SignsOfRest,
        margin_db: float,
    ) -> None:
        self._at, self._changes, self._recorded = at, changes, recorded
        self._signs, self._margin_db = signs, margin_db
        self._judged: dict[Layers, Dropping] = {}

    @property
    def n_layers(self) -> int:
        """Number of layers of the full model."""
        return int(self._at.gains.shape[1])

    @property
    def centres_hz(self) -> Floats:
        """Frequency of each layer, (m,): the median over the places."""
        centres: Floats = np.median(self._at.frequencies_hz, axis=0)
        return centres

    @property
    def n_places(self) -> int:
        """Number of places that are judged."""
        return int(self._at.gains.shape[0])

    def change(self, layers: Layers) -> PowerChange:
        """The change of power by dropping these layers, at the places."""
        return self._changes.of(self._signs.without(self._at.gains, layers))

    def __call__(self, layers: Layers) -> Dropping:
        if layers not in self._judged:
            self._judged[layers] = self._judge(layers)
        return self._judged[layers]

    def _judge(self, layers: Layers) -> Dropping:
        change, margin_db = self.change(layers), self._margin_db
        distances, assumed = change.distances_db(margin_db=margin_db)
        there = distances
        if self._recorded.changes is not self._changes:
            recorded = self._recorded.changes.of(
                self._signs.without(self._recorded.at.gains, layers)
            )
            there, _ = recorded.distances_db(margin_db=margin_db)
        flip_probability = self._recorded.flip_probability(layers, there + margin_db)
        return Dropping(layers, distances, assumed, change.unknown, margin_db, flip_probability)


class SetsOfLayers:
    """The sets of layers that may be dropped.

    A set may go if the change by dropping all of it is below the threshold everywhere, and if that
    is certain of each part that goes: of each group alone, or, where that alone would be felt, of
    the fewest groups with which together it would not. Of more than six groups, only unions of
    those are looked at that may go alone or with a neighbour in frequency; of more than six of
    these only ever larger sets, what changes least first.

    Parameters
    ----------
    groups : sequence of sequences of int
        Layers that go together or not at all.
    """

    def __init__(self, judge: Judge, groups: Sequence[Sequence[int]]) -> None:
        self._judge = judge
        centres = judge.centres_hz
        self._groups = sorted(map(tuple, groups), key=lambda group: float(centres[group[0]]))
        # What lies mostly where nothing is known must not hide behind something louder.
        known = [group for group in self._groups if not judge(group).unknown.any()]
        tried = [judge(layers) for layers in self._tried(known)]
        below = [dropping for dropping in tried if dropping.below]
        self._below = sorted(below, key=lambda d: (len(d.layers), d.highest_db, d.layers))
        every = sum(map(len, self._groups))
        allowed = [d for d in self._below if len(d.layers) < every and self._certain(d)]
        allowed.sort(key=lambda d: (-len(d.layers), d.highest_db, d.layers))
        self.allowed: tuple[Dropping, ...] = tuple(allowed)

    def part(self, group: Layers, dropped: Layers) -> Dropping:
        """The fewest layers with which a group may go, of those that are dropped."""
        return next(d for d in self._below if set(group) <= set(d.layers) <= set(dropped))

    def _certain(self, dropping: Dropping) -> bool:
        inside = (group for group in self._groups if set(group) <= set(dropping.layers))
        parts = (self.part(group, dropping.layers) for group in inside)
        return all(part.flip_probability < HIGHEST_FLIP_PROBABILITY for part in parts)

    def _tried(self, groups: list[Layers]) -> list[Layers]:
        if len(groups) <= MOST_GROUPS:
            return _unions(groups)
        parts = list(filter(None, (self._part_of(n, groups) for n in range(len(groups)))))
        candidates = [g for g in groups if any(set(g) <= set(part.layers) for part in parts)]
        few = [part.layers for part in parts]
        if len(candidates) <= MOST_GROUPS:
            return list(dict.fromkeys(few + _unions(candidates)))
        return list(dict.fromkeys(few + self._one_after_the_other(parts)))

    def _part_of(self, number: int, groups: list[Layers]) -> Dropping | None:
        """A group alone, or with a neighbour if alone it is above; None if neither surely goes."""
        alone = self._judge(groups[number])
        neighbours = groups[max(number - 1, 0) : number] + groups[number + 1 : number + 2]
        pairs = [self._judge(_union((groups[number], other))) for other in neighbours]
        tried = [alone] if alone.below else [pair for pair in pairs if pair.below]
        certain = [d for d in tried if d.flip_probability < HIGHEST_FLIP_PROBABILITY]
        return min(certain, key=lambda d: d.highest_db, default=None)

    def _one_after_the_other(self, parts: list[Dropping]) -> list[Layers]:
        """Ever larger sets: what changes least first, whatever then stays below."""
        chain: list[Layers] = []
        so_far: set[int] = set()
        for part in sorted(parts, key=lambda d: d.highest_db):
            wider = tuple(sorted(so_far.union(part.layers)))
            if self._judge(wider).below:
                so_far.update(part.layers)
                chain.append(wider)
        return chain


def _unions(groups: Sequence[Layers]) -> list[Layers]:
    counts = range(1, len(groups) + 1)
    return [_union(some) for count in counts for some in combinations(groups, count)]


def _union(groups: Sequence[Layers]) -> Layers:
    return tuple(sorted(layer for group in groups for layer in group))
